"""Runs whose workers or cluster are killed lose and repeat no finished episode."""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from joblib.externals.loky import reusable_executor
from support.processes import wait_for_rows
from support.runs import read_rows, sorted_keys

from lgmd_gym.cli import main as cli
from lgmd_gym.processes.pool import Executor, end_workers

LGMD = [sys.executable, "-m", "lgmd_gym"]


def bench(out, *more):
    arguments = ["--suite", "quick", "--agents", "spike-threshold", "ttc-oracle", "--seeds", "1"]
    arguments += ["--no-plots", "--no-report"]
    return [*LGMD, "bench", "--out", str(out), *arguments, *more]


@pytest.fixture(scope="module")
def complete_run(tmp_path_factory):
    """Folder of a complete run in one process."""
    out = tmp_path_factory.mktemp("runs") / "complete_run"
    assert cli.run([*bench(out)[len(LGMD) :], "--jobs", "1"]) == 0
    return out


@pytest.mark.slow
def test_killed_worker_process_is_reported_and_loses_no_other_row(complete_run, tmp_path):
    out = tmp_path / "run"
    process = subprocess.Popen(bench(out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_rows(out, 10, process)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
    workers = [int(pid) for pid in children.split()]
    workers = [pid for pid in workers if "LokyProcess" in Path(f"/proc/{pid}/cmdline").read_text()]
    os.kill(workers[0], signal.SIGKILL)
    output, errors = process.communicate(timeout=120)
    assert process.returncode == 1, errors
    assert "a worker process was killed" in output
    assert "Traceback" not in errors
    before = len(read_rows(out))
    assert 10 <= before < 57
    assert cli.run(["bench", "--resume", str(out), "--jobs", "1", "--no-plots", "--no-report"]) == 0
    assert (out / "summary.csv").read_bytes() == (complete_run / "summary.csv").read_bytes()


def test_idle_workers_end_at_once_and_new_ones_can_start():
    processes = set()
    for _ in range(2):
        with Executor(2).open() as run_tasks:
            processes |= set(run_tasks(pid_of, range(4)))
        started = list(reusable_executor._executor._processes.values())
        end_workers()
        assert started
        assert not any(process.is_alive() for process in started)
    assert os.getpid() not in processes
    end_workers()  # without workers


def pid_of(_):
    return os.getpid()


@pytest.fixture
def cluster(tmp_path):
    """Address of a Dask cluster on the loopback interface, and its scheduler and two worker processes."""
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
def test_cluster_that_loses_a_worker_runs_every_episode_once(cluster, complete_run, tmp_path):
    address, (_, worker, _) = cluster
    out = tmp_path / "run"
    command = bench(out, "--backend", "dask", "--address", address)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_rows(out, 8, process)
    worker.kill()
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    rows = read_rows(out)
    assert len(rows) == 57
    assert sorted_keys(rows) == sorted_keys(read_rows(complete_run))
    assert (out / "summary.csv").read_bytes() == (complete_run / "summary.csv").read_bytes()
