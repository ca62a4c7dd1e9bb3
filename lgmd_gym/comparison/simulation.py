# pyright: standard
# Not strict: joblib states few types.
"""Open-loop detection of the models in simulated approaches, and their closed loop with one rule.

The worlds of validation choose the threshold of each model: the one with the most detections among those with
at most a number of false alarms per km. Test worlds, if given, are played once with these thresholds.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from joblib import delayed

from lgmd_gym.benchmark.analysis.froc import (
    LEAD_TIME,
    FrocPoint,
    OpenLoopTrace,
    alarm_onsets,
    froc_curves,
)
from lgmd_gym.benchmark.case import NO_BRAKE, Row
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.player import WIDTH, BatchPlayer
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import get_suite
from lgmd_gym.benchmark.summary import AgentSummary, summarise
from lgmd_gym.benchmark.task import Task
from lgmd_gym.benchmark.units import make_units
from lgmd_gym.camera import Camera, CameraItem
from lgmd_gym.engine.first_use import compile_kernels
from lgmd_gym.envs.appearance import MIXED
from lgmd_gym.errors import check_whole
from lgmd_gym.processes.pool import run_parallel
from lgmd_gym.statistics.intervals import Mean, cluster_mean, exact_sign_test

CAPS = (0.0, 0.25, 1.0)  # permitted false alarms per km
MAIN_CAP = 1.0  # of the comparison in pairs and of the closed loop [1/km]
MAX_LEVELS = 40  # thresholds of a curve
RULE = "spike-threshold"


@dataclass(frozen=True, kw_only=True)
class Worlds:
    """Episodes of the comparison: every case of the suites, once with each seed.

    Attributes:
        suites: Names of suites, or paths as of `get_suite`.
        seeds: Number of seeds of each case.
        first_world: First world; the runs of a case are in different ones.
        worlds: Number of worlds.
        camera: Camera of all models: a preset's name, a `Camera` or a mapping of its fields.
    """

    suites: tuple[str, ...] = ("quick",)
    seeds: int = 20
    first_world: int = 6100
    worlds: int = 20
    camera: CameraItem = "fovea"

    def tasks(self, sensors: SensorConfig) -> list[Task]:
        """Return the tasks without braking, each in a world and its weather."""
        check_whole("seeds", self.seeds, 1)
        check_whole("worlds", self.worlds, 1)
        cases = [case for suite in self.suites for case in get_suite(suite).cases]
        return [
            Task(
                NO_BRAKE,
                case,
                seed,
                sensors,
                condition=MIXED,
                world=self.first_world + (seed + 7 * index) % self.worlds,
            )
            for seed in range(self.seeds)
            for index, case in enumerate(cases)
        ]

    def sensors(self, models: Sequence[str]) -> SensorConfig:
        """Return one channel per model behind the same camera, which is drawn once."""
        Camera.make(self.camera)
        return SensorConfig(
            [
                {"name": f"model-{index}", "camera": self.camera, "neuron": model}
                for index, model in enumerate(models)
            ]
        )


def record(worlds: Worlds, models: Sequence[str], jobs: int = 1) -> "dict[str, list[Recording]]":
    """Return the open-loop recordings of each model; all models process the same frames.

    Args:
        worlds: The episodes.
        models: Specifications of the models.
        jobs: Number of processes.
    """
    compile_kernels()
    tasks = worlds.tasks(worlds.sensors(models))
    units = [unit.tasks for unit in make_units(tasks, jobs)]
    found: dict[str, list[Recording]] = {model: [] for model in models}
    for of_unit in run_parallel((delayed(_play)(unit, tuple(models)) for unit in units), jobs):
        for model, recording in of_unit:
            found[model].append(recording)
    for recordings in found.values():
        recordings.sort(key=lambda item: (item.task.case.name, item.task.seed))
    return found


class Recording(NamedTuple):
    """One model in one episode without braking."""

    task: Task
    trace: OpenLoopTrace
    counterfactual: Counterfactual


def _play(tasks: list[Task], models: tuple[str, ...]) -> list[tuple[str, Recording]]:
    player = BatchPlayer(tasks[0], min(WIDTH, len(tasks)), by_channel=True)
    found: list[tuple[str, Recording]] = []
    for task, episode in player.episodes(tasks):
        if isinstance(episode, str):
            raise RuntimeError(episode)
        counterfactual = Counterfactual.of(episode)
        shade = None if np.isnan(episode.target_shade) else episode.target_shade
        for index, model in enumerate(models):
            series = {name: episode.series[name] for name in ("time", "ego_speed")}
            series["spike_frequency"] = episode.series[f"spike_frequency/model-{index}"]
            trace = OpenLoopTrace(
                model, task.case.name, episode.world, shade, counterfactual.contact_time, series
            )
            found.append((model, Recording(task, trace, counterfactual)))
    return found


class Operating(NamedTuple):
    """One model at the threshold of a cap."""

    model: str
    cap: float  # permitted false alarms per km
    threshold: float  # [spikes/s]; infinite if no threshold is under the cap
    point: FrocPoint


def curves(recordings: "dict[str, list[Recording]]") -> dict[str, tuple[FrocPoint, ...]]:
    """Return the detection curve of each model, by rising threshold; see `froc_curves`."""
    found: dict[str, tuple[FrocPoint, ...]] = {}
    for model, items in recordings.items():
        traces = [item.trace for item in items]
        found[model] = froc_curves(traces, LEAD_TIME, levels(traces))[model][0].points
    return found


def levels(traces: Sequence[OpenLoopTrace]) -> list[float]:
    """Return at most `MAX_LEVELS` thresholds: the frequencies above 0 that occur, and one above them."""
    occurring = np.unique(np.concatenate([trace.series["spike_frequency"] for trace in traces]))
    occurring = occurring[occurring > 0.0]
    if len(occurring) > MAX_LEVELS:
        occurring = occurring[np.linspace(0, len(occurring) - 1, MAX_LEVELS).round().astype(int)]
    top = float(occurring[-1]) if len(occurring) else 1.0
    return [*occurring.tolist(), 1.001 * top]


def choose(found: dict[str, tuple[FrocPoint, ...]], caps: Sequence[float] = CAPS) -> list[Operating]:
    """Return the threshold of each model under each cap: that with the most detections, else the highest.

    Args:
        found: Detection curve of each model.
        caps: Permitted false alarms per km.
    """
    chosen: list[Operating] = []
    for model, points in found.items():
        for cap in caps:
            allowed = [point for point in points if point.false_per_km <= cap]
            best = max(allowed, key=lambda point: (point.detected.k, point.threshold))
            chosen.append(Operating(model, cap, best.threshold, best))
    return chosen


def apply(chosen: Sequence[Operating], recordings: "dict[str, list[Recording]]") -> list[Operating]:
    """Return models at thresholds that were chosen elsewhere, in other episodes."""
    applied: list[Operating] = []
    for item in chosen:
        traces = [recording.trace for recording in recordings[item.model]]
        (point,) = froc_curves(traces, LEAD_TIME, [item.threshold])[item.model][0].points
        applied.append(item._replace(point=point))
    return applied


class Pair(NamedTuple):
    """Detections of a model against those of the first model in the same threats, each under the same cap."""

    model: str
    reference: str
    cap: float  # permitted false alarms per km
    gained: int  # threats that only this model detects
    lost: int  # threats that only the reference detects
    difference: Mean  # of the shares of detected threats
    p_value: float  # exact, of McNemar's test
    p_adjusted: float  # Bonferroni-corrected for the number of other models


def pairs(chosen: Sequence[Operating], recordings: "dict[str, list[Recording]]") -> list[Pair]:
    """Return the comparison of each model with the first one under each cap."""
    found: list[Pair] = []
    reference, *others = dict.fromkeys(item.model for item in chosen)
    thresholds = {(item.model, item.cap): item.threshold for item in chosen}
    for cap in dict.fromkeys(item.cap for item in chosen):
        before = detections(recordings[reference], thresholds[reference, cap])
        for model in others:
            after = detections(recordings[model], thresholds[model, cap])
            gained = sum(now and not then for now, then in zip(after, before, strict=True))
            lost = sum(then and not now for now, then in zip(after, before, strict=True))
            threats = [item.trace for item in recordings[model] if item.counterfactual.threat]
            difference = cluster_mean(
                [float(now) - float(then) for now, then in zip(after, before, strict=True)],
                [trace.case for trace in threats],
                [trace.world for trace in threats],
            )
            p_value = exact_sign_test(gained, lost)
            corrected = min(1.0, p_value * len(others))
            found.append(Pair(model, reference, cap, gained, lost, difference, p_value, corrected))
    return found


def detections(recordings: "Sequence[Recording]", threshold: float) -> list[bool]:
    """Return whether each threat is detected: an alarm begins 4 s to `LEAD_TIME` before contact."""
    found: list[bool] = []
    for item in recordings:
        if item.counterfactual.threat:
            trace = item.trace
            starts = alarm_onsets(trace.series, threshold)
            inside = (starts >= trace.false_alarm_end) & (starts <= trace.contact_time - LEAD_TIME)
            found.append(bool(inside.any()))
    return found


def closed_loop(
    chosen: Sequence[Operating], recordings: "dict[str, list[Recording]]", camera: CameraItem, jobs: int = 1
) -> list[AgentSummary]:
    """Return how the rule `RULE` drives with each model, at its threshold of `MAIN_CAP`.

    Args:
        chosen: Thresholds of the models.
        recordings: Episodes without braking, which are played with the rule.
        camera: Camera of all models, as of `Worlds`.
        jobs: Number of processes.
    """
    compile_kernels()
    calls: list[tuple[str, list[Task]]] = []
    for item in chosen:
        if item.cap != MAIN_CAP:
            continue
        sensors = SensorConfig({"name": "model", "camera": camera, "neuron": item.model})
        agent = f"{RULE}:threshold={item.threshold:.6g}"
        tasks = [
            replace(
                recording.task,
                agent=agent,
                sensor_config=sensors,
                counterfactual=recording.counterfactual,
            )
            for recording in recordings[item.model]
        ]
        calls += [(item.model, unit.tasks) for unit in make_units(tasks, jobs)]
    rows: dict[str, list[Row]] = {}
    played = run_parallel((delayed(_drive)(tasks) for _, tasks in calls), jobs)
    for (model, _), of_unit in zip(calls, played, strict=True):
        rows.setdefault(model, []).extend(of_unit)
    return [summarise(model, "", of_model) for model, of_model in rows.items()]


def _drive(tasks: list[Task]) -> list[Row]:
    player = BatchPlayer(tasks[0], min(WIDTH, len(tasks)))
    rows = [result.row for result in player.play(tasks)]
    if error := next((row["error"] for row in rows if row["error"] is not None), None):
        raise RuntimeError(error)
    return rows
