"""The report page: its sections, rendered with `page.html`."""

from functools import partial
from pathlib import Path
from typing import Any

from lgmd_gym.benchmark.analysis.compare import compare_runs
from lgmd_gym.benchmark.analysis.compare_tables import change_text
from lgmd_gym.benchmark.analysis.froc import LEAD_TIME, froc_curves, load_traces
from lgmd_gym.benchmark.analysis.ncap_points import SUITE_POINTS
from lgmd_gym.benchmark.analysis.plots import difference_figure, froc_figure, trace_figure
from lgmd_gym.benchmark.analysis.protocol_limits import R152_SUITES, meets_r152
from lgmd_gym.benchmark.analysis.tables import (
    agent_summaries,
    limit_lines,
    mean_kmh,
    rate_text,
    success_lines,
)
from lgmd_gym.benchmark.folder import replace_file
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.statistics import Rate
from lgmd_gym.benchmark.summary import INTERVAL_TEXT, Sample, by_condition, without_fcw_driver
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.report.case_grids import case_grids
from lgmd_gym.report.data import ReportData
from lgmd_gym.report.images import CapturedFrame, figure_uri, key_decisions
from lgmd_gym.report.selection import extreme_episodes, hardest_false_activations, illustrated_agent

BANDS = ("red", "brown", "orange", "yellow", "green")


def write_report(path: Path, trust: bool = False) -> Path:
    """Write `report.html` into a run folder and return its path.

    Only the episodes whose camera frames are shown are simulated again.

    Args:
        path: Run folder.
        trust: Whether to load agents from modules and policy files that the folder names. Otherwise the
            report shows no camera frames of these agents.

    Raises:
        ValueError: If the folder contains no run or a damaged one.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    data = ReportData.load(path, trust)
    environment = Environment(
        loader=PackageLoader("lgmd_gym.report", "."), autoescape=True, undefined=StrictUndefined
    )
    environment.filters |= {"band": band, "rate_band": rate_band, "rate": rate_text, "kmh": mean_kmh}
    text = environment.get_template("page.html").render(
        data=data,
        interval=INTERVAL_TEXT,
        failed=sum(row["error"] is not None for row in data.rows),
        conditions=[_condition(data, name, rows) for name, rows in by_condition(data.rows).items()],
        froc=_froc(data),
        lead_time=LEAD_TIME,
        comparisons=_comparisons(data),
        illustrated=illustrated_agent(data.agents),
        episodes=_episodes(data),
        false_activations=_false_activations(data),
    )
    file = path / "report.html"
    replace_file(file, text)
    return file


def band(share: float | None) -> str:
    """Return the colour of a share, one per fifth and green for the highest; "" for None."""
    return "" if share is None else BANDS[min(int(5 * share), 4)]


def rate_band(rate: Rate, lower_is_better: bool = False) -> str:
    """Return the colour of a rate; "" for an empty one."""
    if rate.n == 0:
        return ""
    share = rate.k / rate.n
    return band(1.0 - share if lower_is_better else share)


def _condition(data: ReportData, name: str, rows: list[Row]) -> dict[str, Any]:
    """Return the tables of one camera condition."""
    braking = [agent for agent in data.agents if agent != NO_BRAKE]
    points = SUITE_POINTS.get(data.suite)
    judged = data.agents if data.suite in R152_SUITES else None
    met = judged and [agent for agent in judged if meets_r152(rows, agent)]
    return {
        "name": name,
        "sample": Sample.of(rows),
        "summaries": agent_summaries(without_fcw_driver(rows), data.agents),
        "limits": limit_lines(rows, data.agents, data.suite),
        "meet_r152": met,
        "points": [(agent, points(rows, agent)) for agent in braking] if points else [],
        "grids": [grids for agent in braking if (grids := case_grids(rows, agent, data.suite))],
        "cases": success_lines(rows, data.agents),
    }


def _froc(data: ReportData) -> str | None:
    """Return the figure of the detection curves; None without a threat."""
    curves = froc_curves(load_traces(data.path))
    if not any(curve.points[0].detected.n for of_condition in curves.values() for curve in of_condition):
        return None
    return figure_uri(partial(froc_figure, curves=curves, lead_time=LEAD_TIME))


def _comparisons(data: ReportData) -> dict[str, Any] | None:
    """Return the paired differences and their figure; None for fewer than two agents with rows."""
    if len({row["agent"] for row in data.rows} - {NO_BRAKE}) < 2:
        return None
    comparisons = compare_runs(data.path, None)
    lines = [(item, [(line, change_text(line)) for line in item.differences]) for item in comparisons]
    return {"figure": figure_uri(partial(difference_figure, comparisons=comparisons)), "lines": lines}


def _episodes(data: ReportData) -> list[dict[str, Any]]:
    """Return the illustrated episodes: time series of all agents, and camera frames of one."""
    alert_level = LGMDParams.make(data.config.params).t_sf
    agent, episodes = illustrated_agent(data.agents), []
    for rows in by_condition(without_fcw_driver(data.rows)).values():
        for description, row in extreme_episodes(rows, agent, data.config.first_seed).items():
            by_agent = {name: data.series(row | {"agent": name}) for name in data.agents}
            stored = {name: series for name, series in by_agent.items() if series is not None}
            if agent in stored:
                figure = figure_uri(partial(trace_figure, episodes=stored, alert_level=alert_level))
                frames = data.frames(row, key_decisions(stored[agent]))
                episodes.append({"description": description, "row": row, "figure": figure, "frames": frames})
    return episodes


def _false_activations(data: ReportData) -> list[tuple[Row, CapturedFrame | None]]:
    """Return false activations with the camera frame at which braking begins, if it may be drawn."""
    rows = hardest_false_activations(without_fcw_driver(data.rows), data.agents, data.config.first_seed)
    captured: list[tuple[Row, CapturedFrame | None]] = []
    for row in rows:
        if (series := data.series(row)) is not None:
            decisions = key_decisions(series)
            onset = {"braking begins": decisions.get("braking begins", decisions["end"])}
            captured += [(row, frame) for frame in data.frames(row, onset) or [None]]
    return captured
