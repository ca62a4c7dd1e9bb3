"""Camera geometry: a pinhole with square pixels on a moving car, over flat ground.

World: x forward, y to the right of a car heading along +x (highway-env's y grows downwards on its
screen), z up; headings grow from +x towards +y. Camera axes: depth along the optical axis, right,
down. Pixels: u to the right, v down, (0, 0) the outer corner of the top left pixel, so that pixel
[row, column] covers column <= u < column + 1 and row <= v < row + 1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

# Layout of the vector that carries a pose and the optics into the kernels.
CAM_X, CAM_Y, CAM_Z = 0, 1, 2
CAM_COS_YAW, CAM_SIN_YAW, CAM_COS_PITCH, CAM_SIN_PITCH = 3, 4, 5, 6
CAM_FOCAL, CAM_CU, CAM_CV, CAM_YAW, CAM_PITCH = 7, 8, 9, 10, 11
CAM_SIZE = 12


class Pose(NamedTuple):
    """Where the lens is and looks: position [m], yaw towards +y and pitch upwards [rad]."""

    x: float
    y: float
    z: float
    yaw: float
    pitch: float


def focal_length_px(width: int, hfov_deg: float) -> float:
    """Focal length [px] of a lens that sees `hfov_deg` degrees over `width` pixels."""
    return 0.5 * width / math.tan(math.radians(0.5 * hfov_deg))


def mounted_pose(
    x: float, y: float, heading: float, length: float, height: float, setback: float, left: float
) -> tuple[float, float, float]:
    """Lens position (x, y, z) [m] on a car whose box centre is (x, y) and whose length is `length`."""
    ahead = 0.5 * length - setback
    c, s = math.cos(heading), math.sin(heading)
    return x + ahead * c + left * s, y + ahead * s - left * c, height


def camera_vector(pose: Pose, focal_px: float, shape: tuple[int, int]) -> np.ndarray:
    """Pack pose and optics for the kernels; float64, shape (12,)."""
    x, y, z, yaw, pitch = pose
    turned = (math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch))
    return np.array((x, y, z, *turned, focal_px, 0.5 * shape[1], 0.5 * shape[0], yaw, pitch))


def project(cam: np.ndarray, points_m: np.ndarray) -> np.ndarray:
    """Project world points.

    Args:
        cam: `camera_vector(...)`.
        points_m: World points (x, y, z), float, shape (..., 3) [m].

    Returns:
        Pixel coordinates (u, v), float64, shape (..., 2); NaN for points not in front of the lens.
    """
    d = np.asarray(points_m, dtype=np.float64) - cam[:3]
    ahead = d[..., 0] * cam[CAM_COS_YAW] + d[..., 1] * cam[CAM_SIN_YAW]
    right = d[..., 1] * cam[CAM_COS_YAW] - d[..., 0] * cam[CAM_SIN_YAW]
    depth = ahead * cam[CAM_COS_PITCH] + d[..., 2] * cam[CAM_SIN_PITCH]
    down = ahead * cam[CAM_SIN_PITCH] - d[..., 2] * cam[CAM_COS_PITCH]
    scale = cam[CAM_FOCAL] / np.where(depth > 1e-6, depth, np.nan)
    return np.stack((cam[CAM_CU] + right * scale, cam[CAM_CV] + down * scale), axis=-1)


def horizon_row(cam: np.ndarray) -> float:
    """Row coordinate v of the horizon; a lens that looks up has it below the middle [px]."""
    return float(cam[CAM_CV] + cam[CAM_FOCAL] * cam[CAM_SIN_PITCH] / cam[CAM_COS_PITCH])


def ground_footprint(cam: np.ndarray, row: float) -> tuple[float, float, float]:
    """Distance ahead and size on the ground of the pixels of one row.

    Args:
        cam: `camera_vector(...)`.
        row: Row coordinate v of the pixel's centre [px].

    Returns:
        (distance ahead, length along the view, width across) [m]; infinities at and above the horizon.
    """
    v = row - cam[CAM_CV]
    fall = v * cam[CAM_COS_PITCH] - cam[CAM_FOCAL] * cam[CAM_SIN_PITCH]
    if fall <= 0.0:
        return math.inf, math.inf, math.inf
    reach = cam[CAM_Z] / fall
    ahead = reach * (cam[CAM_FOCAL] * cam[CAM_COS_PITCH] + v * cam[CAM_SIN_PITCH])
    return float(ahead), float(cam[CAM_FOCAL] * reach / fall), float(reach)
