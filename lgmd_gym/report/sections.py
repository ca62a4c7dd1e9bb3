"""Contents of a run folder, and the report's sections on stored time series and paired differences."""

import io
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import BinaryIO

import numpy as np

from lgmd_gym import neuron
from lgmd_gym.agents.registry import outside_code
from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.analysis.compare import Comparison, change_text, compare_agents, difference_figure
from lgmd_gym.benchmark.analysis.froc import LEAD_TIME, froc_curves, froc_figure, load_traces, write_froc
from lgmd_gym.benchmark.case import Row, Suite, case_order, key_of, relative_impact
from lgmd_gym.benchmark.config import SUITE_FILE, RunConfig
from lgmd_gym.benchmark.run_folder import read_run, read_series, read_settings, series_name
from lgmd_gym.benchmark.suites import get_suite
from lgmd_gym.benchmark.summary import by_condition, without_fcw_driver, write_csv
from lgmd_gym.benchmark.task import NO_BRAKE, Task
from lgmd_gym.camera.worlds import LABORATORY
from lgmd_gym.envs.registration import RANDOM
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.plotting.figures import trace_figure
from lgmd_gym.processes.files import complete_file
from lgmd_gym.report.frames import CapturedFrame, capture_frames, data_uri, key_decisions


def save_figure(file: Path, draw: Callable[[BinaryIO], object]) -> str:
    """Write the SVG that a function draws to a file, and return it as a data URI."""
    drawn = io.BytesIO()
    draw(drawn)
    with complete_file(file) as part:
        part.write_bytes(drawn.getvalue())
    return data_uri("image/svg+xml", drawn.getvalue())


def own_signal(config: RunConfig) -> str:
    """Return the neuron of a run if it is the user's, whose signals have units of its own; else ""."""
    name = config.neuron or ""
    return name if ":" in name and name.partition(":")[0] not in neuron.names() else ""


@dataclass(frozen=True)
class ReportData:
    """Contents of a run folder."""

    path: Path
    config: RunConfig
    settings: Values  # contents of run.json
    suite: Suite
    rows: list[Row]
    agents: list[str]  # no-brake first
    trust: bool  # whether agents from outside this package may be loaded

    @classmethod
    def load(cls, path: Path, trust: bool = False) -> "ReportData":
        """Read a run folder.

        Raises:
            ValueError: If the folder contains no run or a damaged one.
        """
        run = read_run(path)
        config, suite = run.config, get_suite(run.config.suite)
        agents = list(dict.fromkeys([NO_BRAKE, *config.agents]))
        return cls(path, config, read_settings(path), suite, run.rows, agents, trust)

    @property
    def figures(self) -> Path:
        """Folder of the figures and their data."""
        return self.path / "figures"

    @property
    def agents_not_loaded(self) -> list[str]:
        """Agents whose code is outside this package and not trusted."""
        return [] if self.trust else [agent for agent in self.agents if outside_code(agent)]

    @property
    def neuron_not_loaded(self) -> bool:
        """Whether the code of the neuron is outside this package and not trusted."""
        return not self.trust and neuron.outside_code(self.config.neuron or "lgmd") is not None

    def series(self, row: Row) -> dict[str, np.ndarray] | None:
        """Return the time series of a row; None if they are not stored."""
        return read_series(self.path, series_name(key_of(row)))

    @property
    def own_signal(self) -> str:
        """See `own_signal`."""
        return own_signal(self.config)

    @property
    def replay_place(self) -> str:
        """Where the commands of `replay` run: the copy of a suite of one's own is in the run folder."""
        folder = "in the run folder" if self.config.own_suite else ""
        own_code = self.own_signal or any(map(outside_code, self.agents))
        modules = "the folder of your modules" if own_code else ""
        if folder and modules:
            return f"{folder}, with {modules} in PYTHONPATH"
        return folder or (f"in {modules}" if modules else "in any folder")

    def replay(self, row: Row) -> str:
        """Return the command that plays the episode of a row again in this folder; empty for none."""
        config, case = self.config, self.suite.by_name[row["case"]]
        if config.road or config.params or not isinstance(config.camera, str | None):
            return ""
        words = ["lgmd-gym", "drive"]
        words += [SUITE_FILE, "--case", case.name] if config.own_suite else [case.name]
        words += ["--agent", row["agent"], "--seed", str(row["seed"])]
        if case.environment != RANDOM:
            place = LABORATORY if row["world"] is None else str(row["world"])
            words += ["--world", place, "--condition", row["condition"]]
        words += ["--camera", config.camera] if config.camera else []
        words += ["--neuron", config.neuron] if config.neuron else []
        return shlex.join(words)

    def frames(self, row: Row, decisions: dict[str, int]) -> list[CapturedFrame]:
        """Return camera frames of a row's episode, see `capture_frames`; none of `agents_not_loaded`."""
        if row["agent"] in self.agents_not_loaded or self.neuron_not_loaded:
            return []
        case, condition = self.suite.by_name[row["case"]], row["condition"]
        task = Task(
            row["agent"],
            case,
            row["seed"],
            self.config.sensors(condition),
            condition=condition,
            world=row["world"],
            road=self.config.road,
        )
        return capture_frames(task, decisions)


MAX_FALSE_ACTIVATIONS = 12
AGENTS_WITHOUT_NEURON = (NO_BRAKE, "always-brake", "random-brake", "ttc-oracle")

# Description -> filter of the rows, and the value that the shown row maximises (the first one on ties).
EXTREMES: dict[str, tuple[Callable[[Row], bool], Callable[[Row], float]]] = {
    "smallest stopping margin": (
        lambda row: row["avoided"] and row["stopping_margin"] is not None,
        lambda row: -(row["stopping_margin"] or 0.0),
    ),
    "fastest avoided threat": (lambda row: row["avoided"], lambda row: row["ego_speed"]),
    "hardest contact": (lambda row: row["collision"], relative_impact),
    "premature braking": (lambda row: row["premature_brake"], lambda row: 0.0),
    "hardest false activation": (lambda row: row["false_activation"], lambda row: row["peak_deceleration"]),
    "fastest non-threat without false activation": (
        lambda row: not row["threat"] and not row["false_activation"],
        lambda row: row["ego_speed"],
    ),
}


def neuron_agents(agents: list[str]) -> list[str]:
    """Return the agents that depend on the neuron or the camera."""
    return [agent for agent in agents if agent.split(":")[0] not in AGENTS_WITHOUT_NEURON]


def illustrated_agent(agents: list[str]) -> str:
    """Return the first agent that depends on the neuron; without one, the first that can brake."""
    braking = [agent for agent in agents if agent != NO_BRAKE]
    return [*neuron_agents(agents), *braking, NO_BRAKE][0]


def extreme_episodes(rows: list[Row], agent: str, seed: int) -> dict[str, Row]:
    """Return the extreme episodes of one agent and seed, by description; absent kinds are left out."""
    of_agent = [row for row in rows if row["agent"] == agent and row["seed"] == seed and row["error"] is None]
    of_agent.sort(key=lambda row: case_order(row["case"]))
    extremes = {
        description: max(filter(matches, of_agent), key=rank, default=None)
        for description, (matches, rank) in EXTREMES.items()
    }
    return {description: row for description, row in extremes.items() if row is not None}


def hardest_false_activations(rows: list[Row], agents: list[str], seed: int) -> list[Row]:
    """Return the false activations of one seed by agents that depend on the neuron, the hardest first."""
    candidates = neuron_agents(agents)
    false = [
        row for row in rows if row["agent"] in candidates and row["seed"] == seed and row["false_activation"]
    ]
    false.sort(key=lambda row: (-row["peak_deceleration"], row["case"], row["agent"]))
    return false[:MAX_FALSE_ACTIVATIONS]


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


def comparison_section(data: ReportData) -> Values | None:
    """Return the paired differences and their figure; None if no two agents completed the same episode."""
    pairs = combinations([agent for agent in data.agents if agent != NO_BRAKE], 2)
    comparisons = [item for item in compare_agents(data.rows, data.rows, pairs) if item.pairs]
    if not comparisons:
        return None
    write_csv(data.figures / "differences.csv", DIFFERENCE_COLUMNS, _difference_lines(comparisons))
    draw = partial(difference_figure, comparisons=comparisons)
    lines = [(item, [(line, change_text(line)) for line in item.differences]) for item in comparisons]
    return {"figure": save_figure(data.figures / "differences.svg", draw), "lines": lines}


def _difference_lines(comparisons: list[Comparison]) -> list[tuple[object, ...]]:
    """Return the values of `DIFFERENCE_COLUMNS`; an undefined bound is None, an empty field."""
    return [
        (
            item.condition,
            item.name_a,
            item.name_b,
            line.name,
            line.unit,
            line.mean_a,
            line.mean_b,
            *line.change[:3],
            line.change.n,
            line.higher,
            line.lower,
        )
        for item in comparisons
        for line in item.differences
    ]


def episode_section(data: ReportData) -> list[Values]:
    """Return the illustrated episodes: time series of all agents, and camera frames of one."""
    agent, episodes = illustrated_agent(data.agents), list[Values]()
    for group, rows in by_condition(without_fcw_driver(data.rows)).items():
        extremes = extreme_episodes(rows, agent, data.config.first_seed)
        descriptions: dict[str, list[str]] = {}
        for description, row in extremes.items():
            descriptions.setdefault(row["case"], []).append(description)
        for first, *others in descriptions.values():
            row = extremes[first]
            by_agent = {name: data.series({**row, "agent": name}) for name in data.agents}
            stored = {name: series for name, series in by_agent.items() if series is not None}
            if agent in stored:
                name = f"episode-{group}-{re.sub('[^a-z]+', '-', first)}"
                episodes.append(
                    {
                        "description": " and ".join([first, *others]),
                        "group": group,
                        "row": row,
                        "figure": _save_episode(data, name, stored),
                        "name": name,
                        "frames": data.frames(row, key_decisions(stored[agent])),
                        "replay": data.replay(row),
                    }
                )
    return episodes


def _save_episode(data: ReportData, name: str, episodes: dict[str, Values]) -> str:
    """Write figure and data of an episode with all agents; return the figure as a data URI."""
    lines = [
        (agent, *(round(float(value), 4) for value in values))
        for agent, series in episodes.items()
        for values in zip(series["time"], series["spike_frequency"], series["ego_speed"], strict=True)
    ]
    write_csv(data.figures / f"{name}.csv", EPISODE_COLUMNS, lines)
    alert_level = LGMDParams.make(data.config.params).t_sf
    draw = partial(trace_figure, episodes=episodes, alert_level=alert_level, own_signal=data.own_signal)
    return save_figure(data.figures / f"{name}.svg", draw)


def false_activation_section(data: ReportData) -> list[Values]:
    """Return false activations with the camera frame at which braking begins, if it may be drawn."""
    rows = hardest_false_activations(without_fcw_driver(data.rows), data.agents, data.config.first_seed)
    groups = {key_of(row): group for group, part in by_condition(data.rows).items() for row in part}
    captured: list[Values] = []
    for row in rows:
        if (series := data.series(row)) is not None:
            decisions = key_decisions(series)
            onset = {"braking begins": decisions.get("braking begins", decisions["end"])}
            frame = next(iter(data.frames(row, onset)), None)
            captured.append(
                {"row": row, "group": groups[key_of(row)], "frame": frame, "replay": data.replay(row)}
            )
    return captured
