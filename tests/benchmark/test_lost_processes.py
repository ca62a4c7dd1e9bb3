"""Runs whose command, workers or cluster are killed lose and repeat no finished episode."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.runs import read_rows, sorted_keys

LGMD = [sys.executable, "-m", "lgmd_gym"]


def wait_for_rows(out, count, process):
    file = out / "episodes.jsonl"
    end = time.monotonic() + 600
    while not file.exists() or file.read_bytes().count(b"\n") < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.02)


def bench(out, *more):
    arguments = ["--agents", "spike-threshold", "ttc-oracle", "--seeds", "3", "--no-plots", "--no-report"]
    return [*LGMD, "bench", "--out", str(out), *arguments, *more]


@pytest.fixture(scope="module")
def complete_run(tmp_path_factory):
    """Folder of a complete run."""
    out = tmp_path_factory.mktemp("runs") / "complete_run"
    subprocess.run(bench(out), check=True, capture_output=True)
    return out


@pytest.mark.slow
def test_resume_after_sigkill_gives_the_same_summary(complete_run, tmp_path):
    """The command and its workers receive SIGKILL."""
    out = tmp_path / "run"
    process = subprocess.Popen(bench(out), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               start_new_session=True)  # fmt: skip
    wait_for_rows(out, 70, process)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    before = (out / "episodes.jsonl").read_bytes().count(b"\n")
    assert before < 171
    resumed = [*LGMD, "bench", "--resume", str(out), "--no-plots", "--no-report"]
    done = subprocess.run(resumed, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"resuming with {before} of 171" in done.stdout
    assert (out / "summary.csv").read_bytes() == (complete_run / "summary.csv").read_bytes()
    assert (out / "froc.csv").read_bytes() == (complete_run / "froc.csv").read_bytes()
    assert len(read_rows(out)) == len(set(sorted_keys(read_rows(out)))) == 171


@pytest.mark.slow
def test_killed_worker_process_is_reported_and_loses_no_other_row(complete_run, tmp_path):
    out = tmp_path / "run"
    process = subprocess.Popen(bench(out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for_rows(out, 30, process)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
    workers = [int(pid) for pid in children.split()]
    workers = [pid for pid in workers if "LokyProcess" in Path(f"/proc/{pid}/cmdline").read_text()]
    os.kill(workers[0], signal.SIGKILL)
    output, errors = process.communicate(timeout=120)
    assert process.returncode == 1, errors
    assert "a worker process was killed" in output
    assert "Traceback" not in errors
    before = len(read_rows(out))
    assert 30 <= before < 171
    done = subprocess.run([*LGMD, "bench", "--resume", str(out), "--no-plots", "--no-report"])
    assert done.returncode == 0
    assert (out / "summary.csv").read_bytes() == (complete_run / "summary.csv").read_bytes()


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
    wait_for_rows(out, 20, process)
    worker.kill()
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    rows = read_rows(out)
    assert len(rows) == 171
    assert sorted_keys(rows) == sorted_keys(read_rows(complete_run))
    assert (out / "summary.csv").read_bytes() == (complete_run / "summary.csv").read_bytes()
