# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Soft shadows below objects, marks on the ground, and shadows that the sun casts.

The shadow of a box is the convex hull of its outline at two heights, each shifted away from the sun. That of
a tree's crown is an ellipse, drawn out along the same direction.
"""

import math

import numpy as np

from lgmd_gym.camera.effects import ASPHALT_GREY, PAINT_GREY
from lgmd_gym.camera.objects import (
    MODEL_BARRIER,
    MODEL_BOX,
    MODEL_DECK,
    MODEL_MARK,
    MODEL_PEDESTRIAN,
    MODEL_POST,
    MODEL_RAIL,
    MODEL_TREE,
    behind,
    is_figure,
    light_of_code,
)
from lgmd_gym.camera.render.ground import CAST, PAINT, RECTANGLE, SHADOW, add_ground_polygon, add_outline
from lgmd_gym.camera.render.seen import MAX_SEEN, distance, first_from, outside_band, outside_view
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.doubles import load_doubles, madd_doubles, splat_double

# Legs and wheels keep less of the sky's light from the road than a body close above it.
_FIGURE_SPREAD, _FIGURE_SHARE = 0.3, 0.6


@kernel
def _add_footprint(layer, k, lens, obj, centre, grow, weight):
    """Add an object's rectangle on the ground, around `centre` and grown on all sides, to channel k."""
    hx, hy = 0.5 * obj.length + grow, 0.5 * obj.width + grow
    along, side = load_doubles(RECTANGLE, 0), load_doubles(RECTANGLE, RECTANGLE.shape[1])
    x = madd_doubles(side, splat_double(-hy * obj.sin), splat_double(centre[0] - lens.x))
    y = madd_doubles(side, splat_double(hy * obj.cos), splat_double(centre[1] - lens.y))
    x = madd_doubles(along, splat_double(hx * obj.cos), x)
    y = madd_doubles(along, splat_double(hx * obj.sin), y)
    add_ground_polygon(layer, k, lens, x, y, 4, weight)


@kernel
def _add_mark(layer, lens, obj, look):
    """Add a ground mark: filled if it has a shade, else a painted outline."""
    centre = (obj.x, obj.y)
    if obj.shade >= 0.0:
        # A shade lighter than asphalt is added like paint; a darker one removes light like a shadow.
        paint = (obj.shade - ASPHALT_GREY) / (PAINT_GREY - ASPHALT_GREY)
        if paint > 0.0:
            _add_footprint(layer, PAINT, lens, obj, centre, 0.0, min(paint, 1.0))
        else:
            left = light_of_code(obj.shade, look.linear) / light_of_code(ASPHALT_GREY, look.linear)
            _add_footprint(layer, SHADOW, lens, obj, centre, 0.0, 1.0 - left)
        return
    _add_footprint(layer, PAINT, lens, obj, centre, 0.0, 0.8)
    inset = -min(0.2, 0.25 * min(obj.length, obj.width))
    _add_footprint(layer, PAINT, lens, obj, centre, inset, -0.5)


@kernel
def add_shadow(layer, lens, obj, look):
    """Add the mark of an object, or the soft shadow below it, to the ground layer."""
    if obj.model == MODEL_MARK:
        _add_mark(layer, lens, obj, look)
        return
    if obj.model == MODEL_POST or obj.model == MODEL_RAIL:
        return
    # A bridge keeps the light of the sky from the road below it, thin things overhead do not.
    if obj.base > 0.0 and obj.model != MODEL_DECK:
        return
    lean = look.under_lean * obj.height
    centre = (obj.x + lean * look.sun_x, obj.y + lean * look.sun_y)
    ahead = (centre[0] - lens.x) * lens.cos_yaw + (centre[1] - lens.y) * lens.sin_yaw
    widest = max(look.under_first, look.under_first + look.under_step * look.under_rings, 0.0)
    if outside_band(layer.frustum, ahead, 0.5 * (obj.length + obj.width) + 1.5 * widest):
        return
    if obj.model == MODEL_TREE:
        dark = min(0.4, 0.8 - distance(lens, obj) / 60.0)
        if dark > 0.0:
            _add_footprint(layer, SHADOW, lens, obj, centre, -0.2 * obj.width, dark)
        return
    # Nested rectangles: the light falls off from the outer one to the inner one.
    spread = look.under_box if obj.model == MODEL_BOX or obj.model == MODEL_BARRIER else 1.0
    dark = look.under_body
    if is_figure(obj.model):
        spread, dark = _FIGURE_SPREAD, _FIGURE_SHARE * look.under_body
    inmost = -0.5 * min(obj.length, obj.width)
    for ring in range(int(look.under_rings)):
        grow = max(spread * (look.under_first + look.under_step * ring), inmost)
        _add_footprint(layer, SHADOW, lens, obj, centre, grow, dark)


_FADE_START, _FADE_END = 100.0, 150.0  # shadows fade out between these distances from the lens [m]
_CROWN = np.array([(math.cos(0.25 * math.pi * k), math.sin(0.25 * math.pi * k)) for k in range(8)])
"""Corners of the octagon that a tree's crown is drawn as."""
_FIGURE_BOXES = np.array(
    [
        [(0.22, 0.22, 0.0, 0.52, 1.0), (0.2, 0.45, 0.5, 0.97, 1.0)],
        [(0.5, 0.06, 0.0, 0.4, 0.6), (0.17, 0.4, 0.2, 1.0, 1.0)],
        [(0.48, 0.2, 0.0, 0.55, 1.0), (0.2, 0.4, 0.5, 1.0, 1.0)],
    ]
)
"""The shadow of a figure is that of two boxes, legs or wheels, then body: half of length and width, lower and
upper end, as shares of length, width and height of the figure, and weight."""
_MOST_SHIFT = 8.0  # length of a shadow per height; at lower elevations of the sun, shadows end there


@kernel
def find_casters(eye, look, vehicles, roadside, seen):
    """Find the objects within 150 m of an eye, in all directions, that cast a shadow; write them to `seen`.

    Marks cast none. Boxes and barriers have their soft shadow only.
    """
    count, out = 0, seen.casters
    if look.cast > 0.0:
        away = _shift_per_metre(look)
        for i in range(vehicles):
            count += _note_caster(eye, seen.objects[i], i, away, out, count)
        n, low = roadside.shape[0], first_from(roadside, eye.x - _FADE_END)
        while low < n and roadside[low].x < eye.x + _FADE_END and count < out.shape[0]:
            count += _note_caster(eye, roadside[low], MAX_SEEN + low, away, out, count)
            low += 1
    seen.counts[3] = count


@kernel
def _shift_per_metre(look):
    """Return the shift of a point's shadow per metre of its height [m]."""
    stretch = min(1.0 / look.sun_z, _MOST_SHIFT)
    return -look.sun_x * stretch, -look.sun_y * stretch


@kernel
def _note_caster(eye, obj, index, away, casters, count):
    """Write an object with a cast shadow to row `count` of `casters`; returns the number written, 0 or 1."""
    if obj.model == MODEL_MARK or obj.model == MODEL_BOX or obj.model == MODEL_BARRIER:
        return 0
    dx, dy = obj.x - eye.x, obj.y - eye.y
    distance = math.sqrt(dx * dx + dy * dy)
    if distance > _FADE_END:
        return 0
    # A circle around the object and its shadow.
    shift = obj.height * math.sqrt(away[0] * away[0] + away[1] * away[1])
    caster = casters[count]
    caster.index = index
    caster.x, caster.y = dx + 0.5 * obj.height * away[0], dy + 0.5 * obj.height * away[1]
    caster.radius = 0.5 * (obj.length + obj.width + shift)
    caster.weight = min(1.0, (_FADE_END - distance) / (_FADE_END - _FADE_START))
    return 1


@kernel
def add_cast_shadows(layer, view, seen, roadside):
    """Add the cast shadows that a lens sees; see `find_casters`."""
    lens, look, frustum = view.lens, view.look, layer.frustum
    away = _shift_per_metre(look)
    for i in range(seen.counts[3]):
        caster = seen.casters[i]
        ahead = caster.x * lens.cos_yaw + caster.y * lens.sin_yaw
        across = caster.y * lens.cos_yaw - caster.x * lens.sin_yaw
        if outside_view(frustum, ahead, across, caster.radius):
            continue
        if caster.index >= MAX_SEEN:
            add_shadow_of(layer, lens, roadside[caster.index - MAX_SEEN], away, caster.weight)
        # With a shutter, the objects are those that are not behind the lens at the end of the exposure.
        elif look.shutter_s > 0.0 or not behind(frustum, seen.objects[caster.index]):
            add_shadow_of(layer, lens, seen.objects[caster.index], away, caster.weight)


@kernel
def add_shadow_of(layer, lens, obj, away, weight):
    """Add the shadow of one object; `away` is the shift of a point 1 m above the ground [m]."""
    if obj.model == MODEL_TREE:
        n = _crown_outline(layer, lens, obj, away)
        add_outline(layer, CAST, lens, n, weight)
        trunk = 0.06 * obj.width
        n = _box_outline(layer, lens, obj, away, (trunk, trunk), (0.0, 0.3 * obj.height))
        add_outline(layer, CAST, lens, n, weight)
        return
    if is_figure(obj.model):
        for k in range(2):
            box = _FIGURE_BOXES[obj.model - MODEL_PEDESTRIAN, k]
            sides, heights = (
                (box[0] * obj.length, box[1] * obj.width),
                (box[2] * obj.height, box[3] * obj.height),
            )
            n = _box_outline(layer, lens, obj, away, sides, heights)
            add_outline(layer, CAST, lens, n, box[4] * weight)
        return
    sides = (0.5 * obj.length, 0.5 * obj.width)
    n = _box_outline(layer, lens, obj, away, sides, (obj.base, obj.height))
    add_outline(layer, CAST, lens, n, weight)


@kernel
def _box_outline(layer, lens, obj, away, sides, heights):
    """Write the outline of a box's shadow; returns the number of its corners.

    `sides` are half the length and half the width of the box, `heights` its lower and upper end [m].
    """
    hx, hy = sides
    low, high = heights
    dx, dy = obj.x - lens.x, obj.y - lens.y
    along, across = away[0] * obj.cos + away[1] * obj.sin, away[1] * obj.cos - away[0] * obj.sin
    n = 0
    for k in range(4):
        # Corners in turn; the edges that begin and end here face (-1, 0), (0, 1), (1, 0), (0, -1) in turn.
        lx = -hx if k == 0 or k == 1 else hx
        ly = -hy if k == 0 or k == 3 else hy
        before = -across if k == 0 else -along if k == 1 else across if k == 2 else along
        after = -along if k == 0 else across if k == 1 else along if k == 2 else -across
        # An edge that faces away from the sun is shifted by the upper height, another by the lower one.
        for part in range(2):
            facing = before if part == 0 else after
            if part == 1 and (before > 0.0) == (after > 0.0):
                continue
            height = high if facing > 0.0 else low
            x = dx + lx * obj.cos - ly * obj.sin + height * away[0]
            y = dy + lx * obj.sin + ly * obj.cos + height * away[1]
            layer.outline[0, n], layer.outline[1, n] = x, y
            n += 1
    return n


@kernel
def _crown_outline(layer, lens, obj, away):
    """Write the outline of the shadow of a tree's crown; returns the number of its corners."""
    middle, half = 0.6 * obj.height, 0.37 * obj.height
    x, y = obj.x - lens.x + middle * away[0], obj.y - lens.y + middle * away[1]
    radius = 0.46 * obj.width
    shift = math.sqrt(away[0] * away[0] + away[1] * away[1])
    c, s = (away[0] / shift, away[1] / shift) if shift > 1e-9 else (1.0, 0.0)
    long = math.sqrt(radius * radius + (half * shift) ** 2)
    for k in range(_CROWN.shape[0]):
        a, b = long * _CROWN[k, 0], radius * _CROWN[k, 1]
        layer.outline[0, k], layer.outline[1, k] = x + a * c - b * s, y + a * s + b * c
    return _CROWN.shape[0]
