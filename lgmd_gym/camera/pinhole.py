"""Pinhole camera with square pixels over flat ground.

World axes: x forward and y to the right of a car that heads along +x (highway-env's y axis points down on its
screen), z up. Headings grow from +x towards +y. Camera axes: depth along the optical axis, right, down.
A lens is turned by its yaw, then pitched upwards, then rolled clockwise (right side down) about its axis.
Pixels: u to the right, v down. (0, 0) is the outer corner of the top left pixel; pixel [row, column] covers
column <= u < column + 1 and row <= v < row + 1.
"""

import numpy as np
from numpy.typing import ArrayLike

LENS = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("x", "y", "z", "cos_yaw", "sin_yaw", "cos_pitch", "sin_pitch", "cos_roll", "sin_roll"),
            *("focal", "centre_u", "centre_v", "yaw", "pitch", "roll", "turn", "yaw_px"),
        )
    ]
)
"""A posed lens, as the kernels read it: position [m], angles [rad], focal length and image centre [px]; for
the gaze `"stopping"` the yaw relative to the car, 0 for others, whose headlights turn with the lens [rad];
yaw of a derotated view, a whole number of pixels, 0 for others [px]."""


def project(lens: np.void, points_m: ArrayLike) -> np.ndarray:
    """Project world points.

    Args:
        lens: A `LENS` record.
        points_m: World points (x, y, z), float, shape (..., 3) [m].

    Returns:
        Pixel coordinates (u, v), float64, shape (..., 2); NaN for points behind the lens.
    """
    points = np.asarray(points_m, dtype=np.float64)
    dx, dy, dz = points[..., 0] - lens["x"], points[..., 1] - lens["y"], points[..., 2] - lens["z"]
    ahead = dx * lens["cos_yaw"] + dy * lens["sin_yaw"]
    right = dy * lens["cos_yaw"] - dx * lens["sin_yaw"]
    depth = ahead * lens["cos_pitch"] + dz * lens["sin_pitch"]
    down = ahead * lens["sin_pitch"] - dz * lens["cos_pitch"]
    right, down = (
        right * lens["cos_roll"] + down * lens["sin_roll"],
        down * lens["cos_roll"] - right * lens["sin_roll"],
    )
    scale = lens["focal"] / np.where(depth > 1e-6, depth, np.nan)
    return np.stack((lens["centre_u"] + right * scale, lens["centre_v"] + down * scale), axis=-1)
