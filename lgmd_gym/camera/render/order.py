"""Kernels of visibility: culling and drawing order."""

import math
from typing import NamedTuple

from lgmd_gym.camera.objects import MODEL_MARK, is_picture
from lgmd_gym.camera.pose import side_tangent
from lgmd_gym.kernels import kernel


@kernel
def distance(lens, obj):
    """Return the distance of an object's centre from the lens, on the ground [m]."""
    dx, dy = obj.x - lens.x, obj.y - lens.y
    return math.sqrt(dx * dx + dy * dy)


@kernel
def first_from(roadside, x):
    """Return the index of the first object of a roadside, which is sorted by x, at or beyond x."""
    low, high = 0, roadside.shape[0]
    while low < high:
        middle = (low + high) // 2
        if roadside[middle].x < x:
            low = middle + 1
        else:
            high = middle
    return low


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
    return not (inside and obj.base <= lens.z < obj.height)


class Box(NamedTuple):
    """A rectangle on the ground: centre, heading, size [m]."""

    x: float
    y: float
    cos: float
    sin: float
    length: float
    width: float


@kernel
def _footprint(lens, obj, away):
    """Return the rectangle that an object covers; that of a flat picture is a line across the view."""
    if not is_picture(obj.model):
        return Box(obj.x, obj.y, obj.cos, obj.sin, obj.length, obj.width)
    scale = 1.0 / max(away, 1e-6)
    return Box(obj.x, obj.y, scale * (obj.x - lens.x), scale * (obj.y - lens.y), 0.0, obj.width)


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
    """Return whether object a must be drawn after object b: a plane between them has the lens on a's side."""
    if a.base > 0.0 and a.base >= b.height:
        return lens.z > 0.5 * (a.base + b.height)
    if b.base > 0.0 and b.base >= a.height:
        return lens.z < 0.5 * (b.base + a.height)
    if is_picture(a.model) and is_picture(b.model):
        return away_a < away_b
    box_a, box_b = _footprint(lens, a, away_a), _footprint(lens, b, away_b)
    side = _separating_side(box_a, box_b, lens.x, lens.y)
    if side == 0:
        side = -_separating_side(box_b, box_a, lens.x, lens.y)
    if side == 0:
        return away_a < away_b
    return side > 0


@kernel
def _turn(x, y):
    """Return a number from 0 to 4 that grows with the azimuth of a vector; each quarter turn adds 1."""
    size = abs(x) + abs(y)
    if size == 0.0:
        return 0.0
    return 1.0 - x / size if y >= 0.0 else 3.0 + x / size


@kernel
def _wrapped(turn):
    """Return a difference of two turns between -2 and 2."""
    return turn - 4.0 if turn > 2.0 else turn + 4.0 if turn < -2.0 else turn


@kernel
def _write_extent(lens, obj, away, extent):
    """Write the middle and the half of an object's azimuths, and bounds of its distance."""
    box = _footprint(lens, obj, away)
    dx, dy = box.x - lens.x, box.y - lens.y
    radius = 0.5 * math.sqrt(box.length * box.length + box.width * box.width)
    extent[2], extent[3] = away - radius, away + radius
    along, across = abs(dx * box.cos + dy * box.sin), abs(dy * box.cos - dx * box.sin)
    if along <= 0.5 * box.length and across <= 0.5 * box.width:
        extent[0], extent[1] = 0.0, 4.0  # all around the lens
        return
    centre, low, high = _turn(dx, dy), 0.0, 0.0
    for i in range(4):
        lx = (0.5 if i < 2 else -0.5) * box.length
        ly = (0.5 if i % 2 == 0 else -0.5) * box.width
        turn = _turn(dx + lx * box.cos - ly * box.sin, dy + lx * box.sin + ly * box.cos)
        low, high = min(low, _wrapped(turn - centre)), max(high, _wrapped(turn - centre))
    # Half a pixel on both sides: objects next to each other share pixels.
    extent[0], extent[1] = centre + 0.5 * (low + high), 0.5 * (high - low) + 0.5 / lens.focal


@kernel
def _meets_view(one, other):
    """Return whether the azimuths of two extents overlap, and the first is not entirely beyond the other."""
    if one[2] > other[3]:
        return False
    apart = abs(one[0] - other[0])  # below 8, because middles are from -2 to 6
    return min(min(apart, abs(apart - 4.0)), 8.0 - apart) < one[1] + other[1]


@kernel
def _farther(lens, objects, order, first, n, at, distances, extents):
    """Return the place, from `first` on, of an object to be drawn before that at place `at`; -1 if none."""
    i = order[at]
    for k in range(first, n):
        j = order[k]
        if (
            k != at
            and _meets_view(extents[i], extents[j])
            and _hides(objects[i], objects[j], lens, distances[i], distances[j])
        ):
            return k
    return -1


@kernel
def _correct_order(lens, objects, order, n, distances, extents):
    """Move objects that are drawn too early behind those they hide; the others stay in order.

    Only objects with common azimuths hide each other, so that this order exists unless three or more long
    objects hide each other in turn.
    """
    for i in range(n):
        j = order[i]
        _write_extent(lens, objects[j], distances[j], extents[j])
    for first in range(n - 1):
        at = first
        for _ in range(n):
            behind = _farther(lens, objects, order, first, n, at, distances, extents)
            if behind < 0:
                break
            at = behind
        moved = order[at]
        for k in range(at, first, -1):
            order[k] = order[k - 1]
        order[first] = moved


@kernel
def order_objects(lens, objects, count, order, distances, extents):
    """Sort the visible objects from far to near; marks, which lie flat, come last.

    Args:
        lens: `LENS` record.
        objects: `OBJECT` records.
        count: Number of objects.
        order: Output: indices of the visible objects.
        distances: Output: distances of their centres [m], by index.
        extents: Output: see `Buffers`.

    Returns:
        Number of visible objects.
    """
    n = 0
    # From the end: the roadside comes last, sorted by x, so that driving along x meets the far ones first.
    for i in range(count - 1, -1, -1):
        if objects[i].model == MODEL_MARK or not visible(lens, objects[i]):
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
    # The insertion compares neighbours only, and objects side by side are not in a transitive order.
    _correct_order(lens, objects, order, n, distances, extents)
    for i in range(count - 1, -1, -1):
        if objects[i].model == MODEL_MARK and visible(lens, objects[i]):
            order[n] = i
            n += 1
    return n
