"""A benchmark run, which writes each row when its episode finishes."""

import contextlib
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

import lgmd_gym
from lgmd_gym import neuron
from lgmd_gym.agents.registry import outside_code
from lgmd_gym.benchmark.case import Row, key_of
from lgmd_gym.benchmark.config import RUN_FILE, RunConfig, provenance
from lgmd_gym.benchmark.plan import make_plan
from lgmd_gym.benchmark.run_folder import RunFolder, series_name
from lgmd_gym.benchmark.task import NO_BRAKE, Result
from lgmd_gym.engine.first_use import compile_kernels
from lgmd_gym.errors import counted
from lgmd_gym.processes.pool import SERIAL, Executor, PoolLostError

MAX_FAILURES = 5  # kinds of failure that are described
EARLY = 8  # an agent whose first episodes all fail ends the run after this number

_PACKAGE = str(Path(lgmd_gym.__file__).parent)
_FRAME = re.compile(r'^  File "(.+)", line (\d+), in (.+)$', re.MULTILINE)


def failure_lines(rows: Iterable[Row]) -> list[str]:
    """Return a line for each agent and exception: the number of episodes, the exception and its place."""
    failed = [row for row in rows if row["error"] is not None]
    kinds = Counter((row["agent"], describe_failure(row["error"] or "")) for row in failed)
    most = kinds.most_common(MAX_FAILURES)
    lines = [f"{agent}: {text} ({counted(count, 'episode')})" for (agent, text), count in most]
    if len(kinds) > MAX_FAILURES:
        lines.append(f"{len(kinds) - MAX_FAILURES} other failures")
    return lines


def failing_agent(rows: Iterable[Row]) -> str:
    """Return the first agent with at least `EARLY` rows, all of them failed; "" if there is none."""
    failed, succeeded = Counter[str](), set[str]()
    for row in rows:
        if row["error"] is None:
            succeeded.add(row["agent"])
        else:
            failed[row["agent"]] += 1
    return next((agent for agent, n in failed.items() if n >= EARLY and agent not in succeeded), "")


def describe_failure(error: str) -> str:
    """Return the exception of a traceback and its place in code outside this package."""
    exception = error.strip().splitlines()[-1].strip()
    frames = _FRAME.findall(error)
    own = [frame for frame in frames if not frame[0].startswith(_PACKAGE) and "site-packages" not in frame[0]]
    place = ""
    if frames:
        file, line, function = (own or frames)[-1]
        place = f" at {_short(file)}:{line} in {function}"
    return f"{exception}{place}"


def _short(file: str) -> str:
    """Return a path relative to the working directory, if it is in it."""
    path = Path(file)
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else file


INTERRUPTED = "interrupted"


def check_trust(config: RunConfig, source: Path, trust: bool) -> None:
    """Print the modules and policy files that agents and the neuron load, one line each to stderr.

    Raises:
        ValueError: If the user does not trust the file and it names code from outside this package.
    """
    named = [("agent", agent, outside_code(agent)) for agent in config.agents]
    if config.neuron is not None:
        named.append(("neuron", config.neuron, neuron.outside_code(config.neuron)))
    for kind, text, code in named:
        if code is None:
            continue
        if not trust:
            raise ValueError(
                f"{str(source)!r} names {kind} {text!r}, which runs the code of {code}; if you trust it, "
                "add --trust"
            )
        print(f"lgmd-gym: loading {code}, named in {str(source)!r}", file=sys.stderr)


class Run:
    """One benchmark run; use `new` or `resume` to create one.

    Args:
        config: Configuration.
        folder: Open run folder, whose episodes are not run again.
        executor: Worker processes or cluster that run the episodes.

    Attributes:
        plan: The episodes of the run.
        rows: Rows so far.
        stop_reason: Why the last `play` stopped early; "" if it did not.
    """

    def __init__(self, config: RunConfig, folder: RunFolder, executor: Executor = SERIAL) -> None:
        self.config, self.folder, self.executor = config, folder, executor
        self.plan = make_plan(config)
        self.rows = list(folder.rows)
        self.stop_reason = ""

    @classmethod
    def new(cls, config: RunConfig, path: Path, executor: Executor = SERIAL) -> "Run":
        """Return a run in a new folder, which receives the configuration as `run.toml`.

        Raises:
            ValueError: If the configuration is invalid, the cluster is not reachable, or the folder exists
                or cannot be created.
        """
        _check(config, executor)
        provenance()  # slow at its first call; a kill must not leave a folder without settings meanwhile
        folder = RunFolder.create(path)
        try:
            run = cls(RunConfig.load(config.save(path)), folder, executor)
            run._describe(False, 0.0)
            return run
        except BaseException:  # for example a full disk
            folder.discard()
            raise

    @classmethod
    def resume(cls, path: Path, executor: Executor = SERIAL, trust: bool = False) -> "Run":
        """Return the run of a folder; that of a complete one loads no agent.

        Args:
            path: Run folder.
            executor: Worker processes or cluster that run the missing episodes.
            trust: Whether to load agents from modules and policy files that the folder names.

        Raises:
            ValueError: See `RunFolder.reopen`; or if an agent is invalid or not trusted, or the cluster is
                not reachable.
        """
        folder = RunFolder.reopen(path)
        try:
            config = RunConfig.load(path / RUN_FILE)
            run = cls(config, folder, executor)
            if len(run.rows) < run.total:
                check_trust(config, path / RUN_FILE, trust)
                _check(config, executor)
            return run
        except BaseException:
            folder.close()
            raise

    @property
    def total(self) -> int:
        """Number of episodes of the complete run."""
        return self.plan.total

    def play(self, progress: Callable[[Row], None] | None = None) -> bool:
        """Run the missing episodes and write every row as it finishes.

        Args:
            progress: Called with each new row.

        Returns:
            Whether the run is complete; if not, `stop_reason` holds the reason.
        """
        started, complete, self.stop_reason = time.perf_counter(), False, ""
        try:
            self._describe(False, 0.0)
            if self.executor.cluster is None and len(self.rows) < self.total:
                compile_kernels()  # before the workers, which would all do so
            with self.executor.open() as run_tasks:
                for result in self.plan.play(run_tasks, list(self.rows)):
                    self._add(result)
                    if progress is not None:
                        progress(result.row)
                    if result.row["error"] is not None and (agent := failing_agent(self.rows)):
                        self.stop_reason = f"every episode of {agent} failed, {EARLY} so far"
                        break
            complete = not self.stop_reason
        except KeyboardInterrupt:
            self.stop_reason = INTERRUPTED
        except PoolLostError as error:
            self.stop_reason = str(error)
        except OSError as error:
            self.stop_reason = f"{error.strerror or error} in run folder {str(self.folder.path)!r}"
        finally:
            with contextlib.suppress(OSError):  # of a full disk
                self._describe(complete, time.perf_counter() - started)
            self.folder.close()
        return complete

    def _add(self, result: Result) -> None:
        """Write a result; time series of `no-brake` and of the first seed are kept."""
        key = key_of(result.row)
        kept = key[0] == NO_BRAKE or key[2] == self.config.first_seed
        # Before the row, because an episode with a row is not run again.
        if kept and result.series is not None:
            self.folder.add_series(series_name(key), result.series)
        self.folder.add(result.row)
        self.rows.append(result.row)

    def _describe(self, complete: bool, wall_time: float) -> None:
        """Write `run.json`."""
        self.folder.describe(
            {
                **self.config.to_dict(),
                "jobs": self.executor.jobs,
                "cluster": self.executor.cluster,
                "complete": complete,
                "episodes": len(self.rows),
                "wall_time": round(wall_time, 3),
            }
        )


def _check(config: RunConfig, executor: Executor) -> None:
    make_plan(config).check()
    executor.check()
