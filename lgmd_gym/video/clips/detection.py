"""Does the alarm come before the crash, and how often would it have come by chance?

A clip that ends in a crash is mostly alarms: that the neuron is in alarm shortly before says little. What
counts is an *onset*: an alarm after a third of a second of quiet. Chance is the onset rate of the frames
ahead of the window that counts, in the same clip and in clips without a crash, taken as a Poisson
process: 1 - exp(-rate * window). Most clips are too short to hold one earlier window of that length, so
that windows cannot be drawn from them; a rate can, with an exact interval that says how little is known.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lgmd_gym.benchmark.summary import Rate

WINDOW_S = 1.5  # the crash's warning time: 45 frames at 30 Hz
QUIET_S = 1.0 / 3.0  # quiet ahead of an onset: 10 frames at 30 Hz
SETTLE_S = 8.0 / 30.0  # the filters settle: 8 frames at 30 Hz


class Chance(NamedTuple):
    """How likely an onset falls in a window by chance.

    Attributes:
        onsets: Onsets in the quiet part.
        seconds: Length of the quiet part [s].
        level: Probability of an onset in a window; NaN without a quiet part.
        low: Lower end of its 95 % interval.
        high: Upper end.
    """

    onsets: int
    seconds: float
    level: float
    low: float
    high: float

    @classmethod
    def of(cls, onsets: int, seconds: float, window_s: float = WINDOW_S) -> "Chance":
        """Return the chance of at least one onset in a window, from a rate."""
        if seconds <= 0.0:
            return cls(onsets, 0.0, math.nan, 0.0, 1.0)
        low, high = poisson_interval(onsets)
        level, low, high = (1.0 - math.exp(-k * window_s / seconds) for k in (onsets, low, high))
        return cls(onsets, seconds, level, low, high)


@dataclass(frozen=True, slots=True)
class Detection:
    """How one clip was answered.

    Attributes:
        clip: Its name.
        crash_s: Time of the crash [s]; None without one.
        lead_s: From the first onset in the window to the crash [s]; None without an onset there.
        alarm_frames: Which share of the earlier frames (of all frames without a crash) was in alarm.
        chance: Of an onset in a window of this clip.
        peak: Highest spike frequency after settling [spikes/s].
        fps: Frames per second as the neuron saw them.
    """

    clip: str
    crash_s: float | None
    lead_s: float | None
    alarm_frames: Rate
    chance: Chance
    peak: float
    fps: float


def onsets(alarm: np.ndarray, fps: float) -> np.ndarray:
    """Return the frames at which an alarm begins after `QUIET_S` of quiet.

    Args:
        alarm: Whether each frame is in alarm, bool, shape (frames,).
        fps: Frames per second.

    Example:
        >>> onsets(np.arange(30) // 5 == 4, fps=30.0)
        array([20])
    """
    quiet = max(round(QUIET_S * fps), 1)
    loud = np.concatenate([[0], np.cumsum(alarm)])
    frames = np.flatnonzero(alarm)
    frames = frames[frames >= quiet]
    return frames[loud[frames] == loud[frames - quiet]]


def detect(
    clip: str, frequency: Sequence[float] | np.ndarray, alarm: Sequence[bool] | np.ndarray, fps: float,
    crash_s: float | None,
) -> Detection:  # fmt: skip
    """Return how a clip was answered.

    Args:
        clip: Its name.
        frequency: Spike frequency of each frame [spikes/s].
        alarm: Whether each frame is in alarm.
        fps: Frames per second.
        crash_s: Time of the crash [s]; None without one.
    """
    alarm, rate = np.asarray(alarm, bool), np.asarray(frequency, float)
    first = round(SETTLE_S * fps)
    crash = len(alarm) if crash_s is None else min(round(crash_s * fps), len(alarm))
    end = crash if crash_s is None else max(crash - round(WINDOW_S * fps), first)
    begins = onsets(alarm, fps)
    hits = begins[(begins >= end) & (begins < crash)]
    lead = float(crash - hits[0]) / fps if crash_s is not None and len(hits) else None
    earlier = int(((begins >= first) & (begins < end)).sum())
    chance = Chance.of(earlier, max(end - first, 0) / fps)
    peak = float(rate[first:].max(initial=0.0))
    return Detection(clip, crash_s, lead, Rate.of(alarm[first:end].tolist()), chance, peak, fps)


class Verdict(NamedTuple):
    """A choice over all clips.

    Attributes:
        hits: Crashes with an onset in their window.
        pooled: Chance from the quiet parts of all clips together.
        p_value: Probability of so many hits or more if each came with the highest chance in the pooled
            interval: the pooled chance itself is known too roughly.
        alarm_frames: Frames in alarm among the quiet parts of all clips.
        quiet_clips: Clips without a crash that raised no alarm.
        lead_s: Median lead time of the hits [s]; NaN without one.
    """

    hits: Rate
    pooled: Chance
    p_value: float
    alarm_frames: Rate
    quiet_clips: Rate
    lead_s: float


def judge(detections: Iterable[Detection]) -> Verdict:
    """Sum up a choice over clips."""
    items = list(detections)
    crashes = [item for item in items if item.crash_s is not None]
    hits = Rate.of(item.lead_s is not None for item in crashes)
    pooled = Chance.of(
        sum(item.chance.onsets for item in items), math.fsum(item.chance.seconds for item in items)
    )
    loud, frames = (sum(getattr(item.alarm_frames, name) for item in items) for name in ("k", "n"))
    alarm = Rate.of([True] * loud + [False] * (frames - loud))
    calm = Rate.of(item.alarm_frames.k == 0 for item in items if item.crash_s is None)
    leads = [item.lead_s for item in crashes if item.lead_s is not None]
    lead = float(np.median(leads)) if leads else math.nan
    return Verdict(hits, pooled, binomial_tail(hits.k, hits.n, pooled.high), alarm, calm, lead)


def binomial_tail(k: int, n: int, p: float) -> float:
    """Return the probability of k or more successes in n trials of probability p."""
    return math.fsum(math.comb(n, i) * p**i * (1.0 - p) ** (n - i) for i in range(k, n + 1))


def poisson_interval(k: int, error: float = 0.05) -> tuple[float, float]:
    """Return Garwood's exact interval of a Poisson mean of which k events were seen.

    Example:
        >>> [round(bound, 2) for bound in poisson_interval(0)]
        [0.0, 3.69]
    """
    low = 0.0 if k == 0 else _crossing(lambda mean: 1.0 - _poisson_below(k, mean), error / 2.0, k)
    return low, _crossing(lambda mean: 1.0 - _poisson_below(k + 1, mean), 1.0 - error / 2.0, k)


def _poisson_below(k: int, mean: float) -> float:
    """Return the probability of fewer than k events."""
    if mean <= 0.0:
        return 1.0
    return math.fsum(math.exp(i * math.log(mean) - mean - math.lgamma(i + 1)) for i in range(k))


def _crossing(rising: Callable[[float], float], level: float, k: int) -> float:
    """Return where a rising function of the mean reaches a level, by bisection."""
    low, high = 0.0, k + 10.0 * math.sqrt(k + 1.0) + 10.0
    for _ in range(80):
        middle = (low + high) / 2.0
        low, high = (middle, high) if rising(middle) < level else (low, middle)
    return (low + high) / 2.0
