"""Contents of a run folder, for the report."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.agents.registry import outside_code
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.file_names import series_name
from lgmd_gym.benchmark.rows import Row, key_of
from lgmd_gym.benchmark.stored_run import read_run, read_series, read_settings
from lgmd_gym.benchmark.suite_file import get_suite
from lgmd_gym.benchmark.task import NO_BRAKE, Task
from lgmd_gym.report.images import CapturedFrame, capture_frames


@dataclass(frozen=True)
class ReportData:
    """Contents of a run folder."""

    path: Path
    config: RunConfig
    settings: dict[str, Any]  # contents of run.json
    suite: str
    rows: list[Row]
    agents: list[str]  # no-brake first
    cases: dict[str, Case]
    trust: bool  # whether agents from outside this package may be loaded

    @classmethod
    def load(cls, path: Path, trust: bool = False) -> "ReportData":
        """Read a run folder.

        Raises:
            ValueError: If the folder contains no run or a damaged one.
        """
        run = read_run(path)
        config, suite = run.config, get_suite(run.config.suite)
        agents = list(dict.fromkeys([NO_BRAKE, *config.agents]))
        cases = {case.name: case for case in suite.cases}
        return cls(path, config, read_settings(path), suite.name, run.rows, agents, cases, trust)

    @property
    def figures(self) -> Path:
        """Folder of the figures and their data."""
        return self.path / "figures"

    @property
    def agents_not_loaded(self) -> list[str]:
        """Agents whose code is outside this package and not trusted."""
        return [] if self.trust else [agent for agent in self.agents if outside_code(agent)]

    def series(self, row: Row) -> dict[str, np.ndarray] | None:
        """Return the time series of a row; None if they are not stored."""
        return read_series(self.path, series_name(key_of(row)))

    def frames(self, row: Row, decisions: dict[str, int]) -> list[CapturedFrame]:
        """Return camera frames of a row's episode, see `capture_frames`; none of `agents_not_loaded`."""
        if row["agent"] in self.agents_not_loaded:
            return []
        case, condition = self.cases[row["case"]], row["condition"]
        task = Task(
            row["agent"], case, row["seed"], self.config.sensors(condition), condition=condition,
            world=row["world"], road=self.config.road,
        )  # fmt: skip
        return capture_frames(task, decisions)
