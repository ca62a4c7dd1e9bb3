"""Narrow camera fields along the path, as parts of a wide frame."""

from collections.abc import Mapping
from math import atan, cos, degrees, radians, sin, tan
from typing import Any

import numpy as np

from lgmd_gym.agents.rules import excitation
from lgmd_gym.agents.zones import CAMERA_SETBACK, FULL_DECELERATION, stopping_distance
from lgmd_gym.neuron import LGMD

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
        angles = {"hfov_deg": round(hfov_deg, 4), "pitch_deg": round(pitch * down_deg, 4)}
        cameras.append({"name": f"{kind}{speed_kmh}", "shape": list(shape), **angles})
    return cameras


def field_samples(camera: Mapping[str, Any], shape: tuple[int, int], hfov_deg: float) -> np.ndarray | None:
    """Return where the pixels of a camera field are in a frame; None for a field that cannot be resampled.

    Args:
        camera: `shape`, `hfov_deg` and `pitch_deg` of the field, which is straight ahead.
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
    pitch = radians(camera["pitch_deg"])
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
