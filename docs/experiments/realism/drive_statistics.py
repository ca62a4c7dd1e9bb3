"""Statistics of a drive's grey frames: brightness, spectrum, motion, and responses of the neuron.

The responses are those to the whole frame, and to narrow fields along the path that are parts of it.
"""

from collections.abc import Iterable, Mapping
from math import atan, cos, degrees, radians, sin, tan
from typing import Any, NamedTuple

import numpy as np
from drives import Optics

from lgmd_gym.agents.rules import excitation
from lgmd_gym.agents.zones import CAMERA_SETBACK, FULL_DECELERATION, stopping_distance
from lgmd_gym.clips.playback import DuplicateFilter
from lgmd_gym.neuron import LGMD

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


MIN_SCALE = 0.3  # pixels of the frame per pixel of a field, below which a field is left out
SPEEDS_KMH = (10, 20, 25, 30, 40, 50, 60, 70, 80, 90)
"""Ego speeds, each of which has an upright and a ground field at the stopping distance."""
# Excitation threshold, frame shape (height, width) [px] and pitch of each kind of field. The unit of pitch is
# the angle from the horizon down to the road at the stopping distance.
KINDS = {"upright": (0.5, (20, 80), 0.1), "ground": (3.0, (30, 80), -1.375)}
CAMERA_HEIGHT, SPAN_M, REACTION = 1.2, 2.4, 0.4  # height [m], width at the stopping distance [m], time [s]


class Fields:
    """Upright and ground fields at the stopping distances of ten speeds, with one neuron per field.

    A field is a pinhole camera of its own; its pixels are interpolated in the frame, with several samples per
    pixel if the frame is finer. The frame's optical axis is assumed horizontal and straight ahead, so that
    the horizon is at half height. Fields that the frame does not cover, or whose pixels are smaller than 0.3
    pixels of the frame, are left out: of 432×240 px over 90°, upright fields for 10 to 50 km/h and ground
    fields for 20 to 50 km/h remain. The fields of `stopping-zone` are similar, but follow the speed and have
    contrast control; the speed of real clips is unknown.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        hfov_deg: Horizontal field of view of the frames [degrees].

    Attributes:
        names: Names of the fields in use by kind.
    """

    def __init__(self, shape: tuple[int, int], fps: float, hfov_deg: float) -> None:
        self._samples: dict[str, list[np.ndarray]] = {kind: [] for kind in KINDS}
        self.names: dict[str, list[str]] = {kind: [] for kind in KINDS}
        for kind in KINDS:
            for camera in field_cameras(kind):
                samples = field_samples(camera, shape, hfov_deg)
                if samples is not None:
                    self._samples[kind].append(samples)
                    self.names[kind].append(camera["name"])
        self._neurons = {
            kind: [LGMD(samples.shape[3:], fps) for samples in items] for kind, items in self._samples.items()
        }

    def step(self, frame: np.ndarray) -> np.ndarray:
        """Process a frame, float32, shape (H, W); return the share of excited fields by kind, shape (2,)."""
        return np.array([self._share(kind, frame) for kind in KINDS])

    def _share(self, kind: str, frame: np.ndarray) -> float:
        """Return the share of the fields of a kind that are excited; NaN without a field."""
        pairs = zip(self._samples[kind], self._neurons[kind], strict=True)
        potential = [neuron.step(resample(frame, samples)).membrane_potential for samples, neuron in pairs]
        if not potential:
            return float("nan")
        return float(np.mean(excitation(np.array(potential)) >= KINDS[kind][0]))


def field_cameras(kind: str) -> list[dict[str, Any]]:
    """Return the cameras of the fields of a kind, a key of `KINDS`, in order of speed."""
    _, shape, pitch = KINDS[kind]
    cameras = []
    for speed_kmh in SPEEDS_KMH:
        depth = stopping_distance(speed_kmh / 3.6, FULL_DECELERATION, REACTION) + CAMERA_SETBACK
        hfov_deg, down_deg = 2 * degrees(atan(SPAN_M / 2 / depth)), degrees(atan(CAMERA_HEIGHT / depth))
        angles = {"hfov_deg": round(hfov_deg, 4), "mount": {"pitch_deg": round(pitch * down_deg, 4)}}
        cameras.append({"name": f"{kind}{speed_kmh}", "shape": list(shape), **angles})
    return cameras


def field_samples(camera: Mapping[str, Any], shape: tuple[int, int], hfov_deg: float) -> np.ndarray | None:
    """Return where the pixels of a camera field are in a frame; None for a field that cannot be resampled.

    Args:
        camera: `shape`, `hfov_deg` and `mount` of the field, which is straight ahead.
        shape: (height, width) of the frame [px].
        hfov_deg: Horizontal field of view of the frame [degrees].

    Returns:
        Row and column in the frame, 0 at the centre of the first pixel, of n × n samples per pixel, float64,
        shape (2, n, n, field height, field width).
    """
    height, width = camera["shape"]
    focal = 0.5 * width / tan(radians(0.5 * camera["hfov_deg"]))
    frame_focal = 0.5 * shape[1] / tan(radians(0.5 * hfov_deg))
    scale = frame_focal / focal
    if scale < MIN_SCALE:
        return None
    count = int(np.ceil(scale))
    offsets = (np.arange(count) + 0.5) / count
    rows = (np.arange(height) + offsets[:, None] - 0.5 * height)[:, None, :, None] / focal
    columns = (np.arange(width) + offsets[:, None] - 0.5 * width)[None, :, None, :] / focal
    pitch = radians(camera["mount"]["pitch_deg"])
    forward = cos(pitch) + rows * sin(pitch)
    down = rows * cos(pitch) - sin(pitch)
    samples = np.stack(np.broadcast_arrays(
        0.5 * (shape[0] - 1) + frame_focal * down / forward,
        0.5 * (shape[1] - 1) + frame_focal * columns / forward,
    ))  # fmt: skip
    limits = np.array(shape)[:, None] - 1.0
    inside = (samples.reshape(2, -1) >= 0.0) & (samples.reshape(2, -1) <= limits)
    return samples if inside.all() else None


def resample(frame: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return a field, uint8, from a frame, by bilinear interpolation at `field_samples`."""
    row, column = samples
    top = np.minimum(row.astype(np.int64), frame.shape[0] - 2)
    left = np.minimum(column.astype(np.int64), frame.shape[1] - 2)
    down, right = row - top, column - left
    upper = frame[top, left] * (1.0 - right) + frame[top, left + 1] * right
    lower = frame[top + 1, left] * (1.0 - right) + frame[top + 1, left + 1] * right
    values = upper * (1.0 - down) + lower * down
    return np.rint(values.mean(axis=(0, 1))).astype(np.uint8)
