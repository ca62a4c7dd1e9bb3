"""Camera axes and polygons of the reference camera."""

import numpy as np
from reference.ground import inside

from lgmd_gym.camera.render.coverage import NEAR


def camera_axes(lens, x, y, z):
    """Return world vectors as (depth, right, down), on the last axis."""
    ahead, right = x * lens.cos_yaw + y * lens.sin_yaw, y * lens.cos_yaw - x * lens.sin_yaw
    depth = ahead * lens.cos_pitch + z * lens.sin_pitch
    return np.stack((depth, right, ahead * lens.sin_pitch - z * lens.cos_pitch), axis=-1)


def covered(lens, corners, rays):
    """Return whether rays go through a polygon, which is cut at the near plane."""
    points = []
    for start, end in zip(np.roll(corners, 1, axis=0), corners, strict=True):
        if (start[0] >= NEAR) != (end[0] >= NEAR):
            points.append(start + (NEAR - start[0]) / (end[0] - start[0]) * (end - start))
        if end[0] >= NEAR:
            points.append(end)
    if len(points) < 3:
        return np.zeros(rays.v.shape, dtype=bool)
    flat = np.array([(right / depth, down / depth) for depth, right, down in points])
    return inside(rays.direction[..., 1] / lens.focal, rays.direction[..., 2] / lens.focal, flat)
