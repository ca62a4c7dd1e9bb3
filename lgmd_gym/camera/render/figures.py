"""Kernels of figures: pedestrians and riders.

A limb is one polygon: its outline, as seen from the lens. That is a third of the faces that a box shows, it
is round from every direction, and no face appears or vanishes when the limb turns.
"""

import math

import numpy as np

from lgmd_gym.camera.objects import MODEL_PEDESTRIAN
from lgmd_gym.camera.render.coverage import add_polygon, bounds, clip_and_project, winding
from lgmd_gym.camera.render.figure_builder import DAY_LAMP, REFLECTOR, WHEEL
from lgmd_gym.camera.render.figure_motion import pose_figure
from lgmd_gym.camera.render.order import distance
from lgmd_gym.camera.render.solids import (
    compose,
    grey_of,
    outside,
    place_corners,
    place_object,
    to_axes,
)
from lgmd_gym.kernels import kernel

_RETURN = 12.0  # light that a reflector returns, relative to that of a white surface in the same beam
_ROUND = 0.55  # half the width of the round end of a limb, relative to the limb
_ANGLES = 2.0 * math.pi / 16 * (np.arange(16) + 0.5)
_CIRCLE = np.stack((np.cos(_ANGLES), np.sin(_ANGLES)), axis=1) * math.sqrt(
    math.pi / 8.0 / math.sin(math.pi / 8.0)
)
"""Corners of the polygon that a wheel is drawn as, which has the area of a circle of radius 1."""


@kernel
def draw_figure(image, view, obj, tables, air, layer):
    """Draw a pedestrian or a two-wheeler with its rider over the image; `tables` are `FigureTables`."""
    lens, figure = view.lens, obj.model - MODEL_PEDESTRIAN
    place_object(lens, view.look, obj, layer.axes)
    if outside(lens, layer.axes):
        return
    thick = pose_figure(obj, tables, layer.joints)
    _to_camera(lens, obj, layer, tables.counts[figure, 1])
    size = lens.focal * (obj.height - obj.base) / max(distance(lens, obj) - 0.5 * obj.length, 1.0)
    x, y = lens.x - obj.x, lens.y - obj.y
    ahead, left = x * obj.cos + y * obj.sin, y * obj.cos - x * obj.sin
    facing = ahead / max(math.sqrt(ahead * ahead + left * left), 1e-6)
    order = tables.orders[figure, (1 if ahead < 0.0 else 0) + (2 if left < 0.0 else 0)]
    height, width = image.shape
    for i in range(tables.counts[figure, 0]):
        part = tables.parts[figure, order[i]]
        weight = air.opacity * min(1.0, part.abeam + part.facing * facing)
        if part.fine > 0.0:
            weight *= min(1.0, size / part.fine - 1.0)
        if not weight > 0.0:
            continue
        if part.shape == WHEEL:
            m = _add_wheel(layer, view, obj, part, thick, weight, air)
        else:
            m = _add_limb(layer, view, obj, part, thick, weight, air)
        if m >= 3:
            u0, v0, u1, v1 = bounds(layer.uv, m)
            rows = (int(max(v0, 0.0)), int(min(math.ceil(v1), height)))
            columns = (int(max(u0, 0.0)), int(min(math.ceil(u1) + 1.0, width)))
            compose(image, layer, rows, columns, air, view)


@kernel
def _to_camera(lens, obj, layer, used):
    """Turn the used joints into camera axes, and the axes of the object into unit vectors."""
    axes, joints = layer.axes, layer.joints
    to_axes(lens, obj.cos, obj.sin, 0.0, axes, np.int64(1))
    to_axes(lens, -obj.sin, obj.cos, 0.0, axes, np.int64(2))
    to_axes(lens, 0.0, 0.0, 1.0, axes, np.int64(3))
    place_corners(joints, used, axes, joints)


@kernel(inline=True)
def _row(table, i):
    """Return row i of a table of vectors."""
    return table[i, 0], table[i, 1], table[i, 2]


@kernel(inline=True)
def _dot(a, b):
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel(inline=True)
def _cross(a, b):
    """Return the vector product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel(inline=True)
def _unit(a):
    """Return the unit vector in the direction of a vector."""
    scale = 1.0 / max(math.sqrt(_dot(a, a)), 1e-9)
    return scale * a[0], scale * a[1], scale * a[2]


@kernel(inline=True)
def _grey_in_sun(part, obj, view, air, axes, way, along):
    """Return the grey of a part as a cylinder: `way` is the direction of view, `along` that of its length.

    The light of the sun is its mean over the visible half, weighted by the apparent width. It depends on the
    angle between sun and view around the cylinder as the light of the moon does on its phase.
    """
    look, sun = view.look, _row(axes, 4)
    light = look.ambient
    if look.direct > 0.0:
        front, end = -_dot(sun, way), _dot(sun, along)
        side = math.sqrt(max(1.0 - front * front - end * end, 0.0))
        light += 0.25 * look.direct * ((math.pi - math.atan2(side, front)) * front + side)
    if part.role == DAY_LAMP:
        return 255.0
    grey = grey_of(part.role, part.value, light * air.light, obj, look, air)
    if part.role == REFLECTOR and look.night > 0.0:
        return min(grey + _RETURN * 255.0 * (air.light - look.night_light), 255.0)
    return grey


@kernel(inline=True)
def _in_frame(layer, m):
    """Return whether the projected polygon may be in the frame; edges left of the frame would cancel."""
    if m < 3:
        return False
    left, top, right, bottom = bounds(layer.uv, m)
    height, width = layer.coverage.shape[1], layer.coverage.shape[2] - 2
    return right > 0.0 and bottom > 0.0 and left < width and top < height


@kernel
def _add_limb(layer, view, obj, part, thick, weight, air):
    """Add the outline of a limb to the layer.

    Returns:
        Number of corners in `layer.uv`; below 3 if none is in view.
    """
    axes, corners = layer.axes, layer.corners
    a, b = _row(layer.joints, part.a), _row(layer.joints, part.b)
    length = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    way = _unit((a[0] + 0.5 * length[0], a[1] + 0.5 * length[1], a[2] + 0.5 * length[2]))
    across = _cross(length, way)
    if _dot(across, across) < 1e-12:
        across = _cross(way, _row(axes, 3))  # a round part, or a limb along the view: level
    across = _unit(across)
    along = _cross(way, across)
    # The radius of an ellipse, `wide` to the left and `deep` at right angles to that, in this direction.
    wide = _dot(across, _row(axes, 2))
    wide *= wide
    deep = 1.0 - wide
    first = thick * math.sqrt(part.deep_a * part.deep_a * deep + part.wide_a * part.wide_a * wide)
    last = thick * math.sqrt(part.deep_b * part.deep_b * deep + part.wide_b * part.wide_b * wide)
    cap = thick * part.cap
    for k in range(3):
        side, tip = first * across[k], a[k] - cap * along[k]
        corners[0, k], corners[1, k] = a[k] + side, tip + _ROUND * side
        corners[2, k], corners[3, k] = tip - _ROUND * side, a[k] - side
        side, tip = last * across[k], b[k] + cap * along[k]
        corners[4, k], corners[5, k] = b[k] - side, tip - _ROUND * side
        corners[6, k], corners[7, k] = tip + _ROUND * side, b[k] + side
    m = clip_and_project(view.lens, corners, 8, layer.uv)
    if not _in_frame(layer, m):
        return 0
    grey = _grey_in_sun(part, obj, view, air, axes, way, along)
    add_polygon(layer.coverage, np.int64(0), layer.uv, m, weight, weight * grey)
    return m


@kernel
def _place_ring(centre, level, radius, wider, layer):
    """Place the corners of a ring: its radius, and the width that the tyre adds on both sides [m]."""
    for i in range(_CIRCLE.shape[0]):
        c, s = _CIRCLE[i, 0], _CIRCLE[i, 1]
        for k in range(3):
            g = radius * layer.axes[1, k] + wider * level[k]
            layer.corners[i, k] = centre[k] + c * g + s * radius * layer.axes[3, k]


@kernel
def _add_wheel(layer, view, obj, part, thick, weight, air):
    """Add a wheel to the layer as a ring; returns as `_add_limb` does, for the outer edge."""
    n, up = _CIRCLE.shape[0], _row(layer.axes, 3)
    centre = _row(layer.joints, part.a)
    way = _unit(centre)
    level = _unit(_cross(up, way))
    shown = _dot(level, _row(layer.axes, 1))
    tyre = thick * part.wide_a
    wider = tyre if shown >= 0.0 else -tyre
    grey = _grey_in_sun(part, obj, view, air, layer.axes, way, up)
    if thick * part.hole * abs(shown) > tyre:
        _place_ring(centre, level, thick * part.hole, -wider, layer)
        m = clip_and_project(view.lens, layer.corners, n, layer.uv)
        if _in_frame(layer, m):
            share = weight * (part.spokes - 1.0)
            share = share if winding(layer.uv, m) > 0.0 else -share
            add_polygon(layer.coverage, np.int64(0), layer.uv, m, share, share * grey)
    _place_ring(centre, level, thick * part.deep_a, wider, layer)
    m = clip_and_project(view.lens, layer.corners, n, layer.uv)
    if not _in_frame(layer, m):
        return 0
    share = weight if winding(layer.uv, m) > 0.0 else -weight
    add_polygon(layer.coverage, np.int64(0), layer.uv, m, share, share * grey)
    return m
