"""Sections of the report on stored time series and paired differences, with their figures and data files."""

import re
from functools import partial
from itertools import combinations
from typing import Any

from lgmd_gym.benchmark.analysis.compare import Comparison, compare_agents
from lgmd_gym.benchmark.analysis.compare_tables import change_text
from lgmd_gym.benchmark.analysis.froc import LEAD_TIME, froc_curves, load_traces, write_froc
from lgmd_gym.benchmark.analysis.plots import difference_figure, froc_figure, trace_figure
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.summary import by_condition, without_fcw_driver, write_csv
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.report.data import ReportData
from lgmd_gym.report.images import CapturedFrame, key_decisions, save_figure
from lgmd_gym.report.selection import extreme_episodes, hardest_false_activations, illustrated_agent

DIFFERENCE_COLUMNS = (
    *("condition", "agent_a", "agent_b", "quantity", "unit", "mean_a", "mean_b", "difference"),
    *("difference_low", "difference_high", "pairs", "b_higher", "b_lower"),
)
EPISODE_COLUMNS = ("agent", "time_s", "spike_frequency_1_s", "ego_speed_m_s")


def froc_section(data: ReportData) -> str | None:
    """Return the figure of the detection curves as a data URI; None without a threat."""
    curves = froc_curves(load_traces(data.path))
    if not any(curve.points[0].detected.n for of_condition in curves.values() for curve in of_condition):
        return None
    write_froc(data.figures / "froc.csv", curves, LEAD_TIME)
    draw = partial(froc_figure, curves=curves, lead_time=LEAD_TIME)
    return save_figure(data.figures / "froc.svg", draw)


def comparison_section(data: ReportData) -> dict[str, Any] | None:
    """Return the paired differences and their figure; None if no two agents completed the same episode."""
    pairs = combinations([agent for agent in data.agents if agent != NO_BRAKE], 2)
    comparisons = [item for item in compare_agents(data.rows, data.rows, pairs) if item.pairs]
    if not comparisons:
        return None
    write_csv(data.figures / "differences.csv", DIFFERENCE_COLUMNS, _difference_lines(comparisons))
    draw = partial(difference_figure, comparisons=comparisons)
    lines = [(item, [(line, change_text(line)) for line in item.differences]) for item in comparisons]
    return {"figure": save_figure(data.figures / "differences.svg", draw), "lines": lines}


def _difference_lines(comparisons: list[Comparison]) -> list[tuple[Any, ...]]:
    """Return the values of `DIFFERENCE_COLUMNS`; an undefined bound is None, an empty field."""
    return [
        (item.condition, item.name_a, item.name_b, line.name, line.unit, line.mean_a, line.mean_b,
         *line.change[:3], line.change.n, line.higher, line.lower)
        for item in comparisons
        for line in item.differences
    ]  # fmt: skip


def episode_section(data: ReportData) -> list[dict[str, Any]]:
    """Return the illustrated episodes: time series of all agents, and camera frames of one."""
    agent, episodes = illustrated_agent(data.agents), []
    for rows in by_condition(without_fcw_driver(data.rows)).values():
        for description, row in extreme_episodes(rows, agent, data.config.first_seed).items():
            by_agent = {name: data.series(row | {"agent": name}) for name in data.agents}
            stored = {name: series for name, series in by_agent.items() if series is not None}
            if agent in stored:
                name = f"episode-{row['condition']}-{re.sub('[^a-z]+', '-', description)}"
                figure = _save_episode(data, name, stored)
                frames = data.frames(row, key_decisions(stored[agent]))
                episodes.append(
                    {"description": description, "row": row, "figure": figure, "name": name, "frames": frames}
                )
    return episodes


def _save_episode(data: ReportData, name: str, episodes: dict[str, dict[str, Any]]) -> str:
    """Write figure and data of an episode with all agents; return the figure as a data URI."""
    lines = [
        (agent, *(round(float(value), 4) for value in values))
        for agent, series in episodes.items()
        for values in zip(series["time"], series["spike_frequency"], series["ego_speed"], strict=True)
    ]
    write_csv(data.figures / f"{name}.csv", EPISODE_COLUMNS, lines)
    alert_level = LGMDParams.make(data.config.params).t_sf
    draw = partial(trace_figure, episodes=episodes, alert_level=alert_level)
    return save_figure(data.figures / f"{name}.svg", draw)


def false_activation_section(data: ReportData) -> list[tuple[Row, CapturedFrame | None]]:
    """Return false activations with the camera frame at which braking begins, if it may be drawn."""
    rows = hardest_false_activations(without_fcw_driver(data.rows), data.agents, data.config.first_seed)
    captured: list[tuple[Row, CapturedFrame | None]] = []
    for row in rows:
        if (series := data.series(row)) is not None:
            decisions = key_decisions(series)
            onset = {"braking begins": decisions.get("braking begins", decisions["end"])}
            captured += [(row, frame) for frame in data.frames(row, onset) or [None]]
    return captured
