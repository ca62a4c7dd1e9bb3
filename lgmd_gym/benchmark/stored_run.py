"""Reading of run folders: the one place where stored rows are checked."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.benchmark.config import RUN_FILE, RunConfig
from lgmd_gym.benchmark.plan import CasePlan, Plan
from lgmd_gym.benchmark.rows import ID_KEYS, Row, RowKey, key_of
from lgmd_gym.benchmark.suites import TRAFFIC
from lgmd_gym.benchmark.traffic.plan import TrafficPlan

ROWS_FILE = "episodes.jsonl"
MAX_LISTED = 10  # line numbers that a message lists


class StoredRun(NamedTuple):
    """Contents of a run folder.

    Attributes:
        config: Configuration of the run.
        rows: Rows in the order of the file; each belongs to the run, and none occurs twice.
        truncated: Whether an incomplete last line was skipped.
    """

    config: RunConfig
    rows: list[Row]
    truncated: bool


def make_plan(config: RunConfig) -> Plan:
    """Return the plan of a configuration."""
    return TrafficPlan(config) if config.suite == TRAFFIC else CasePlan(config)


def read_run(path: Path) -> StoredRun:
    """Read and check the configuration and the rows of a run folder.

    Raises:
        ValueError: If the folder contains no run or a damaged one, a row of another run, or an episode twice.
    """
    file = rows_file(path)
    rows, truncated = _parse(file)
    config = RunConfig.load(path / RUN_FILE)
    _check_rows(file, rows, make_plan(config))
    return StoredRun(config, rows, truncated)


def rows_file(path: Path) -> Path:
    """Return the path of `episodes.jsonl` in a run folder.

    Raises:
        ValueError: If there is no such file.
    """
    file = path / ROWS_FILE
    if not file.is_file():
        raise ValueError(f"{str(path)!r} contains no run (no {ROWS_FILE}); start one with --out")
    return file


def read_settings(path: Path) -> dict[str, Any]:
    """Return the contents of `run.json` of a run folder.

    Raises:
        ValueError: If it is missing or damaged.
    """
    file = path / "run.json"
    try:
        settings = json.loads(file.read_text(encoding="utf-8"))
        if not isinstance(settings, dict):
            raise ValueError
    except (OSError, ValueError):
        raise ValueError(f"{str(file)!r} is missing or damaged; start a new run") from None
    return settings


def read_series(path: Path, name: str) -> dict[str, np.ndarray] | None:
    """Return the time series in `traces/<name>.npz` of a run folder, or None if there is no such file.

    Raises:
        ValueError: If the file is damaged.
    """
    file = path / "traces" / f"{name}.npz"
    if not file.exists():
        return None
    try:
        with np.load(file) as series:
            return dict(series)
    except Exception:  # errors of the archive, its compression or its arrays, or of the file system
        raise ValueError(f"{str(file)!r} is damaged; remove it to leave its episode out") from None


def _parse(file: Path) -> tuple[list[Row], bool]:
    """Return the rows of a file, and whether an incomplete last line was skipped."""
    rows = []
    lines = file.read_bytes().splitlines(keepends=True)
    for number, line in enumerate(lines, start=1):
        try:
            if not line.endswith(b"\n"):
                raise ValueError
            rows.append(json.loads(line))
        except ValueError:
            if number < len(lines):
                raise _damaged(file, number) from None
            return rows, True
    return rows, False


def _damaged(file: Path, number: int) -> ValueError:
    return ValueError(f"{str(file)!r} is damaged in line {number}; start a new run")


def _check_rows(file: Path, rows: list[Row], plan: Plan) -> None:
    """Raise ValueError for rows without an identity, rows of another run, and repeated rows."""
    planned, lines, faults = plan.keys(), dict[RowKey, int](), dict[int, str]()
    for number, row in enumerate(rows, start=1):
        if not isinstance(row, dict) or not {*ID_KEYS, "error"} <= row.keys():
            raise _damaged(file, number)
        key = key_of(row)
        try:
            is_planned = key in planned
        except TypeError:  # a list or table in the place of a name
            raise _damaged(file, number) from None
        if row["suite"] != plan.suite or not is_planned:
            faults[number] = f"does not belong to the run: {', '.join(map(str, key))}"
        elif row.keys() != rows[0].keys():
            faults[number] = "has other columns than line 1, as from another version"
        elif key in lines:
            faults[number] = f"repeats the episode of line {lines[key]}"
        lines.setdefault(key, number)
    if faults:
        number, fault = next(iter(faults.items()))
        others = [str(other) for other in faults if other != number]
        listed = ", ".join(others[:MAX_LISTED]) + (", ..." if len(others) > MAX_LISTED else "")
        more = f" (also to be checked: {len(others)} lines, {listed})" if others else ""
        raise ValueError(f"{str(file)!r} line {number} {fault}{more}; remove such lines or start a new run")
