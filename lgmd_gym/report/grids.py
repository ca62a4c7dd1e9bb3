"""Heat maps of the protocols' grids: speed × overlap, or ego × target speed."""

import re
from typing import Any, NamedTuple

from lgmd_gym.benchmark.analysis.ncap_points import UNKNOWN, colour_2023, colour_of_row_2026
from lgmd_gym.benchmark.analysis.protocol_limits import WEIGHTS, impact
from lgmd_gym.envs.dynamics.units import KMH

Row = dict[str, Any]
PATTERNS = (
    re.compile(
        r"/(?P<family>CCR[smb])/v(?P<row>\d+)(?P<tail>-warned)?/(?P<axis>overlap|location)(?P<column>-?\d+)$"
    ),
    re.compile(r"/(?P<family>CCCscp)/(?:v(?P<row>\d+)|from-stop)(?P<tail>)/(?P<axis>target)(?P<column>\d+)$"),
)
AXES = {"overlap": "overlap [%]", "location": "impact location [%]", "target": "target [km/h]"}
JUDGES = {"ncap2023": colour_2023, "ncap2026": colour_of_row_2026}
ORDER = {-50: 0, -75: 1, 100: 2, 75: 3, 50: 4}  # the protocol's, from the left side to the right


class Cell(NamedTuple):
    """One cell: its colour's name, what stands in it, and what a pointer shows."""

    colour: str
    text: str
    title: str


class Grid(NamedTuple):
    """One family of one agent.

    Attributes:
        title: Agent and family.
        axis: What the columns are.
        columns: Their headings.
        rows: Heading to one cell per column, None where there is no case.
    """

    title: str
    axis: str
    columns: list[str]
    rows: list[tuple[str, list[Cell | None]]]


def grids(rows: list[Row], agent: str, suite: str) -> list[Grid]:
    """Return an agent's grids in a Euro NCAP suite; none for others."""
    if suite not in JUDGES:
        return []
    cells: dict[str, dict[tuple[str, int], list[Row]]] = {}
    axes: dict[str, str] = {}
    for row in rows:
        found = next((m for pattern in PATTERNS if (m := pattern.search(row["case"]))), None)
        if row["agent"] != agent or row["error"] is not None or found is None:
            continue
        head = found["row"] + (" warned" if found["tail"] else "") if found["row"] else "from stop"
        axes[found["family"]] = found["axis"]
        cells.setdefault(found["family"], {}).setdefault((head, int(found["column"])), []).append(row)
    return [_grid(agent, family, axes[family], items, suite) for family, items in sorted(cells.items())]


def _grid(agent: str, family: str, axis: str, items: dict[tuple[str, int], list[Row]], suite: str) -> Grid:
    heads = sorted({head for head, _ in items}, key=_speed)
    columns = sorted({column for _, column in items}, key=_place if axis == "overlap" else lambda c: c)
    rows = [
        (head, [_cell(items[head, column], suite) if (head, column) in items else None for column in columns])
        for head in heads
    ]
    return Grid(f"{family}: {agent}", AXES[axis], [str(column) for column in columns], rows)


def _cell(rows: list[Row], suite: str) -> Cell:
    """Return the cell of one case: coloured by its worst seed."""
    worst = max(rows, key=impact)
    colour, speed = JUDGES[suite](worst), impact(worst) / KMH
    contacts = sum(bool(row["collision"]) for row in rows)
    early = sum(bool(row["premature_brake"]) for row in rows)
    title = f"{worst['case']}: contact in {contacts} of {len(rows)} seeds, {early} braked prematurely"
    assert colour in WEIGHTS or colour == UNKNOWN
    return Cell(colour, f"{speed:.0f}" if contacts else "0" + ("*" if early else ""), title)


def _speed(head: str) -> int:
    digits = head.split()[0]
    return int(digits) if digits.isdigit() else 0


def _place(column: int) -> int:
    return ORDER.get(column, column)
