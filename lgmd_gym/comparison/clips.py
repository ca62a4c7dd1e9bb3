"""Detection of crashes in video clips by the models, each at a threshold chosen on the other clips.

A clip with a crash has a window of 1.5 s before it, in which an alarm must begin; its earlier frames, and
all of a clip without a crash, should have none (`lgmd_gym.clips.detection`). The threshold for a clip is
the lowest at which at most a share of the earlier frames of all other clips is in alarm: no clip has an
influence on its own threshold.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.clips.batch import ClipJob
from lgmd_gym.clips.detection import (
    SETTLE_S,
    WINDOW_S,
    ClipDetection,
    DetectionSummary,
    detect,
    summarize_detections,
)
from lgmd_gym.clips.video import VideoReader, luma
from lgmd_gym.comparison.models import step_models
from lgmd_gym.statistics.intervals import exact_sign_test


class ClipResponse(NamedTuple):
    """Spike frequency of the models in one clip."""

    clip: str  # file name without suffix
    fps: float  # frame rate of the run [Hz]
    crash_s: float | None  # time of the crash [s]; None without one
    frequency: dict[str, NDArray[np.float64]]  # by model [spikes/s], shape (frames,)


def run_clips(
    models: Sequence[str],
    jobs: Sequence[ClipJob],
    fps: float | None = None,
    on_step: Callable[[], object] = lambda: None,
) -> list[ClipResponse]:
    """Return the responses of models to clips; each clip is decoded once.

    Args:
        models: Specifications of the models.
        jobs: Clips with known crashes, see `lgmd_gym.clips.batch.make_jobs`.
        fps: Frame rate to resample to [Hz]; None for that of each clip.
        on_step: Function called after each clip.
    """
    found: list[ClipResponse] = []
    for job in jobs:
        reader = VideoReader(job.clip, fps)
        signals = step_models(models, map(luma, reader), reader.fps)
        frequency = {model: values["spike_frequency"] for model, values in signals.items()}
        found.append(ClipResponse(job.clip.stem, reader.fps, job.crash_s, frequency))
        on_step()
    return found


class ClipScore(NamedTuple):
    """Detections of one model."""

    model: str
    thresholds: tuple[float, ...]  # of each clip [spikes/s]; infinite if no lower one is under the cap
    detections: tuple[ClipDetection, ...]  # of each clip
    summary: DetectionSummary
    gained: int  # crashes that only this model detects, not the first one
    lost: int  # crashes that only the first model detects
    p_value: float  # exact, of McNemar's test against the first model, Bonferroni-corrected


def check_jobs(jobs: Sequence[ClipJob]) -> None:
    """Raise ValueError for fewer than two clips, or none with a crash."""
    if len(jobs) < 2:
        raise ValueError(f"at least 2 clips are required to choose thresholds, got {len(jobs)}")
    if all(job.crash_s is None for job in jobs):
        raise ValueError("no clip has a crash; name the crash frames with --crashes FILE")


def score_clips(responses: Sequence[ClipResponse], cap: float = 0.1) -> list[ClipScore]:
    """Return the detections of each model.

    Args:
        responses: Responses to at least two clips.
        cap: Highest share of the earlier frames of the other clips in alarm, in [0, 1].
    """
    models = list(responses[0].frequency)
    found = {model: _score(model, responses, cap) for model in models}
    hits = {
        model: [item.lead_s is not None for item in detections if item.crash_s is not None]
        for model, (_, detections) in found.items()
    }
    scores: list[ClipScore] = []
    for model, (thresholds, detections) in found.items():
        paired = list(zip(hits[model], hits[models[0]], strict=True))
        gained, lost = (
            sum(now and not then for now, then in paired),
            sum(then and not now for now, then in paired),
        )
        p_value = min(1.0, exact_sign_test(gained, lost) * max(len(models) - 1, 1))
        summary = summarize_detections(detections)
        scores.append(ClipScore(model, tuple(thresholds), tuple(detections), summary, gained, lost, p_value))
    return scores


def _score(
    model: str, responses: Sequence[ClipResponse], cap: float
) -> tuple[list[float], list[ClipDetection]]:
    """Return the threshold and the detection of each clip."""
    earlier = [_earlier(item, item.frequency[model]) for item in responses]
    thresholds: list[float] = []
    detections: list[ClipDetection] = []
    for index, item in enumerate(responses):
        others = np.concatenate([frames for k, frames in enumerate(earlier) if k != index])
        threshold = lowest_threshold(others, cap)
        frequency = item.frequency[model]
        thresholds.append(threshold)
        detections.append(detect(item.clip, frequency, frequency >= threshold, item.fps, item.crash_s))
    return thresholds, detections


def _earlier(item: ClipResponse, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the frames before the window of the crash, without the settling time; see `detect`."""
    first = round(SETTLE_S * item.fps)
    if item.crash_s is None:
        return frequency[first:]
    return frequency[first : max(round(item.crash_s * item.fps) - round(WINDOW_S * item.fps), first)]


def lowest_threshold(frames: NDArray[np.float64], cap: float) -> float:
    """Return the lowest threshold above 0 at which at most a share of the frames is in alarm.

    Args:
        frames: Spike frequencies, shape (frames,) [spikes/s].
        cap: The share.

    Returns:
        One of the frequencies, or infinity if even the highest one exceeds the cap.

    Example:
        >>> lowest_threshold(np.array([0.0, 5.0, 10.0, 20.0]), 0.25)
        20.0
    """
    if not frames.size:
        return math.inf
    levels, counts = np.unique(frames, return_counts=True)
    shares = counts[::-1].cumsum()[::-1] / len(frames)
    allowed = levels[(shares <= cap) & (levels > 0.0)]
    return float(allowed[0]) if len(allowed) else math.inf
