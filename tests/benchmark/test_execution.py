"""Configurations, suite files, and runs with a full disk or a faulty agent."""

import resource
import socket
import subprocess
import sys

import pytest
from support.runs import new_run, read_rows, sorted_keys

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.suites import copy_suite, get_suite, load_suite
from lgmd_gym.cli import main as cli
from lgmd_gym.processes import pool

LGMD = [sys.executable, "-m", "lgmd_gym"]
SHORT = """
name = "mine"
[[cases]]
family = "CCRs"
speeds_kmh = [10, 20]
name = "dark"
arguments = { shade = 40 }
[[cases]]
family = "EmptyRoad"
speeds_kmh = [30]
"""


@pytest.fixture
def short_suite(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(SHORT)
    return path


def test_suite_file_is_read_and_copied(short_suite, tmp_path):
    suite = get_suite(str(short_suite))
    names = [case.name for case in suite.cases]
    assert names == ["mine/CCRs/v10/dark", "mine/CCRs/v20/dark", "mine/EmptyRoad/v30"]
    assert suite.cases[1].scenario.actors[0].shade == 40
    copy_suite(short_suite, tmp_path / "copy.toml")
    assert load_suite(tmp_path / "copy.toml") == suite


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('family = "CCRs"', 'family = "CCRss"', "did you mean 'CCRs'"),
        ("speeds_kmh = [10, 20]", "speed_kmh = [10, 20]", "unknown key of a case 'speed_kmh'; did you mean"),
        ("shade = 40", "shad = 40", "unknown argument of CCRs 'shad'; did you mean 'shade'"),
        ("shade = 40", "shade = 400", "400"),
        ("[10, 20]", "[10, 10]", "is defined twice"),
        ("[10, 20]", "[-10]", "must be a list of numbers > 0"),
        ('name = "mine"', 'name = "quick"', "is the name of a shipped suite"),
        ('name = "mine"', "name = ", "is not TOML"),
        ('name = "dark"', "fcw_driver = 1", "must be true or false"),
    ],
)
def test_invalid_suite_file_gives_one_line_with_a_suggestion(short_suite, old, new, words, capsys, tmp_path):
    short_suite.write_text(SHORT.replace(old, new, 1))
    out = tmp_path / "run"
    assert cli.run(["bench", "--suite", str(short_suite), "--out", str(out)]) == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1
    assert not out.exists()


def test_run_toml_repeats_the_run_without_the_original_suite_file(short_suite, tmp_path):
    agents, conditions = ["spike-threshold:threshold=45"], ["clear", "rain"]
    first = new_run(tmp_path / "a", suite=str(short_suite), agents=agents, seeds=2, conditions=conditions)
    assert first.play()
    assert first.total == len(first.rows) == 2 * 3 * 2 * 2
    short_suite.unlink()
    again = Run.new(RunConfig.load(tmp_path / "a" / "run.toml"), tmp_path / "b")
    assert again.play()
    assert again.rows == first.rows
    clear, rain = (
        [row["ttc_at_brake"] for row in again.rows if row["condition"] == name] for name in conditions
    )
    assert clear != rain
    run_tomls = [(tmp_path / name / "run.toml").read_text().splitlines() for name in ("a", "b")]
    assert run_tomls[0][1:] == run_tomls[1][1:]  # the first line is a comment with the commit
    assert load_suite(tmp_path / "b" / "suite.toml") == load_suite(tmp_path / "a" / "suite.toml")


def test_config_is_the_same_after_saving(tmp_path):
    config = RunConfig(
        suite="traffic",
        agents=["no-brake"],
        seeds=2,
        first_seed=5,
        conditions=["clear", "fog"],
        camera=[{"name": "tele"}, "fovea"],
        params={"t_sf": 45.0},
        kinds=["merge"],
    )
    assert RunConfig.load(config.save(tmp_path)) == config


@pytest.mark.slow
def test_first_seed_selects_the_later_seeds_of_a_longer_run(short_suite, tmp_path, capsys):
    whole = new_run(tmp_path / "whole", suite=str(short_suite), agents=["spike-threshold"], seeds=3)
    assert whole.play()
    out = tmp_path / "late"
    flags = ["--suite", str(short_suite), "--agents", "spike-threshold", "--jobs", "1", "--out", str(out)]
    assert cli.run(["bench", *flags, "--seeds", "2", "--first-seed", "1", "--worlds", "0"]) == 0
    assert "2 seeds from 1 on" in " ".join(capsys.readouterr().out.split())
    late = Run.resume(out)
    assert late.play()  # no episode is missing
    assert late.total == len(late.rows)
    assert late.rows == [row for row in whole.rows if row["seed"] > 0]
    page = (out / "report.html").read_text()
    assert "(first: 1)" in page
    assert "fastest avoided threat" in page  # an episode of the first seed, which has time series
    assert RunConfig.load(out / "run.toml").seed_range == range(1, 3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('suit = "quick"', "unknown key 'suit'; did you mean 'suite'"),
        ('suite = "quick"\nagents = ["no-brake"]', "'seeds' is missing"),
        ('suite = "quick"\nagents = "no-brake"\nseeds = 1', "must be a list of strings"),
        ('suite = "quick"\nagents = ["no-brake"]\nseeds = 1.5', "must be a whole number"),
        ('suite = "quick"\nagents = ["no-brake"]\nseeds = 1\nconditions = ["fogg"]', "did you mean 'fog'"),
    ],
)
def test_invalid_run_config_gives_a_suggestion(tmp_path, text, words, capsys):
    (tmp_path / "run.toml").write_text(text)
    out = tmp_path / "out"
    assert cli.run(["bench", "--config", str(tmp_path / "run.toml"), "--out", str(out)]) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()


def test_config_rejects_further_options(tmp_path, capsys):
    assert cli.run(["bench", "--config", "run.toml", "--seeds", "2", "--first-seed", "4"]) == 2
    assert "--config replaces --seeds, --first-seed" in capsys.readouterr().err


def test_unreachable_cluster_is_reported_within_seconds(tmp_path, capsys, monkeypatch):
    assert pool.CONNECT <= 10.0
    monkeypatch.setattr(pool, "CONNECT", 0.5)
    with socket.socket() as unused:  # a port without a listener
        unused.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{unused.getsockname()[1]}"
        out = tmp_path / "run"
        assert cli.run(["bench", "--backend", "dask", "--address", address, "--out", str(out)]) == 2
    printed = capsys.readouterr().err
    assert f"no Dask scheduler at '{address}'" in printed
    assert "after 0.5 s" in printed
    assert not out.exists()
    assert cli.run(["bench", "--backend", "dask"]) == 2
    assert "needs --address" in capsys.readouterr().err


BAD_AGENTS = """
class Raises:
    def act(self, observation, info):
        raise RuntimeError("internal failure")
class NotANumber:
    def act(self, observation, info):
        return float("nan")
class TwoNumbers:
    def act(self, observation, info):
        return [0.0, -1.0]
class Nothing:
    def act(self, observation, info):
        return None
class Exits:
    def act(self, observation, info):
        raise SystemExit(3)
"""


def test_faulty_agents_become_error_rows(short_suite, tmp_path, monkeypatch):
    (tmp_path / "bad_agents.py").write_text(BAD_AGENTS)
    monkeypatch.syspath_prepend(tmp_path)
    words = {
        "Raises": "internal failure",
        "NotANumber": "one number in [-1, 1], got nan",
        "TwoNumbers": "one number in [-1, 1], got [0.0, -1.0]",
        "Nothing": "one number in [-1, 1], got None",
        "Exits": "SystemExit: 3",
    }
    agents = [f"bad_agents:{name}" for name in words]
    run = new_run(tmp_path / "run", suite=str(short_suite), agents=agents, seeds=1)
    assert run.play()
    failed = [row for row in run.rows if row["agent"] != "no-brake"]
    assert len(failed) == 5 * 3
    for row in failed:
        assert words[row["agent"].split(":")[1]] in row["error"]
    # Resuming replays the failed episodes without duplicate rows.
    again = Run.resume(tmp_path / "run", trust=True)
    assert len(again.rows) == 3
    assert again.play()
    assert sorted_keys(read_rows(tmp_path / "run")) == sorted_keys(run.rows)


@pytest.mark.slow
def test_full_disk_loses_only_the_episode_in_flight(short_suite, tmp_path):
    """A limit on the file size emulates a full disk: writing the row that exceeds it fails halfway."""
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (30000, resource.RLIM_INFINITY)); "
    code = limit + "from pathlib import Path; from lgmd_gym.benchmark.config import RunConfig; "
    code += "from lgmd_gym.benchmark.runner import Run; "
    code += f"config = RunConfig(suite={str(short_suite)!r}, agents=['ttc-oracle'], seeds=10); "
    code += "run = Run.new(config, Path('run')); print(run.play(), len(run.rows), run.stop_reason)"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.startswith("False "), done.stderr
    assert "in run folder" in done.stdout
    before = read_rows(tmp_path / "run")
    assert 0 < len(before) == int(done.stdout.split()[1]) < 60
    run = Run.resume(tmp_path / "run")
    assert not run.folder.repaired
    assert run.play()
    assert len(read_rows(tmp_path / "run")) == len(set(sorted_keys(run.rows))) == 60
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[1] == resource.RLIM_INFINITY
