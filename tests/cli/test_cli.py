"""End-to-end tests of the command line."""

import itertools
import json
import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import docstring_parser
import pytest
from support.runs import SMALL_SUITE

from lgmd_gym import __version__
from lgmd_gym.cli import main as cli
from lgmd_gym.clips import VideoReader

ROOT = Path(__file__).resolve().parents[2]


def run(*arguments):
    command = [sys.executable, "-m", "lgmd_gym", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@pytest.mark.slow
def test_bench_writes_a_run_folder(tmp_path, capsys):
    out, suite = tmp_path / "deep" / "run", tmp_path / "small.toml"
    suite.write_text(SMALL_SUITE)
    arguments = ("bench", "--suite", str(suite), "--agents", "spike-threshold", "--seeds", "1", "--jobs", "1")
    done = run(*arguments, "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert done.stdout.rstrip().endswith(f"run folder: {out}")
    assert "spike-threshold" in done.stdout
    assert "T_sf = 30" in done.stdout
    rows = [json.loads(line) for line in (out / "episodes.jsonl").read_text().splitlines()]
    assert {row["agent"] for row in rows} == {"no-brake", "spike-threshold"}
    assert len(list((out / "plots").glob("*.png"))) == len({row["case"] for row in rows}) == 3
    assert (out / "summary.csv").exists()
    assert cli.run([*arguments, "--out", str(out)]) == 2
    assert "already exists" in capsys.readouterr().err


@pytest.mark.slow
def test_drive_writes_a_video(tmp_path):
    video = tmp_path / "out.mp4"
    done = run(
        *("drive", "LGMD/CCRs-v0", "--agent", "spike-threshold", "--video", str(video)),
        *("--set", "ego_speed=4"),
    )
    assert done.returncode == 0, done.stderr
    assert "no contact" in done.stdout
    pictures = list(VideoReader(video))
    assert pictures[0].shape == (720, 1280, 3)
    assert len(pictures) > 40
    assert pictures[-1].std() > 20
    assert (pictures[0] != pictures[-1]).any()


def test_drive_prints_the_result_of_a_case(capsys):
    assert cli.run(["drive", "quick/CCRs/v20", "--agent", "no-brake"]) == 0
    assert "contact at 20.0 km/h" in capsys.readouterr().out


def test_drive_prints_the_line_of_an_agent_that_fails(tmp_path, monkeypatch, capsys):
    text = "class Wrong:\n    def act(self, observation, info):\n        return observation['ego_sped']\n"
    (tmp_path / "wrong_key_agent.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    assert cli.run(["drive", "quick/CCRs/v30", "--agent", "wrong_key_agent:Wrong"]) == 2
    error = "KeyError: \"unknown observation key 'ego_sped'; did you mean 'ego_speed'?\""
    message = f"agent 'wrong_key_agent:Wrong' failed: {error} at wrong_key_agent.py:3 in act"
    assert capsys.readouterr().err == f"lgmd-gym: {message}\n"


def test_drive_reports_an_empty_road(capsys):
    assert cli.run(["drive", "LGMD/EmptyRoad-v0", "--agent", "no-brake"]) == 0
    printed = capsys.readouterr().out
    assert "no contact" in printed
    assert "no vehicle ahead" in printed


def test_list_prints_every_table(capsys):
    assert cli.run(["list"]) == 0
    listed = capsys.readouterr().out
    for name in ("quick", "spike-threshold", "LGMD/CCRs-v0", "fovea"):
        assert name in listed


def test_help_lists_every_command(capsys):
    with pytest.raises(SystemExit) as stop:
        cli.run(["--help"])
    assert not stop.value.code
    text = capsys.readouterr().out
    for name in cli.COMMANDS:
        assert f"• {name}" in text


@pytest.mark.parametrize("columns", ["80", "100", None])
@pytest.mark.parametrize("command", [None, *cli.COMMANDS])
def test_help_of_a_command_is_readable(command, columns, capsys, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    with pytest.raises(SystemExit) as stop:
        cli.run([command, "--help"] if command else ["--help"])
    assert not stop.value.code
    text = capsys.readouterr().out
    for word in ("{None}", "default: None", "default: False", "STR", "INT", "FLOAT"):
        assert word not in text
    lines = text.splitlines()
    assert max(map(len, lines)) <= int(columns or 80)
    words = set(text.split())
    for cls in [cli.COMMANDS[command]] if command else []:
        for item in docstring_parser.parse_from_object(cls).params:
            assert set(item.description.split()) <= words  # no word is broken
        assert set(cls.__doc__.split()) <= words


def test_lines_of_a_help_text_break_only_where_they_are_full(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        cli.run(["bench", "--help"])
    text = capsys.readouterr().out
    start = text.index("Suites by name (see")
    lines = text[start : text.index("Default: overview.")].splitlines()
    for line, following in itertools.pairwise(lines):
        assert 17 + len(line.strip()) + 1 + len(following.split()[0]) > 76


def test_version(capsys):
    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out == f"lgmd-gym {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "a command is required: bench, compare, drive"),
        (["benc"], "did you mean 'bench'?"),
        (["bench", "--resume", "run", "--seeds", "4", "--out", "x"], "ignores --seeds, --out; remove them"),
        (["train", "--resume", "run", "--algo", "ppo"], "ignores --algo; remove them"),
        (["bench", "--agent", "no-brake"], "did you mean --agents?"),
        (["bench", "--seeds", "x"], "--seeds has the invalid value 'x'"),
        (["train", "--config", "run.toml"], "see lgmd-gym train --help"),
        (["bench", "--seeds", "0"], "seeds must be a whole number >= 1, got 0"),
        (["bench", "--suite", "quik"], "did you mean 'quick'?"),
        (["bench", "--suite", "trafic"], "did you mean 'traffic'?"),
        (["bench", "--first-seed", "-1"], "first_seed must be a whole number >= 0, got -1"),
        (["bench", "--suite", "traffic", "--seeds", "0"], "seeds must be a whole number >= 1, got 0"),
        (["bench", "--agents", "spike-treshold"], "did you mean 'spike-threshold'?"),
        (["bench", "--camera", "fova"], "did you mean 'fovea'?"),
        (["bench", "--params", "nowhere.toml"], "params file 'nowhere.toml' cannot be read"),
        (["bench", "--out", "/proc/nowhere/run"], "run folder '/proc/nowhere/run' cannot be created"),
        (["drive", "LGMD/CCR-v0"], "did you mean 'LGMD/CCR"),
        (["drive", "quick/CCRs/v35"], "did you mean 'quick/CCRs/v"),
        (["drive", "CCRz"], "LGMD/CCRs-v0"),
        (["drive", "LGMD/CCRs-v0", "--seed", "-1"], "seed must be >= 0, got -1"),
        (["drive", "LGMD/CCRs-v0", "--overlays", "zones"], "did you mean 'zone'?"),
        (["drive", "LGMD/CCRs-v0", "--world", "labratory"], "did you mean 'laboratory'?"),
        (
            ["drive", "LGMD/CCRs-v0", "--world", "10000"],
            "world must be a whole number in [0, 9999], got 10000",
        ),
        (["drive", "LGMD/CCRs-v0", "--condition", "nite"], "did you mean 'night'?"),
        (["train", "--seed", "-1"], "seed must be in [0, 4294967295], got -1"),
        (["drive", "LGMD/CCRs-v0", "--set", "ego_speed=50"], "for 50 km/h pass 13.89"),
        (["drive", "LGMD/CCRs-v0", "--set", "ego_speed=-1"], "ego_speed must be in (0, 40] m/s, got -1"),
        (["drive", "LGMD/CCRs-v0", "--set", "speed=5"], "did you mean 'ego_speed'?"),
        (["drive", "LGMD/CCRs-v0", "--set", "ego_speed"], "--set must be NAME=VALUE"),
        (["drive", "LGMD/CCRs-v0", "--set", "ego_speed="], "--set must be NAME=VALUE"),
        (["drive", "LGMD/CCRs-v0", "--set", "ego_speed=fast"], "ego_speed must be a number, got 'fast'"),
        (["drive", "LGMD/CPLA-v0", "--set", "lying=1"], "lying must be true or false"),
        (["drive", "LGMD/AnimalCrossing-v0", "--set", "animal=mouse"], "did you mean 'moose'"),
        (["drive", "LGMD/CCRs-v0", "--video", "out.txt"], "must have a suffix among .mp4"),
        (["drive", "LGMD/CCRs-v0", "--video", "nowhere/out.mp4"], "does not exist; create it first"),
        (["drive", "LGMD/CCRs-v0", "--video", "x" * 300 + ".mp4"], "is not a path: File name too long"),
        (["train", "--env", "nix"], "env 'nix' cannot be made"),
        (["list", "agent"], "unknown value of what 'agent'; did you mean 'agents'?\n"),
        (["train", "--sead", "3"], "unknown option --sead; did you mean --seed?"),
        (["scenario", "chek", "x"], "unknown value of action 'chek'; did you mean 'check'?"),
        (["bench", "--backend", "dusk"], "unknown value of --backend 'dusk'; did you mean 'dask'?"),
        (["drive"], "drive requires ENV|CASE|TRAFFIC|FILE; see lgmd-gym drive --help"),
        (["bench", "--seeds"], "--seeds requires a value; see lgmd-gym bench --help"),
        (["drive", "nix"], " print all names; a family of your own requires --module"),
        (["scenario", "export", "quick/nix", "--to", "x.xosc"], "lgmd-gym list cases print all names; "),
        (["bench", "--agents", "json:JSONDecodr"], "did you mean 'json:JSONDecoder'?"),
        (["bench", "--agents", "nix:Nix"], "(No module named 'nix')"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_two(arguments, words, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert cli.run(arguments) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("lgmd-gym: ")
    assert output.err.count("\n") == 1
    assert words in output.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_bench_runs_the_traffic_suite(tmp_path, capsys):
    out = tmp_path / "run"
    arguments = ["--suite", "traffic", "--agents", "ttc-oracle", "--seeds", "1", "--out", str(out)]
    assert cli.run(["bench", *arguments, "--jobs", "1"]) == 0
    assert "needless: without it, no contact" in capsys.readouterr().out
    rows = [json.loads(line) for line in (out / "episodes.jsonl").read_text().splitlines()]
    kinds = ["highway", "intersection", "merge", "roundabout", "two-way"]
    assert sorted(row["case"] for row in rows) == [f"traffic/{kind}/s0" for kind in kinds]
    assert len((out / "summary.csv").read_text().splitlines()) == 1 + 1 + len(kinds)
    table = (out / "episodes.csv").read_text().splitlines()
    assert len(table) == 1 + len(kinds)
    assert "moving_time_s" in table[0].split(",")


def test_a_failed_episode_gives_exit_code_one(tmp_path, monkeypatch, capsys):
    from lgmd_gym.benchmark import player

    def fail(*arguments):
        raise RuntimeError("no road today")

    monkeypatch.setattr(player, "BatchPlayer", fail)
    options = ["--jobs", "1", "--seeds", "1", "--agents", "no-brake", "--out", str(tmp_path / "run")]
    assert cli.run(["bench", "--suite", "quick", *options]) == 1
    printed = " ".join(capsys.readouterr().out.split())
    assert "quick: camera each agent's own, T_sf" in printed
    assert "8 episodes failed" in printed
    assert "- no-brake: RuntimeError: no road today at " in printed
    assert "every episode of no-brake failed, 8 so far: 8 of 19 episodes kept; correct the agent" in printed
    assert "no road today" in (tmp_path / "run" / "episodes.jsonl").read_text()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_during_the_imports_ends_the_command(number, tmp_path):
    (tmp_path / "tyro.py").write_text(f"import signal; signal.raise_signal({int(number)})")
    done = subprocess.run(
        [sys.executable, "-m", "lgmd_gym", "--version"],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}:{ROOT}"},
        capture_output=True,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", "lgmd-gym: interrupted\n")


def test_the_installed_command_is_that_of_the_module():
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    assert scripts == {"lgmd-gym": "lgmd_gym.__main__:main"}
