"""The report page: its sections, rendered with `page.html`."""

from pathlib import Path
from typing import Any

from lgmd_gym.benchmark.analysis.froc import LEAD_TIME
from lgmd_gym.benchmark.analysis.ncap_points import SUITE_POINTS
from lgmd_gym.benchmark.analysis.protocol_limits import R152_SUITES, meets_r152
from lgmd_gym.benchmark.analysis.tables import (
    agent_summaries,
    limit_lines,
    mean_kmh,
    rate_text,
    success_lines,
)
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.folder import replace_file
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.summary import INTERVAL_TEXT, Sample, by_condition, without_fcw_driver
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.envs.registration import SCENARIO
from lgmd_gym.report.agent_notes import agent_note
from lgmd_gym.report.case_grids import case_grids
from lgmd_gym.report.conclusion import conclusion
from lgmd_gym.report.data import ReportData
from lgmd_gym.report.figures import MAX_PANELS, ReportFigure, avoidance_figure, impact_figure
from lgmd_gym.report.grid_figure import CELL_COLOURS, DARK_CELLS, grid_figure
from lgmd_gym.report.sections import (
    comparison_section,
    episode_section,
    false_activation_section,
    froc_section,
)
from lgmd_gym.report.selection import illustrated_agent
from lgmd_gym.report.svg import DARK_CSS, legend_mark, to_text
from lgmd_gym.statistics.intervals import Rate

BANDS = ("red", "brown", "orange", "yellow", "green")


def write_report(path: Path, trust: bool = False) -> Path:
    """Write `report.html` and its `figures/` into a run folder and return the path of the page.

    The page contains all of its figures. Each is also a file with its data, `figures/<name>.svg` and `.csv`;
    files of an earlier report are replaced. Only the episodes whose camera frames are shown are simulated
    again.

    Args:
        path: Run folder.
        trust: Whether to load agents from modules and policy files that the folder names. Otherwise the
            report shows no camera frames of these agents.

    Raises:
        ValueError: If the folder contains no run or a damaged one.
    """
    data = ReportData.load(path, trust)
    file = path / "report.html"
    replace_file(file, _render(data))
    return file


def _render(data: ReportData) -> str:
    """Return the page; the figures are written to files meanwhile."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("lgmd_gym.report", "."), autoescape=True, undefined=StrictUndefined
    )
    environment.filters |= {"band": band, "rate_band": rate_band, "rate": rate_text, "kmh": mean_kmh}
    environment.filters["svg"] = to_text
    families = {case.name: _family(case) for case in data.cases.values()}
    return environment.get_template("page.html").render(
        data=data,
        interval=INTERVAL_TEXT,
        conclusion=conclusion(data.rows, data.agents, data.suite),
        notes=[(agent, agent_note(agent, agent not in data.agents_not_loaded)) for agent in data.agents],
        legend=[(agent, legend_mark(series)) for series, agent in enumerate(data.agents)],
        families=families,
        max_panels=MAX_PANELS,
        cell_colours=CELL_COLOURS,
        dark_cells=DARK_CELLS,
        dark_css=DARK_CSS,
        failed=sum(row["error"] is not None for row in data.rows),
        conditions=[_condition(data, name, rows, families) for name, rows in by_condition(data.rows).items()],
        froc=froc_section(data),
        lead_time=LEAD_TIME,
        comparisons=comparison_section(data),
        illustrated=illustrated_agent(data.agents),
        episodes=episode_section(data),
        false_activations=false_activation_section(data),
    )


def band(share: float | None) -> str:
    """Return the colour of a share, one per fifth and green for the highest; "" for None."""
    return "" if share is None else BANDS[min(int(5 * share), 4)]


def rate_band(rate: Rate, lower_is_better: bool = False) -> str:
    """Return the colour of a rate; "" for an empty one."""
    if rate.n == 0:
        return ""
    share = rate.k / rate.n
    return band(1.0 - share if lower_is_better else share)


def _family(case: Case) -> str:
    """Return the family of a case; that of a case with a given scenario is in its name."""
    return case.name.split("/")[1] if case.family == SCENARIO else case.family


def _condition(data: ReportData, name: str, rows: list[Row], families: dict[str, str]) -> dict[str, Any]:
    """Return the tables and figures of one camera condition."""
    braking = [agent for agent in data.agents if agent != NO_BRAKE]
    points = SUITE_POINTS.get(data.suite)
    judged = data.agents if data.suite in R152_SUITES else None
    met = judged and [agent for agent in judged if meets_r152(rows, agent)]
    grids = [grid for agent in braking for grid in case_grids(rows, agent, data.suite)]
    return {
        "name": name,
        "sample": Sample.of(rows),
        "summaries": agent_summaries(without_fcw_driver(rows), data.agents),
        "limits": limit_lines(rows, data.agents, data.suite),
        "meet_r152": met,
        "points": [(agent, points(rows, agent)) for agent in braking] if points else [],
        "avoidance": _saved(data, avoidance_figure(rows, data.agents, name)),
        "impacts": _saved(data, impact_figure(rows, data.agents, families, name)),
        "grids": _saved(data, grid_figure(grids, name)),
        "cases": success_lines(rows, data.agents),
    }


def _saved(data: ReportData, figure: ReportFigure | None) -> ReportFigure | None:
    """Write the files of a figure and return it."""
    if figure is not None:
        figure.write(data.figures)
    return figure
