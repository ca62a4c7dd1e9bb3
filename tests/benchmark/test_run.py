"""Runs of a suite: rows, resumption, errors, and the folder that they write."""

import json
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from support.runs import interrupt, new_run, read_rows, sorted_rows

from lgmd_gym.benchmark import RunConfig
from lgmd_gym.benchmark import run as run_benchmark
from lgmd_gym.benchmark.analysis.arms import compare_arms
from lgmd_gym.benchmark.analysis.compare import compare_runs
from lgmd_gym.benchmark.metrics import KEYS
from lgmd_gym.benchmark.run_folder import read_run
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.benchmark.summary import write_csv
from lgmd_gym.cli import main as cli
from lgmd_gym.plotting.style import saved_figure
from lgmd_gym.processes.files import FolderLock
from lgmd_gym.processes.pool import Executor
from lgmd_gym.report.page import write_outputs, write_report

BOUNDS = ("no-brake", "always-brake", "ttc-oracle", "spike-threshold")


@pytest.fixture(scope="module")
def quick_run(tmp_path_factory):
    """The quick suite with one seed, run in this process."""
    run = new_run(tmp_path_factory.mktemp("runs") / "quick", agents=BOUNDS[1:], seeds=1)
    assert run.play()
    return run


def test_every_episode_runs_once(quick_run):
    assert len(quick_run.rows) == quick_run.total == 4 * len(SUITES["quick"].cases)
    assert read_rows(quick_run.folder.path) == quick_run.rows
    assert len({(row["agent"], row["case"], row["seed"]) for row in quick_run.rows}) == quick_run.total
    assert all(row["error"] is None for row in quick_run.rows)
    settings = json.loads((quick_run.folder.path / "run.json").read_text())
    assert settings["complete"] is True
    assert settings["packages"]["numpy"] == np.__version__


def test_bounding_agents_and_the_neuron_behave_as_documented(quick_run):
    def rows(agent, family=""):
        return [row for row in quick_run.rows if row["agent"] == agent and f"/{family}" in row["case"]]

    assert all(row["avoided"] is not True for row in rows("no-brake"))
    assert all(row["collision"] for row in rows("no-brake", "CCR"))
    for family in ("AdjacentPass", "Following", "EmptyRoad"):
        assert not any(row["collision"] for row in rows("no-brake", family))
    assert all(row["avoided"] for row in rows("ttc-oracle", "CCR"))
    assert not any(row["false_activation"] for row in rows("ttc-oracle"))
    assert not any(row["avoided"] for row in rows("always-brake"))
    assert all(row["false_activation"] for row in rows("always-brake") if not row["threat"])
    slow = [row for row in rows("spike-threshold", "CCRs") if row["ego_speed"] * 3.6 < 41]
    assert len(slow) == 4
    assert all(row["avoided"] for row in slow)
    for family in ("EmptyRoad", "Following"):
        assert not any(row["false_activation"] for row in rows("spike-threshold", family))


def test_interrupted_run_keeps_its_rows(tmp_path):
    run = new_run(tmp_path / "run", agents=["no-brake"], seeds=1)

    def interrupt_after_three(row):
        if len(run.rows) == 3:
            raise KeyboardInterrupt

    assert not run.play(interrupt_after_three)
    assert run.stop_reason == "interrupted"
    assert len(read_rows(tmp_path / "run")) == 3
    assert json.loads((tmp_path / "run" / "run.json").read_text())["complete"] is False


@pytest.mark.parametrize(
    "fraction", [0.6, *(pytest.param(value, marks=pytest.mark.slow) for value in (0.3, 0.9))]
)
def test_resumed_run_has_the_rows_of_a_complete_one(quick_run, tmp_path, fraction):
    """The folder is left as by kill -9: some rows, the last one incomplete."""
    folder = tmp_path / "run"
    interrupted = new_run(folder, agents=BOUNDS[1:], seeds=1)
    assert not interrupted.play(interrupt)
    whole = (quick_run.folder.path / "episodes.jsonl").read_bytes()
    (folder / "episodes.jsonl").write_bytes(whole[: int(fraction * len(whole))])
    run = Run.resume(folder)
    assert run.folder.repaired
    before = len(run.rows)
    assert 0 < before < run.total
    played = []
    assert run.play(played.append)
    assert len(played) == run.total - before
    assert sorted_rows(read_rows(folder)) == sorted_rows(quick_run.rows) == sorted_rows(run.rows)


def test_resume_rejects_missing_damaged_and_older_runs(tmp_path):
    with pytest.raises(ValueError, match="contains no run"):
        Run.resume(tmp_path)
    new_run(tmp_path / "run", agents=["no-brake"], seeds=1).play(interrupt)
    settings = json.loads((tmp_path / "run" / "run.json").read_text())
    (tmp_path / "run" / "run.json").write_text(json.dumps(settings | {"lgmd_gym": "0.0.1"}))
    with pytest.raises(ValueError, match=r"made by lgmd-gym 0.0.1, this is .*; start a new run"):
        Run.resume(tmp_path / "run")
    (tmp_path / "run" / "run.json").write_text(json.dumps(settings))
    (tmp_path / "run" / "episodes.jsonl").write_text("{}\nnonsense\n{}\n")
    with pytest.raises(ValueError, match="damaged in line 2"):
        Run.resume(tmp_path / "run")


def test_second_writer_is_refused_while_the_first_runs(tmp_path, capsys):
    folder = tmp_path / "run"
    run = new_run(folder, agents=["no-brake"], seeds=1)

    def resume_meanwhile(row):
        assert cli.run(["bench", "--resume", str(folder)]) == 2
        read_run(folder)  # readers need no lock
        raise KeyboardInterrupt

    assert not run.play(resume_meanwhile)
    message = capsys.readouterr().err
    assert f"run folder {str(folder)!r} is in use by process {os.getpid()};" in message
    assert message.count("\n") == 1
    assert len(read_rows(folder)) == 1
    # The end of the first releases the folder; the file that remains holds no lock.
    resumed = Run.resume(folder)
    assert resumed.play()
    assert len(read_rows(folder)) == resumed.total


def test_failed_resume_releases_the_folder(tmp_path):
    folder = tmp_path / "run"
    new_run(folder, agents=["no-brake"], seeds=1).play(interrupt)
    original = (folder / "run.toml").read_text()
    (folder / "run.toml").write_text("nonsense")
    with pytest.raises(ValueError, match="is not TOML") as failure:
        Run.resume(folder)
    (folder / "run.toml").write_text(original)
    Run.resume(folder).folder.close()
    assert failure.value  # its traceback keeps the objects of the failed resume


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({}, "line 77 repeats the episode of line 1"),
        ({"agent": "eta-oracle"}, "line 77 does not belong to the run: eta-oracle, quick/"),
        ({"seed": 1}, "line 77 does not belong to the run: no-brake, quick/"),
        ({"condition": "fog"}, "line 77 does not belong to the run"),
        (
            {"case": "quick/CCRs/v31"},
            "line 77 does not belong to the run: no-brake, quick/CCRs/v31, 0",
        ),
        ({"suite": "r152"}, "line 77 does not belong to the run"),
        ({"case": ["quick"]}, "damaged in line 77"),
        ({"extra": 1}, "line 77 has other columns than line 1, as from another version"),
        (None, "damaged in line 77"),
    ],
)
def test_repeated_and_foreign_rows_are_refused_alike(quick_run, tmp_path, change, words):
    folder = tmp_path / "run"
    shutil.copytree(quick_run.folder.path, folder)
    row = quick_run.rows[0]
    wrong = [] if change is None else row | change
    with (folder / "episodes.jsonl").open("a") as file:
        file.write(json.dumps(wrong) + "\n")
    for read in (Run.resume, write_outputs, write_report, compare_runs, compare_arms):
        with pytest.raises(ValueError, match=re.escape(words)):
            read(folder, None) if read is compare_runs else read(folder)
    before = (folder / "episodes.jsonl").read_bytes()
    assert before == (quick_run.folder.path / "episodes.jsonl").read_bytes() + before.splitlines(True)[-1]


def test_refusal_lists_all_lines(quick_run, tmp_path, capsys):
    folder = tmp_path / "run"
    shutil.copytree(quick_run.folder.path, folder)
    with (folder / "episodes.jsonl").open("a") as file:
        file.writelines(json.dumps(row) + "\n" for row in quick_run.rows[:3])
    assert cli.run(["compare", str(folder)]) == 2
    assert "(also to be checked: 2 lines, 78, 79)" in capsys.readouterr().err


@pytest.mark.slow
def test_python_function_and_command_write_the_same_folder(tmp_path):
    config = RunConfig(suite="r152", agents=("ttc-oracle", "spike-threshold"), seeds=1)
    table = run_benchmark(config, tmp_path / "python")
    flags = ["--suite", "r152", "--agents", "ttc-oracle", "spike-threshold", "--seeds", "1", "--jobs", "1"]
    assert cli.run(["bench", *flags, "--out", str(tmp_path / "command")]) == 0

    def files(name):
        return sorted(str(path.relative_to(tmp_path / name)) for path in (tmp_path / name).rglob("*"))

    assert files("python") == files("command")
    assert {"summary.csv", "froc.csv", "plots", "report.html", "run.toml"} < set(files("python"))
    assert read_rows(tmp_path / "python") == read_rows(tmp_path / "command")
    for name in ("summary.csv", "froc.csv"):
        assert (tmp_path / "python" / name).read_text() == (tmp_path / "command" / name).read_text()
    assert RunConfig.load(tmp_path / "python" / "run.toml") == RunConfig.load(
        tmp_path / "command" / "run.toml"
    )
    assert list(table.columns) == list(KEYS)
    assert len(table) == 3 * len(SUITES["r152"].cases)
    assert table[table.agent == "ttc-oracle"].avoided.all()


def test_run_requires_a_configuration(tmp_path):
    with pytest.raises(TypeError, match="config must be a RunConfig, got 'quick'"):
        run_benchmark("quick", tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"suite": "quik"}, "did you mean 'quick'"),
        ({"suite": "trafic"}, "did you mean 'traffic'"),
        ({"agents": ["nobrake"]}, "did you mean 'no-brake'"),
        ({"agents": []}, "agents must contain at least one name, got none"),
        ({"agents": "no-brake"}, "agents must be a list of strings, got 'no-brake'"),
        ({"conditions": ["fogg"]}, "did you mean 'fog'"),
        ({"kinds": ["merge"]}, "kinds applies to suites of traffic only"),
        ({"seeds": 0}, "seeds must be a whole number >= 1, got 0"),
        ({"seeds": 1.5}, "seeds must be a whole number >= 1, got 1.5"),
        ({"first_seed": -1}, "first_seed must be a whole number >= 0, got -1"),
        ({"camera": "fova"}, "did you mean 'fovea'"),
        ({"params": {"sigma_33": 1.0}}, "did you mean 'sigma_3'"),
    ],
)
def test_invalid_configuration_is_rejected_before_the_folder_is_created(tmp_path, values, message):
    with pytest.raises(ValueError, match=message):
        new_run(tmp_path / "run", **{"agents": ["no-brake"], "seeds": 1} | values)
    assert list(tmp_path.iterdir()) == []


def test_existing_folder_and_zero_jobs_are_rejected(tmp_path):
    with pytest.raises(ValueError, match="already exists"):
        new_run(tmp_path, agents=["no-brake"])
    with pytest.raises(ValueError, match=r"jobs must be a whole number in \[1, 1024\], got 0"):
        Executor(jobs=0)


def test_outputs_are_complete_or_absent(tmp_path, monkeypatch):
    def draw(path):
        with saved_figure(path, 1, 1):
            pass

    def fail(path):
        raise OSError("disk full")

    monkeypatch.setattr("lgmd_gym.processes.files._sync", fail)  # at the end of each file
    for name, write in (("summary.csv", lambda path: write_csv(path, ["x"], [])), ("case.png", draw)):
        path = tmp_path / name
        path.write_text("old")
        with pytest.raises(OSError, match="disk full"):
            write(path)
        assert path.read_text() == "old"
    assert not list(tmp_path.glob("*.part"))


def test_a_run_that_cannot_start_leaves_no_folder(tmp_path, monkeypatch):
    """A disk that is full from the beginning: the same command works once there is space."""
    config = RunConfig(suite="quick", agents=["no-brake"], seeds=1)

    def full(*_):
        raise OSError(28, "No space left on device")

    for place in ("lgmd_gym.benchmark.run_folder.replace_file", "lgmd_gym.benchmark.run_folder.FolderLock"):
        with monkeypatch.context() as patch:
            patch.setattr(place, full)
            with pytest.raises(OSError, match="No space left"):
                Run.new(config, tmp_path / "run")
        assert list(tmp_path.iterdir()) == []
    Run.new(config, tmp_path / "run").folder.close()


def test_a_limit_of_the_file_size_is_no_full_disk(tmp_path):
    """The row that exceeds the limit is written in part; the reason is that of the next write."""
    code = (
        "import resource; from pathlib import Path; from lgmd_gym.benchmark.run_folder import RunFolder\n"
        "folder = RunFolder.create(Path('run')); folder.add({'a': 1})\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (12, resource.RLIM_INFINITY))\n"
        "try: folder.add({'a': 2})\n"
        "except OSError as error: print(error.strerror)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout == "File too large\n", done.stderr
    assert (tmp_path / "run" / "episodes.jsonl").read_text() == '{"a": 1}\n'


def test_outputs_have_one_writer(tmp_path):
    (tmp_path / "episodes.jsonl").touch()
    lock = FolderLock(tmp_path)
    with pytest.raises(ValueError, match=rf"in use by process {os.getpid()}"):
        write_outputs(tmp_path)
    lock.release()
    for path in (tmp_path / "episodes.jsonl", tmp_path / ".lock"):
        path.unlink()
    with pytest.raises(ValueError, match="contains no run"):
        write_outputs(tmp_path)
    assert list(tmp_path.iterdir()) == []  # no lock in a folder without a run
