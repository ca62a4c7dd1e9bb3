"""Alarm onsets before a crash, compared with the rate of onsets by chance.

Most clips that end in a crash contain many alarms, so an alarm shortly before the crash is weak evidence. An
*onset* is an alarm after a third of a second without alarm. Onsets in the earlier part of the same clip, and
in clips without a crash, give a rate. With a Poisson process of this rate, the probability of an onset in the
window before a crash is 1 - exp(-rate * window). Most clips are too short for an earlier window of the same
length; the rate can still be estimated, with an exact interval.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from lgmd_gym.statistics.intervals import Rate, binomial_tail, poisson_interval

WINDOW_S = 1.5  # window before a crash: 45 frames at 30 Hz
SILENCE_S = 1.0 / 3.0  # time without alarm before an onset: 10 frames at 30 Hz
SETTLE_S = 8.0 / 30.0  # settling time of the filters: 8 frames at 30 Hz


_interval = cache(poisson_interval)  # tables of many clips have the same few numbers of onsets


class ChanceLevel(NamedTuple):
    """Probability of an onset in a window by chance."""

    onsets: int  # number of onsets in the earlier part
    seconds: float  # length of the earlier part [s]
    probability: float  # probability of at least one onset in a window; NaN without an earlier part
    low: float  # lower bound of the 95 % interval of the probability
    high: float  # upper bound

    @classmethod
    def of(cls, onsets: int, seconds: float) -> "ChanceLevel":
        """Return the chance level for a number of onsets in a number of seconds."""
        if seconds <= 0.0:
            return cls(onsets, 0.0, math.nan, 0.0, 1.0)
        low, high = _interval(onsets)
        bounds = (1.0 - math.exp(-count * WINDOW_S / seconds) for count in (onsets, low, high))
        return cls(onsets, seconds, *bounds)


@dataclass(frozen=True, slots=True)
class ClipDetection:
    """Alarms of one clip before and during the window that precedes its crash."""

    clip: str  # name of the clip
    crash_s: float | None  # time of the crash [s]; None without one
    # time from the first onset in the window to the crash [s]; None without such an onset
    lead_s: float | None
    alarm_frames: Rate  # share of alarm frames in the earlier part, which is the whole clip without a crash
    chance: ChanceLevel  # probability of an onset in a window of this clip by chance
    peak: float  # highest spike frequency after settling [spikes/s]
    fps: float  # frame rate of the run [Hz]


def find_onsets(alarm: np.ndarray, fps: float) -> np.ndarray:
    """Return the frames at which an alarm begins after `SILENCE_S` without alarm.

    Args:
        alarm: Alarm state of each frame, bool, shape (frames,).
        fps: Frame rate [Hz].

    Example:
        >>> find_onsets(np.arange(30) // 5 == 4, fps=30.0)
        array([20])
    """
    silence = max(round(SILENCE_S * fps), 1)
    alarms_before = np.concatenate([[0], np.cumsum(alarm)])
    frames = np.flatnonzero(alarm)
    frames = frames[frames >= silence]
    return frames[alarms_before[frames] == alarms_before[frames - silence]]


def detect(
    clip: str,
    frequency: Sequence[float] | np.ndarray,
    alarm: Sequence[bool] | np.ndarray,
    fps: float,
    crash_s: float | None,
) -> ClipDetection:
    """Return the alarms of a clip relative to its crash.

    Args:
        clip: Name of the clip.
        frequency: Spike frequency of each frame [spikes/s].
        alarm: Alarm state of each frame.
        fps: Frame rate [Hz].
        crash_s: Time of the crash [s]; None without one.
    """
    alarm, rate = np.asarray(alarm, bool), np.asarray(frequency, float)
    first = round(SETTLE_S * fps)
    crash = len(alarm) if crash_s is None else min(round(crash_s * fps), len(alarm))
    end = crash if crash_s is None else max(crash - round(WINDOW_S * fps), first)
    onsets = find_onsets(alarm, fps)
    hits = onsets[(onsets >= end) & (onsets < crash)]
    lead = float(crash - hits[0]) / fps if crash_s is not None and len(hits) else None
    earlier = int(((onsets >= first) & (onsets < end)).sum())
    chance = ChanceLevel.of(earlier, max(end - first, 0) / fps)
    peak = float(rate[first:].max(initial=0.0))
    return ClipDetection(clip, crash_s, lead, Rate.of(alarm[first:end].tolist()), chance, peak, fps)


class DetectionSummary(NamedTuple):
    """Detection by one configuration over all clips."""

    hits: Rate  # crashes with an onset in their window
    chance: ChanceLevel  # chance level from the earlier parts of all clips together
    # probability of at least as many hits if each had the upper bound of the chance level. The chance level
    # itself is too uncertain to be used
    p_value: float
    alarm_frames: Rate  # alarm frames in the earlier parts of all clips
    silent_clips: Rate  # clips without a crash that have no alarm
    lead_s: float  # median lead time of the hits [s]; NaN without hits


def summarize_detections(detections: Iterable[ClipDetection]) -> DetectionSummary:
    """Return the detection summary over all clips."""
    items = list(detections)
    crashes = [item for item in items if item.crash_s is not None]
    hits = Rate.of(item.lead_s is not None for item in crashes)
    chance = ChanceLevel.of(
        sum(item.chance.onsets for item in items), math.fsum(item.chance.seconds for item in items)
    )
    alarms, frames = (sum(getattr(item.alarm_frames, name) for item in items) for name in ("k", "n"))
    alarm_frames = Rate.of([True] * alarms + [False] * (frames - alarms))
    silent = Rate.of(item.alarm_frames.k == 0 for item in items if item.crash_s is None)
    leads = [item.lead_s for item in crashes if item.lead_s is not None]
    lead = float(np.median(leads)) if leads else math.nan
    p_value = binomial_tail(hits.k, hits.n, chance.high)
    return DetectionSummary(hits, chance, p_value, alarm_frames, silent, lead)
