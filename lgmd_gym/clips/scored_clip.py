"""Scores of the evaluated frames of one clip."""

from typing import NamedTuple

import numpy as np

from lgmd_gym.clips.detection import SETTLE_S


class ScoredClip(NamedTuple):
    """Scores of the frames of one clip.

    Attributes:
        name: Name of the clip.
        scores: Score of each evaluated frame, float, shape (frames,). The event follows the last frame.
        event: Whether the clip ends in an event.
        fps: Frame rate [Hz].
    """

    name: str
    scores: np.ndarray
    event: bool
    fps: float

    @classmethod
    def of(
        cls, name: str, scores: np.ndarray, fps: float, event_s: float | None, start_s: float = 0.0,
        end_s: float | None = None,
    ) -> "ScoredClip":  # fmt: skip
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
