"""The page itself: what goes into `page.html`."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from lgmd_gym.benchmark.analysis import plots as plots_bench
from lgmd_gym.benchmark.analysis.compare import compare_runs
from lgmd_gym.benchmark.analysis.compare_tables import change_text
from lgmd_gym.benchmark.analysis.froc import LEAD, curves, load_traces
from lgmd_gym.benchmark.analysis.ncap_points import points_2023, points_2026
from lgmd_gym.benchmark.analysis.protocol_limits import JUDGES, meets_r152, verdicts
from lgmd_gym.benchmark.analysis.tables import mean_kmh, rate_text
from lgmd_gym.benchmark.config import OWN_SUITE
from lgmd_gym.benchmark.folder import read_rows, read_series, read_settings
from lgmd_gym.benchmark.run_cases import trace_name
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suite_file import get_suite
from lgmd_gym.benchmark.summary import automatic, by_condition, case_order, scores
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.report.grids import grids
from lgmd_gym.report.pictures import Picture, figure_uri, frames_at, moments
from lgmd_gym.report.selection import false_reactions, first_seed, seen_agent, telling_cases

Row = dict[str, Any]
POINTS = {"ncap2023": points_2023, "ncap2026": points_2026}


@dataclass(frozen=True)
class Source:
    """What a run folder holds.

    Attributes:
        path: The folder.
        settings: Of `run.json`.
        rows: Its rows.
        agents: `no-brake` and those asked for.
        cases: By name.
    """

    path: Path
    settings: dict[str, Any]
    rows: list[Row]
    agents: list[str]
    cases: dict[str, Any]

    @classmethod
    def open(cls, path: Path) -> "Source":
        """Read a run folder."""
        settings, rows = read_settings(path), read_rows(path)[0]
        suite = str(path / OWN_SUITE) if settings["suite"] == OWN_SUITE else settings["suite"]
        agents = list(dict.fromkeys([NO_BRAKE, *settings["agents"]]))
        return cls(path, settings, rows, agents, {case.name: case for case in get_suite(suite).cases})

    def sensor_config(self, condition: str) -> SensorConfig:
        """Return camera and neuron under a condition."""
        return SensorConfig(self.settings["camera"], self.settings["params"]).under(condition)

    def series(self, row: Row, agent: str | None = None) -> dict[str, Any] | None:
        """Return the time series of a row's episode, or of another agent's in the same place."""
        name = trace_name(agent or row["agent"], row["case"], row["seed"], row["condition"])
        return read_series(self.path, name)

    def frames(self, row: Row, wanted: dict[str, int]) -> list[Picture]:
        """Return frames of a row's episode."""
        case, sensor_config = self.cases[row["case"]], self.sensor_config(row["condition"])
        return frames_at(case, row["agent"], row["seed"], sensor_config, wanted)


def write_report(path: Path) -> Path:
    """Write `report.html` into the folder of a run of cases, from what lies in it, and return its path.

    Episodes whose camera frames are shown are played again; nothing else is.

    Raises:
        ValueError: For a folder without a run, or a damaged one.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    source = Source.open(path)
    pages = Environment(
        loader=PackageLoader("lgmd_gym.report", "."), autoescape=True, undefined=StrictUndefined
    )
    text = pages.get_template("page.html").render(
        suite=next(iter(source.cases)).split("/")[0],
        settings=source.settings,
        first_seed=first_seed(source.rows),
        agents=source.agents,
        episodes=len(source.rows),
        failed=sum(row["error"] is not None for row in source.rows),
        conditions=[_condition(source, name, rows) for name, rows in by_condition(source.rows).items()],
        froc=_froc(source),
        lead=LEAD,
        comparisons=_comparisons(source),
        traces=_traces(source),
        gallery=_gallery(source),
        seen=seen_agent(source.agents),
    )
    file = path / "report.html"
    file.write_text(text, encoding="utf-8")
    return file


def _condition(source: Source, name: str, rows: list[Row]) -> dict[str, Any]:
    """Return the tables of one camera condition."""
    suite = rows[0]["suite"]
    braking = [agent for agent in source.agents if agent != NO_BRAKE]
    return {
        "name": name,
        "scores": [
            _score(item)
            for agent in source.agents
            for item in scores(automatic(_of(rows, agent)), lambda _: "")
        ],
        "verdicts": _verdicts(rows, source.agents, suite),
        "points": [(agent, POINTS[suite](rows, agent)) for agent in braking] if suite in POINTS else [],
        "grids": [grids(rows, agent, suite) for agent in braking],
        "cases": _cases(rows, source.agents),
    }


def _of(rows: list[Row], agent: str) -> list[Row]:
    return [row for row in rows if row["agent"] == agent]


def _score(item: Any) -> dict[str, Any]:
    share = item.avoided.k / item.avoided.n if item.avoided.n else None
    calm = 1.0 - item.false_activations.k / item.false_activations.n if item.false_activations.n else None
    return {
        "agent": item.agent,
        "avoided": (rate_text(item.avoided), _band(share)),
        "speed": mean_kmh(item.speed_reduction),
        "ttc": "–" if item.ttc_at_brake is None else f"{item.ttc_at_brake:.2f}",
        "premature": rate_text(item.premature),
        "false": (rate_text(item.false_activations), _band(calm)),
        "errors": item.errors,
    }


def _band(share: float | None) -> str:
    """Return the colour of a share in fifths, the best first; "" for none."""
    if share is None:
        return ""
    return ("red", "brown", "orange", "yellow", "green")[min(int(5 * share), 4)]


def _verdicts(rows: list[Row], agents: list[str], suite: str) -> dict[str, Any] | None:
    if suite not in JUDGES:
        return None
    by_agent = {agent: {item.case: item for item in verdicts(rows, agent, JUDGES[suite])} for agent in agents}
    demands = {case: item.demand for cells in by_agent.values() for case, item in cells.items()}
    lines = []
    for case in sorted(demands, key=case_order):
        cells = []
        for agent in agents:
            item = by_agent[agent].get(case)
            text = (
                f"{item.met.k}/{item.met.n}" + (f" ({item.worst / KMH:.0f})" if item.worst else "")
                if item
                else ""
            )
            cells.append((text, _band(item.met.k / item.met.n) if item else ""))
        lines.append((case.split("/", 1)[1], demands[case], cells))
    met = [agent for agent in agents if meets_r152(rows, agent)] if suite == "r152" else None
    return {"lines": lines, "met": met}


def _cases(rows: list[Row], agents: list[str]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return per case how many episodes went as they should, of n."""
    cells = {(item.agent, item.group): item for item in scores(rows, lambda row: row["case"])}
    lines = []
    for case in sorted({row["case"] for row in rows}, key=case_order):
        line = []
        for agent in agents:
            item = cells.get((agent, case))
            good = item.avoided.k + item.false_activations.n - item.false_activations.k if item else 0
            n = item.avoided.n + item.false_activations.n if item else 0
            line.append((f"{good}/{n}" if n else "", _band(good / n) if n else ""))
        lines.append((case.split("/", 1)[1], line))
    return lines


def _froc(source: Source) -> str | None:
    """Return the detector curves as a figure; None without a threat."""
    found = curves(load_traces(source.path))
    if not any(item.points[0].detected.n for items in found.values() for item in items):
        return None
    return figure_uri(partial(plots_bench.froc_figure, curves=found, lead=LEAD))


def _comparisons(source: Source) -> dict[str, Any] | None:
    # A run that was broken off early may hold no row of most agents.
    if len({row["agent"] for row in source.rows} - {NO_BRAKE}) < 2:
        return None
    found = compare_runs(source.path, None)
    lines = [(item, [(line, change_text(line)) for line in item.differences]) for item in found]
    return {"figure": figure_uri(partial(plots_bench.difference_figure, found=found)), "lines": lines}


def _traces(source: Source) -> list[dict[str, Any]]:
    """Return the chosen cases: spike trace of all agents, and what the camera saw."""
    level = LGMDParams.from_dict(source.settings["params"] or {}).t_sf
    agent, shown = seen_agent(source.agents), []
    for condition, rows in by_condition(source.rows).items():
        for why, row in telling_cases(rows, agent).items():
            found = {name: source.series(row, name) for name in source.agents}
            episodes = {name: series for name, series in found.items() if series is not None}
            own = episodes.get(agent)
            if own is not None:
                figure = figure_uri(partial(plots_bench.trace_figure, episodes=episodes, alert_level=level))
                frames = source.frames(row, moments(own))
                shown.append(
                    {"why": why, "row": row, "condition": condition, "figure": figure, "frames": frames}
                )
    return shown


def _gallery(source: Source) -> list[tuple[Row, Picture]]:
    """Return false reactions with the frame at which braking began."""
    found = []
    for row in false_reactions(source.rows, source.agents):
        series = source.series(row)
        if series is not None:
            named = moments(series)
            onset = named.get("braking begins", named["end"])
            found += [(row, frame) for frame in source.frames(row, {"braking begins": onset})]
    return found
