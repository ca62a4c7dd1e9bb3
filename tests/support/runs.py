"""Benchmark runs and rows for several test files."""

import json

from lgmd_gym.benchmark.case import key_of
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.processes.pool import Executor

SMALL_SUITE = """
name = "small"
[[cases]]
family = "CCRs"
speeds_kmh = [10, 20]
[[cases]]
family = "EmptyRoad"
speeds_kmh = [30]
"""


def new_run(folder, jobs=1, **values):
    """Return a new run of a `RunConfig`, in the laboratory unless it states a number of worlds."""
    return Run.new(RunConfig(**{"worlds": 0} | values), folder, Executor(jobs))


def read_rows(folder):
    return [json.loads(line) for line in (folder / "episodes.jsonl").read_text().splitlines()]


def sorted_rows(rows):
    return sorted(rows, key=key_of)


def sorted_keys(rows):
    return sorted(map(key_of, rows))


def interrupt(row):
    """Progress callback that interrupts the run after one row."""
    raise KeyboardInterrupt
