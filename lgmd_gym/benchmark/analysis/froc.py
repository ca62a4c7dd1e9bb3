"""The neuron as a detector, from open-loop traces: detection against false alarms per km, per event.

The traces are `no-brake`'s, recorded once with the eye on; a threshold is swept over them without playing
anything again. An alarm is an event, not a frame (frames are autocorrelated): it begins where the signal
reaches the threshold after `QUIET` below it. With contact at t_c a threat is detected if an alarm begins
between t_c − 4 s and t_c − lead; an alarm that begins earlier, or in an episode without a threat, is false.
What begins after t_c − lead is too late, and neither.
"""

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.benchmark.folder import read_rows, read_series
from lgmd_gym.benchmark.metrics import PREMATURE
from lgmd_gym.benchmark.run_cases import trace_name
from lgmd_gym.benchmark.summary import Rate
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.benchmark.traffic.summary import poisson_interval

QUIET = 1.0  # [s] below the threshold, after which the next alarm is a new one
LEAD = 1.0  # [s] before contact
THRESHOLDS = tuple(float(level) for level in range(5, 305, 5))  # [spikes/s]: the steps of six frames at 30 Hz
ASPHALT = 104.0  # mean grey of the asphalt by day
LOW_CONTRAST = 0.35  # |grey − asphalt| / asphalt


@dataclass(frozen=True, slots=True)
class Trace:
    """One open-loop episode.

    Attributes:
        condition: The camera's condition.
        shade: The first actor's body grey; None for none.
        contact: Time of contact [s]; infinity for none.
        series: Its time series.
    """

    condition: str
    shade: float | None
    contact: float
    series: dict[str, np.ndarray]

    @property
    def contrast(self) -> str:
        """Whether the first actor's body is darker or lighter than asphalt, or much the same; or none."""
        if self.shade is None:
            return "none"
        weber = (self.shade - ASPHALT) / ASPHALT
        return "like asphalt" if abs(weber) < LOW_CONTRAST else "dark" if weber < 0 else "light"


class Point(NamedTuple):
    """What one threshold gives.

    Attributes:
        threshold: Of the signal.
        detected: Threats detected, of all.
        false: False alarms.
        distance: Driven where an alarm would be false [m].
        false_per_km: Their rate [1/km]; infinite if nothing was driven.
        false_low: Lower end of its exact Poisson 95 % interval [1/km].
        false_high: Upper end [1/km].
        chance: Share of random windows, as long as a threat's, that an alarm begins in.
    """

    threshold: float
    detected: Rate
    false: int
    distance: float
    false_per_km: float
    false_low: float
    false_high: float
    chance: float


class Curve(NamedTuple):
    """The points of one group of traces.

    Attributes:
        condition: The camera's condition.
        group: "all", or a contrast; the false alarms are those of all.
        points: By rising threshold.
    """

    condition: str
    group: str
    points: tuple[Point, ...]


def load_traces(path: Path) -> list[Trace]:
    """Return the open-loop traces of a run folder, in the order of condition, case and seed.

    Raises:
        ValueError: If it holds no run, or a damaged one.
    """
    rows = [row for row in read_rows(path)[0] if row["agent"] == NO_BRAKE and row["error"] is None]
    found = []
    for row in sorted(rows, key=lambda row: (row["condition"], row["case"], row["seed"])):
        series = read_series(path, trace_name(NO_BRAKE, row["case"], row["seed"], row["condition"]))
        if series is not None:
            contact = row["duration"] if row["collision"] else inf
            found.append(Trace(row["condition"], row["target_shade"], contact, series))
    return found


def curves(
    traces: list[Trace],
    lead: float = LEAD,
    thresholds: Iterable[float] = THRESHOLDS,
    signal: str = "spike_frequency",
) -> dict[str, list[Curve]]:
    """Return each condition's curve over all threats, and over those of each contrast.

    Args:
        traces: Open-loop episodes.
        lead: Before contact, in [0, 4) [s].
        thresholds: To be swept.
        signal: Which series: "spike_frequency", "membrane_potential" or "ffi".

    Raises:
        ValueError: For a lead outside its range.
    """
    if not 0.0 <= lead < PREMATURE:
        raise ValueError(f"lead must be in [0, {PREMATURE:g}) s, got {lead!r}")
    levels = sorted(thresholds)
    found: dict[str, list[Curve]] = {}
    for condition in dict.fromkeys(trace.condition for trace in traces):
        chosen = [trace for trace in traces if trace.condition == condition]
        begun = [[onsets(trace.series, signal, level) for trace in chosen] for level in levels]
        contrasts = [trace.contrast for trace in chosen if trace.contact < inf]
        groups = ["all", *(name for name in ("dark", "like asphalt", "light") if name in contrasts)]
        found[condition] = [
            Curve(condition, group, tuple(_points(chosen, begun, levels, lead, group))) for group in groups
        ]
    return found


def onsets(series: dict[str, np.ndarray], signal: str, level: float) -> np.ndarray:
    """Return the times at which alarms begin [s]."""
    times = series["time"][series[signal] >= level]
    if times.size == 0:
        return times
    # A frame later than `QUIET` after the last one at the level begins a new alarm.
    return times[np.concatenate(([True], np.diff(times) > QUIET))]


def _points(
    traces: list[Trace], begun: list[list[np.ndarray]], levels: list[float], lead: float, group: str
) -> Iterable[Point]:
    ends = [trace.contact - PREMATURE for trace in traces]  # up to which an alarm is false
    metres = sum(_driven(trace, end) for trace, end in zip(traces, ends, strict=True))
    for level, starts in zip(levels, begun, strict=True):
        hits = [
            bool(np.any((times >= trace.contact - PREMATURE) & (times <= trace.contact - lead)))
            for trace, times in zip(traces, starts, strict=True)
            if trace.contact < inf and group in ("all", trace.contrast)
        ]
        false = sum(int(np.sum(times < end)) for times, end in zip(starts, ends, strict=True))
        low, high = (_per_km(bound, metres) for bound in poisson_interval(false))
        chance = _chance(traces, starts, ends, PREMATURE - lead)
        rate = _per_km(false, metres)
        yield Point(level, Rate.of(hits), false, metres, rate, low, high, chance)


def _driven(trace: Trace, end: float) -> float:
    """Return the distance driven up to a time [m]."""
    time, speed = trace.series["time"], trace.series["ego_speed"]
    before = time < end
    return float(np.trapezoid(speed[before], time[before]))


def _per_km(count: float, metres: float) -> float:
    return 1000.0 * count / metres if metres > 0.0 else inf


def _chance(traces: list[Trace], starts: list[np.ndarray], ends: list[float], length: float) -> float:
    """Return the share of all windows of a length, before `ends`, in which an alarm begins; NaN for none."""
    windows = hits = 0
    for trace, times, end in zip(traces, starts, ends, strict=True):
        clock = trace.series["time"]
        opened = clock[clock + length <= min(end, float(clock[-1]))]
        windows += opened.size
        after = np.searchsorted(times, opened, side="left")
        reached = np.append(times, inf)[after]
        hits += int(np.sum(reached <= opened + length))
    return hits / windows if windows else float("nan")


def write_curves(path: Path, found: dict[str, list[Curve]], lead: float) -> None:
    """Write the curves to a CSV file, one line per point."""
    lines = [
        _line(curve, point, lead) for items in found.values() for curve in items for point in curve.points
    ]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(lines[0]))
        writer.writeheader()
        writer.writerows(lines)


def _line(curve: Curve, point: Point, lead: float) -> dict[str, Any]:
    return {
        "condition": curve.condition,
        "contrast": curve.group,
        "lead": lead,
        "threshold": point.threshold,
        "threats": point.detected.n,
        "detected": point.detected.k,
        "detected_low": round(point.detected.low, 4),
        "detected_high": round(point.detected.high, 4),
        "false_alarms": point.false,
        "km": round(point.distance / 1000.0, 4),
        "false_per_km": round(point.false_per_km, 4),
        "false_low": round(point.false_low, 4),
        "false_high": round(point.false_high, 4),
        "chance": round(point.chance, 4),
    }
