"""Statistics of a drive's grey frames: brightness, spectrum, motion, and the neuron's responses."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from lgmd_gym.clips.playback import DuplicateFilter
from lgmd_gym.neuron import LGMD
from lgmd_gym.paper.realism_drives import Optics
from lgmd_gym.paper.realism_fields import Fields

DARK, BRIGHT = 20, 235  # grey levels
SPECTRUM_FIT = (0.02, 0.2)  # spatial frequencies of the fit [cycles/px]
MIN_SIZE = 50  # [px]: a period of the lowest frequency of the fit
DUPLICATES = 0.25  # threshold of `DuplicateFilter`, as in the configuration `conservative`
WARM_UP = 8  # first frames, whose responses are left out
MIN_FRAMES = WARM_UP + 2


class Statistic(NamedTuple):
    """One statistic.

    Attributes:
        label: What is measured.
        unit: Its unit; "" for a plain number.
    """

    label: str
    unit: str = ""


STATISTICS = {
    "p1": Statistic("grey p1", "grey"),
    "p50": Statistic("grey p50", "grey"),
    "p99": Statistic("grey p99", "grey"),
    "dark": Statistic(f"pixels below {DARK}", "%"),
    "bright": Statistic(f"pixels above {BRIGHT}", "%"),
    "contrast": Statistic("RMS contrast", "grey"),
    "slope": Statistic("spectrum slope"),
    "difference": Statistic("mean absolute frame difference", "grey"),
    "ffi_p50": Statistic("F̂ median", "grey"),
    "ffi_p95": Statistic("F̂ p95", "grey"),
    "upright": Statistic("upright field excited", "%"),
    "ground": Statistic("ground field excited", "%"),
}


def drive_statistics(frames: Iterable[np.ndarray], fps: float, optics: Optics) -> dict[str, float]:
    """Return the statistics of a drive by key of `STATISTICS`.

    Near-duplicate frames are skipped, as `PlaybackConfig.drop_duplicates` = 0.25 does. Percentiles and shares
    are over all pixels of all frames; RMS contrast (standard deviation of the grey) and absolute difference
    of successive frames are means over the frames. The slope is that of log power over log frequency, see
    `spectrum_slope`. F̂ is that of `LGMD` with default parameters on the whole frame. A field is excited if
    its excitation reaches the threshold of its kind; the share is a mean over the fields, see `Fields`.
    The first eight frames of F̂ and excitation are left out. All statistics but the excitation of fields are
    those of the frame without its ignored bottom.

    Args:
        frames: Grey frames, uint8, of the shape of the optics, at least 50×50 px without the ignored bottom.
        fps: Frame rate [Hz].
        optics: Shape, field of view and ignored bottom of the frames.

    Raises:
        ValueError: For frames that are too small, or fewer than ten frames without duplicates.
    """
    accumulator, duplicates = _Accumulator(fps, optics), DuplicateFilter(DUPLICATES)
    for frame in frames:
        if not duplicates.is_duplicate(frame):
            accumulator.add(frame)
    if accumulator.count < MIN_FRAMES:
        raise ValueError(f"a drive must have at least {MIN_FRAMES} different frames, got {accumulator.count}")
    return accumulator.result()


class _Accumulator:
    """Sums over the frames of a drive."""

    def __init__(self, fps: float, optics: Optics) -> None:
        height, width = round(optics.shape[0] * (1.0 - optics.ignored_bottom)), optics.shape[1]
        if min(height, width) < MIN_SIZE:
            raise ValueError(f"frames must be at least {MIN_SIZE}×{MIN_SIZE} px, got {width}×{height}")
        self.count = 0
        self._greys = np.zeros(256, np.int64)
        self._contrast = self._difference = 0.0
        self._power = np.zeros((height, width // 2 + 1))
        self._window = np.outer(np.hanning(height), np.hanning(width)).astype(np.float32)
        self._last: np.ndarray | None = None
        self._height, self._neuron = height, LGMD((height, width), fps)
        self._fields = Fields(optics.shape, fps, optics.hfov_deg)
        self._ffi: list[float] = []
        self._excited: list[np.ndarray] = []

    def add(self, frame: np.ndarray) -> None:
        """Add a frame that is not a duplicate."""
        self._excited.append(self._fields.step(frame.astype(np.float32)))
        frame = frame[: self._height]
        values = frame.astype(np.float32)
        self.count += 1
        self._greys += np.bincount(frame.reshape(-1), minlength=256)
        self._contrast += float(values.std())
        self._power += np.abs(np.fft.rfft2((values - values.mean()) * self._window)) ** 2
        if self._last is not None:
            self._difference += float(np.abs(values - self._last).mean())
        self._last = values
        self._ffi.append(float(self._neuron.step(frame).ffi))

    def result(self) -> dict[str, float]:
        """Return the statistics of the frames so far."""
        total = self._greys.sum()
        shares = np.cumsum(self._greys) / total
        p1, p50, p99 = (float(np.searchsorted(shares, share)) for share in (0.01, 0.5, 0.99))
        ffi = np.percentile(self._ffi[WARM_UP:], (50, 95))
        upright, ground = 100.0 * np.mean(self._excited[WARM_UP:], axis=0)
        values = (
            p1, p50, p99, 100.0 * self._greys[:DARK].sum() / total,
            100.0 * self._greys[BRIGHT + 1 :].sum() / total, self._contrast / self.count,
            spectrum_slope(self._power), self._difference / (self.count - 1), *ffi, upright, ground,
        )  # fmt: skip
        return dict(zip(STATISTICS, map(float, values), strict=True))


def spectrum_slope(power: np.ndarray) -> float:
    """Return the slope of log power over log radial frequency; about -2 for natural scenes.

    The mean power in rings of the frequency plane, of equal width on a logarithmic scale, is fitted by a line
    between 0.02 and 0.2 cycles/px. Video compression removes power above that range.

    Args:
        power: Squared magnitudes of `np.fft.rfft2` of frames with a Hann window, summed over frames, shape
            (H, W // 2 + 1).

    Returns:
        The slope; NaN without power in one of the rings, for example of uniform frames.
    """
    height = power.shape[0]
    vertical, horizontal = np.fft.fftfreq(height), np.arange(power.shape[1]) / (2.0 * (power.shape[1] - 1))
    radius = np.hypot(vertical[:, None], horizontal[None, :])
    edges = np.geomspace(*SPECTRUM_FIT, 13)
    ring = np.digitize(radius, edges).reshape(-1)
    sums, counts = np.bincount(ring, power.reshape(-1), 14)[1:13], np.bincount(ring, minlength=14)[1:13]
    filled = counts > 0
    means = sums[filled] / counts[filled]
    if not (means > 0.0).all():
        return float("nan")
    centres = np.sqrt(edges[1:] * edges[:-1])[filled]
    return float(np.polyfit(np.log(centres), np.log(means), 1)[0])
