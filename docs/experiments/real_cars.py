"""Agents in the cells of 49 CFR 571.127 in which NHTSA tested six cars.

    python docs/experiments/real_cars.py RUN RUN ...

Each argument is a run folder of `lgmd-gym bench --suite fmvss127`. A line is an agent of a run, and a cell
contains the runs without contact and without premature braking, of n, and the highest relative impact speed.
The table is in Markdown.
"""

import re
import sys
from collections.abc import Sequence
from pathlib import Path

from lgmd_gym.benchmark.case import Row, relative_impact
from lgmd_gym.benchmark.run_folder import StoredRun, read_run
from lgmd_gym.envs.dynamics.units import KMH

CELLS = {
    "stopped, 10–80 km/h": r"/CCRs/",
    "20 km/h, at 70 and 80 km/h": r"/CCRm/v[78]0$",
    "both 50 km/h, 12 m, 0.5 g": r"/CCRb/v50/brake0.5g-gap12$",
    "both 80 km/h, 12 m, 0.5 g": r"/CCRb/v80/brake0.5g-gap12$",
}


def cell(rows: list[Row]) -> str:
    """Return the runs that avoid the contact, of n, and the highest relative impact speed in km/h."""
    avoided = sum(bool(row["avoided"]) for row in rows)
    worst = max(map(relative_impact, rows), default=0.0) / KMH
    return f"{avoided}/{len(rows)}" + (f" ({worst:.0f} km/h)" if worst else "")


def table(runs: Sequence[StoredRun]) -> list[str]:
    """Return the lines of the table."""
    lines = [f"| agent | {' | '.join(CELLS)} |", "| --- " * (len(CELLS) + 1) + "|"]
    for run in runs:
        where = "worlds" if run.config.worlds else "laboratory"
        for agent in run.config.agents:
            rows = [row for row in run.rows if row["agent"] == agent and row["error"] is None]
            cells = [cell([row for row in rows if re.search(text, row["case"])]) for text in CELLS.values()]
            lines.append(f"| `{agent}`, {where} | {' | '.join(cells)} |")
    return lines


if __name__ == "__main__":
    if len(sys.argv) == 1:
        sys.exit(__doc__)
    try:
        stored = [read_run(Path(folder)) for folder in sys.argv[1:]]
    except ValueError as error:
        sys.exit(str(error))
    print(*table(stored), sep="\n")
