"""A stopped `bench --jobs 2` loses, repeats and leaves nothing; tests/fuzz/kills.py has random times."""

import os
import signal
import subprocess
import sys
import time

import pytest
from support import processes as kills
from support.runs import read_rows, sorted_rows

from lgmd_gym.cli import main as cli
from lgmd_gym.processes import pool as worker_processes
from lgmd_gym.processes.pool import Executor

SUITE = """
name = "tiny"
[[cases]]
family = "CCRs"
speeds_kmh = [10, 20, 30]
[[cases]]
family = "EmptyRoad"
speeds_kmh = [30]
"""


@pytest.fixture(scope="module", autouse=True)
def sigint_is_not_ignored():
    """In the background of a shell without job control it is, also in the processes that the tests start."""
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, previous)


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    path = tmp_path_factory.mktemp("suite") / "tiny.toml"
    path.write_text(SUITE)
    return path


OPTIONS = ["--agents", "spike-threshold", "ttc-oracle", "--seeds", "4", "--no-plots", "--no-report"]


@pytest.fixture(scope="module")
def complete(suite, tmp_path_factory):
    """Folder of a complete run in one process."""
    out = tmp_path_factory.mktemp("runs") / "complete"
    assert cli.run(["bench", "--suite", str(suite), "--out", str(out), *OPTIONS, "--jobs", "1"]) == 0
    return out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "count"), [(signal.SIGINT, 12), (signal.SIGTERM, 1), (signal.SIGKILL, 24)]
)
def test_stopped_command_leaves_nothing_and_resumes(suite, complete, tmp_path, capsys, number, count):
    """SIGTERM and SIGKILL go to the command alone, SIGINT also to its workers, as from a terminal."""
    rows = sorted_rows(read_rows(complete))
    out, tag = tmp_path / "run", f"{os.getpid()}-{number}"
    process = kills.start(["bench", "--suite", suite, "--out", out, *OPTIONS], tag)
    kills.wait_for_rows(out, count, process)
    owners = {process.pid, *kills.processes(tag)}
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    printed, errors = process.communicate(timeout=120)
    # Python restores the default handler of SIGTERM at the very end.
    assert process.returncode in (kills.CODES[number], -number), errors
    assert "Traceback" not in errors
    kills.wait_until_gone(tag, owners)
    kept = read_rows(out)
    assert count <= len(kept) < len(rows) == 48
    assert all(row in rows for row in kept)
    if number == signal.SIGINT:
        assert f"interrupted: {len(kept)} of 48" in printed
        assert (out / "summary.csv").exists()
    assert cli.run(["bench", "--resume", str(out), "--jobs", "1", "--no-plots", "--no-report"]) == 0
    assert f"resuming with {len(kept)} of 48" in capsys.readouterr().out
    assert sorted_rows(read_rows(out)) == rows
    for name in ("summary.csv", "froc.csv"):
        assert (out / name).read_bytes() == (complete / name).read_bytes()


def test_sigterm_ends_a_command_like_ctrl_c_with_its_own_code(monkeypatch, capsys):
    from lgmd_gym.cli import list as command

    for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
        monkeypatch.setattr(command, "run", lambda options, number=number: signal.raise_signal(number))
        before = [signal.getsignal(item) for item in (signal.SIGINT, signal.SIGTERM)]
        assert cli.run(["list", "suites"]) == code
        assert capsys.readouterr().err == "lgmd-gym: interrupted\n"
        assert [signal.getsignal(item) for item in (signal.SIGINT, signal.SIGTERM)] == before


def test_signal_in_a_callback_of_a_c_library_is_repeated(monkeypatch, capsys):
    import ctypes

    from lgmd_gym.cli import list as command

    @ctypes.CFUNCTYPE(None)
    def callback():
        signal.raise_signal(signal.SIGTERM)

    def run(options):
        callback()  # ctypes reports the exception and goes on
        time.sleep(5)

    monkeypatch.setattr(command, "run", run)
    assert cli.run(["list", "suites"]) == 143
    assert capsys.readouterr().err == "lgmd-gym: interrupted\n"


def test_ignored_signals_stay_ignored(monkeypatch):
    """As under nohup, or in the background of a shell without job control."""
    from lgmd_gym.cli import list as command

    monkeypatch.setattr(command, "run", lambda options: signal.raise_signal(signal.SIGINT) or 0)
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        assert cli.run(["list", "suites"]) == 0
    finally:
        signal.signal(signal.SIGINT, previous)


def test_signal_that_arrives_while_workers_start_is_kept():
    blocked = set()
    with pytest.raises(KeyboardInterrupt), worker_processes.signals_blocked():  # noqa: PT012
        signal.raise_signal(signal.SIGINT)
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    assert signal.SIGINT in blocked
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


@pytest.mark.slow
def test_worker_processes_leave_signals_to_the_command():
    """In a new process: joblib starts processes with its first workers that change the blocked signals."""
    code = """
import signal
from joblib import delayed
from lgmd_gym.processes.pool import run_parallel
calls = [delayed(signal.pthread_sigmask)(signal.SIG_BLOCK, []) for _ in range(4)]
print([sorted(map(int, blocked)) for blocked in run_parallel(calls, 2)])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str([[int(signal.SIGINT), int(signal.SIGTERM)]] * 4)


def test_one_job_needs_no_worker_process():
    with Executor(1).open() as run_tasks:
        assert sorted(run_tasks(abs, [-2, 1])) == [1, 2]
