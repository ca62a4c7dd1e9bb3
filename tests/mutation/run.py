"""Mutation test: plant small errors in the source, one at a time, and count those that the tests notice.

    python tests/mutation/run.py [MODULE ...] [--limit N] [--seed S] [--jobs N]

Each mutant is written to a temporary copy of the sources, and the tests of its module are run without
compilation (`NUMBA_DISABLE_JIT=1`), which takes a second. A mutant survives if they pass. The exit code is 0
if at least 90 % are killed.
"""

import argparse
import importlib
import multiprocessing
import os
import random
import shutil
import sys
import tempfile
import time
from itertools import product
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import NamedTuple

import pytest
from mutants import Mutant, mutants_of

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("lgmd_gym", "envs", "agents", "tests", "pyproject.toml")
PRELOADED = ("numpy", "numba", "gymnasium", "highway_env.envs", "hypothesis", "rich.console", "tyro")
GOAL = 0.9


class Module(NamedTuple):
    """Sources, their tests, and functions that cannot run without compilation."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]
    skipped: tuple[str, ...] = ()


def _under(folder: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{folder}/{name}.py" for name in names)


_HAND = ("test_motion_by_hand", "test_ego_by_hand", "test_contact_by_hand", "test_episode_end")
_FAMILIES = ("rear", "crossing", "turning", "adjacent", "obstacle")
MODULES = {
    "reward": Module(("envs/reward.py",), ("tests/envs/test_formulas.py",)),
    "info": Module(("envs/info.py", "envs/surrogate_safety.py"), ("tests/envs/test_formulas.py",)),
    "dynamics": Module(
        _under(
            "envs/dynamics",
            "longitudinal",
            "brake",
            "bodies",
            "speed_profile",
            "path",
            "bend",
            "units",
            "episode",
        ),
        _under("tests/envs", *_HAND, "test_path", "test_formulas"),
        ("__deepcopy__", "DelayLine", "SpeedProfile", "step_environment"),
    ),
    "contact": Module(
        _under("envs/dynamics", "contact", "swept_contact"), ("tests/envs/test_contact_by_hand.py",)
    ),
    "scenarios": Module(
        _under("envs/scenarios", "adjacent", "crossing", "obstacles", "rear", "scenario", "turning"),
        (*_under("tests/envs", *(f"test_{name}_scenarios" for name in _FAMILIES), "test_scenario_data"),),
        ("_time_to_cover",),
    ),
    "metrics": Module(("lgmd_gym/benchmark/metrics.py",), ("tests/benchmark/test_formulas.py",)),
    "statistics": Module(
        ("lgmd_gym/benchmark/statistics.py", *_under("lgmd_gym/benchmark/analysis", "bootstrap", "compare")),
        ("tests/benchmark/test_formulas.py", "tests/benchmark/test_statistics.py"),
        ("compare_runs", "read_case_rows", "_agent_pairs"),
    ),
    "neuron": Module(("lgmd_gym/neuron/scalars.py",), ("tests/neuron/test_boundaries.py",)),
    "camera": Module(
        (
            *_under("lgmd_gym/camera", "pinhole", "pose"),
            *_under("lgmd_gym/camera/render", "glare", "markings", "texture_sampling"),
        ),
        tuple(f"tests/camera/test_{name}_by_hand.py" for name in ("geometry", "glare", "ground", "markings")),
        ("noise_start", "fixed_line", "_fixed", "sample"),
    ),
}


class Task(NamedTuple):
    """One mutant of one source."""

    module: str
    source: str
    mutant: Mutant


def all_tasks(names: list[str]) -> list[Task]:
    """Return every mutant of the modules."""
    return [
        Task(name, source, mutant)
        for name in names
        for source in MODULES[name].sources
        for mutant in mutants_of((ROOT / source).read_bytes(), MODULES[name].skipped)
    ]


def make_copy(folder: Path) -> None:
    """Copy the sources and tests; the links of the package stay links."""
    for name in COPIED:
        if (ROOT / name).is_dir():
            ignored = shutil.ignore_patterns("__pycache__", "*.npz")
            shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=ignored)
        else:
            shutil.copy2(ROOT / name, folder / name)


def run_tests(copy: Path, tests: tuple[str, ...], bytecode: bool) -> None:
    """Run tests in a copy of the sources and exit with the code of pytest; runs in a process of its own."""
    os.chdir(copy)
    sys.path.insert(0, str(copy))
    # The bytecode of a mutant may be as old and as long as that of the next one.
    sys.dont_write_bytecode = not bytecode
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
        options = ["-x", "-q", "-o", "addopts=--import-mode=importlib", "--noconftest"]
        os._exit(pytest.main([*options, "--tb=no", "-p", "no:cacheprovider", *tests]))


def start(copy: Path, module: str, bytecode: bool = False) -> BaseProcess:
    """Return a process that runs the tests of a module in a copy of the sources."""
    arguments = copy, MODULES[module].tests, bytecode
    process = multiprocessing.get_context("fork").Process(target=run_tests, args=arguments)
    process.start()
    return process


def time_limits(names: list[str], copies: list[Path]) -> dict[str, float]:
    """Run the tests of each module without a mutant and return the time limits of its mutants [s]."""
    limits = {}
    for name, copy in product(names, copies):
        begin = time.monotonic()
        process = start(copy, name, bytecode=True)
        process.join()
        if process.exitcode != 0:
            raise SystemExit(f"the tests of {name} fail without a mutant: {' '.join(MODULES[name].tests)}")
        limits[name] = 5.0 + 5.0 * (time.monotonic() - begin)
    return limits


class Slot:
    """One copy of the sources, in which one mutant at a time is played."""

    def __init__(self, copy: Path) -> None:
        self.copy, self.task, self.process, self.end = copy, None, None, 0.0

    def play(self, task: Task, limit_s: float) -> None:
        """Write a mutant and start its tests."""
        path = self.copy / task.source
        self.original = path, path.read_bytes(), path.stat()
        path.write_bytes(task.mutant.source)
        self.task, self.end = task, time.monotonic() + limit_s
        self.process = start(self.copy, task.module)

    def outcome(self) -> str | None:
        """Return "killed", "survived" or "timeout" and restore the source; None while the tests run."""
        late = time.monotonic() > self.end
        if self.process.is_alive() and not late:
            return None
        self.process.kill()
        self.process.join()
        path, source, times = self.original
        path.write_bytes(source)
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
        return "survived" if self.process.exitcode == 0 else "timeout" if late else "killed"


def play_all(tasks: list[Task], copies: list[Path]) -> list[tuple[Task, str]]:
    """Play all mutants and print each outcome other than "killed"."""
    limits = time_limits(sorted({task.module for task in tasks}), copies)
    idle, busy, waiting, outcomes = [Slot(copy) for copy in copies], [], list(tasks), []
    while waiting or busy:
        while waiting and idle:
            slot, task = idle.pop(), waiting.pop(0)
            slot.play(task, limits[task.module])
            busy.append(slot)
        time.sleep(0.01)
        for slot in list(busy):
            outcome = slot.outcome()
            if outcome is not None:
                busy.remove(slot)
                idle.append(slot)
                outcomes.append((slot.task, outcome))
                report(slot.task, outcome)
    return outcomes


def report(task: Task, outcome: str) -> None:
    """Print the place and the change of a mutant that was not killed by a failed test."""
    if outcome != "killed":
        mutant = task.mutant
        print(f"{outcome}  {task.source}:{mutant.line}\n  - {mutant.before}\n  + {mutant.after}", flush=True)


def main() -> None:
    """Parse the command line, play the mutants and print the score."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("modules", nargs="*", metavar="MODULE", help=f"default: all of {', '.join(MODULES)}")
    parser.add_argument("--limit", type=int, help="number of mutants, drawn at random; default: all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.modules if name not in MODULES]:
        parser.error(f"unknown module {unknown[0]!r}; choose from {', '.join(MODULES)}")
    tasks = all_tasks(arguments.modules or list(MODULES))
    total = len(tasks)
    if arguments.limit is not None and arguments.limit < total:
        tasks = random.Random(arguments.seed).sample(tasks, arguments.limit)
    os.environ |= {"NUMBA_DISABLE_JIT": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    for name in PRELOADED:  # once, not in every process
        importlib.import_module(name)
    with tempfile.TemporaryDirectory() as folder:
        copies = [Path(folder) / str(number) for number in range(arguments.jobs)]
        for copy in copies:
            make_copy(copy)
        outcomes = play_all(tasks, copies)
    for name in arguments.modules or MODULES:
        found = [outcome for task, outcome in outcomes if task.module == name]
        print(f"{name:12} {sum(outcome != 'survived' for outcome in found):4} of {len(found):4} killed")
    killed = sum(outcome != "survived" for _, outcome in outcomes)
    print(f"killed {killed} of {len(tasks)} mutants ({killed / max(len(tasks), 1):.1%}); {total} in all")
    sys.exit(killed < GOAL * len(tasks))


if __name__ == "__main__":
    main()
