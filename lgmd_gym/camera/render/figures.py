"""Kernels of figures: pedestrians and riders.

A limb is one polygon: its outline, as seen from the lens. That is a third of the faces of a box, round from
every direction, and no face appears or vanishes when the limb turns.
"""

import math

import numpy as np

from lgmd_gym.camera.objects import MODEL_PEDESTRIAN
from lgmd_gym.camera.render.coverage import add_polygon, bounds, clip_and_project, winding
from lgmd_gym.camera.render.figure_builder import DAY_LAMP, REFLECTOR, WHEEL
from lgmd_gym.camera.render.figure_motion import pose_figure
from lgmd_gym.camera.render.jit import inlined_kernel, kernel
from lgmd_gym.camera.render.order import distance
from lgmd_gym.camera.render.solids import compose, grey_of, outside, place_object, to_axes

_RETURN = 12.0  # light that a reflector returns, relative to that of a white surface in the same beam
_ROUND = 0.55  # half the width of the round end of a limb, relative to the limb
_WHEEL_SIDES = 16
_CIRCLE = np.array(
    [
        (math.cos(2.0 * math.pi * (k + 0.5) / _WHEEL_SIDES), math.sin(2.0 * math.pi * (k + 0.5) / _WHEEL_SIDES))
        for k in range(_WHEEL_SIDES)
    ]
)
_SWELL = math.sqrt(2.0 * math.pi / _WHEEL_SIDES / math.sin(2.0 * math.pi / _WHEEL_SIDES))
"""Radius of the polygon with the area of a circle of radius 1."""


@kernel
def draw_figure(image, view, obj, tables, air, layer):
    """Draw a pedestrian or a two-wheeler with its rider over the image; `tables` are `FigureTables`."""
    lens, look, joints = view.lens, view.look, layer.joints
    place_object(lens, look, obj, layer.axes)
    if outside(lens, layer.axes):
        return
    thick = pose_figure(obj, tables, joints)
    figure = obj.model - MODEL_PEDESTRIAN
    _to_camera(lens, obj, layer, tables.counts[figure, 1])
    size = lens.focal * (obj.height - obj.base) / max(distance(lens, obj) - 0.5 * obj.length, 1.0)
    x, y = lens.x - obj.x, lens.y - obj.y
    ahead, left = x * obj.cos + y * obj.sin, y * obj.cos - x * obj.sin
    order = tables.orders[figure, (1 if ahead < 0.0 else 0) + (2 if left < 0.0 else 0)]
    height, width = image.shape
    for i in range(tables.counts[figure, 0]):
        part = tables.parts[figure, order[i]]
        weight = air.opacity
        if part.fine > 0.0:
            weight *= min(1.0, size / part.fine - 1.0)
        if not weight > 0.0:
            continue
        if part.shape == WHEEL:
            u0, v0, u1, v1 = _add_wheel(layer, view, obj, part, thick, weight, air)
        else:
            u0, v0, u1, v1 = _add_limb(layer, view, obj, part, thick, weight, air)
        if u1 > u0:
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
    for j in range(used):
        a, b, c = joints[j, 0], joints[j, 1], joints[j, 2]
        for k in range(3):
            joints[j, k] = axes[0, k] + a * axes[1, k] + b * axes[2, k] + c * axes[3, k]


@inlined_kernel
def _round_light(look, axes, vx, vy, vz, mx, my, mz):
    """Return the mean light on the visible half of a cylinder across the view.

    (vx, vy, vz) is the direction of view, and (mx, my, mz) that of the cylinder, at right angles to it. The
    mean of the sun's light over the visible half, weighted by the apparent width, is that of a sphere's
    phases in a plane.
    """
    if look.direct == 0.0:
        return look.ambient
    front = -(axes[4, 0] * vx + axes[4, 1] * vy + axes[4, 2] * vz)
    along = axes[4, 0] * mx + axes[4, 1] * my + axes[4, 2] * mz
    side = math.sqrt(max(1.0 - front * front - along * along, 0.0))
    angle = math.atan2(side, front)
    return look.ambient + 0.25 * look.direct * ((math.pi - angle) * front + side)


@kernel
def _part_grey(part, light, obj, look, air):
    """Return the grey of a part in `light`, with lamps and reflectors."""
    if part.role == DAY_LAMP:
        return 255.0
    grey = grey_of(part.role, part.value, light * air.light, obj, look, air)
    if part.role == REFLECTOR and look.night > 0.0:
        return min(grey + _RETURN * 255.0 * (air.light - look.night_light), 255.0)
    return grey


@kernel
def _add_limb(layer, view, obj, part, thick, weight, air):
    """Add the outline of a limb to the layer; returns its bounds [px], right < left if it is not in view."""
    lens, joints, corners, axes = view.lens, layer.joints, layer.corners, layer.axes
    a, b = part.a, part.b
    ex, ey, ez = joints[b, 0] - joints[a, 0], joints[b, 1] - joints[a, 1], joints[b, 2] - joints[a, 2]
    vx, vy, vz = joints[a, 0] + 0.5 * ex, joints[a, 1] + 0.5 * ey, joints[a, 2] + 0.5 * ez
    norm = 1.0 / max(math.sqrt(vx * vx + vy * vy + vz * vz), 1e-9)
    vx, vy, vz = norm * vx, norm * vy, norm * vz
    # Across the limb and the view; for a dot, or a limb along the view, across the vertical and the view.
    nx, ny, nz = ey * vz - ez * vy, ez * vx - ex * vz, ex * vy - ey * vx
    norm = math.sqrt(nx * nx + ny * ny + nz * nz)
    if norm < 1e-6:
        nx, ny, nz = axes[3, 2] * vy - axes[3, 1] * vz, axes[3, 0] * vz - axes[3, 2] * vx, axes[3, 1] * vx - axes[3, 0] * vy
        norm = max(math.sqrt(nx * nx + ny * ny + nz * nz), 1e-9)
    nx, ny, nz = nx / norm, ny / norm, nz / norm
    mx, my, mz = vy * nz - vz * ny, vz * nx - vx * nz, vx * ny - vy * nx
    # The radius of an ellipse, `wide` to the left and `deep` at right angles to that, in the direction n.
    left = nx * axes[2, 0] + ny * axes[2, 1] + nz * axes[2, 2]
    left *= left
    first = thick * math.sqrt(part.deep_a * part.deep_a * (1.0 - left) + part.wide_a * part.wide_a * left)
    last = thick * math.sqrt(part.deep_b * part.deep_b * (1.0 - left) + part.wide_b * part.wide_b * left)
    cap = thick * part.cap
    for i in range(8):
        joint, radius, reach = (a, first, -cap) if i < 4 else (b, last, cap)
        inner = i == 1 or i == 2 or i == 5 or i == 6
        across = radius if i < 2 or i > 5 else -radius
        if inner:
            across *= _ROUND
        beyond = reach if inner else 0.0
        corners[i, 0] = joints[joint, 0] + across * nx + beyond * mx
        corners[i, 1] = joints[joint, 1] + across * ny + beyond * my
        corners[i, 2] = joints[joint, 2] + across * nz + beyond * mz
    light = _round_light(view.look, axes, vx, vy, vz, mx, my, mz)
    grey = _part_grey(part, light, obj, view.look, air)
    m = clip_and_project(lens, corners, 8, layer.uv)
    if m < 3:
        return 0.0, 0.0, -1.0, 0.0
    u0, v0, u1, v1 = bounds(layer.uv, m)
    height, width = layer.coverage.shape[1], layer.coverage.shape[2] - 2
    if u1 <= 0.0 or v1 <= 0.0 or u0 >= width or v0 >= height:
        return 0.0, 0.0, -1.0, 0.0
    add_polygon(layer.coverage, np.int64(0), layer.uv, m, weight, weight * grey)
    return u0, v0, u1, v1


@kernel
def _add_wheel(layer, view, obj, part, thick, weight, air):
    """Add a wheel to the layer as a ring; returns its bounds [px], right < left if it is not in view."""
    axes, joints = layer.axes, layer.joints
    x, y, z = joints[part.a, 0], joints[part.a, 1], joints[part.a, 2]
    norm = 1.0 / max(math.sqrt(x * x + y * y + z * z), 1e-9)
    vx, vy, vz = norm * x, norm * y, norm * z
    # Level and across the view: the tyre widens the ring in this direction.
    hx, hy, hz = axes[3, 1] * vz - axes[3, 2] * vy, axes[3, 2] * vx - axes[3, 0] * vz, axes[3, 0] * vy - axes[3, 1] * vx
    norm = 1.0 / max(math.sqrt(hx * hx + hy * hy + hz * hz), 1e-9)
    shown = norm * (hx * axes[1, 0] + hy * axes[1, 1] + hz * axes[1, 2])
    half = thick * part.wide_a * norm * (1.0 if shown >= 0.0 else -1.0)
    light = _round_light(view.look, axes, vx, vy, vz, axes[3, 0], axes[3, 1], axes[3, 2])
    grey = _part_grey(part, light, obj, view.look, air)
    height, width = layer.coverage.shape[1], layer.coverage.shape[2] - 2
    u0, v0, u1, v1, sign = 0.0, 0.0, -1.0, 0.0, 0.0
    for ring in range(2):
        radius = thick * (part.deep_a if ring == 0 else part.hole) * _SWELL
        wider = half if ring == 0 else -half
        if ring == 1 and radius * abs(shown) <= thick * part.wide_a:
            break  # the tyre closes the hole
        for i in range(_WHEEL_SIDES):
            c, s = _CIRCLE[i, 0], _CIRCLE[i, 1]
            layer.corners[i, 0] = x + c * (radius * axes[1, 0] + wider * hx) + s * radius * axes[3, 0]
            layer.corners[i, 1] = y + c * (radius * axes[1, 1] + wider * hy) + s * radius * axes[3, 1]
            layer.corners[i, 2] = z + c * (radius * axes[1, 2] + wider * hz) + s * radius * axes[3, 2]
        m = clip_and_project(view.lens, layer.corners, _WHEEL_SIDES, layer.uv)
        if m < 3:
            break
        if ring == 0:
            u0, v0, u1, v1 = bounds(layer.uv, m)
            if u1 <= 0.0 or v1 <= 0.0 or u0 >= width or v0 >= height:
                return 0.0, 0.0, -1.0, 0.0
            sign = weight if winding(layer.uv, m) > 0.0 else -weight
        else:
            sign *= -(1.0 - part.spokes)
        add_polygon(layer.coverage, np.int64(0), layer.uv, m, sign, sign * grey)
    return u0, v0, u1, v1
