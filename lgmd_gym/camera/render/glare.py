"""Kernel of glare: what the headlights of oncoming cars do to a lens at night."""

from __future__ import annotations

import math

import numba as nb

from lgmd_gym.camera.pinhole import (
    CAM_COS_PITCH,
    CAM_COS_YAW,
    CAM_CU,
    CAM_CV,
    CAM_FOCAL,
    CAM_SIN_PITCH,
    CAM_SIN_YAW,
    CAM_X,
    CAM_Y,
    CAM_Z,
)
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.scene import (
    MODEL_CAR,
    MODEL_TRUCK,
    OBJ_COS,
    OBJ_HEIGHT,
    OBJ_LENGTH,
    OBJ_MODEL,
    OBJ_SIN,
    OBJ_WIDTH,
    OBJ_X,
    OBJ_Y,
)

BUDGET_PX = 3000.0
"""All halos of a frame together cover no more pixels than about this."""
_RADIUS = 0.03  # of a halo, 1.7°: scatter in lens and eye, not the lamp's own size [rad]
_PEAK = 200.0  # grey that a lamp nearer than _FULL adds in the middle
_FULL = 50.0  # [m]
_LAMP_AT = 0.375  # of the width from the middle


@kernel
def add_glare(image, cam, obj, clear, budget):
    """Add the halos of an object's headlights, where they shine at the lens.

    Args:
        image: float32, shape (height, width).
        cam: `camera_vector(...)`.
        obj: Row of the array of objects.
        clear: Transmission of the air, and of the fading far away.
        budget: Pixels that halos may still cover.

    Returns:
        Pixels left.
    """
    if not (obj[OBJ_MODEL] == MODEL_CAR or obj[OBJ_MODEL] == MODEL_TRUCK) or budget <= 0.0:
        return budget
    c, s = obj[OBJ_COS], obj[OBJ_SIN]
    up = (0.45 if obj[OBJ_MODEL] == MODEL_CAR else 0.22) * obj[OBJ_HEIGHT]
    for side in (-_LAMP_AT, _LAMP_AT):
        x = obj[OBJ_X] + 0.5 * obj[OBJ_LENGTH] * c - side * obj[OBJ_WIDTH] * s - cam[CAM_X]
        y = obj[OBJ_Y] + 0.5 * obj[OBJ_LENGTH] * s + side * obj[OBJ_WIDTH] * c - cam[CAM_Y]
        away = math.sqrt(x * x + y * y)
        # Full within 30° of straight at the lens, nothing beyond 60°.
        facing = min((-(x * c + y * s) / max(away, 0.1) - 0.5) / 0.366, 1.0)
        ahead = x * cam[CAM_COS_YAW] + y * cam[CAM_SIN_YAW]
        z = up - cam[CAM_Z]
        depth = ahead * cam[CAM_COS_PITCH] + z * cam[CAM_SIN_PITCH]
        if not (facing > 0.0 and depth > 1.0):
            continue
        f = cam[CAM_FOCAL]
        u = cam[CAM_CU] + f * (y * cam[CAM_COS_YAW] - x * cam[CAM_SIN_YAW]) / depth
        v = cam[CAM_CV] + f * (ahead * cam[CAM_SIN_PITCH] - z * cam[CAM_COS_PITCH]) / depth
        near = min(_FULL / away, 1.0)
        radius = max(f * _RADIUS * math.sqrt(near), 1.5)
        radius = min(radius, math.sqrt(max(budget, 0.0) / math.pi), 24.0)
        budget -= _add_halo(image, u, v, radius, _PEAK * facing * near * clear)
    return budget


@kernel
def _add_halo(image, u, v, radius, peak):
    """Add a round, soft light; returns the pixels it went over."""
    height, width = image.shape
    if not (
        radius > 0.5 and u + radius > 0.0 and u - radius < width and v + radius > 0.0 and v - radius < height
    ):
        return 0.0
    i0, i1 = int(max(v - radius, 0.0)), int(min(v + radius + 1.0, float(height)))
    j0, j1 = int(max(u - radius, 0.0)), int(min(u + radius + 1.0, float(width)))
    scale = 1.0 / (radius * radius)
    for i in range(i0, i1):
        dy = i + 0.5 - v
        for j in range(j0, j1):
            dx = j + 0.5 - u
            rest = max(1.0 - scale * (dx * dx + dy * dy), 0.0)
            image[i, j] += nb.float32(peak * rest * rest * rest)
    return float((i1 - i0) * (j1 - j0))
