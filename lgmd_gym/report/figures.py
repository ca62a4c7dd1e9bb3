"""Figures of a report that are drawn from its rows: SVG panels, Euro NCAP grids, and their data."""

from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

from lgmd_gym.benchmark.analysis.tables import agent_summaries
from lgmd_gym.benchmark.case import Row, Suite, relative_impact
from lgmd_gym.benchmark.protocols.car_to_car_2023 import OVERLAPS, colour_weight
from lgmd_gym.benchmark.summary import AgentSummary, without_fcw_driver, write_csv
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.processes.files import replace_file
from lgmd_gym.report.svg import (
    INK,
    RULE,
    SOFT,
    Element,
    Panel,
    PanelAxis,
    element,
    file_text,
    label,
    new_panel,
)
from lgmd_gym.statistics.intervals import Rate

MAX_SPEEDS = 25  # test speeds of a family from which they are rounded to `COARSE`
COARSE = 5  # [km/h]
MAX_PANELS = 24  # families that are drawn; the data file has all
IMPACT_COLUMNS = (
    "condition",
    "family",
    "agent",
    "test_speed_km_h",
    "threats",
    "contacts",
    "mean_impact_speed_km_h",
    "highest_impact_speed_km_h",
)
RATE_COLUMNS = (
    "condition",
    "agent",
    "threats",
    "avoided",
    "avoided_low",
    "avoided_high",
    "non_threats",
    "false_activations",
    "false_low",
    "false_high",
)


class ReportFigure(NamedTuple):
    """Panels of one figure, and its data as lines of a CSV file."""

    name: str  # stem of the files
    title: str
    panels: list[Element]  # SVG elements
    legend: list[str]  # agents in the order of their marks; empty without marks
    columns: Sequence[str]  # header of the CSV file
    lines: Sequence[Sequence[object]]  # lines of the CSV file

    def write(self, folder: Path) -> None:
        """Write `<name>.svg` and `<name>.csv` into a folder; existing files are replaced."""
        write_csv(folder / f"{self.name}.csv", self.columns, self.lines)
        replace_file(folder / f"{self.name}.svg", file_text(self.title, self.panels, self.legend))


class ImpactPoint(NamedTuple):
    """Impact speeds of one agent in the threats of one family and test speed; 0 without contact."""

    condition: str
    family: str
    agent: str
    speed: int  # [km/h]
    threats: int
    contacts: int
    mean: float  # [km/h]
    highest: float  # [km/h]


def impact_figure(rows: list[Row], agents: list[str], condition: str) -> ReportFigure | None:
    """Return impact speed over test speed, one panel per scenario family; None without a threat."""
    points = impact_points(rows, agents, condition)
    if not points:
        return None
    shown = sorted({point.family for point in points})[:MAX_PANELS]
    panels = [_impact_panel([p for p in points if p.family == family], agents) for family in shown]
    lines = [(*point[:6], f"{point.mean:.3f}", f"{point.highest:.3f}") for point in points]
    title = f"Impact speed over test speed, {condition}"
    return ReportFigure(f"impact-speed-{condition}", title, panels, agents, IMPACT_COLUMNS, lines)


def impact_points(rows: list[Row], agents: list[str], condition: str) -> list[ImpactPoint]:
    """Return one point per family, agent and test speed, over the threats without an error or FCW driver."""
    groups: dict[str, list[Row]] = {}
    for row in without_fcw_driver(rows):
        if row["threat"] and row["error"] is None:
            groups.setdefault(row["family"], []).append(row)
    points: list[ImpactPoint] = []
    for family, part in sorted(groups.items()):
        speeds = {round(row["ego_speed"] / KMH) for row in part}
        step = 1 if len(speeds) <= MAX_SPEEDS else COARSE
        for agent in agents:
            cells: dict[int, list[Row]] = {}
            for row in part:
                if row["agent"] == agent:
                    cells.setdefault(step * round(row["ego_speed"] / KMH / step), []).append(row)
            for speed, cell in sorted(cells.items()):
                impacts = [(row["impact_speed"] or 0.0) / KMH for row in cell]
                contacts = sum(bool(row["collision"]) for row in cell)
                counts = (len(cell), contacts, fmean(impacts), max(impacts))
                points.append(ImpactPoint(condition, family, agent, speed, *counts))
    return points


def _impact_panel(points: list[ImpactPoint], agents: list[str]) -> Element:
    """Draw one family; the thin diagonal is an impact at test speed."""
    high = max(10.0, *(point.speed for point in points), *(point.mean for point in points)) * 1.04
    axes = PanelAxis("test speed [km/h]", high), PanelAxis("mean impact speed [km/h]", high)
    panel = Panel(points[0].family, *axes, family=points[0].family)
    (x1, y1), (x2, y2) = panel.point(0.0, 0.0), panel.point(high, high)
    ends = {"x1": f"{x1:.1f}", "y1": f"{y1:.1f}", "x2": f"{x2:.1f}", "y2": f"{y2:.1f}"}
    element(panel.root, "line", class_="rule", stroke=RULE, stroke_dasharray="2 3", **ends)
    present = [agent for agent in agents if any(point.agent == agent for point in points)]
    for place, agent in enumerate(present):
        series, group = agents.index(agent), panel.group(agent)
        of_agent = [point for point in points if point.agent == agent]
        panel.line(group, [(point.speed, point.mean) for point in of_agent], series)
        shift = 2.0 * (place - (len(present) - 1) / 2)
        for point in of_agent:
            panel.mark(group, point.speed, point.mean, series, _impact_title(point), shift)
    return panel.root


def _impact_title(point: ImpactPoint) -> str:
    contacts = f"contact in {point.contacts} of {point.threats} threats"
    impact = f"impact speed mean {point.mean:.1f}, highest {point.highest:.1f} km/h"
    return f"{point.agent}, {point.family} at {point.speed} km/h: {contacts}, {impact}"


def avoidance_figure(rows: list[Row], agents: list[str], condition: str) -> ReportFigure | None:
    """Return avoided threats against false activations; None unless the rows have both kinds of episodes."""
    summaries = [
        item
        for item in agent_summaries(without_fcw_driver(rows), agents)
        if item.avoided.n and item.false_activations.n
    ]
    if not summaries:
        return None
    title = f"Avoided threats against false activations, {condition}"
    axes = (
        PanelAxis("false activations [% of non-threats]", 104.0),
        PanelAxis("avoided [% of threats]", 104.0),
    )
    panel = Panel(condition, *axes, size=(420.0, 300.0))
    drawn: list[tuple[float, float]] = []
    for item in summaries:
        place = item.false_activations.k / item.false_activations.n, item.avoided.k / item.avoided.n
        _add_summary(panel, item, agents.index(item.agent), shift=5.0 * drawn.count(place))
        drawn.append(place)
    lines = [_rate_line(item, condition) for item in summaries]
    return ReportFigure(f"avoidance-{condition}", title, [panel.root], agents, RATE_COLUMNS, lines)


def _add_summary(panel: Panel, item: AgentSummary, series: int, shift: float) -> None:
    """Draw one agent with the 95 % intervals of both rates, `shift` pixels down and to the right."""
    false, avoided, group = item.false_activations, item.avoided, panel.group(item.agent)
    group.set("transform", f"translate({shift:g} {shift:g})")
    x, y = 100.0 * false.k / false.n, 100.0 * avoided.k / avoided.n
    for ends in (
        [(100.0 * false.low, y), (100.0 * false.high, y)],
        [(x, 100.0 * avoided.low), (x, 100.0 * avoided.high)],
    ):
        panel.line(group, ends, series)
    texts = f"avoided {_percent(avoided)} threats", f"false activation in {_percent(false)} non-threats"
    panel.mark(group, x, y, series, f"{item.agent}: {', '.join(texts)}")


def _percent(rate: Rate) -> str:
    return f"{rate.k} of {rate.n} [{100 * rate.low:.0f}–{100 * rate.high:.0f} %]"


def _rate_line(item: AgentSummary, condition: str) -> list[object]:
    rates = [
        value
        for rate in (item.avoided, item.false_activations)
        for value in (rate.n, rate.k, f"{rate.low:.4f}", f"{rate.high:.4f}")
    ]
    return [condition, item.agent, *rates]


PAIRED = ("CCCscp", "CCFtap", "CMCscp", "CMFtap")  # families with grids of ego and target speeds
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
    letter: bool = True  # whether a letter repeats the colour


class CaseGrid(NamedTuple):
    """Grid of one scenario family and one agent; the cell is None where the suite has no case."""

    title: str
    axis: str  # quantity of the columns
    columns: Sequence[int | str]
    lines: list[tuple[str, list[GridCell | None]]]
    agent: str
    family: str


def case_grids(rows: list[Row], agent: str, suite: Suite) -> list[CaseGrid]:
    """Return the grids of an agent in a Euro NCAP suite; none for other suites."""
    if suite.colour is None:
        return []
    sides = {(case.family, case.argument("side")) for case in suite.cases}
    sided = [family for family, side in sides if side == "right" and (family, "left") in sides]
    grids: dict[tuple[str, str], dict[tuple[str, int], list[Row]]] = {}
    for row in rows:
        position = _position(row, sided)
        if row["agent"] == agent and row["error"] is None and position is not None:
            family, axis, head, column = position
            grids.setdefault((family, axis), {}).setdefault((head, column), []).append(row)
    return [
        _grid(agent, family, axis, cells, suite.colour) for (family, axis), cells in sorted(grids.items())
    ]


def _position(row: Row, sided: list[str]) -> tuple[str, str, str, int] | None:
    """Return title, axis, row heading and column of a row; None for a case without a grid.

    `sided` are the families with a grid for each side of the target.
    """
    family, target = row["family"], row["test_target_speed"]
    speed = "from stop" if row["test_speed"] is None else f"{row['test_speed'] / KMH:.0f}"
    for axis, place in (("overlap", row["overlap"]), ("location", row["impact_location"])):
        if place is not None:
            title = family + (" at night" if row["light"] == "night" else "")
            return title, axis, speed + (" warned" if row["fcw_driver"] else ""), round(100 * place)
    if family in PAIRED and target is not None:
        title = family + (f" from the {row['target_side']}" if family in sided else "")
        return title, "target", speed, round(target / KMH)
    return None


def _grid(
    agent: str,
    family: str,
    axis: str,
    cells: dict[tuple[str, int], list[Row]],
    colour: Callable[[Row], str],
) -> CaseGrid:
    heads = sorted({head for head, _ in cells}, key=_head_speed)
    columns = sorted({column for _, column in cells})
    if axis == "overlap":
        columns.sort(key=OVERLAPS.index)
    lines = [(head, [_cell(cells.get((head, column)), colour) for column in columns]) for head in heads]
    return CaseGrid(f"{family}: {agent}", AXES[axis], columns, lines, agent, family)


def _cell(rows: list[Row] | None, colour_of: Callable[[Row], str]) -> GridCell | None:
    """Return the cell of one case: highest impact speed, and the colour of the seed that earns least."""
    if rows is None:
        return None
    worst = max(rows, key=relative_impact)
    colours = [colour_of(row) for row in sorted(rows, key=relative_impact, reverse=True)]
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


CELL, LINE, HEAD, TOP = 34.0, 24.0, 66.0, 50.0  # width and height of a cell, row headings, title [px]
# For colour-blind readers and grey prints, lightness falls to red, and a letter repeats the colour.
CELL_COLOURS = {
    "green": ("#8fd3bd", "G"),
    "yellow": ("#f5e58a", "Y"),
    "orange": ("#f0a552", "O"),
    "brown": ("#9a6233", "B"),
    "red": ("#8c1c3a", "R"),
    "contact": ("#b3a2c7", "C"),
    "premature": ("#c4c0b8", "P"),
}
DARK_CELLS = ("brown", "red")
COLUMNS = (
    "condition",
    "agent",
    "family",
    "ego_speed_km_h",
    "column",
    "column_value",
    "colour",
    "runs",
    "contacts",
    "premature",
    "highest_relative_impact_speed_km_h",
)


def grid_figure(
    grids: list[CaseGrid], condition: str, name: str = "grids", title: str = "Euro NCAP grids"
) -> ReportFigure | None:
    """Return the grids of all agents under one condition; None without a grid."""
    if not grids:
        return None
    lines = [
        (condition, grid.agent, grid.family, head, grid.axis, column, cell.colour, *_values(cell))
        for grid in grids
        for head, cells in grid.lines
        for column, cell in zip(grid.columns, cells, strict=True)
        if cell is not None
    ]
    panels = list(map(_panel, grids))
    return ReportFigure(f"{name}-{condition}", f"{title}, {condition}", panels, [], COLUMNS, lines)


def _values(cell: GridCell) -> tuple[int, int, int, str]:
    return cell.runs, cell.contacts, cell.premature, f"{cell.impact_kmh:.3f}"


def _panel(grid: CaseGrid) -> Element:
    """Draw one grid: a row per ego speed, and the quantity of the columns below the title."""
    size = max(HEAD + CELL * len(grid.columns) + 8, 240.0), TOP + LINE * len(grid.lines) + 10
    root = new_panel(grid.title, size, agent=grid.agent, family=grid.family)
    label(root, 4, 14, grid.title, font_size=12, font_weight=600)
    label(root, HEAD, 28, grid.axis, font_size=10, class_="soft", fill=SOFT)
    for index, column in enumerate(grid.columns):
        label(root, HEAD + CELL * (index + 0.5), TOP - 6, str(column), "middle")
    for row, (head, cells) in enumerate(grid.lines):
        y = TOP + LINE * row
        label(root, HEAD - 5, y + LINE / 2 + 4, head, "end")
        for index, cell in enumerate(cells):
            if cell is not None:
                _draw_cell(root, HEAD + CELL * index, y, cell)
    return root


def _draw_cell(root: Element, x: float, y: float, cell: GridCell) -> None:
    colour, letter = CELL_COLOURS[cell.colour]
    text_colour = "#ffffff" if cell.colour in DARK_CELLS else INK
    group = element(root, "g")
    element(group, "title", cell.tooltip)
    element(group, "rect", x=x + 1, y=y + 1, width=CELL - 2, height=LINE - 2, fill=colour)
    style = {"class_": "cell", "fill": text_colour}
    label(group, x + CELL / 2, y + LINE / 2 + 4, cell.text, "middle", **style)
    if cell.letter:
        label(group, x + CELL - 4, y + 9, letter, "end", font_size=8, **style)
