# pyright: standard
# Not strict: matplotlib states few types.
"""Free-response detection curve (FROC) of the neuron: detection rate against false alarms per km.

The input is the open-loop traces of a run: the time series of `no-brake`. A threshold is swept over the
recorded signal, so no episode is simulated again. Consecutive frames are correlated, so alarms are counted
as events: an alarm begins where the signal reaches the threshold after more than `REARM_TIME` below it. For
a contact at time t_c, an alarm that begins in [t_c - 4 s, t_c - lead time] is a detection. An earlier alarm,
and any alarm in an episode without contact, is false. A later alarm is neither.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import compress
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lgmd_gym.benchmark.case import key_of
from lgmd_gym.benchmark.metrics import PREMATURE
from lgmd_gym.benchmark.run_folder import read_run, read_series, series_name
from lgmd_gym.benchmark.summary import write_csv
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.plotting.style import COLOURS, FigureFile, saved_figure
from lgmd_gym.statistics.intervals import Rate, poisson_interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

REARM_TIME = 1.0  # time below the threshold after which the next alarm is a new event [s]
LEAD_TIME = 1.0  # latest start of a detection before contact [s]
# The spike frequency over six frames at 30 Hz is a multiple of 5 spikes/s.
THRESHOLDS = tuple(float(level) for level in range(5, 305, 5))
ASPHALT = 104.0  # mean grey level of the asphalt by day
LOW_CONTRAST = 0.35  # Weber contrast |grey - asphalt| / asphalt
CONTRAST_CLASSES = ("dark", "like asphalt", "light")
FALSE_PER_KM_TICKS = (0.0, 0.5, 1.0, 3.0, 10.0, 30.0, 100.0)  # linear below 1, logarithmic above
LABELLED_THRESHOLDS = (15.0, 30.0, 60.0, 120.0)  # [spikes/s]
COLUMNS = (
    *("condition", "contrast", "lead", "threshold", "threats", "detected", "detected_low", "detected_high"),
    *("false_alarms", "km", "false_per_km", "false_low", "false_high", "chance"),
)


@dataclass(frozen=True, slots=True)
class OpenLoopTrace:
    """Time series of one `no-brake` episode."""

    condition: str
    case: str
    world: int | None  # None in the laboratory
    shade: float | None  # grey level of the first actor; None on an empty road
    contact_time: float  # [s]; inf without contact
    series: dict[str, np.ndarray]  # keys: lgmd_gym.benchmark.episode.SERIES

    @property
    def false_alarm_end(self) -> float:
        """Time before which every alarm is false [s]."""
        return self.contact_time - PREMATURE

    @property
    def contrast(self) -> str:
        """First actor against the asphalt, one of `CONTRAST_CLASSES`; "none" on an empty road."""
        if self.shade is None:
            return "none"
        weber = (self.shade - ASPHALT) / ASPHALT
        return "like asphalt" if abs(weber) < LOW_CONTRAST else "dark" if weber < 0 else "light"


class FrocPoint(NamedTuple):
    """Detections and false alarms at one threshold."""

    threshold: float
    detected: Rate  # of all threats
    false_alarms: int
    distance: float  # driven while an alarm would be false [m]
    false_per_km: float  # inf without distance
    false_low: float  # exact Poisson 95 % interval [1/km]
    false_high: float
    chance: float  # share of random windows, as long as a detection window, in which an alarm begins


class FrocCurve(NamedTuple):
    """Points by rising threshold: detections of the threats of one contrast, false alarms of all traces."""

    condition: str
    contrast: str  # "all", or one of CONTRAST_CLASSES
    points: tuple[FrocPoint, ...]


def load_traces(path: Path) -> list[OpenLoopTrace]:
    """Return the open-loop traces of a run folder, ordered by condition, case and seed.

    Raises:
        ValueError: If the folder contains no run or a damaged one.
    """
    rows = [row for row in read_run(path).rows if row["agent"] == NO_BRAKE and row["error"] is None]
    traces = []
    for row in sorted(rows, key=lambda row: (row["condition"], row["case"], row["seed"])):
        series = read_series(path, series_name(key_of(row)))
        if series is not None:
            contact_time = row["duration"] if row["collision"] else inf
            identity = (row["condition"], row["case"], row.get("world"))
            traces.append(OpenLoopTrace(*identity, row["target_shade"], contact_time, series))
    return traces


def froc_curves(
    traces: list[OpenLoopTrace],
    lead_time: float = LEAD_TIME,
    thresholds: Iterable[float] = THRESHOLDS,
) -> dict[str, list[FrocCurve]]:
    """Return the curves of each condition: one over all threats, then one per contrast.

    Args:
        traces: Open-loop traces.
        lead_time: Latest start of a detection before contact, in [0, 4) [s].
        thresholds: Thresholds of the signal.

    Raises:
        ValueError: For a lead time outside its range.
    """
    if not 0.0 <= lead_time < PREMATURE:
        raise ValueError(f"lead_time must be in [0, {PREMATURE:g}) s, got {lead_time!r}")
    levels = sorted(thresholds)
    curves: dict[str, list[FrocCurve]] = {}
    for condition in dict.fromkeys(trace.condition for trace in traces):
        chosen = [trace for trace in traces if trace.condition == condition]
        onsets = {level: [alarm_onsets(trace.series, level) for trace in chosen] for level in levels}
        present = {trace.contrast for trace in chosen if trace.contact_time < inf}
        curves[condition] = [
            FrocCurve(condition, contrast, tuple(_points(chosen, onsets, lead_time, contrast)))
            for contrast in ("all", *(name for name in CONTRAST_CLASSES if name in present))
        ]
    return curves


def alarm_onsets(series: dict[str, np.ndarray], threshold: float) -> np.ndarray:
    """Return the times at which alarms of the spike frequency begin [s]."""
    times = series["time"][series["spike_frequency"] >= threshold]
    if times.size == 0:
        return times
    return times[np.concatenate(([True], np.diff(times) > REARM_TIME))]


def _points(
    traces: list[OpenLoopTrace], onsets: dict[float, list[np.ndarray]], lead_time: float, contrast: str
) -> Iterator[FrocPoint]:
    distance = sum(_distance(trace) for trace in traces)
    chosen = [trace.contact_time < inf and contrast in ("all", trace.contrast) for trace in traces]
    threats = list(compress(traces, chosen))
    cases, worlds = [trace.case for trace in threats], [trace.world for trace in threats]
    for threshold, starts in onsets.items():
        detections = [
            bool(np.any((times >= trace.false_alarm_end) & (times <= trace.contact_time - lead_time)))
            for trace, times in zip(threats, compress(starts, chosen), strict=True)
        ]
        false_alarms = sum(
            int(np.sum(times < trace.false_alarm_end)) for trace, times in zip(traces, starts, strict=True)
        )
        yield FrocPoint(
            threshold,
            Rate.clustered(detections, cases, worlds),
            false_alarms,
            distance,
            *(_per_km(count, distance) for count in (false_alarms, *poisson_interval(false_alarms))),
            chance=_chance(traces, starts, PREMATURE - lead_time),
        )


def _distance(trace: OpenLoopTrace) -> float:
    """Return the distance driven while an alarm would be false [m]."""
    time, speed = trace.series["time"], trace.series["ego_speed"]
    before = time < trace.false_alarm_end
    return float(np.trapezoid(speed[before], time[before]))


def _per_km(count: float, distance: float) -> float:
    return 1000.0 * count / distance if distance > 0.0 else inf


def _chance(traces: list[OpenLoopTrace], starts: list[np.ndarray], length: float) -> float:
    """Return the share of windows of `length` [s] before the detection window in which an alarm begins.

    The result is NaN if no trace is long enough for a window.
    """
    windows = hits = 0
    for trace, times in zip(traces, starts, strict=True):
        time = trace.series["time"]
        opened = time[time + length <= min(trace.false_alarm_end, float(time[-1]))]
        windows += opened.size
        next_alarm = np.append(times, inf)[np.searchsorted(times, opened, side="left")]
        hits += int(np.sum(next_alarm <= opened + length))
    return hits / windows if windows else float("nan")


def write_froc(path: Path, curves: dict[str, list[FrocCurve]], lead_time: float) -> None:
    """Write the curves to a CSV file, one line per point."""
    lines = [
        (curve.condition, curve.contrast, lead_time, *_csv_values(point))
        for of_condition in curves.values()
        for curve in of_condition
        for point in curve.points
    ]
    write_csv(path, COLUMNS, lines)


def _csv_values(point: FrocPoint) -> list[float]:
    """Return the values of `COLUMNS` from the threshold on."""
    rate, km = point.detected, point.distance / 1000.0
    detected = (rate.n, rate.k, rate.low, rate.high)
    false = (point.false_alarms, km, point.false_per_km, point.false_low, point.false_high)
    return [round(value, 4) for value in (point.threshold, *detected, *false, point.chance)]


def froc_figure(file: FigureFile, curves: dict[str, list[FrocCurve]], lead_time: float) -> "Figure":
    """Plot detections against false alarms per km, one panel per condition; save and return the figure."""
    size = (1.0 + 4.6 * len(curves), 3.9)
    with saved_figure(file, 1, len(curves), figsize=size, squeeze=False, sharey=True) as (figure, axes):
        for axis, (condition, of_condition) in zip(axes[0], curves.items(), strict=True):
            for colour, curve in zip(COLOURS, of_condition, strict=False):
                _plot_froc(axis, curve, colour)
            distance = of_condition[0].points[0].distance / 1000
            axis.set_title(f"{condition}; {distance:.2f} km without threat", fontsize=9)
            axis.set_xscale("symlog", linthresh=1.0)
            highest = max(point.false_per_km for curve in of_condition for point in curve.points)
            axis.set_xticks(FALSE_PER_KM_TICKS, [f"{tick:g}" for tick in FALSE_PER_KM_TICKS])
            axis.set_xticks([], minor=True)
            top = next((x for x in FALSE_PER_KM_TICKS if x >= max(highest, 1.0)), FALSE_PER_KM_TICKS[-1])
            axis.set(xlim=(-0.05, 1.05 * top), ylim=(-0.02, 1.02), xlabel="false alarms per km")
            axis.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axes[0][0].set_ylabel(f"threats with an alarm 4 to {lead_time:g} s before contact")
    return figure


def _plot_froc(axis: "Axes", curve: FrocCurve, colour: str) -> None:
    points = curve.points
    false_per_km = [point.false_per_km for point in points]
    detected = [point.detected.k / max(point.detected.n, 1) for point in points]
    label = f"{curve.contrast} (n = {points[0].detected.n})"
    axis.plot(false_per_km, detected, "o-", color=colour, markersize=2.5, linewidth=1.2, label=label)
    if curve.contrast == "all":
        chance = [point.chance for point in points]
        axis.plot(false_per_km, chance, ":", color="0.5", linewidth=1.2, label="chance: random windows")
        _label_thresholds(axis, points, list(zip(false_per_km, detected, strict=True)))


def _label_thresholds(
    axis: "Axes", points: tuple[FrocPoint, ...], positions: list[tuple[float, float]]
) -> None:
    """Write some thresholds next to their points; equal points share a label."""
    labels: dict[tuple[float, float], list[str]] = {}
    for point, position in zip(points, positions, strict=True):
        if point.threshold in LABELLED_THRESHOLDS:
            labels.setdefault(position, []).append(f"{point.threshold:g}")
    for position, texts in labels.items():
        offset = {"xytext": (3, -8), "textcoords": "offset points"}
        axis.annotate(", ".join(texts), position, fontsize=7, **offset)
