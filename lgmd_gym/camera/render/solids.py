"""Kernels of the solid objects: cars, trucks, boxes, posts and trees, with exact outlines."""

import math
from typing import NamedTuple

import numba as nb

from lgmd_gym.camera.objects import MODEL_POST
from lgmd_gym.camera.render.coverage import add_polygon, clip_and_project
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.render.model_builder import BODY, LAMP, TAIL
from lgmd_gym.camera.render.order import distance
from lgmd_gym.camera.render.shadows import SUN

_AMBIENT, _DIRECT = 0.62, 0.42  # light on a face turned away from the sun, and the share that the sun adds


class Air(NamedTuple):
    """The light on an object and the air between it and the lens.

    Attributes:
        light: Light on the object; 1 by day.
        transmission: Share of the object's contrast that remains behind the fog.
        haze: Grey level of the fog.
        night: 1.0 at night.
        opacity: Share of the object that is drawn; below 1 near the end of its range.
    """

    light: float
    transmission: float
    haze: float
    night: float
    opacity: float


@kernel
def _to_axes(lens, x, y, z, out, i):
    """Write a world vector as (depth, right, down) to row i of `out`."""
    ahead = x * lens.cos_yaw + y * lens.sin_yaw
    out[i, 0] = ahead * lens.cos_pitch + z * lens.sin_pitch
    out[i, 1] = y * lens.cos_yaw - x * lens.sin_yaw
    out[i, 2] = ahead * lens.sin_pitch - z * lens.cos_pitch


@kernel
def place_object(lens, obj, axes):
    """Write an object in camera axes: ground centre, length, width and height [m], direction of the sun."""
    c, s = obj.cos, obj.sin
    dx, dy = obj.x - lens.x, obj.y - lens.y
    if obj.model >= MODEL_POST:
        # Posts and trees are flat pictures that face the lens.
        away = max(math.sqrt(dx * dx + dy * dy), 1e-6)
        c, s = dx / away, dy / away
    _to_axes(lens, dx, dy, -lens.z, axes, 0)
    _to_axes(lens, c * obj.length, s * obj.length, 0.0, axes, 1)
    _to_axes(lens, -s * obj.width, c * obj.width, 0.0, axes, 2)
    _to_axes(lens, 0.0, 0.0, obj.height, axes, 3)
    _to_axes(lens, SUN[0], SUN[1], SUN[2], axes, 4)


@kernel
def _place_corners(fractions, n, axes, corners):
    """Place the first n corners of a polygon, given as fractions of an object's axes, in camera axes."""
    for i in range(n):
        a, b, c = fractions[i, 0], fractions[i, 1], fractions[i, 2]
        for k in range(3):
            corners[i, k] = axes[0, k] + a * axes[1, k] + b * axes[2, k] + c * axes[3, k]


@kernel
def _face_light(corners, axes):
    """Return the light on a face, or a negative number if its back faces the lens."""
    ax, ay, az = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    bx, by, bz = corners[2, 0] - corners[1, 0], corners[2, 1] - corners[1, 1], corners[2, 2] - corners[1, 2]
    # Camera axes are right-handed (depth, right, down): this normal points outwards.
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    if nx * corners[0, 0] + ny * corners[0, 1] + nz * corners[0, 2] >= 0.0:
        return -1.0
    norm = math.sqrt(nx * nx + ny * ny + nz * nz)
    return _AMBIENT + _DIRECT * max(0.0, (nx * axes[4, 0] + ny * axes[4, 1] + nz * axes[4, 2]) / norm)


@kernel
def _grey(role, value, light, obj, night):
    """Return the grey of a polygon; lamps emit light, all else reflects it."""
    if role == TAIL:
        if obj.braking > 0:
            return 255.0
        return 170.0 if night else value * light
    if role == LAMP:
        return 255.0 if night else value
    grey = value * obj.shade if role == BODY else value
    return min(grey * light, 250.0)


@kernel
def draw_object(image, lens, obj, models, air, layer):
    """Draw one object over the image."""
    place_object(lens, obj, layer.axes)
    # Apparent height [px], at a distance of 1 m or more.
    size = lens.focal * obj.height / max(distance(lens, obj) - 0.5 * obj.length, 1.0)
    for solid in range(models.models[obj.model, 0], models.models[obj.model, 1]):
        u0, v0, u1, v1 = _add_solid(layer, lens, obj, models, solid, size, air)
        height, width = image.shape
        # Includes solids left of the frame: their edges are summed in column 0 and cancel up to rounding.
        if v1 > 0.0 and v0 < height and u0 < width:
            rows = (int(max(v0, 0.0)), int(min(math.ceil(v1), height)))
            columns = (int(max(u0, 0.0)), int(max(min(math.ceil(u1) + 1.0, width), 0.0)))
            _compose(image, layer, rows, columns, air)


@kernel
def _add_solid(layer, lens, obj, models, solid, size, air):
    """Add the faces and details of one solid; returns the bounds of its faces (u0, v0, u1, v1) [px]."""
    corners, uv, greys = layer.corners, layer.uv, layer.greys
    night = air.night > 0.0
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
        _place_corners(models.corners[p], n, layer.axes, corners)
        light = greys[parent, 1] if parent >= 0 else _face_light(corners, layer.axes) * air.light
        if light <= 0.0:
            continue
        m = clip_and_project(lens, corners, n, uv)
        if m < 3:
            continue
        grey = _grey(models.role[p], models.value[p], light, obj, night)
        greys[p, 0], greys[p, 1] = grey, light
        if parent >= 0:
            add_polygon(layer.coverage, 1, uv, m, weight * (grey - greys[parent, 0]), 0.0)
            continue
        add_polygon(layer.coverage, 0, uv, m, weight, weight * grey)
        for i in range(m):
            u0, u1 = min(u0, uv[i, 0]), max(u1, uv[i, 0])
            v0, v1 = min(v0, uv[i, 1]), max(v1, uv[i, 1])
    return u0, v0, u1, v1


@kernel
def _compose(image, layer, rows, columns, air):
    """Draw the layer over a part of the image and clear it; `rows` and `columns` are (first, last + 1)."""
    acc = layer.coverage
    one, zero = nb.float32(1.0), nb.float32(0.0)
    clear, murk = nb.float32(air.transmission), nb.float32((1.0 - air.transmission) * air.haze)
    first, end = nb.uint64(columns[0]), nb.uint64(columns[1])
    last = nb.uint64(min(columns[1] + 2, acc.shape[2]))
    covers, greys = layer.rows[0], layer.rows[1]
    for i in range(nb.uint64(rows[0]), nb.uint64(rows[1])):
        # Three loops: only the first depends on the pixel before.
        cover, grey = zero, zero
        for j in range(first, end):
            cover += acc[0, i, j]
            grey += acc[1, i, j]
            covers[j], greys[j] = cover, grey
        for j in range(first, end):
            a = covers[j]
            a = one if a > one else zero if a < zero else a
            image[i, j] = image[i, j] * (one - a) + greys[j] * clear + a * murk
        for j in range(first, last):
            acc[0, i, j] = zero
            acc[1, i, j] = zero
