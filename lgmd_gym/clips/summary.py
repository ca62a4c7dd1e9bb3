"""Constant-memory summary of a processed clip."""

import numpy as np

from lgmd_gym.clips.playback import ClipFrame

BINS = 4096
SERIES = ("time", "spike_frequency", "spikes", "membrane_potential", "adapted_potential", "ffi")
_PICTURE_WIDTH = 240  # of the stored pictures, approximate [px]
Snapshot = tuple[float, np.ndarray]  # time [s], RGB picture


class ClipSummary:
    """Time series of a clip in at most `BINS` bins, its alarm onsets, and pictures at some of them.

    Each bin holds the maximum over its frames. When all bins are full, they are merged in pairs.

    Args:
        fps: Frame rate [Hz].
        crash_frame: Frame of the crash, of which a picture is stored; None for none.

    Attributes:
        frames: Number of frames.
        alarms: Number of alarm frames.
        onsets: Number of alarm onsets.
        first_alarm: Time of the first alarm frame [s]; None without one.
        peak: Highest spike frequency [spikes/s].
    """

    def __init__(self, fps: float, crash_frame: int | None = None) -> None:
        self.fps = fps
        self.crash_frame = crash_frame
        self.frames = self.alarms = self.onsets = 0
        self.first_alarm: float | None = None
        self.peak = 0.0
        self._bins = np.full((len(SERIES), BINS), -np.inf)
        self._frames_per_bin = 1
        self._first_onset: list[Snapshot] = []
        self._onset_before_crash: list[Snapshot] = []
        self._last_onsets: list[Snapshot] = []
        self._peak: Snapshot | None = None
        self._crash: Snapshot | None = None

    def add(self, frame: ClipFrame) -> None:
        """Add the next frame."""
        r = frame.response
        if self.frames >= BINS * self._frames_per_bin:
            self._merge_bins()
        slot = self.frames // self._frames_per_bin
        values = (frame.time, r.spike_frequency, r.spikes, r.membrane_potential, r.adapted_potential, r.ffi)
        self._bins[:, slot] = np.maximum(self._bins[:, slot], values)
        self.frames += 1
        self.alarms += bool(r.alert)
        if r.alert and self.first_alarm is None:
            self.first_alarm = frame.time
        if r.spike_frequency > self.peak or self._peak is None:
            self.peak, self._peak = r.spike_frequency, _snapshot(frame)
        if frame.onset:
            self.onsets += 1
            self._store_onset(frame.frame, _snapshot(frame))
        if frame.frame == self.crash_frame:
            self._crash = _snapshot(frame)

    def series(self) -> dict[str, np.ndarray]:
        """Return the time series by name, shape (bins in use,)."""
        used = -(-self.frames // self._frames_per_bin)
        return dict(zip(SERIES, self._bins[:, :used], strict=True))

    def pictures(self) -> list[tuple[str, float, np.ndarray]]:
        """Return (label, time [s], RGB picture) of selected frames, in the order of time.

        These are the first and the last two onsets, or the peak of a clip without onsets; with a crash frame
        also that frame and the last onset before it.
        """
        onsets = {
            item[0]: item for item in (*self._first_onset, *self._onset_before_crash, *self._last_onsets)
        }
        chosen = [("alarm begins", *item) for item in onsets.values()]
        if not chosen and self._peak is not None:
            chosen = [("highest frequency", *self._peak)]
        if self._crash is not None:
            chosen.append(("crash", *self._crash))
        return sorted(chosen, key=lambda item: item[1])

    def _store_onset(self, frame: int, item: Snapshot) -> None:
        """Store the picture of an onset as the first, the last before the crash, or one of the last two."""
        if not self._first_onset:
            self._first_onset = [item]
        elif self.crash_frame is not None and frame <= self.crash_frame:
            self._onset_before_crash = [item]
        else:
            self._last_onsets = [*self._last_onsets, item][-2:]

    def _merge_bins(self) -> None:
        half = np.maximum(self._bins[:, ::2], self._bins[:, 1::2])
        self._bins[:, : BINS // 2], self._bins[:, BINS // 2 :] = half, -np.inf
        self._frames_per_bin *= 2


def _snapshot(frame: ClipFrame) -> Snapshot:
    """Return the time and a reduced copy of the picture of a frame."""
    step = max(round(frame.picture.shape[1] / _PICTURE_WIDTH), 1)
    return frame.time, frame.picture[::step, ::step].copy()
