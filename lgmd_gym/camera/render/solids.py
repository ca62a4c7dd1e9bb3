# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Solid objects: which are visible, their order from far to near, and how they are drawn."""

import math
from typing import NamedTuple

import numba as nb
import numpy as np

from lgmd_gym.camera.objects import MODEL_MARK, is_picture
from lgmd_gym.camera.pose import side_tangent
from lgmd_gym.camera.render.coverage import add_polygon, bounds, clip_and_project, sum_differences
from lgmd_gym.camera.render.light import row_slope, veil_at
from lgmd_gym.camera.render.models.builder import BODY, LAMP, TAIL, UNDER
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import (
    LANES,
    any_above,
    load_part,
    madd,
    magnitude,
    maximum,
    minimum,
    splat,
    store_part,
)


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


class Footprint(NamedTuple):
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
        return Footprint(x=obj.x, y=obj.y, cos=obj.cos, sin=obj.sin, length=obj.length, width=obj.width)
    scale = 1.0 / max(away, 1e-6)
    cos, sin = scale * (obj.x - lens.x), scale * (obj.y - lens.y)
    return Footprint(x=obj.x, y=obj.y, cos=cos, sin=sin, length=0.0, width=obj.width)


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


_HALF = 0.55  # reach of the models from their centre, as a share of their length and width
_TRACE = nb.float32(1e-3)  # less grey comes from rounding


class Air(NamedTuple):
    """The light on an object and the air between it and the lens."""

    light: float  # light on the object; 1 by day
    transmission: float  # share of the object's contrast that remains behind the fog
    opacity: float  # share of the object that is drawn; below 1 near the end of its range
    away: float  # distance of the object [m]


@kernel
def to_axes(lens, x, y, z, out, i):
    """Write a world vector as (depth, right, down) to row i of `out`."""
    ahead, right = x * lens.cos_yaw + y * lens.sin_yaw, y * lens.cos_yaw - x * lens.sin_yaw
    down = ahead * lens.sin_pitch - z * lens.cos_pitch
    out[i, 0] = ahead * lens.cos_pitch + z * lens.sin_pitch
    out[i, 1] = right * lens.cos_roll + down * lens.sin_roll
    out[i, 2] = down * lens.cos_roll - right * lens.sin_roll


@kernel
def place_object(lens, look, obj, axes):
    """Write an object in camera axes: centre of its underside, its size [m], direction of the sun."""
    c, s = obj.cos, obj.sin
    dx, dy = obj.x - lens.x, obj.y - lens.y
    if is_picture(obj.model):
        away = max(math.sqrt(dx * dx + dy * dy), 1e-6)
        c, s = dx / away, dy / away
    # int64, because a kernel is compiled anew for each literal argument.
    to_axes(lens, dx, dy, obj.base - lens.z, axes, np.int64(0))
    to_axes(lens, c * obj.length, s * obj.length, 0.0, axes, np.int64(1))
    to_axes(lens, -s * obj.width, c * obj.width, 0.0, axes, np.int64(2))
    to_axes(lens, 0.0, 0.0, obj.height - obj.base, axes, np.int64(3))
    to_axes(lens, look.sun_x, look.sun_y, look.sun_z, axes, np.int64(4))


@kernel
def place_corners(fractions, n, axes, corners):
    """Place the first n corners of a polygon, given as fractions of an object's axes, in camera axes."""
    for i in range(n):
        a, b, c = fractions[i, 0], fractions[i, 1], fractions[i, 2]
        for k in range(3):
            corners[i, k] = axes[0, k] + a * axes[1, k] + b * axes[2, k] + c * axes[3, k]


@kernel
def outside(lens, axes):
    """Return whether an object is entirely beyond the left, right, upper or lower side of the frame.

    The planes through the lens and the sides of the frame are tested against the box around the object.
    """
    for side in range(4):
        k, way = 1 + side // 2, 1.0 - 2.0 * (side % 2)
        focal, edge = way * lens.focal, lens.centre_u if k == 1 else lens.centre_v
        # Scaled distance of the box's centre from the plane, then of the corner furthest inside.
        up = 0.5 * (focal * axes[3, k] + edge * axes[3, 0])
        inside = focal * axes[0, k] + edge * axes[0, 0] + up
        for i in range(1, 3):
            inside += _HALF * abs(focal * axes[i, k] + edge * axes[i, 0])
        if inside + abs(up) < 0.0:
            return True
    return False


@kernel
def _face_light(corners, axes, look):
    """Return the light on a face, or a negative number if its back faces the lens."""
    ax, ay, az = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    bx, by, bz = corners[2, 0] - corners[1, 0], corners[2, 1] - corners[1, 1], corners[2, 2] - corners[1, 2]
    # Camera axes are right-handed (depth, right, down): this normal points outwards.
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    if nx * corners[0, 0] + ny * corners[0, 1] + nz * corners[0, 2] >= 0.0:
        return -1.0
    norm = math.sqrt(nx * nx + ny * ny + nz * nz)
    return look.ambient + look.direct * max(0.0, (nx * axes[4, 0] + ny * axes[4, 1] + nz * axes[4, 2]) / norm)


@kernel
def grey_of(role, value, light, obj, look, air):
    """Return the grey of a polygon; lamps emit light, all else reflects it.

    The gap below a vehicle has the light of the shaded road behind it, whatever the light on the face.
    """
    night = look.night > 0.0
    if role == UNDER and look.under_road > 0.0:
        return look.under_road * air.light
    if role == TAIL:
        if obj.braking > 0:
            return 255.0
        return 170.0 if night else value * light
    if role == LAMP:
        return 255.0 if night else value
    grey = value * obj.shade if role == BODY else value
    return min(grey * light, 250.0)


@kernel
def draw_object(image, view, obj, models, air, layer):
    """Draw one object over the image."""
    lens, look = view.lens, view.look
    place_object(lens, look, obj, layer.axes)
    if outside(lens, layer.axes):
        return
    # Apparent height [px], at a distance of 1 m or more.
    size = lens.focal * (obj.height - obj.base) / max(distance(lens, obj) - 0.5 * obj.length, 1.0)
    first, last = models.models[obj.model, 0], models.models[obj.model, 1]
    # From below the top of its body, a car's cabin is behind the body.
    reverse = lens.z < models.splits[obj.model] * obj.height
    for k in range(last - first):
        solid = last - 1 - k if reverse else first + k
        u0, v0, u1, v1 = _add_solid(layer, lens, look, obj, models, solid, size, air)
        if u1 >= u0:
            height, width = image.shape
            rows = (int(max(v0, 0.0)), int(min(math.ceil(v1), height)))
            columns = (int(max(u0, 0.0)), int(min(math.ceil(u1) + 1.0, width)))
            compose(image, layer, rows, columns, air, view)


@kernel
def _add_solid(layer, lens, look, obj, models, solid, size, air):
    """Add the faces and details of one solid that are in the frame.

    Returns the bounds (u0, v0, u1, v1) of all of them [px]; u1 < u0 if there is none.
    """
    corners, uv, greys = layer.corners, layer.uv, layer.greys
    height, width = layer.coverage.shape[1], layer.coverage.shape[2] - 2
    u0, v0, u1, v1 = 1e9, 1e9, -1e9, -1e9
    for p in range(models.solids[solid, 0], models.solids[solid, 1]):
        n, parent = models.corners_used[p], models.parent[p]
        greys[p, 1] = 0.0
        weight = air.opacity
        if parent >= 0:
            # Details fade in as they grow, so that none appears suddenly.
            weight *= min(1.0, size / models.fine[p] - 1.0)
            if greys[parent, 1] == 0.0 or weight <= 0.0:
                continue
        place_corners(models.corners[p], n, layer.axes, corners)
        light = greys[parent, 1] if parent >= 0 else _face_light(corners, layer.axes, look) * air.light
        if light <= 0.0:
            continue
        m = clip_and_project(lens, corners, n, uv)
        if m < 3:
            continue
        left, top, right, bottom = bounds(uv, m)
        # The edges of a polygon left of the frame would cancel.
        if right <= 0.0 or bottom <= 0.0 or left >= width or top >= height:
            continue
        grey = grey_of(models.role[p], models.value[p], light, obj, look, air)
        greys[p, 0], greys[p, 1] = grey, light
        # Also a detail, which may protrude from its face: the layer is cleared within the bounds.
        u0, v0, u1, v1 = min(u0, left), min(v0, top), max(u1, right), max(v1, bottom)
        if parent >= 0:
            add_polygon(layer.coverage, np.int64(1), uv, m, weight * (grey - greys[parent, 0]), 0.0)
            continue
        add_polygon(layer.coverage, np.int64(0), uv, m, weight, weight * grey)
    return u0, v0, u1, v1


@kernel
def compose(image, layer, rows, columns, air, view):
    """Draw the layer over a part of the image and clear it; `rows` and `columns` are (first, last + 1)."""
    look, veiled = view.look, view.look.veil > 0.0
    width, stride = image.shape[1], layer.coverage.shape[2]
    covers, greys = layer.coverage[0], layer.coverage[1]
    zero, one, trace = splat(nb.float32(0.0)), splat(nb.float32(1.0)), splat(_TRACE)
    clear = splat(nb.float32(air.transmission))
    murk = splat(nb.float32((1.0 - air.transmission) * look.haze))
    for i in range(rows[0], rows[1]):
        sum_cover = sum_grey = veil = zero
        if veiled:
            veil = splat(nb.float32(veil_at(look, view.lens.z, row_slope(view.lens, i), air.away)))
        # The last edges may be in the two columns right of the solid.
        for j in range(columns[0], min(columns[1] + 2, stride), LANES):
            at, pixel = i * stride + j, i * width + j
            cover, sum_cover = sum_differences(covers, at, stride - j, sum_cover)
            grey, sum_grey = sum_differences(greys, at, stride - j, sum_grey)
            if not (any_above(cover, trace) or any_above(magnitude(grey), trace)):
                continue
            cover = minimum(maximum(cover, zero), one)
            behind = load_part(image, pixel, width - j)
            light = madd(grey, clear, cover * murk)
            if veiled:
                light = madd(cover * veil, load_part(view.beam, j, width - j), light)
            store_part(image, pixel, width - j, madd(behind, one - cover, light))
