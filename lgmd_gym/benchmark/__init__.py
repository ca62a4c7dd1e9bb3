"""Benchmark: suites of cases, runs on many processes, rows and summaries."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, cast

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.extensions import OUTPUTS, provided
from lgmd_gym.benchmark.suites import Source, get_suite
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.errors import shown
from lgmd_gym.processes.pool import SERIAL, Executor

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Executor", "RunConfig", "get_suite", "run"]


def run(
    config: RunConfig | Scenario | Sequence[Scenario | str],
    folder: Path | str | None = None,
    executor: Executor = SERIAL,
    plots: bool = True,
    report: bool = True,
) -> "pd.DataFrame":
    """Run a benchmark and write the same folder as `lgmd-gym bench`.

    Args:
        config: Configuration of the run; or a scenario, or several scenarios and paths of files, which the
            default agents play.
        folder: Run folder, which must not exist; None to keep no folder.
        executor: Worker processes or cluster that run the episodes.
        plots: Whether to draw one PNG per case.
        report: Whether to write report.html.

    Returns:
        One row per episode, including `no-brake`, with the columns `lgmd_gym.benchmark.metrics.KEYS`;
        for the suite "traffic", `lgmd_gym.benchmark.traffic.rows.KEYS`.

    Raises:
        TypeError: If the configuration is none of these.
        ValueError: If the configuration is invalid, the cluster is not reachable, or the folder exists or
            cannot be created.
        RuntimeError: If the run stopped early, because a worker was killed or the disk is full.

    Example:
        >>> config = RunConfig(suite="quick", agents=("ttc-oracle",), seeds=1)
        >>> table = run(config)  # doctest: +SKIP
    """
    if isinstance(config, Scenario | list | tuple):
        config = RunConfig(suite=cast(Source, config))
    if not isinstance(config, RunConfig):
        raise TypeError(
            f"config must be a RunConfig, got {shown(config)}; use RunConfig(suite=..., agents=...)"
        )
    if not isinstance(folder, str | Path | None):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise TypeError(
            f"folder must be a path, got {shown(folder)}; agents are in RunConfig(suite=..., agents=...)"
        )
    import pandas as pd

    from lgmd_gym.benchmark.runner import Run

    with TemporaryDirectory() as spare:
        benchmark = Run.new(config, Path(folder or Path(spare) / "run"), executor)
        complete = benchmark.play()
        if folder is not None:
            provided(OUTPUTS)(benchmark.folder.path, plots, report, trust=True)
        if not complete:
            kept = f"{len(benchmark.rows)} of {benchmark.total} episodes kept"
            raise RuntimeError(f"{benchmark.stop_reason}: {kept}")
        return pd.DataFrame(benchmark.rows)
