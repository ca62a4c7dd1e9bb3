"""Mutation test: plant small errors in the source, one at a time, and count those that the tests notice.

    python tests/mutation/run.py [MODULE ...] [--limit N] [--seed S] [--jobs N] [--out FILE]

Each mutant is written to a temporary copy of the sources, and the tests of its module are run without
compilation (`NUMBA_DISABLE_JIT=1`), which takes a second. A mutant survives if they pass. The exit code is 0
if all were played and at least 90 % killed. Ctrl-C and SIGTERM end the test with the score so far.
"""

import argparse
import contextlib
import importlib
import multiprocessing
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import product
from multiprocessing.process import BaseProcess
from pathlib import Path

import pytest
from modules import MODULES
from mutants import mutants_of
from score import Score, Task

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("lgmd_gym", "envs", "agents", "tests", "pyproject.toml")
PRELOADED = ("numpy", "numba", "gymnasium", "highway_env.envs", "hypothesis", "rich.console", "tyro")
SIGNALS = (signal.SIGINT, signal.SIGTERM)


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
    for number in SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
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
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # an exception in a callback of fork() would be lost
    process.start()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
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


def play_all(tasks: list[Task], copies: list[Path]) -> Iterator[tuple[Task, str]]:
    """Play all mutants and yield each with its outcome, in the order in which their tests end."""
    limits = time_limits(sorted({task.module for task in tasks}), copies)
    idle, busy, waiting = [Slot(copy) for copy in copies], [], list(tasks)
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
                yield slot.task, outcome


def play_in_copies(tasks: list[Task], jobs: int, score: Score) -> None:
    """Play all mutants in temporary copies of the sources and count them.

    No test and no copy is left at the end, also after Ctrl-C and SIGTERM.
    """
    for number in SIGNALS:  # also SIGINT, which a shell's background processes ignore
        signal.signal(number, signal.default_int_handler)
    with tempfile.TemporaryDirectory(prefix="lgmd-gym-mutants-") as folder:
        try:
            copies = [Path(folder) / str(number) for number in range(jobs)]
            for copy in copies:
                make_copy(copy)
            for task, outcome in play_all(tasks, copies):
                score.add(task, outcome)
        finally:
            for number in SIGNALS:  # a second one would interrupt the removal
                signal.signal(number, signal.SIG_IGN)
            for process in multiprocessing.active_children():
                process.kill()
                process.join()


def parse() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("modules", nargs="*", metavar="MODULE", help=f"default: all of {', '.join(MODULES)}")
    parser.add_argument("--limit", type=int, help="number of mutants, drawn at random; default: all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="file for the outcomes, written as they come, as JSON lines")
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.modules if name not in MODULES]:
        parser.error(f"unknown module {unknown[0]!r}; choose from {', '.join(MODULES)}")
    return arguments


def main() -> None:
    """Play the mutants that the command line selects and print the score."""
    arguments = parse()
    tasks = all_tasks(arguments.modules or list(MODULES))
    total = len(tasks)
    if arguments.limit is not None and arguments.limit < total:
        tasks = random.Random(arguments.seed).sample(tasks, arguments.limit)
    # Options of the caller, such as -n, belong to plugins that are not loaded.
    os.environ |= {"NUMBA_DISABLE_JIT": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": ""}
    for name in PRELOADED:  # once, not in every process
        importlib.import_module(name)
    with open(arguments.out or os.devnull, "w") as file:
        score = Score(len(tasks), file)
        with contextlib.suppress(KeyboardInterrupt):  # the score of a part is printed, too
            play_in_copies(tasks, arguments.jobs, score)
    score.show_result()
    print(f"{total} mutants in all")
    sys.exit(not score.reaches_goal)


if __name__ == "__main__":
    main()
