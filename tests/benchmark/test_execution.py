"""Runs on processes and clusters that break: a killed command, a killed worker, a full disk, bad agents."""

import json
import os
import random
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.run_cases import Run
from lgmd_gym.benchmark.runs import repeat_run, resume_run
from lgmd_gym.benchmark.suite_file import get_suite, load_suite, save_suite
from lgmd_gym.cli import main as cli

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


def rows_of(folder):
    return [json.loads(line) for line in (folder / "episodes.jsonl").read_text().splitlines()]


def keys(rows):
    return sorted((row["agent"], row["case"], row["seed"], row["condition"]) for row in rows)


def test_own_suite_is_read_and_written(short_suite, tmp_path):
    suite = get_suite(str(short_suite))
    names = [case.name for case in suite.cases]
    assert names == ["mine/CCRs/v10/dark", "mine/CCRs/v20/dark", "mine/EmptyRoad/v30"]
    assert suite.cases[1].scenario.actors[0].shade == 40
    save_suite(suite, tmp_path / "again.toml")
    assert load_suite(tmp_path / "again.toml").cases == suite.cases


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('family = "CCRs"', 'family = "CCRss"', "did you mean 'CCRs'"),
        ("speeds_kmh = [10, 20]", "speed_kmh = [10, 20]", "unknown key of a case 'speed_kmh'; did you mean"),
        ("shade = 40", "shad = 40", "unknown argument of CCRs 'shad'; did you mean 'shade'"),
        ("shade = 40", "shade = 400", "400"),
        ("[10, 20]", "[10, 10]", "comes twice"),
        ("[10, 20]", "[-10]", "must be a list of numbers > 0"),
        ('name = "mine"', 'name = "quick"', "is a shipped suite's"),
        ('name = "mine"', "name = ", "is not TOML"),
        ('name = "dark"', "fcw_driver = 1", "must be true or false"),
    ],
)
def test_bad_suite_files_name_the_mend(short_suite, old, new, words, capsys, tmp_path):
    short_suite.write_text(SHORT.replace(old, new, 1))
    out = tmp_path / "run"
    assert cli.run(["bench", "--suite", str(short_suite), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert not out.exists()


def test_a_run_is_repeated_from_its_own_config(short_suite, tmp_path):
    agents, conditions = ["spike-threshold:threshold=45"], ["clear", "degraded"]
    first = Run(str(short_suite), agents, 2, 1, tmp_path / "a", conditions=conditions)
    assert first.play()
    assert first.total == len(first.rows) == 2 * 3 * 2 * 2
    short_suite.unlink()  # the folder holds all it takes
    config = RunConfig.load(tmp_path / "a" / "run.toml")
    again = repeat_run(config, 1, tmp_path / "b")
    assert again.play()
    assert again.rows == first.rows
    assert {row["condition"] for row in again.rows} == {"clear", "degraded"}
    clear, robust = (
        [row["ttc_at_brake"] for row in again.rows if row["condition"] == name] for name in conditions
    )
    assert clear != robust
    assert (tmp_path / "b" / "run.toml").read_text() == (tmp_path / "a" / "run.toml").read_text()


def test_seeds_from_one_on_are_those_of_a_longer_run(short_suite, tmp_path, capsys):
    whole = Run(str(short_suite), ["spike-threshold"], 3, 1, tmp_path / "whole")
    assert whole.play()
    out = tmp_path / "late"
    flags = ["--suite", str(short_suite), "--agents", "spike-threshold", "--jobs", "1", "--out", str(out)]
    assert cli.run(["bench", *flags, "--seeds", "2", "--first-seed", "1"]) == 0
    assert "2 seeds from 1 on" in " ".join(capsys.readouterr().out.split())
    late = resume_run(out, 1)  # nothing is missing
    assert late.play()
    assert late.total == len(late.rows)
    assert late.rows == [row for row in whole.rows if row["seed"] > 0]
    page = (out / "report.html").read_text()
    assert "seeds from 1 on" in page
    assert "hardest contact" in page or "narrowest stop" in page  # the first seed played has its traces
    again = repeat_run(RunConfig.load(out / "run.toml"), 1, tmp_path / "again")
    assert again.config.played == range(1, 3)


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
def test_bad_configs_name_the_mend(tmp_path, text, words, capsys):
    (tmp_path / "run.toml").write_text(text)
    out = tmp_path / "out"
    assert cli.run(["bench", "--config", str(tmp_path / "run.toml"), "--out", str(out)]) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()


def test_config_and_options_do_not_mix(tmp_path, capsys):
    assert cli.run(["bench", "--config", "run.toml", "--seeds", "2", "--first-seed", "4"]) == 2
    assert "leave out --seeds, --first-seed," in capsys.readouterr().err


def test_an_unreachable_cluster_fails_in_seconds(tmp_path, capsys):
    with socket.socket() as taken:  # a port where nothing listens
        taken.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        started, out = time.perf_counter(), tmp_path / "run"
        assert cli.run(["bench", "--backend", "dask", "--address", address, "--out", str(out)]) == 2
    assert time.perf_counter() - started < 20
    assert f"no Dask scheduler answers at '{address}'" in capsys.readouterr().err
    assert not out.exists()
    assert cli.run(["bench", "--backend", "dask"]) == 2
    assert "needs --address" in capsys.readouterr().err


BAD_AGENTS = """
class Raises:
    def act(self, observation, info):
        raise RuntimeError("out of ideas")
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


def test_agents_that_misbehave_become_error_rows(short_suite, tmp_path, monkeypatch):
    (tmp_path / "bad_agents.py").write_text(BAD_AGENTS)
    monkeypatch.syspath_prepend(tmp_path)
    words = {
        "Raises": "out of ideas",
        "NotANumber": "one finite number, got [nan]",
        "TwoNumbers": "one finite number, got [0.0, -1.0]",
        "Nothing": "Error",
        "Exits": "SystemExit: 3",
    }
    run = Run(str(short_suite), [f"bad_agents:{name}" for name in words], 1, 1, tmp_path / "run")
    assert run.play()
    failed = [row for row in run.rows if row["agent"] != "no-brake"]
    assert len(failed) == 5 * 3
    for row in failed:
        assert words[row["agent"].split(":")[1]] in row["error"]
    # Resuming plays the failed ones again, and no row comes twice.
    again = resume_run(tmp_path / "run", 1)
    assert len(again.rows) == 3
    assert again.play()
    assert keys(rows_of(tmp_path / "run")) == keys(run.rows)


def test_a_full_disk_loses_only_what_was_in_flight(short_suite, tmp_path):
    """A limit on file size stands for the full disk: the row that crosses it fails in the middle."""
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (30000, resource.RLIM_INFINITY)); "
    code = limit + "from lgmd_gym.benchmark.run_cases import Run; "
    code += f"run = Run({str(short_suite)!r}, ['ttc-oracle'], 10, 1, __import__('pathlib').Path('run')); "
    code += "print(run.play(), len(run.rows), run.stopped)"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.startswith("False "), done.stderr
    assert "in run folder" in done.stdout
    kept = rows_of(tmp_path / "run")
    assert 0 < len(kept) == int(done.stdout.split()[1]) < 60
    run = resume_run(tmp_path / "run", 1)
    assert not run.folder.mended
    assert run.play()
    assert len(rows_of(tmp_path / "run")) == len(set(keys(run.rows))) == 60
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[1] == resource.RLIM_INFINITY


def wait_for_rows(out, count, process):
    file = out / "episodes.jsonl"
    end = time.monotonic() + 120
    while not file.exists() or file.read_bytes().count(b"\n") < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


def bench(out, *more):
    arguments = ["--agents", "spike-threshold", "ttc-oracle", "--seeds", "3", "--no-plots", "--no-report"]
    return [*LGMD, "bench", "--out", str(out), *arguments, *more]


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """A run that nothing breaks off."""
    out = tmp_path_factory.mktemp("runs") / "unbroken"
    subprocess.run(bench(out), check=True, capture_output=True)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_kill_9_and_resume_give_the_same_summary(unbroken, tmp_path, seed):
    """SIGKILL to the command and its workers at a random moment, then --resume."""
    out = tmp_path / "run"
    process = subprocess.Popen(bench(out), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               start_new_session=True)  # fmt: skip
    rng = random.Random(seed)
    wait_for_rows(out, rng.randrange(5, 140), process)
    time.sleep(rng.uniform(0.0, 0.1))
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    kept = (out / "episodes.jsonl").read_bytes().count(b"\n")
    assert kept < 171
    resumed = [*LGMD, "bench", "--resume", str(out), "--no-plots", "--no-report"]
    done = subprocess.run(resumed, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"resuming with {kept} of 171" in done.stdout
    assert (out / "summary.csv").read_bytes() == (unbroken / "summary.csv").read_bytes()
    assert (out / "froc.csv").read_bytes() == (unbroken / "froc.csv").read_bytes()
    assert len(rows_of(out)) == len(set(keys(rows_of(out)))) == 171


@pytest.mark.slow
def test_a_killed_worker_process_is_said_and_nothing_else_lost(unbroken, tmp_path):
    out = tmp_path / "run"
    process = subprocess.Popen(bench(out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_rows(out, 30, process)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
    workers = [int(pid) for pid in children.split()]
    workers = [pid for pid in workers if "LokyProcess" in Path(f"/proc/{pid}/cmdline").read_text()]
    os.kill(workers[0], signal.SIGKILL)
    said, complaint = process.communicate(timeout=120)
    assert process.returncode == 1, complaint
    assert "a worker process was killed" in said
    assert "Traceback" not in complaint
    kept = len(rows_of(out))
    assert 30 <= kept < 171
    done = subprocess.run([*LGMD, "bench", "--resume", str(out), "--no-plots", "--no-report"])
    assert done.returncode == 0
    assert (out / "summary.csv").read_bytes() == (unbroken / "summary.csv").read_bytes()


@pytest.fixture
def cluster(tmp_path):
    """A real Dask cluster on loopback: its address, and the processes of its scheduler and two workers."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address, dask = f"tcp://127.0.0.1:{port}", [sys.executable, "-m", "dask"]
    started = []

    def start(*command):
        started.append(
            subprocess.Popen(
                [*dask, *command], cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
        )

    start("scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    for _ in range(2):
        start("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
    try:
        from distributed import Client

        with Client(address, timeout=60) as client:
            client.wait_for_workers(2, timeout=60)
        yield address, started
    finally:
        for process in started:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_plays_every_row_once(cluster, unbroken, tmp_path):
    address, (_, worker, _) = cluster
    out = tmp_path / "run"
    command = bench(out, "--backend", "dask", "--address", address)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_rows(out, 20, process)
    worker.kill()
    _, complaint = process.communicate(timeout=300)
    assert process.returncode == 0, complaint
    rows = rows_of(out)
    assert len(rows) == 171
    assert keys(rows) == keys(rows_of(unbroken))
    assert (out / "summary.csv").read_bytes() == (unbroken / "summary.csv").read_bytes()


@pytest.mark.slow
def test_a_cluster_that_dies_is_said_and_can_be_resumed(cluster, unbroken, tmp_path):
    address, processes = cluster
    out = tmp_path / "run"
    command = bench(out, "--backend", "dask", "--address", address)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_rows(out, 20, process)
    for one in processes:
        one.kill()
    said, complaint = process.communicate(timeout=180)
    assert process.returncode == 1, complaint
    assert f"the cluster at {address} is lost" in said
    assert 20 <= len(rows_of(out)) < 171
    done = subprocess.run([*LGMD, "bench", "--resume", str(out), "--no-plots", "--no-report"])
    assert done.returncode == 0
    assert (out / "summary.csv").read_bytes() == (unbroken / "summary.csv").read_bytes()
