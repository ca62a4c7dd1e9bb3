"""Figures of a report that are drawn from its rows: SVG panels and the data in them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any, NamedTuple

from lgmd_gym.benchmark.analysis.tables import agent_summaries
from lgmd_gym.benchmark.folder import replace_file
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.summary import AgentSummary, without_fcw_driver, write_csv
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.report.svg import RULE, Axis, Element, Panel, element, file_text
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
    """Panels of one figure, and its data as lines of a CSV file.

    Attributes:
        name: Stem of the files.
        title: Title.
        panels: SVG elements.
        legend: Agents in the order of their marks; empty without marks.
        columns: Header of the CSV file.
        lines: Lines of the CSV file.
    """

    name: str
    title: str
    panels: list[Element]
    legend: list[str]
    columns: Sequence[str]
    lines: Sequence[Sequence[Any]]

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


def impact_figure(
    rows: list[Row], agents: list[str], families: Mapping[str, str], condition: str
) -> ReportFigure | None:
    """Return impact speed over test speed, one panel per scenario family; None without a threat.

    Args:
        rows: Rows of one condition.
        agents: Agents in the order of their marks.
        families: Family of each case, by name.
        condition: Camera condition.
    """
    points = impact_points(rows, agents, families, condition)
    if not points:
        return None
    shown = sorted({point.family for point in points})[:MAX_PANELS]
    panels = [_impact_panel([p for p in points if p.family == family], agents) for family in shown]
    lines = [(*point[:6], f"{point.mean:.3f}", f"{point.highest:.3f}") for point in points]
    title = f"Impact speed over test speed, {condition}"
    return ReportFigure(f"impact-speed-{condition}", title, panels, agents, IMPACT_COLUMNS, lines)


def impact_points(
    rows: list[Row], agents: list[str], families: Mapping[str, str], condition: str
) -> list[ImpactPoint]:
    """Return one point per family, agent and test speed, over the threats without an error or FCW driver."""
    groups: dict[str, list[Row]] = {}
    for row in without_fcw_driver(rows):
        if row["threat"] and row["error"] is None:
            groups.setdefault(families[row["case"]], []).append(row)
    points = []
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
    axes = Axis("test speed [km/h]", high), Axis("mean impact speed [km/h]", high)
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
    """Return avoided threats against false activations; None unless the rows have both kinds of episodes.

    Args:
        rows: Rows of one condition.
        agents: Agents in the order of their marks.
        condition: Camera condition.
    """
    summaries = [
        item
        for item in agent_summaries(without_fcw_driver(rows), agents)
        if item.avoided.n and item.false_activations.n
    ]
    if not summaries:
        return None
    title = f"Avoided threats against false activations, {condition}"
    axes = Axis("false activations [% of non-threats]", 104.0), Axis("avoided [% of threats]", 104.0)
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


def _rate_line(item: AgentSummary, condition: str) -> list[Any]:
    rates = [
        value
        for rate in (item.avoided, item.false_activations)
        for value in (rate.n, rate.k, f"{rate.low:.4f}", f"{rate.high:.4f}")
    ]
    return [condition, item.agent, *rates]
