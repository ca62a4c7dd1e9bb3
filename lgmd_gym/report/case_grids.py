"""Coloured grids of the Euro NCAP suites: ego speed by overlap, impact location or target speed."""

import re
from typing import NamedTuple

from lgmd_gym.benchmark.analysis.ncap_points import ROW_COLOURS, colour_weight
from lgmd_gym.benchmark.analysis.protocol_limits import relative_impact
from lgmd_gym.benchmark.protocols.car_to_car_2023 import OVERLAPS
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.envs.dynamics.units import KMH

LOCATED_CASE = re.compile(
    r"/(?P<family>\w+)/v(?P<speed>\d+)(?P<warned>-warned)?/(?P<axis>overlap|location)(?P<place>-?\d+)"
    r"(?P<night>-night)?$"
)
PAIRED_CASE = re.compile(
    r"/(?P<family>\w+)/(?:v(?P<speed>\d+)|from-stop)/target(?P<target>\d+)(?:-(?P<side>\w+))?$"
)
AXES = {"overlap": "overlap [%]", "location": "impact location [%]", "target": "target speed [km/h]"}


class GridCell(NamedTuple):
    """Result of one case over all seeds."""

    colour: str  # CSS class: of the Euro NCAP colour, "contact" or "premature"
    text: str  # highest relative impact speed [km/h]; "*" marks premature braking
    tooltip: str
    impact_kmh: float  # highest relative impact speed; 0 without contact
    contacts: int  # runs with contact
    premature: int  # runs with premature braking
    runs: int


class CaseGrid(NamedTuple):
    """Grid of one scenario family and one agent; the cell is None where the suite has no case."""

    title: str
    axis: str  # quantity of the columns
    columns: list[int]
    lines: list[tuple[str, list[GridCell | None]]]
    agent: str
    family: str


def case_grids(rows: list[Row], agent: str, suite: str) -> list[CaseGrid]:
    """Return the grids of an agent in a Euro NCAP suite; none for other suites."""
    if suite not in ROW_COLOURS:
        return []
    grids: dict[tuple[str, str], dict[tuple[str, int], list[Row]]] = {}
    for row in rows:
        position = _position(row["case"])
        if row["agent"] == agent and row["error"] is None and position is not None:
            family, axis, head, column = position
            grids.setdefault((family, axis), {}).setdefault((head, column), []).append(row)
    return [_grid(agent, family, axis, cells, suite) for (family, axis), cells in sorted(grids.items())]


def _position(case: str) -> tuple[str, str, str, int] | None:
    """Return title, axis, row heading and column of a case; None for a case without a grid."""
    if located := LOCATED_CASE.search(case):
        head = located["speed"] + (" warned" if located["warned"] else "")
        title = located["family"] + (" at night" if located["night"] else "")
        return title, located["axis"], head, int(located["place"])
    if paired := PAIRED_CASE.search(case):
        title = paired["family"] + (f" from the {paired['side']}" if paired["side"] else "")
        return title, "target", paired["speed"] or "from stop", int(paired["target"])
    return None


def _grid(
    agent: str, family: str, axis: str, cells: dict[tuple[str, int], list[Row]], suite: str
) -> CaseGrid:
    heads = sorted({head for head, _ in cells}, key=_head_speed)
    columns = sorted({column for _, column in cells})
    if axis == "overlap":
        columns.sort(key=OVERLAPS.index)
    lines = [(head, [_cell(cells.get((head, column)), suite) for column in columns]) for head in heads]
    return CaseGrid(f"{family}: {agent}", AXES[axis], columns, lines, agent, family)


def _cell(rows: list[Row] | None, suite: str) -> GridCell | None:
    """Return the cell of one case: highest impact speed, and the colour of the seed that earns least."""
    if rows is None:
        return None
    worst = max(rows, key=relative_impact)
    colours = [ROW_COLOURS[suite](row) for row in sorted(rows, key=relative_impact, reverse=True)]
    colour = min(colours, key=colour_weight)
    contacts = sum(bool(row["collision"]) for row in rows)
    premature = sum(bool(row["premature_brake"]) for row in rows)
    impact = relative_impact(worst) / KMH
    text = f"{impact:.0f}" if contacts else "0" + ("*" if premature else "")
    counts = f"contact in {contacts} of {len(rows)} runs, premature braking in {premature}"
    tooltip = f"{worst['case']}: {colour}, {counts}"
    return GridCell(colour, text, tooltip, impact, contacts, premature, len(rows))


def _head_speed(head: str) -> int:
    """Return the speed in a row heading [km/h]; 0 for a start from standstill."""
    digits = head.split()[0]
    return int(digits) if digits.isdigit() else 0
