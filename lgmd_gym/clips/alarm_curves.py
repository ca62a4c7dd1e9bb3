"""Alarms of clips at all thresholds, and figures of weighted clips; `anticipation` has the definitions."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from lgmd_gym.clips.detection import WINDOW_S

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
    """Alarms of clips with an event at ascending thresholds.

    Attributes:
        hit: 1 where the window at a horizon is in alarm, else 0; NaN without a frame. Shape (horizons, clips,
            levels).
        lead: Time from the first alarm to the event [s], NaN without an alarm. Shape (clips, levels).
    """

    hit: np.ndarray
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
    return np.where(below.any(axis=1), below.argmax(axis=1), alarms.shape[1])


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
        recalls, precisions = [], []
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
    return np.where(enough.any(axis=1), size - 1 - enough[:, ::-1].argmax(axis=1), size)


def _steps(recall: np.ndarray) -> np.ndarray:
    """Return the increase of recall from the next higher level to each level."""
    return recall - np.pad(recall[:, 1:], ((0, 0), (0, 1)))


def _at(curves: np.ndarray, level: np.ndarray, missing: float) -> np.ndarray:
    """Return the value of each curve at its level, `missing` behind the highest level."""
    padded = np.pad(curves, ((0, 0), (0, 1)), constant_values=missing)
    return np.take_along_axis(padded, level[:, None], axis=1)[:, 0]
