"""`episodes.csv`: the rows of a run as a table whose column names state the units."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.summary import case_order, write_csv

FILE = "episodes.csv"
# Key of a row -> unit at the end of its column name; keys that are absent have no unit or name it themselves.
UNITS = {
    "ego_speed": "m_s",
    "target_speed": "m_s",
    "impact_speed": "m_s",
    "relative_impact_speed": "m_s",
    "speed_reduction": "m_s",
    "ttc_at_alert": "s",
    "distance_at_alert": "m",
    "warning_lead_time": "s",
    "ttc_at_brake": "s",
    "distance_at_brake": "m",
    "drac_at_brake": "m_s2",
    "max_drac": "m_s2",
    "min_ttc": "s",
    "stopping_margin": "m",
    "peak_deceleration": "m_s2",
    "distance": "m",
    "duration": "s",
    "moving_time": "s",
    "needed_time": "s",
    "fps": "hz",
}


def column_name(key: str) -> str:
    """Return the column of a row key.

    Example:
        >>> column_name("impact_speed"), column_name("case"), column_name("theta_at_alert_deg")
        ('impact_speed_m_s', 'case', 'theta_at_alert_deg')
    """
    return f"{key}_{UNITS[key]}" if key in UNITS else key


def write_episodes(rows: Sequence[Row], path: Path) -> None:
    """Write rows to a CSV file, one line each, ordered by condition, case, agent and seed.

    Null is an empty field, booleans are `true` and `false`, and `error` is the last line of the traceback.

    Args:
        rows: Rows of one run, at least one.
        path: File to write; an existing one is replaced.
    """
    keys = list(rows[0])
    lines = ([_field(key, row[key]) for key in keys] for row in sorted(rows, key=_order))
    write_csv(path, [column_name(key) for key in keys], lines)


def _order(row: Row) -> tuple[Any, ...]:
    """Return the place of a row, which does not depend on the time at which its episode finished."""
    return row["condition"], case_order(row["case"]), row["agent"], row["seed"]


def _field(key: str, value: Any) -> Any:
    """Return a value as the field of a CSV file."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if key == "error":
        return next(reversed(str(value).strip().splitlines()), "")
    return value
