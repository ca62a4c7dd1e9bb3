"""Scores of accident anticipation on clips: recall and average precision before the event, time to accident.

Each clip has a score per frame (for the neuron: its spike frequency) and either one event or none. The
definitions follow the literature on dash cameras, with fixed rules where it leaves a choice:

- *Evaluated frames*: from `start_s` of the clip, and at least `SETTLE_S` after its first frame, up to the
  frame before the event, or up to `end_s` in a clip without an event.
- *Threshold* θ: a frame is in alarm if its score is >= θ and > 0. Equal scores therefore give equal alarms.
- *Window at τ*: the `WINDOW_S` of evaluated frames up to τ before the event; shorter at the beginning of a
  clip. Its score is the maximum. An event with no evaluated frame up to τ before it is not counted at this τ.
- *False alarms* at θ: share of the windows of a clip in alarm, over all positions of the window in the clip,
  averaged over the clips without an event. A clip that is shorter than the window has one position.
- *Cap*: the threshold is the lowest score of any evaluated frame at which the false alarms are <= the cap.
- *Recall at τ*: share of the events whose window at τ is in alarm at this threshold.
- *AP at τ*: average precision of the windows at τ against a random window of each clip without an event. It
  is the sum of precision × increase of recall over all thresholds, without interpolation, as the Nexar
  challenge computes it at 0.5, 1.0 and 1.5 s with one score per clip (Moura et al. 2025, arXiv 2503.03848).
  Here a score of 0 is the lowest threshold. A random score gives about the share of clips with an event.
- *TTA* at θ: time from the first evaluated frame in alarm to the event, averaged over the events with such a
  frame (Chan et al. 2016, "Anticipating accidents in dashcam videos", ACCV). It is given at the cap, at the
  highest threshold that reaches a recall of 80 % (Suzuki et al. 2018, CVPR), and as *mTTA*, the mean over
  recall, weighted by its increase at each threshold (Bao et al. 2020, ACM Multimedia, average over recalls).
  Here an alarm at any time before the event counts as recalled, so a detector that always alarms has a high
  TTA: read it together with the false alarms.

Intervals are percentiles of a bootstrap that draws clips with and without an event separately; the threshold
of the cap is chosen anew in each sample. The interval of a recall also covers Wilson's, because a bootstrap
has no width at 0 and 1. The *chance level* is the mean of the same figure for events at random times: each
event's clip is replaced by a random piece, of the same length, of a random clip without an event. For recall
it is about the share of false alarms, for AP the share of clips with an event; for the TTA it shows how much
of the time is due to the length of the clips. p is the share of such samples with at least the measured
value.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from lgmd_gym.clips.detection import SETTLE_S, WINDOW_S
from lgmd_gym.errors import check_within
from lgmd_gym.statistics.intervals import DRAWS, wilson


class ScoredClip(NamedTuple):
    """Scores of the frames of one clip."""

    name: str  # name of the clip
    # score of each evaluated frame, float, shape (frames,). The event follows the last frame
    scores: np.ndarray
    event: bool  # whether the clip ends in an event
    fps: float  # frame rate [Hz]

    @classmethod
    def of(
        cls,
        name: str,
        scores: np.ndarray,
        fps: float,
        event_s: float | None,
        start_s: float = 0.0,
        end_s: float | None = None,
    ) -> "ScoredClip":
        """Return the evaluated frames of a whole clip.

        Args:
            name: Name of the clip.
            scores: Score of each frame of the clip, shape (frames,).
            fps: Frame rate [Hz].
            event_s: Time of the event from the first frame [s]; None without one.
            start_s: Start of the evaluation [s].
            end_s: End of the evaluation of a clip without an event [s]; None for the end of the clip.
        """
        last = event_s if event_s is not None else end_s
        stop = len(scores) if last is None else round(last * fps)
        first = max(round(start_s * fps), round(SETTLE_S * fps))
        return cls(name, np.asarray(scores, float)[first:stop], event_s is not None, fps)

    def time_to_event(self, threshold: float | None) -> float | None:
        """Return the time from the first frame in alarm to the event [s]; None without alarm or event."""
        if not self.event or threshold is None:
            return None
        frames = np.flatnonzero(self.scores >= threshold)
        return float(len(self.scores) - frames[0]) / self.fps if len(frames) else None


HORIZONS_S = (0.5, 1.0, 1.5)  # times before the event
TARGET_RECALL = 0.8
_ROUNDING = 1e-12

FALSE_ALARMS = "false alarms"
RECALLS = tuple(f"recall at {tau:.1f} s" for tau in HORIZONS_S)
PRECISIONS = tuple(f"AP at {tau:.1f} s" for tau in HORIZONS_S)
MEAN_PRECISION = "mean AP"
TTA_CAP, TTA_RECALL, MEAN_TTA = "TTA at the cap", "TTA at recall 80 %", "mTTA"
WITHOUT_NEGATIVES = (TTA_RECALL, MEAN_TTA)  # figures that need only clips with an event
FIGURES = (FALSE_ALARMS, *RECALLS, *PRECISIONS, MEAN_PRECISION, TTA_CAP, *WITHOUT_NEGATIVES)


class EventAlarms(NamedTuple):
    """Alarms of clips with an event at ascending thresholds."""

    # 1 where the window at a horizon is in alarm, else 0; NaN without a frame. Shape (horizons, clips,
    # levels)
    hit: np.ndarray
    # time from the first alarm to the event [s], NaN without an alarm. Shape (clips, levels)
    lead: np.ndarray

    @classmethod
    def of(cls, scores: Sequence[np.ndarray], fps: Sequence[float], levels: np.ndarray) -> "EventAlarms":
        """Return the alarms of clips, given the scores and the frame rate [Hz] of each."""
        hit = np.full((len(HORIZONS_S), len(scores), len(levels)), np.nan)
        lead = np.full((len(scores), len(levels)), np.nan)
        for clip, (series, rate) in enumerate(zip(scores, fps, strict=True)):
            for horizon, tau in enumerate(HORIZONS_S):
                highest = window_score(series, rate, tau)
                if highest is not None:
                    hit[horizon, clip] = highest >= levels
            first = np.searchsorted(np.maximum.accumulate(series), levels)
            reached = first < len(series)
            lead[clip, reached] = (len(series) - first[reached]) / rate
        return cls(hit, lead)


def window_score(scores: np.ndarray, fps: float, tau: float) -> float | None:
    """Return the highest score of the window up to `tau` before the event; None without a frame.

    Args:
        scores: Score of each evaluated frame; the event follows the last frame.
        fps: Frame rate [Hz].
        tau: Time before the event [s].
    """
    stop = max(len(scores) - round(tau * fps) + 1, 0)
    window = scores[max(stop - round(WINDOW_S * fps), 0) : stop]
    return float(window.max()) if len(window) else None


def window_shares(scores: np.ndarray, fps: float, levels: np.ndarray) -> np.ndarray:
    """Return the share of the positions of the window in alarm at each level.

    Args:
        scores: Score of each evaluated frame of a clip without an event.
        fps: Frame rate [Hz].
        levels: Thresholds.
    """
    width = min(max(round(WINDOW_S * fps), 1), len(scores))
    highest = np.sort(sliding_window_view(scores, width).max(axis=1))
    return 1.0 - np.searchsorted(highest, levels) / len(highest)


def cap_level(alarms: np.ndarray, clips: np.ndarray | int, cap: float) -> np.ndarray:
    """Return the index of the lowest level under the cap, the number of levels without one.

    Args:
        alarms: Expected number of clips in alarm, shape (samples, levels).
        clips: Number of clips, shape (samples, 1).
        cap: Highest permitted share.
    """
    below = alarms <= cap * clips + _ROUNDING
    lowest: np.ndarray = below.argmax(axis=1)
    return np.where(below.any(axis=1), lowest, alarms.shape[1])


def figures(
    events: EventAlarms, false: np.ndarray, cap: float, weights: np.ndarray, negatives: np.ndarray
) -> np.ndarray:
    """Return the `FIGURES` of weighted clips, NaN where undefined, shape (figures, samples).

    Args:
        events: Alarms of the clips with an event.
        false: Share of windows in alarm, shape (clips without an event, levels).
        cap: Highest permitted share of false alarms.
        weights: Weights of the clips with an event, shape (samples, clips).
        negatives: Weights of the clips without an event, shape (samples, clips).
    """
    alarms, total = negatives @ false, negatives.sum(axis=1, keepdims=True)
    at = cap_level(alarms, total, cap)
    seen = np.isfinite(events.lead)
    with np.errstate(invalid="ignore", divide="ignore"):
        recalls: list[np.ndarray] = []
        precisions: list[np.ndarray] = []
        for hit in events.hit:
            counted = np.isfinite(hit[:, 0])
            hits, n = weights[:, counted] @ hit[counted], weights[:, counted].sum(axis=1, keepdims=True)
            recalls.append(_at(hits / n, at, 0.0))
            precisions.append(_average_precision(hits, n, alarms, total))
        found = weights @ seen
        lead = weights @ np.where(seen, events.lead, 0.0) / found
        recall = found / weights.sum(axis=1, keepdims=True)
        steps = _steps(recall)
        mean_lead = (np.where(found > 0, lead, 0.0) * steps).sum(axis=1) / steps.sum(axis=1)
        table = [_at(alarms / total, at, 0.0), *recalls, *precisions, np.mean(precisions, axis=0)]
    table += [_at(lead, at, np.nan), _at(lead, _target_level(recall), np.nan), mean_lead]
    values = np.array(table)
    values[: -len(WITHOUT_NEGATIVES), total[:, 0] == 0] = np.nan
    return values


def numbers_of_clips(events: EventAlarms, false: np.ndarray, cap: float) -> dict[str, int]:
    """Return the number of clips that each figure rests on; of a TTA, of those with an alarm."""
    counted = np.isfinite(events.hit[:, :, 0]).sum(axis=1).tolist()
    found = np.isfinite(events.lead).sum(axis=0, keepdims=True)
    at = cap_level(false.sum(axis=0, keepdims=True), len(false), cap)
    numbers = [int(_at(found, level, 0)[0]) for level in (at, _target_level(found / len(events.lead)))]
    return {
        FALSE_ALARMS: len(false),
        **dict(zip(RECALLS, counted, strict=True)),
        **{name: n + len(false) for name, n in zip(PRECISIONS, counted, strict=True)},
        MEAN_PRECISION: max(counted) + len(false),
        TTA_CAP: numbers[0],
        TTA_RECALL: numbers[1],
        MEAN_TTA: int(found[0, 0]),
    }


def _average_precision(hits: np.ndarray, n: np.ndarray, alarms: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Return Σ precision × increase of recall over the levels, and over score 0, below all of them."""
    precision = np.where(hits > 0, hits / (hits + alarms), 0.0)
    rest = (1.0 - hits[:, :1] / n) * n / (n + total)
    return (precision * _steps(hits / n)).sum(axis=1) + rest[:, 0]


def _target_level(recall: np.ndarray) -> np.ndarray:
    """Return the index of the highest level with the recall `TARGET_RECALL`; the number of levels without."""
    enough = recall >= TARGET_RECALL - _ROUNDING
    size = recall.shape[1]
    last: np.ndarray = size - 1 - enough[:, ::-1].argmax(axis=1)
    return np.where(enough.any(axis=1), last, size)


def _steps(recall: np.ndarray) -> np.ndarray:
    """Return the increase of recall from the next higher level to each level."""
    return recall - np.pad(recall[:, 1:], ((0, 0), (0, 1)))


def _at(curves: np.ndarray, level: np.ndarray, missing: float) -> np.ndarray:
    """Return the value of each curve at its level, `missing` behind the highest level."""
    padded = np.pad(curves, ((0, 0), (0, 1)), constant_values=missing)
    return np.take_along_axis(padded, level[:, None], axis=1)[:, 0]


PIECES = 2000  # random pieces of clips without an event
CHANCE_DRAWS = 1000  # samples of the chance level


class Score(NamedTuple):
    """One figure with its interval and chance level."""

    name: str  # name of the figure, for example "recall at 0.5 s"
    value: float | None  # value; None if undefined
    low: float | None  # lower bound of the 95 % interval; None if undefined
    high: float | None  # upper bound
    n: int  # number of clips that the figure rests on
    chance: float | None = None  # chance level; None if undefined or without meaning
    p_value: float | None = None  # probability of at least this value by chance


class Anticipation(NamedTuple):
    """Scores of a detector over clips."""

    # threshold of the cap; infinite if even the highest score exceeds the cap, None without a clip without an
    # event
    threshold: float | None
    cap: float  # highest permitted share of false alarms
    events: int  # number of clips with an event
    negatives: int  # number of clips without an event
    scores: tuple[Score, ...]  # figures in the order of a table


def anticipation(clips: Sequence[ScoredClip], cap: float = 0.1) -> Anticipation:
    """Return recall, average precision and time to accident; the module defines them.

    Args:
        clips: Clips with and without an event; those without an evaluated frame are not counted.
        cap: Highest permitted share of false alarms, in [0, 1].

    Raises:
        ValueError: If no clip has an event, or `cap` is out of range.
    """
    check_within("cap", cap, 0.0, 1.0)
    events = [clip for clip in clips if clip.event and len(clip.scores)]
    negatives = [clip for clip in clips if not clip.event and len(clip.scores)]
    if not events:
        raise ValueError("no clip has an evaluated frame before an event; the scores need at least one")
    levels = _levels((*events, *negatives))
    alarms, false = _alarms(events, levels), _false_alarms(negatives, levels)
    rng = np.random.default_rng(0)
    values = figures(alarms, false, cap, np.ones((1, len(events))), np.ones((1, len(negatives))))[:, 0]
    samples = figures(alarms, false, cap, _drawn(rng, len(events)), _drawn(rng, len(negatives)))
    chance = _chance(rng, events, negatives, levels, false, cap)
    clips_of = numbers_of_clips(alarms, false, cap)
    scores = [
        _score(name, value, drawn, random, clips_of[name], min(len(events), len(negatives)))
        for name, value, drawn, random in zip(FIGURES, values, samples, chance, strict=True)
    ]
    level = int(cap_level(false.sum(axis=0, keepdims=True), len(negatives), cap)[0])
    threshold = float(levels[level]) if level < len(levels) else np.inf
    return Anticipation(threshold if negatives else None, cap, len(events), len(negatives), tuple(scores))


def _levels(clips: Sequence[ScoredClip]) -> np.ndarray:
    """Return all thresholds, ascending: the scores above 0, or infinity if no score is above 0."""
    levels = np.unique(np.concatenate([clip.scores for clip in clips]))
    return levels[levels > 0.0] if levels[-1] > 0.0 else np.array([np.inf])


def _false_alarms(negatives: Sequence[ScoredClip], levels: np.ndarray) -> np.ndarray:
    """Return the share of windows in alarm, shape (clips, thresholds)."""
    false = np.zeros((len(negatives), len(levels)))
    for row, clip in enumerate(negatives):
        false[row] = window_shares(clip.scores, clip.fps, levels)
    return false


def _chance(
    rng: np.random.Generator,
    events: Sequence[ScoredClip],
    negatives: Sequence[ScoredClip],
    levels: np.ndarray,
    false: np.ndarray,
    cap: float,
) -> np.ndarray:
    """Return the figures of events at random times, shape (figures, draws); no draws without negatives."""
    if not negatives:
        return np.full((len(FIGURES), 0), np.nan)
    pieces = _random_pieces(rng, events, negatives)
    weights = rng.multinomial(len(events), np.full(PIECES, 1.0 / PIECES), CHANCE_DRAWS)
    every = np.ones((CHANCE_DRAWS, len(negatives)))
    return figures(_alarms(pieces, levels), false, cap, weights, every)


def _alarms(events: Sequence[ScoredClip], levels: np.ndarray) -> EventAlarms:
    return EventAlarms.of([clip.scores for clip in events], [clip.fps for clip in events], levels)


def _drawn(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return how often each of some clips is in each bootstrap sample, shape (DRAWS, count)."""
    return rng.multinomial(count, np.full(count, 1.0 / count), DRAWS) if count else np.ones((DRAWS, 0))


def _random_pieces(
    rng: np.random.Generator, events: Sequence[ScoredClip], negatives: Sequence[ScoredClip]
) -> list[ScoredClip]:
    """Return pieces of random clips without an event, each as long as the evaluated part of an event."""
    pieces: list[ScoredClip] = []
    for _ in range(PIECES):
        event, clip = events[int(rng.integers(len(events)))], negatives[int(rng.integers(len(negatives)))]
        length = min(round(len(event.scores) / event.fps * clip.fps), len(clip.scores))
        start = rng.integers(len(clip.scores) - length + 1)
        pieces.append(clip._replace(scores=clip.scores[start : start + length]))
    return pieces


def _score(name: str, value: float, samples: np.ndarray, chance: np.ndarray, n: int, smaller: int) -> Score:
    """Return a figure with the interval of its bootstrap samples, and its chance level.

    `smaller` is the number of clips of the rarer kind; with one, a figure of both kinds has no interval.
    """
    if not np.isfinite(value):
        return Score(name, None, None, None, n)
    samples, chance = samples[np.isfinite(samples)], chance[np.isfinite(chance)]
    low, high = None, None
    if n > 1 and (smaller > 1 or name in WITHOUT_NEGATIVES):
        low, high = (float(bound) for bound in np.percentile(samples, (2.5, 97.5)))
    if name in RECALLS:
        bounds = wilson(float(value) * n, n)
        low, high = min(bounds[0], 1.0 if low is None else low), max(bounds[1], high or 0.0)
    if name == FALSE_ALARMS or not len(chance):
        return Score(name, float(value), low, high, n)
    p_value = float(np.mean(chance >= value - 1e-12))
    return Score(name, float(value), low, high, n, float(chance.mean()), p_value)
