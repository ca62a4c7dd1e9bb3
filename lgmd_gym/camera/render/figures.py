# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Pedestrians and riders: poses of their joints, limbs and wheels.

A limb is one polygon: its outline, as seen from the lens. That is a third of the faces that a box shows, it
is round from every direction, and no face appears or vanishes when the limb turns.
"""

import math

import numpy as np

from lgmd_gym.camera.objects import MODEL_BICYCLE, MODEL_PEDESTRIAN
from lgmd_gym.camera.render.coverage import add_polygon, bounds, clip_and_project, winding
from lgmd_gym.camera.render.models.builder import (
    ANKLE,
    ARM,
    CRANK,
    DAY_LAMP,
    ELBOW,
    FRONT_AXLE,
    HAND,
    HIP,
    KNEE,
    LEG,
    PEDAL,
    REAR_AXLE,
    REFLECTOR,
    SHOULDER,
    SPOKE,
    TOE,
    WHEEL,
)
from lgmd_gym.camera.render.seen import distance
from lgmd_gym.camera.render.solids import (
    compose,
    grey_of,
    outside,
    place_object,
    place_point,
    to_axes,
)
from lgmd_gym.kernels import kernel

STEP = 0.43
"""Length of a step as a share of a pedestrian's height; adults walk with 0.41 to 0.45."""
DEVELOPMENT = 4.6
"""Distance per turn of a bicycle's crank [m]: 44 and 20 teeth, 28 inches; 54 turns a minute at 15 km/h."""
_FULL_STEP = 0.8  # speed from which a pedestrian takes whole steps [m/s]
_LEG, _BONE = 0.84, 0.4225  # height of the hip above the ankle, length of a thigh or shank of an adult [m]
_RIDER_BONE = 0.43  # the same of a cyclist
_CRANK, _SPOKE = 0.17, 0.2  # distance of the pedals and reflectors from their axles [m]


@kernel
def pose_figure(obj, tables, joints):
    """Write the joints of a figure (forward, left, up) from the centre of its underside.

    Args:
        obj: `OBJECT` record of a figure.
        tables: `FigureTables`.
        joints: Output: joints, float64, shape (56, 3) [m].

    Returns:
        Factor of the radii of the parts.
    """
    k = obj.model - MODEL_PEDESTRIAN
    tall = (obj.height - obj.base) / tables.sizes[k, 2]
    along, across = obj.length / tables.sizes[k, 0], obj.width / tables.sizes[k, 1]
    thick = min(along, across, tall)
    if k == 0:
        along = min(along, tall)  # the length of a pedestrian is that of the steps
    used = tables.counts[k, 1]
    for j in range(used):
        joints[j, 0] = along * tables.joints[k, j, 0]
        joints[j, 1] = across * tables.joints[k, j, 1]
        joints[j, 2] = tall * tables.joints[k, j, 2]
    if k == 0:
        _walk(obj, tall, joints, used)
    elif obj.model == MODEL_BICYCLE:
        _pedal(obj.travelled, along, tall, joints)
    return thick


@kernel
def _walk(obj, tall, joints, used):
    """Swing legs and arms with the distance walked; a pedestrian who stands has straight legs."""
    size = obj.height - obj.base
    phase = math.pi * obj.travelled / max(STEP * size, 1e-3)
    amount = min(1.0, abs(obj.speed) / _FULL_STEP)
    # With the foot, the leg reaches as far ahead and behind as the length allows.
    ahead = max(min(0.5 * obj.length - 0.165 * tall, 0.22 * size), 0.0)
    behind = max(min(0.5 * obj.length - 0.06 * tall, 0.22 * size), 0.0)
    swing = 0.5 * amount * (ahead + behind) * math.sin(phase)
    sunk = tall * _LEG - math.sqrt(max((tall * _LEG) ** 2 - swing * swing, 0.0))
    for j in range(SHOULDER, used):
        joints[j, 2] -= sunk
    for i in range(2):
        way = 1.0 - 2.0 * i
        ankle = LEG * i + ANKLE
        s, c = way * math.sin(phase), way * math.cos(phase)
        lift = max(-s, 0.0)  # of the heel, behind the body
        raised = max(s, 0.0)  # of the toes, ahead of it
        joints[LEG * i + HIP, 2] -= sunk
        joints[ankle, 0] = amount * (0.5 * (ahead + behind) * s + 0.5 * (ahead - behind) * s * s)
        joints[ankle, 2] += amount * tall * (0.08 * lift * lift + 0.07 * max(c, 0.0) ** 2)
        _bend(joints, LEG * i, _BONE * tall)
        turn = -0.29 + amount * (0.3 * raised * raised - 0.9 * lift * lift)
        toe, foot = LEG * i + TOE, 0.157 * tall
        joints[toe, 0] = joints[ankle, 0] + foot * math.cos(turn)
        joints[toe, 2] = max(joints[ankle, 2] + foot * math.sin(turn), 0.035 * tall)
        _swing_arm(joints, SHOULDER + ARM * i, -0.36 * amount * s * min(1.0, 3.0 * obj.length / size), tall)


@kernel
def _swing_arm(joints, shoulder, turn, tall):
    """Turn an arm forwards, with the elbow bent a little more [rad]."""
    elbow, hand = shoulder + ELBOW - SHOULDER, shoulder + HAND - SHOULDER
    bent = turn + 0.12 + 0.5 * max(turn, 0.0)
    joints[elbow, 0] = joints[shoulder, 0] + 0.3 * tall * math.sin(turn)
    joints[elbow, 2] = joints[shoulder, 2] - 0.3 * tall * math.cos(turn)
    joints[hand, 0] = joints[elbow, 0] + 0.26 * tall * math.sin(bent)
    joints[hand, 2] = joints[elbow, 2] - 0.26 * tall * math.cos(bent)


@kernel
def _bend(joints, leg, bone):
    """Place the knee of a leg ahead of the line from hip to ankle, with bones of equal length [m]."""
    hip, knee, ankle = leg + HIP, leg + KNEE, leg + ANKLE
    x, z = joints[ankle, 0] - joints[hip, 0], joints[ankle, 2] - joints[hip, 2]
    square = max(x * x + z * z, 1e-12)
    ahead = math.sqrt(max(bone * bone / square - 0.25, 0.0))
    joints[knee, 0] = joints[hip, 0] + 0.5 * x - ahead * z
    joints[knee, 2] = joints[hip, 2] + 0.5 * z + ahead * x


@kernel
def _pedal(travelled, along, tall, joints):
    """Turn the crank with the rider's legs, and the reflectors of the wheels."""
    turn = 2.0 * math.pi * travelled / DEVELOPMENT
    for i in range(2):
        way = 1.0 - 2.0 * i
        pedal, leg = PEDAL + i, LEG * i
        joints[pedal, 0] = joints[CRANK, 0] + along * _CRANK * way * math.cos(turn)
        joints[pedal, 2] = joints[CRANK, 2] - tall * _CRANK * way * math.sin(turn)
        joints[leg + ANKLE, 0] = joints[pedal, 0] - 0.06 * along
        joints[leg + ANKLE, 2] = joints[pedal, 2] + 0.1 * tall
        joints[leg + TOE, 0] = joints[pedal, 0] + 0.08 * along
        joints[leg + TOE, 2] = joints[pedal, 2] + 0.04 * tall
        _bend(joints, leg, _RIDER_BONE * tall)
    for i in range(4):
        axle = REAR_AXLE if i < 2 else FRONT_AXLE
        angle = travelled / max(joints[axle, 2], 1e-3) + math.pi * i
        joints[SPOKE + i, 0] = joints[axle, 0] + along * _SPOKE * math.sin(angle)
        joints[SPOKE + i, 2] = joints[axle, 2] + tall * _SPOKE * math.cos(angle)


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
    for j in range(used):
        x, y, z = _row(joints, j)
        for k in range(3):
            joints[j, k] = place_point(axes, k, x, y, z)


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
        corners[k, 0], corners[k, 1] = a[k] + side, tip + _ROUND * side
        corners[k, 2], corners[k, 3] = tip - _ROUND * side, a[k] - side
        side, tip = last * across[k], b[k] + cap * along[k]
        corners[k, 4], corners[k, 5] = b[k] - side, tip - _ROUND * side
        corners[k, 6], corners[k, 7] = tip + _ROUND * side, b[k] + side
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
            layer.corners[k, i] = centre[k] + c * g + s * radius * layer.axes[3, k]


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
