"""What remains of a watched clip in a room that does not grow with its length."""

import numpy as np

from lgmd_gym.video.clips.playback import Moment

BINS = 4096
NAMES = ("time", "spike_frequency", "spikes", "membrane_potential", "adapted_potential", "ffi")
_PICTURE_WIDTH = 240  # [px] of the pictures kept


class Summary:
    """The series of a clip in at most `BINS` bins, its alarm onsets, and pictures of a few of them.

    Each bin holds the highest value of its frames; when all are full, neighbours are merged in pairs.

    Args:
        fps: Frames per second.
        mark: Number of a frame whose picture is kept, such as the crash; None for none.

    Attributes:
        frames: Frames so far.
        alarms: Frames in alarm.
        onsets: Number of alarm onsets.
        first_alarm: Time of the first frame in alarm [s]; None without one.
        peak: Highest spike frequency [spikes/s].
        peak_time: When it was first reached [s].
        marked: The picture of the frame `mark`.
    """

    def __init__(self, fps: float, mark: int | None = None) -> None:
        self.fps = fps
        self.mark = mark
        self.frames = self.alarms = self.onsets = 0
        self.first_alarm: float | None = None
        self.peak = self.peak_time = 0.0
        self.marked: tuple[float, np.ndarray] | None = None
        self._bins = np.full((len(NAMES), BINS), -np.inf)
        self._width = 1
        self._first: list[tuple[float, np.ndarray]] = []
        self._last: list[tuple[float, np.ndarray]] = []
        self._before: list[tuple[float, np.ndarray]] = []
        self._at_peak: tuple[float, np.ndarray] | None = None

    def add(self, moment: Moment) -> None:
        """Take in the next moment."""
        r = moment.response
        if self.frames >= BINS * self._width:
            self._merge()
        slot = self.frames // self._width
        values = (moment.time, r.spike_frequency, r.spikes, r.membrane_potential, r.adapted_potential, r.ffi)
        self._bins[:, slot] = np.maximum(self._bins[:, slot], values)
        self.frames += 1
        self.alarms += bool(r.alert)
        if r.alert and self.first_alarm is None:
            self.first_alarm = moment.time
        if r.spike_frequency > self.peak or self._at_peak is None:
            self.peak, self.peak_time = r.spike_frequency, moment.time
            self._at_peak = moment.time, _small(moment.picture)
        if moment.onset:
            self.onsets += 1
            self._keep(moment.frame, (moment.time, _small(moment.picture)))
        if moment.frame == self.mark:
            self.marked = moment.time, _small(moment.picture)

    def series(self) -> dict[str, np.ndarray]:
        """Return the series by name, shape (bins so far,); the highest value where bins hold many frames."""
        used = -(-self.frames // self._width)
        return dict(zip(NAMES, self._bins[:, :used], strict=True))

    def pictures(self) -> list[tuple[str, float, np.ndarray]]:
        """Return (what, time [s], RGB picture) of the first and last onsets, or of the peak.

        With a marked frame, the last onset ahead of it is among them, and the frame itself.
        """
        onsets = {item[0]: item for item in (*self._first, *self._before, *self._last)}
        kept = [("alarm begins", *item) for item in onsets.values()]
        if not kept and self._at_peak is not None:
            kept = [("highest frequency", *self._at_peak)]
        if self.marked is not None:
            kept.append(("crash", *self.marked))
        return sorted(kept, key=lambda item: item[1])

    def _keep(self, frame: int, item: tuple[float, np.ndarray]) -> None:
        """Keep the picture of an onset: the first, the last ahead of the mark, the last two."""
        if not self._first:
            self._first = [item]
        elif self.mark is not None and frame <= self.mark:
            self._before = [item]
        else:
            self._last = [*self._last, item][-2:]

    def _merge(self) -> None:
        """Merge bins in pairs."""
        half = np.maximum(self._bins[:, ::2], self._bins[:, 1::2])
        self._bins[:, : BINS // 2], self._bins[:, BINS // 2 :] = half, -np.inf
        self._width *= 2


def _small(picture: np.ndarray) -> np.ndarray:
    """Return a copy of a picture at most `_PICTURE_WIDTH` or so wide."""
    step = max(round(picture.shape[1] / _PICTURE_WIDTH), 1)
    return picture[::step, ::step].copy()
