"""Kernels of visibility: culling and drawing order."""

import math

from lgmd_gym.camera.objects import MODEL_MARK, MODEL_POST, MODEL_RAIL
from lgmd_gym.camera.pose import side_tangent
from lgmd_gym.camera.render.jit import kernel


@kernel
def distance(lens, obj):
    """Return the distance of an object's centre from the lens, on the ground [m]."""
    dx, dy = obj.x - lens.x, obj.y - lens.y
    return math.sqrt(dx * dx + dy * dy)


@kernel
def visible(lens, obj):
    """Return whether an object may be in the frame and the lens is outside it."""
    dx, dy = obj.x - lens.x, obj.y - lens.y
    if dx * dx + dy * dy > obj.range**2:
        return False
    # With its shadow.
    radius = 0.5 * math.sqrt(obj.length**2 + obj.width**2) + 0.4 + 0.1 * obj.height
    ahead = dx * lens.cos_yaw + dy * lens.sin_yaw
    across = dy * lens.cos_yaw - dx * lens.sin_yaw
    tan = side_tangent(lens)
    reach = radius * math.sqrt(1.0 + tan * tan)
    if tan >= 0.0 and (ahead < -radius or abs(across) > max(ahead, 0.0) * tan + reach):
        return False
    if obj.model == MODEL_MARK:
        return True
    lx = -dx * obj.cos - dy * obj.sin
    ly = dx * obj.sin - dy * obj.cos
    inside = abs(lx) < 0.5 * obj.length and abs(ly) < 0.5 * obj.width
    return not (inside and lens.z < obj.height)


@kernel
def _separating_side(a, b, px, py):
    """Find a side of box a that separates it from box b.

    Returns 1 if the point (px, py) is on a's side of it (a may hide b, but not the reverse), -1 if it is on
    b's side, 0 if there is no such side.
    """
    dx, dy = b.x - a.x, b.y - a.y
    bx, by = dx * a.cos + dy * a.sin, dy * a.cos - dx * a.sin
    cos, sin = abs(a.cos * b.cos + a.sin * b.sin), abs(b.sin * a.cos - b.cos * a.sin)
    half_x = 0.5 * (cos * b.length + sin * b.width)
    half_y = 0.5 * (sin * b.length + cos * b.width)
    ex, ey = px - a.x, py - a.y
    lx, ly = ex * a.cos + ey * a.sin, ey * a.cos - ex * a.sin
    side_x = abs(bx) - half_x - 0.5 * a.length
    side_y = abs(by) - half_y - 0.5 * a.width
    if side_x < 0.0 and side_y < 0.0:
        return 0
    if side_x >= side_y:
        beyond = lx * (1.0 if bx > 0.0 else -1.0) > 0.5 * a.length + 0.5 * side_x
    else:
        beyond = ly * (1.0 if by > 0.0 else -1.0) > 0.5 * a.width + 0.5 * side_y
    return -1 if beyond else 1


@kernel
def _hides(a, b, lens, away_a, away_b):
    """Return whether box a must be drawn after box b."""
    rail = a.model == MODEL_RAIL or b.model == MODEL_RAIL
    if not rail and (a.model >= MODEL_POST or b.model >= MODEL_POST):
        return away_a < away_b  # thin objects apart from all others
    side = _separating_side(a, b, lens.x, lens.y)
    if side == 0:
        side = -_separating_side(b, a, lens.x, lens.y)
    if side == 0:
        return away_a < away_b
    return side > 0


@kernel
def order_objects(lens, objects, count, order, distances):
    """Sort the visible objects from far to near.

    Writes the indices of the visible objects to `order` and the distances of their centres [m] to
    `distances`; returns the number of visible objects.
    """
    n = 0
    # From the end: the roadside comes last, sorted by x, so that driving along x meets the far ones first.
    for i in range(count - 1, -1, -1):
        if not visible(lens, objects[i]):
            continue
        distances[i] = distance(lens, objects[i])
        k = n
        while k > 0:
            j = order[k - 1]
            if not _hides(objects[j], objects[i], lens, distances[j], distances[i]):
                break
            order[k] = j
            k -= 1
        order[k] = i
        n += 1
    return n
