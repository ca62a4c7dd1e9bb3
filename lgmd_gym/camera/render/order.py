"""Kernels that decide what is seen at all, and what hides what."""

from __future__ import annotations

import math

from lgmd_gym.camera.pinhole import CAM_COS_YAW, CAM_CU, CAM_FOCAL, CAM_SIN_YAW, CAM_X, CAM_Y, CAM_Z
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.scene import (
    MODEL_MARK,
    MODEL_POST,
    MODEL_RAIL,
    OBJ_COS,
    OBJ_HEIGHT,
    OBJ_LENGTH,
    OBJ_MODEL,
    OBJ_RANGE,
    OBJ_SIN,
    OBJ_WIDTH,
    OBJ_X,
    OBJ_Y,
)


@kernel
def distance(cam, obj):
    """Distance of an object's centre from the lens, on the ground [m]."""
    dx, dy = obj[OBJ_X] - cam[CAM_X], obj[OBJ_Y] - cam[CAM_Y]
    return math.sqrt(dx * dx + dy * dy)


@kernel
def visible(cam, obj):
    """Whether any of an object may be in the frame, and the lens is outside it."""
    dx, dy = obj[OBJ_X] - cam[CAM_X], obj[OBJ_Y] - cam[CAM_Y]
    if dx * dx + dy * dy > obj[OBJ_RANGE] ** 2:
        return False
    radius = 0.5 * math.sqrt(obj[OBJ_LENGTH] ** 2 + obj[OBJ_WIDTH] ** 2)
    ahead = dx * cam[CAM_COS_YAW] + dy * cam[CAM_SIN_YAW]
    across = dy * cam[CAM_COS_YAW] - dx * cam[CAM_SIN_YAW]
    # The horizontal half-angle grows when the lens is pitched; 1.3 covers it up to 45°.
    tan = 1.3 * cam[CAM_CU] / cam[CAM_FOCAL]
    reach = radius * math.sqrt(1.0 + tan * tan) + 0.5
    if ahead < -radius or abs(across) > max(ahead, 0.0) * tan + reach:
        return False
    if obj[OBJ_MODEL] == MODEL_MARK:
        return True
    lx = -dx * obj[OBJ_COS] - dy * obj[OBJ_SIN]
    ly = dx * obj[OBJ_SIN] - dy * obj[OBJ_COS]
    inside = abs(lx) < 0.5 * obj[OBJ_LENGTH] and abs(ly) < 0.5 * obj[OBJ_WIDTH]
    return not (inside and cam[CAM_Z] < obj[OBJ_HEIGHT])


@kernel
def _separated(a, b, px, py):
    """Look for a side of box a with all of box b beyond it.

    Returns:
        1 if the point (px, py) is on a's side of it (a may hide b, never b a), -1 if on b's, 0 if
        there is no such side.
    """
    ca, sa, cb, sb = a[OBJ_COS], a[OBJ_SIN], b[OBJ_COS], b[OBJ_SIN]
    dx, dy = b[OBJ_X] - a[OBJ_X], b[OBJ_Y] - a[OBJ_Y]
    bx, by = dx * ca + dy * sa, dy * ca - dx * sa
    cos, sin = abs(ca * cb + sa * sb), abs(sb * ca - cb * sa)
    half_x = 0.5 * (cos * b[OBJ_LENGTH] + sin * b[OBJ_WIDTH])
    half_y = 0.5 * (sin * b[OBJ_LENGTH] + cos * b[OBJ_WIDTH])
    ex, ey = px - a[OBJ_X], py - a[OBJ_Y]
    lx, ly = ex * ca + ey * sa, ey * ca - ex * sa
    side_x = abs(bx) - half_x - 0.5 * a[OBJ_LENGTH]
    side_y = abs(by) - half_y - 0.5 * a[OBJ_WIDTH]
    if side_x < 0.0 and side_y < 0.0:
        return 0
    if side_x >= side_y:
        beyond = lx * (1.0 if bx > 0.0 else -1.0) > 0.5 * a[OBJ_LENGTH] + 0.5 * side_x
    else:
        beyond = ly * (1.0 if by > 0.0 else -1.0) > 0.5 * a[OBJ_WIDTH] + 0.5 * side_y
    return -1 if beyond else 1


@kernel
def _hides(a, b, px, py, near_a, near_b):
    """Whether box a must be drawn after box b."""
    long = a[OBJ_MODEL] == MODEL_RAIL or b[OBJ_MODEL] == MODEL_RAIL
    if not long and (a[OBJ_MODEL] >= MODEL_POST or b[OBJ_MODEL] >= MODEL_POST):
        return near_a < near_b  # thin things, apart from all else
    verdict = _separated(a, b, px, py)
    if verdict == 0:
        verdict = -_separated(b, a, px, py)
    if verdict == 0:
        return near_a < near_b
    return verdict > 0


@kernel
def order_objects(cam, objects, count, order, nearness):
    """Sort the visible objects, the last to be drawn last.

    Args:
        cam: `camera_vector(...)`.
        objects: float64, shape (>= count, 12).
        count: How many.
        order: Gets the indices, int64.
        nearness: Scratch, float64: distance of the centres.

    Returns:
        Number of visible objects.
    """
    n = 0
    # From the end: the roadside comes last, sorted by x, so that driving along x meets the far ones first.
    for i in range(count - 1, -1, -1):
        if not visible(cam, objects[i]):
            continue
        nearness[i] = distance(cam, objects[i])
        k = n
        while k > 0:
            j = order[k - 1]
            if not _hides(objects[j], objects[i], cam[CAM_X], cam[CAM_Y], nearness[j], nearness[i]):
                break
            order[k] = j
            k -= 1
        order[k] = i
        n += 1
    return n
