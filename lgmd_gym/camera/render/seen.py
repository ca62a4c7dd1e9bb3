# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Which objects the lenses of one eye see, in their order from far to near.

Lenses at one place, such as the fields of one camera module, form an *eye*: what hides what, and which faces
are turned towards it, does not depend on where they look.
"""

import math
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.objects import MAX_DRAWN, MODEL_MARK, OBJECT, is_picture, light_of_code
from lgmd_gym.camera.pose import half_frame, side_tangent
from lgmd_gym.camera.roadside import PLANT_RANGE
from lgmd_gym.kernels import kernel

MAX_EYE = 62
"""Maximum number of lenses of an eye, which are the bits of an integer."""
_MARGIN_M = 0.2  # of the height of an object
_MARGIN = 1.1  # factor on the height

FRUSTUM = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("x", "y", "z", "cos_yaw", "sin_yaw", "tangent", "secant"),
            *("near", "far", "slope", "drop"),
        )
    ]
)
"""What a lens sees, as the tests of objects read it: position [m] and direction of the lens; tangent of the
largest angle to its side, see `side_tangent`, and the secant; least and greatest distance ahead of the ground
in the frame [m], infinite above the horizon; the plane through the lens and the lower side of the frame."""

MAX_SEEN = 2 * MAX_DRAWN
"""Maximum number of objects that the lenses of an eye see."""
MAX_CASTERS = 8 * MAX_DRAWN
"""Maximum number of objects around an eye whose cast shadows are drawn; those of the least x are kept."""

CASTER = np.dtype([("index", np.int64), *((name, np.float64) for name in ("x", "y", "radius", "weight"))])
"""An object with a cast shadow: its index in `Seen.objects`, or in the roadside plus `MAX_SEEN`; centre of a
circle around the object and its shadow relative to the eye, and its radius [m]; weight of the shadow."""


class Seen(NamedTuple):
    """What the lenses of an eye see; arrays of shape (1024, …) have a row per object."""

    frusta: np.ndarray  # `FRUSTUM` records of the lenses, shape (62,)
    objects: np.ndarray  # `OBJECT` records: vehicles and obstacles, then the roadside
    lenses: np.ndarray  # lenses that may see the object, as bits, int64
    order: np.ndarray  # indices of the seen objects in drawing order, int64
    distances: np.ndarray  # of their centres from the eye, float64 [m]
    # middle and half of an object's azimuths [quarter turns] and its least and greatest distance [m],
    # float64, shape (1024, 4)
    extents: np.ndarray
    # first of `polygons`, and their number or -1 if they are not known yet, int64, shape (1024, 2)
    faces: np.ndarray
    polygons: np.ndarray  # polygons of the objects that are turned towards the eye, int64
    lights: np.ndarray  # light on them, without headlights, float64
    casters: np.ndarray  # `CASTER` records, shape (4096,), see `shadows.find_casters`
    # numbers of objects, of those in `order`, of `polygons` in use, and of casters, int64, shape (4,)
    counts: np.ndarray


def make_seen(polygons: int) -> Seen:
    """Return arrays for models with at most this many polygons each."""
    return Seen(
        frusta=np.zeros(MAX_EYE, FRUSTUM),
        objects=np.zeros(MAX_SEEN, OBJECT),
        lenses=np.zeros(MAX_SEEN, np.int64),
        order=np.zeros(MAX_SEEN, np.int64),
        distances=np.zeros(MAX_SEEN),
        extents=np.zeros((MAX_SEEN, 4)),
        faces=np.zeros((MAX_SEEN, 2), np.int64),
        polygons=np.zeros(MAX_SEEN * polygons, np.int64),
        lights=np.zeros(MAX_SEEN * polygons),
        casters=np.zeros(MAX_CASTERS, CASTER),
        counts=np.zeros(4, np.int64),
    )


@kernel
def aim_frustum(lens, frustum):
    """Write the `FRUSTUM` of a lens; the frame is the upright rectangle around the rolled one."""
    frustum.x, frustum.y, frustum.z = lens.x, lens.y, lens.z
    frustum.cos_yaw, frustum.sin_yaw = lens.cos_yaw, lens.sin_yaw
    tan = side_tangent(lens)
    frustum.tangent, frustum.secant = tan, math.sqrt(1.0 + tan * tan)
    t = half_frame(lens)[1] / lens.focal
    upper, lower = lens.sin_pitch + t * lens.cos_pitch, t * lens.cos_pitch - lens.sin_pitch
    drop = lens.cos_pitch + t * lens.sin_pitch
    frustum.near = lens.z * drop / lower if lower > 1e-9 else math.inf
    frustum.far = lens.z * (lens.cos_pitch - t * lens.sin_pitch) / -upper if upper < -1e-9 else math.inf
    frustum.slope, frustum.drop = lower, drop


@kernel
def outside_band(frustum, ahead, radius):
    """Return whether a circle on the ground, its centre at a distance ahead [m], is outside the frame."""
    return ahead + radius < frustum.near or ahead - radius > frustum.far


@kernel
def beside(frustum, ahead, across, radius):
    """Return whether a circle around a point ahead and across of the lens [m] is beside the view."""
    tan = frustum.tangent
    return tan >= 0.0 and (ahead < -radius or abs(across) > max(ahead, 0.0) * tan + radius * frustum.secant)


@kernel
def outside_view(frustum, ahead, across, radius):
    """Return whether a circle on the ground is outside the view; arguments as of `beside`."""
    return outside_band(frustum, ahead, radius) or beside(frustum, ahead, across, radius)


@kernel
def _reach_of(obj):
    """Return the radius of an object on the ground, with its soft shadow [m]."""
    return 0.5 * math.sqrt(obj.length**2 + obj.width**2) + 0.4 + 0.1 * obj.height


@kernel
def above_or_below(frustum, ahead, radius, height):
    """Return whether an object on the ground is entirely above or below the frame, with its soft shadow.

    Args:
        frustum: `FRUSTUM` record.
        ahead: Distance of its centre ahead of the lens [m].
        radius: See `_reach_of`.
        height: Height of its top [m].
    """
    if ahead - radius > frustum.far:
        return True
    # The plane through the lens and the lower side of the frame, at the highest and farthest point.
    top = _MARGIN * height + _MARGIN_M
    farthest = ahead + radius if frustum.slope > 0.0 else ahead - radius
    return (frustum.z - top) * frustum.drop - frustum.slope * farthest > 0.0


@kernel
def encloses(obj, dx, dy, height):
    """Return whether a lens at (-dx, -dy) from the centre of an object and at a height is inside it [m]."""
    if obj.model == MODEL_MARK:
        return False
    lx = -dx * obj.cos - dy * obj.sin
    ly = dx * obj.sin - dy * obj.cos
    inside = abs(lx) < 0.5 * obj.length and abs(ly) < 0.5 * obj.width
    return inside and obj.base <= height < obj.height


@kernel
def seen_by(frusta, n, obj, ahead_only):
    """Return by which of the first n lenses of an eye an object may be seen, as bits.

    `ahead_only` also leaves out what is entirely above or below a frame.
    """
    dx, dy = obj.x - frusta[0].x, obj.y - frusta[0].y
    if dx * dx + dy * dy > obj.range**2 or encloses(obj, dx, dy, frusta[0].z):
        return 0
    radius, bits = _reach_of(obj), 0
    for k in range(n):
        f = frusta[k]
        ahead, across = dx * f.cos_yaw + dy * f.sin_yaw, dy * f.cos_yaw - dx * f.sin_yaw
        if beside(f, ahead, across, radius):
            continue
        if ahead_only and above_or_below(f, ahead, radius, obj.height):
            continue
        bits |= 1 << k
    return bits


@kernel
def distance(eye, obj):
    """Return the distance of an object's centre from an eye, on the ground [m]."""
    dx, dy = obj.x - eye.x, obj.y - eye.y
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


class Footprint(NamedTuple):
    """A rectangle on the ground: centre, heading, size [m]."""

    x: float
    y: float
    cos: float
    sin: float
    length: float
    width: float


@kernel
def _footprint(eye, obj, away):
    """Return the rectangle that an object covers; that of a flat picture is a line across the view."""
    if not is_picture(obj.model):
        return Footprint(x=obj.x, y=obj.y, cos=obj.cos, sin=obj.sin, length=obj.length, width=obj.width)
    scale = 1.0 / max(away, 1e-6)
    cos, sin = scale * (obj.x - eye.x), scale * (obj.y - eye.y)
    return Footprint(x=obj.x, y=obj.y, cos=cos, sin=sin, length=0.0, width=obj.width)


@kernel
def _sides_of(a, b, px, py):
    """Return whether planes along sides of box a separate it from box b.

    Returns whether one of them has the point (px, py) on a's side, and whether one has it on b's side.
    """
    dx, dy = b.x - a.x, b.y - a.y
    bx, by = dx * a.cos + dy * a.sin, dy * a.cos - dx * a.sin
    cos, sin = abs(a.cos * b.cos + a.sin * b.sin), abs(b.sin * a.cos - b.cos * a.sin)
    half_x = 0.5 * (cos * b.length + sin * b.width)
    half_y = 0.5 * (sin * b.length + cos * b.width)
    gap_x, gap_y = abs(bx) - half_x - 0.5 * a.length, abs(by) - half_y - 0.5 * a.width
    ex, ey = px - a.x, py - a.y
    lx, ly = ex * a.cos + ey * a.sin, ey * a.cos - ex * a.sin
    beyond_x = (lx if bx > 0.0 else -lx) > 0.5 * a.length
    beyond_y = (ly if by > 0.0 else -ly) > 0.5 * a.width
    apart_x, apart_y = gap_x >= 0.0, gap_y >= 0.0
    on_a = (apart_x and not beyond_x) or (apart_y and not beyond_y)
    return on_a, (apart_x and beyond_x) or (apart_y and beyond_y)


@kernel
def _hides(a, b, eye, away_a, away_b):
    """Return whether object a must be drawn after object b.

    It must if a plane between them has the lens on a's side. If another one has it on b's side, neither hides
    the other. Of objects without a plane between them, the nearer one is drawn later.
    """
    if is_picture(a.model) and is_picture(b.model):
        return away_a < away_b
    box_a, box_b = _footprint(eye, a, away_a), _footprint(eye, b, away_b)
    on_a, on_b = _sides_of(box_a, box_b, eye.x, eye.y)
    also_b, also_a = _sides_of(box_b, box_a, eye.x, eye.y)
    on_a, on_b = on_a or also_a, on_b or also_b
    if a.base > 0.0 and a.base >= b.height:
        above = eye.z > a.base
        on_a, on_b = on_a or above, on_b or not above
    elif b.base > 0.0 and b.base >= a.height:
        below = eye.z < b.base
        on_a, on_b = on_a or below, on_b or not below
    return away_a < away_b if not (on_a or on_b) else not on_b


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
def _write_extent(eye, focal, obj, away, extent):
    """Write the middle and the half of an object's azimuths, and bounds of its distance."""
    box = _footprint(eye, obj, away)
    dx, dy = box.x - eye.x, box.y - eye.y
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
    extent[0], extent[1] = centre + 0.5 * (low + high), 0.5 * (high - low) + 0.5 / focal


@kernel
def _meets_view(one, other):
    """Return whether the azimuths of two extents overlap, and the first is not entirely beyond the other."""
    if one[2] > other[3]:
        return False
    apart = abs(one[0] - other[0])  # below 8, because middles are from -2 to 6
    return min(min(apart, abs(apart - 4.0)), 8.0 - apart) < one[1] + other[1]


@kernel
def _farther(eye, objects, order, first, n, at, distances, extents):
    """Return the place, from `first` on, of an object to be drawn before that at place `at`; -1 if none."""
    i = order[at]
    for k in range(first, n):
        j = order[k]
        if extents[j, 3] < extents[i, 2]:
            break  # this object and the next ones, which reach less far, are nearer
        if (
            k != at
            and _meets_view(extents[i], extents[j])
            and _hides(objects[i], objects[j], eye, distances[i], distances[j])
        ):
            return k
    return -1


@kernel
def _farthest(eye, objects, order, first, n, distances, extents):
    """Return the place, from `first` on, of an object that hides no other one, and whether there is one.

    Otherwise it is one of some objects that hide each other in turn, found by Brent's algorithm.
    """
    at, passed, steps, limit = first, order[first], 0, 1
    while True:
        behind = _farther(eye, objects, order, first, n, at, distances, extents)
        if behind < 0:
            return at, True
        at = behind
        if order[at] == passed:
            return at, False
        steps += 1
        if steps == limit:
            passed, steps, limit = order[at], 0, 2 * limit


@kernel
def _correct_order(eye, objects, order, n, distances, extents):
    """Move objects that are drawn too early behind those they hide; the others stay in order.

    Returns whether every object is drawn before those that hide it. Only objects with common azimuths hide
    each other, so that this order exists unless some objects hide each other in turn.
    """
    exists = True
    for first in range(n - 1):
        at, found = _farthest(eye, objects, order, first, n, distances, extents)
        exists &= found
        moved = order[at]
        for k in range(at, first, -1):
            order[k] = order[k - 1]
        order[first] = moved
    return exists


@kernel
def order_objects(eye, focal, lenses, seen):
    """Sort the objects that some lenses see from far to near; marks, which lie flat, come last.

    Args:
        eye: Record with the position x, y, z of the lenses [m].
        focal: Least focal length of the lenses [px].
        lenses: The lenses, as bits.
        seen: `Seen`, of which the first `counts[0]` objects and their lenses are read; the order is written.

    Returns:
        Whether every object comes before those that hide it; objects may hide each other in turn.
    """
    objects, order, distances, extents, n = seen.objects, seen.order, seen.distances, seen.extents, 0
    # From the end: the roadside comes last, sorted by x, so that driving along x meets the far ones first.
    for i in range(seen.counts[0] - 1, -1, -1):
        if objects[i].model == MODEL_MARK or seen.lenses[i] & lenses == 0:
            continue
        distances[i] = distance(eye, objects[i])
        _write_extent(eye, focal, objects[i], distances[i], extents[i])
        k, reach = n, extents[i, 3]
        while k > 0 and extents[order[k - 1], 3] < reach:
            order[k] = order[k - 1]
            k -= 1
        order[k] = i
        n += 1
    exists = _correct_order(eye, objects, order, n, distances, extents)
    for i in range(seen.counts[0] - 1, -1, -1):
        if objects[i].model == MODEL_MARK and seen.lenses[i] & lenses != 0:
            order[n] = i
            n += 1
    seen.counts[1] = n
    return exists


@kernel
def _append_roadside(frusta, n, roadside, look, lamps, seen, count):
    """Append the roadside that a lens of an eye may see to the objects; returns the new count.

    At night, objects with a lamp above or below the frame are kept: their halos may be in it. `lamps` is that
    of `Models`.
    """
    x, y, objects = frusta[0].x, frusta[0].y, seen.objects
    end, low = roadside.shape[0], first_from(roadside, x - PLANT_RANGE)
    while low < end and roadside[low].x < x + PLANT_RANGE and count < objects.shape[0]:
        dx, dy = roadside[low].x - x, roadside[low].y - y
        if dx * dx + dy * dy < PLANT_RANGE * PLANT_RANGE:
            lit = look.night > 0.0 and lamps[roadside[low].model, 1] != 0.0
            bits = seen_by(frusta, n, roadside[low], not lit)
            if bits != 0:
                objects[count] = roadside[low]
                if objects[count].model != MODEL_MARK:
                    objects[count].shade = light_of_code(objects[count].shade, look.linear)
                seen.lenses[count] = bits
                count += 1
        low += 1
    return count


@kernel
def see(n, focal, roadside, look, lamps, vehicles, seen):
    """Find what the lenses of an eye see, from far to near; returns whether this order is that of each lens.

    Args:
        n: Number of lenses in `seen.frusta`, 1 to `MAX_EYE`.
        focal: Least focal length of the lenses [px].
        roadside: `OBJECT` records sorted by x.
        look: `LOOK` record.
        lamps: That of `Models`.
        vehicles: Number of the objects in `seen.objects`, to which the roadside is appended.
        seen: `Seen` to write.
    """
    frusta = seen.frusta
    for i in range(vehicles):
        seen.lenses[i] = seen_by(frusta, n, seen.objects[i], False)
    count = _append_roadside(frusta, n, roadside, look, lamps, seen, vehicles)
    seen.faces[:count, 1] = -1
    seen.counts[0], seen.counts[2] = count, 0
    return order_objects(frusta[0], focal, (1 << n) - 1, seen)
