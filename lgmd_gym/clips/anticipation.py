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

from lgmd_gym.clips.alarm_curves import (
    FALSE_ALARMS,
    FIGURES,
    RECALLS,
    WITHOUT_NEGATIVES,
    EventAlarms,
    cap_level,
    figures,
    numbers_of_clips,
    window_shares,
)
from lgmd_gym.clips.scored_clip import ScoredClip
from lgmd_gym.errors import check_within
from lgmd_gym.statistics.intervals import DRAWS, wilson

PIECES = 2000  # random pieces of clips without an event
CHANCE_DRAWS = 1000  # samples of the chance level


class Score(NamedTuple):
    """One figure with its interval and chance level.

    Attributes:
        name: Name of the figure, for example "recall at 0.5 s".
        value: Value; None if undefined.
        low: Lower bound of the 95 % interval; None if undefined.
        high: Upper bound.
        n: Number of clips that the figure rests on.
        chance: Chance level; None if undefined or without meaning.
        p_value: Probability of at least this value by chance.
    """

    name: str
    value: float | None
    low: float | None
    high: float | None
    n: int
    chance: float | None = None
    p_value: float | None = None


class Anticipation(NamedTuple):
    """Scores of a detector over clips.

    Attributes:
        threshold: Threshold of the cap; infinite if even the highest score exceeds the cap, None without a
            clip without an event.
        cap: Highest permitted share of false alarms.
        events: Number of clips with an event.
        negatives: Number of clips without an event.
        scores: Figures in the order of a table.
    """

    threshold: float | None
    cap: float
    events: int
    negatives: int
    scores: tuple[Score, ...]


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
    rng: np.random.Generator, events: Sequence[ScoredClip], negatives: Sequence[ScoredClip],
    levels: np.ndarray, false: np.ndarray, cap: float,
) -> np.ndarray:  # fmt: skip
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
    pieces = []
    for _ in range(PIECES):
        event, clip = events[int(rng.integers(len(events)))], negatives[int(rng.integers(len(negatives)))]
        length = min(round(len(event.scores) / event.fps * clip.fps), len(clip.scores))
        start = rng.integers(len(clip.scores) - length + 1)
        pieces.append(clip._replace(scores=clip.scores[start : start + length]))
    return pieces


def _score(name: str, value: float, samples: np.ndarray, chance: np.ndarray, n: int, smaller: int) -> Score:
    """Return a figure with the interval of its bootstrap samples, and its chance level.

    Args:
        name: Name of the figure.
        value: Value; NaN if undefined.
        samples: Bootstrap samples.
        chance: Values by chance; without any, the chance level is undefined.
        n: Number of clips that the figure rests on.
        smaller: Number of clips of the rarer kind; with one, a figure of both kinds has no interval.
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
