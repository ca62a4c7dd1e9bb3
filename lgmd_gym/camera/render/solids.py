"""Kernels of the solids: cars, trucks, boxes and posts, with exact outlines."""

from __future__ import annotations

import math

import numba as nb

from lgmd_gym.camera.effects import ASPHALT_GREY, PAINT_GREY
from lgmd_gym.camera.pinhole import (
    CAM_COS_PITCH,
    CAM_COS_YAW,
    CAM_FOCAL,
    CAM_SIN_PITCH,
    CAM_SIN_YAW,
    CAM_X,
    CAM_Y,
    CAM_Z,
)
from lgmd_gym.camera.render.coverage import add_polygon, clip_and_project
from lgmd_gym.camera.render.ground import PAINT, SHADOW, add_ground_quad
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.render.models import BODY, LAMP, TAIL
from lgmd_gym.camera.render.order import distance
from lgmd_gym.camera.scene import (
    MODEL_MARK,
    MODEL_POST,
    MODEL_RAIL,
    MODEL_TREE,
    OBJ_BRAKE,
    OBJ_COS,
    OBJ_HEIGHT,
    OBJ_LENGTH,
    OBJ_MODEL,
    OBJ_SHADE,
    OBJ_SIN,
    OBJ_WIDTH,
    OBJ_X,
    OBJ_Y,
)

# Where the light comes from (world x, y, up) and how much of it there is without sun.
_SUN_X, _SUN_Y, _SUN_Z = -0.48, 0.36, 0.80
_AMBIENT, _DIRECT = 0.62, 0.42


@kernel
def _add_footprint(acc, k, cam, obj, x, y, grow, weight, pts, uv, quad):
    """Add an object's rectangle on the ground, centred on (x, y) and grown on all sides, to channel k."""
    c, s = obj[OBJ_COS], obj[OBJ_SIN]
    hx, hy = 0.5 * obj[OBJ_LENGTH] + grow, 0.5 * obj[OBJ_WIDTH] + grow
    for i in range(4):
        lx = -hx if i < 2 else hx
        ly = -hy if i == 0 or i == 3 else hy
        quad[2 * i] = x + lx * c - ly * s
        quad[2 * i + 1] = y + lx * s + ly * c
    add_ground_quad(acc, k, cam, quad, weight, pts, uv)


@kernel
def add_shadow(acc, cam, obj, pts, uv, quad):
    """Add what an object does to the ground: a soft shadow of three nested quads, or a mark."""
    x, y = obj[OBJ_X], obj[OBJ_Y]
    if obj[OBJ_MODEL] == MODEL_MARK and obj[OBJ_SHADE] >= 0.0:
        # Lighter than asphalt is laid on like paint, darker takes light away like a shadow.
        over = (obj[OBJ_SHADE] - ASPHALT_GREY) / (PAINT_GREY - ASPHALT_GREY)
        if over > 0.0:
            _add_footprint(acc, PAINT, cam, obj, x, y, 0.0, min(over, 1.0), pts, uv, quad)
        else:
            dark = 1.0 - obj[OBJ_SHADE] / ASPHALT_GREY
            _add_footprint(acc, SHADOW, cam, obj, x, y, 0.0, dark, pts, uv, quad)
        return
    if obj[OBJ_MODEL] == MODEL_MARK:
        _add_footprint(acc, PAINT, cam, obj, x, y, 0.0, 0.8, pts, uv, quad)
        inset = -min(0.2, 0.25 * min(obj[OBJ_LENGTH], obj[OBJ_WIDTH]))
        _add_footprint(acc, PAINT, cam, obj, x, y, inset, -0.5, pts, uv, quad)
        return
    if obj[OBJ_MODEL] == MODEL_POST or obj[OBJ_MODEL] == MODEL_RAIL:
        return
    lean = -0.12 * obj[OBJ_HEIGHT] / _SUN_Z
    x, y = x + lean * _SUN_X, y + lean * _SUN_Y
    if obj[OBJ_MODEL] == MODEL_TREE:
        away = distance(cam, obj)
        dark = min(0.4, 0.8 - away / 60.0)
        if dark > 0.0:
            _add_footprint(acc, SHADOW, cam, obj, x, y, -0.2 * obj[OBJ_WIDTH], dark, pts, uv, quad)
        return
    for ring in range(3):
        _add_footprint(acc, SHADOW, cam, obj, x, y, 0.16 * ring - 0.08, 0.22, pts, uv, quad)


@kernel
def _to_axes(cam, x, y, z, out, i):
    """Turn a world vector into (depth, right, down)."""
    ahead = x * cam[CAM_COS_YAW] + y * cam[CAM_SIN_YAW]
    out[i, 0] = ahead * cam[CAM_COS_PITCH] + z * cam[CAM_SIN_PITCH]
    out[i, 1] = y * cam[CAM_COS_YAW] - x * cam[CAM_SIN_YAW]
    out[i, 2] = ahead * cam[CAM_SIN_PITCH] - z * cam[CAM_COS_PITCH]


@kernel
def place_object(cam, obj, frame):
    """Write the object's axes in camera axes to `frame`.

    Args:
        cam: `camera_vector(...)`.
        obj: Row of the array of objects.
        frame: Gets its centre on the ground, its length, width and height as vectors, and the
            direction of the sun; float64, shape (5, 3).
    """
    c, s = obj[OBJ_COS], obj[OBJ_SIN]
    dx, dy = obj[OBJ_X] - cam[CAM_X], obj[OBJ_Y] - cam[CAM_Y]
    if obj[OBJ_MODEL] >= MODEL_POST:
        # Posts and trees are flat pictures that turn to the lens.
        away = max(math.sqrt(dx * dx + dy * dy), 1e-6)
        c, s = dx / away, dy / away
    _to_axes(cam, dx, dy, -cam[CAM_Z], frame, 0)
    _to_axes(cam, c * obj[OBJ_LENGTH], s * obj[OBJ_LENGTH], 0.0, frame, 1)
    _to_axes(cam, -s * obj[OBJ_WIDTH], c * obj[OBJ_WIDTH], 0.0, frame, 2)
    _to_axes(cam, 0.0, 0.0, obj[OBJ_HEIGHT], frame, 3)
    _to_axes(cam, _SUN_X, _SUN_Y, _SUN_Z, frame, 4)


@kernel
def _corners(corners, p, n, frame, pts):
    """Place the corners of polygon p in camera axes."""
    for i in range(n):
        a, b, c = corners[p, i, 0], corners[p, i, 1], corners[p, i, 2]
        for k in range(3):
            pts[i, k] = frame[0, k] + a * frame[1, k] + b * frame[2, k] + c * frame[3, k]


@kernel
def _face_light(pts, frame):
    """Light on a face, or a negative number if the lens sees its back."""
    ax, ay, az = pts[1, 0] - pts[0, 0], pts[1, 1] - pts[0, 1], pts[1, 2] - pts[0, 2]
    bx, by, bz = pts[2, 0] - pts[1, 0], pts[2, 1] - pts[1, 1], pts[2, 2] - pts[1, 2]
    # Camera axes are right-handed (depth, right, down), so this points outwards.
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    if nx * pts[0, 0] + ny * pts[0, 1] + nz * pts[0, 2] >= 0.0:
        return -1.0
    norm = math.sqrt(nx * nx + ny * ny + nz * nz)
    return _AMBIENT + _DIRECT * max(0.0, (nx * frame[4, 0] + ny * frame[4, 1] + nz * frame[4, 2]) / norm)


@kernel
def _grey(role, value, light, obj, night):
    """Grey of a polygon; lamps shine by themselves, all else takes the light."""
    if role == TAIL:
        if obj[OBJ_BRAKE] > 0.0:
            return 255.0
        return 170.0 if night else value * light
    if role == LAMP:
        return 255.0 if night else value
    grey = value * obj[OBJ_SHADE] if role == BODY else value
    return min(grey * light, 250.0)


@kernel
def _apparent_height(cam, obj):
    """Height of an object in the frame [px], not less than that of anything nearer than 1 m."""
    away = distance(cam, obj) - 0.5 * obj[OBJ_LENGTH]
    return cam[CAM_FOCAL] * obj[OBJ_HEIGHT] / max(away, 1.0)


@kernel
def draw_object(image, acc, sums, cam, obj, model, air, frame, pts, uv, greys):
    """Draw one object over the image.

    Args:
        image: float32, shape (height, width).
        acc: Accumulator of coverage and of grey times coverage, float32, shape (height, width + 2, 2).
        sums: Scratch, float32, shape (>= 2, >= width).
        cam: `camera_vector(...)`.
        obj: Row of the array of objects.
        model: `models.Model`.
        air: (light on the object, transmission of the air, grey of the air, 1.0 at night, opacity).
        frame: Scratch for the object's axes.
        pts: Scratch for corners in camera axes.
        uv: Scratch for projected corners.
        greys: Scratch for grey and light of each polygon.
    """
    kind = int(obj[OBJ_MODEL])
    place_object(cam, obj, frame)
    size = _apparent_height(cam, obj)
    for solid in range(model.models[kind, 0], model.models[kind, 1]):
        u0, v0, u1, v1 = add_solid(acc, cam, obj, model, solid, size, air, frame, pts, uv, greys)
        height, width = image.shape
        # Also what lies left of the frame: its edges are summed in column 0, and cancel but for rounding.
        if v1 > 0.0 and v0 < height and u0 < width:
            r0, r1 = int(max(v0, 0.0)), int(min(math.ceil(v1), height))
            c0, c1 = int(max(u0, 0.0)), int(max(min(math.ceil(u1) + 1.0, width), 0.0))
            _compose(image, acc, sums, r0, r1, c0, c1, air[1], air[2])


@kernel
def add_solid(acc, cam, obj, model, solid, size, air, frame, pts, uv, greys):
    """Add the faces and details of one solid to the accumulator.

    Returns:
        The bounds of its faces (u0, v0, u1, v1) [px].
    """
    night = air[3] > 0.0
    u0, v0, u1, v1 = 1e9, 1e9, -1e9, -1e9
    for p in range(model.solids[solid, 0], model.solids[solid, 1]):
        n, parent = model.corners_used[p], model.parent[p]
        greys[p, 1] = 0.0
        weight = air[4]
        if parent >= 0:
            # Details fade in as they grow, so that none pops up.
            weight *= min(1.0, size / model.fine[p] - 1.0)
            if greys[parent, 1] == 0.0 or weight <= 0.0:
                continue
        _corners(model.corners, p, n, frame, pts)
        light = greys[parent, 1] if parent >= 0 else _face_light(pts, frame) * air[0]
        if light <= 0.0:
            continue
        m = clip_and_project(cam, pts, n, uv)
        if m < 3:
            continue
        grey = _grey(model.role[p], model.value[p], light, obj, night)
        greys[p, 0], greys[p, 1] = grey, light
        if parent >= 0:
            add_polygon(acc, 1, uv, m, weight * (grey - greys[parent, 0]), 0.0)
            continue
        add_polygon(acc, 0, uv, m, weight, weight * grey)
        for i in range(m):
            u0, u1 = min(u0, uv[i, 0]), max(u1, uv[i, 0])
            v0, v1 = min(v0, uv[i, 1]), max(v1, uv[i, 1])
    return u0, v0, u1, v1


@kernel
def _compose(image, acc, sums, r0, r1, c0, c1, clear, haze):
    """Lay accumulated coverage and grey over a part of the image, and clear them."""
    one, zero = nb.float32(1.0), nb.float32(0.0)
    clear, murk = nb.float32(clear), nb.float32((1.0 - clear) * haze)
    last = nb.uint64(min(c1 + 2, acc.shape[1]))
    first, end = nb.uint64(c0), nb.uint64(c1)
    covers, greys = sums[0], sums[1]
    for i in range(nb.uint64(r0), nb.uint64(r1)):
        # Three loops, for only the first has to go step by step.
        cover, grey = zero, zero
        for j in range(first, end):
            cover += acc[i, j, 0]
            grey += acc[i, j, 1]
            covers[j], greys[j] = cover, grey
        for j in range(first, end):
            a = covers[j]
            a = one if a > one else zero if a < zero else a
            image[i, j] = image[i, j] * (one - a) + greys[j] * clear + a * murk
        for j in range(first, last):
            acc[i, j, 0] = zero
            acc[i, j, 1] = zero
