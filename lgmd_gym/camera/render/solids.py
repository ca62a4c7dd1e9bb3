# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Solid objects: the faces that are turned towards the lens, and how they are drawn."""

import math
from typing import NamedTuple

import numba as nb
import numpy as np

from lgmd_gym.camera.objects import is_picture
from lgmd_gym.camera.render.coverage import add_polygon, project_eight, sum_differences
from lgmd_gym.camera.render.light import row_slope, veil_at
from lgmd_gym.camera.render.models.builder import BODY, LAMP, TAIL, UNDER
from lgmd_gym.camera.render.seen import distance
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.doubles import load_doubles, madd_doubles, splat_double
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


@kernel(inline=True)
def _along(axes, k, a, b, c):
    """Return coordinate k in camera axes of eight points, given as fractions of an object's axes."""
    sums = madd_doubles(a, splat_double(axes[1, k]), splat_double(axes[0, k]))
    return madd_doubles(c, splat_double(axes[3, k]), madd_doubles(b, splat_double(axes[2, k]), sums))


@kernel(inline=True)
def _place_polygon(lens, models, p, layer):
    """Project polygon p of an object; see `project_eight`."""
    corners = models.corners[p]
    size = corners.shape[1]
    a, b, c = load_doubles(corners, 0), load_doubles(corners, size), load_doubles(corners, 2 * size)
    depth = _along(layer.axes, 0, a, b, c)
    right, down = _along(layer.axes, 1, a, b, c), _along(layer.axes, 2, a, b, c)
    return project_eight(lens, depth, right, down, models.corners_used[p], layer)


@kernel(inline=True)
def place_point(axes, k, a, b, c):
    """Return coordinate k in camera axes of a point, given as fractions of an object's axes."""
    return axes[0, k] + a * axes[1, k] + b * axes[2, k] + c * axes[3, k]


@kernel
def _place_face(fractions, axes, corners):
    """Place the first three corners of a face in camera axes."""
    for i in range(3):
        for k in range(3):
            corners[k, i] = place_point(axes, k, fractions[0, i], fractions[1, i], fractions[2, i])


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
    ax, ay, az = corners[0, 1] - corners[0, 0], corners[1, 1] - corners[1, 0], corners[2, 1] - corners[2, 0]
    bx, by, bz = corners[0, 2] - corners[0, 1], corners[1, 2] - corners[1, 1], corners[2, 2] - corners[2, 1]
    # Camera axes are right-handed (depth, right, down): this normal points outwards.
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    if nx * corners[0, 0] + ny * corners[1, 0] + nz * corners[2, 0] >= 0.0:
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


@kernel(inline=True)
def draw_object(image, view, obj, index, models, air, layer, seen):
    """Draw one object, that at `index` of `seen.objects`, over the image."""
    lens, look = view.lens, view.look
    place_object(lens, look, obj, layer.axes)
    if outside(lens, layer.axes):
        return
    # Apparent height [px], at a distance of 1 m or more.
    size = lens.focal * (obj.height - obj.base) / max(distance(lens, obj) - 0.5 * obj.length, 1.0)
    first, last = models.models[obj.model, 0], models.models[obj.model, 1]
    # From below the top of its body, a car's cabin is behind the body.
    reverse = lens.z < models.splits[obj.model] * obj.height
    if seen.faces[index, 1] < 0:
        _find_faces(layer, look, models, (first, last, reverse), seen, index)
    at = seen.faces[index, 0]
    end = at + seen.faces[index, 1]
    for k in range(last - first):
        solid = last - 1 - k if reverse else first + k
        start = at
        while at < end and models.solids[solid, 0] <= seen.polygons[at] < models.solids[solid, 1]:
            at += 1
        if at == start:
            continue
        u0, v0, u1, v1 = _add_solid(layer, lens, look, obj, models, (start, at), size, air, seen)
        if u1 >= u0:
            height, width = image.shape
            rows = (int(max(v0, 0.0)), int(min(math.ceil(v1), height)))
            columns = (int(max(u0, 0.0)), int(min(math.ceil(u1) + 1.0, width)))
            compose(image, layer, rows, columns, air, view)


@kernel
def _find_faces(layer, look, models, solids, seen, index):
    """Write the polygons of an object that are turned towards the eye, in the order of drawing.

    `solids` is (first, last + 1, whether they are drawn in reverse).
    """
    first, last, reverse = solids
    corners, greys = layer.corners, layer.greys
    start = at = seen.counts[2]
    for k in range(last - first):
        solid = last - 1 - k if reverse else first + k
        for p in range(models.solids[solid, 0], models.solids[solid, 1]):
            parent = models.parent[p]
            if parent >= 0:
                light = greys[parent, 1]
            else:
                _place_face(models.corners[p], layer.axes, corners)
                light = _face_light(corners, layer.axes, look)
            greys[p, 1] = light
            if light > 0.0:
                seen.polygons[at], seen.lights[at] = p, light
                at += 1
    seen.faces[index, 0], seen.faces[index, 1], seen.counts[2] = start, at - start, at


@kernel(inline=True)
def _add_solid(layer, lens, look, obj, models, part, size, air, seen):
    """Add the faces and details of one solid that are in the frame, `part` of `seen.polygons`.

    Returns the bounds (u0, v0, u1, v1) of all of them [px]; u1 < u0 if there is none.
    """
    uv, greys = layer.uv, layer.greys
    height, width = layer.coverage.shape[1], layer.coverage.shape[2] - 2
    u0, v0, u1, v1 = 1e9, 1e9, -1e9, -1e9
    for at in range(part[0], part[1]):
        p = seen.polygons[at]
        parent = models.parent[p]
        greys[p, 1] = 0.0
        weight = air.opacity
        if parent >= 0:
            # Details fade in as they grow, so that none appears suddenly.
            weight *= min(1.0, size / models.fine[p] - 1.0)
            if greys[parent, 1] == 0.0 or weight <= 0.0:
                continue
        light = seen.lights[at] * air.light
        if light <= 0.0:
            continue
        m, box = _place_polygon(lens, models, p, layer)
        if m < 3:
            continue
        left, top, right, bottom = box
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
