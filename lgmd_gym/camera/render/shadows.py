"""Kernels of the shadows of objects and of marks on the ground."""

from lgmd_gym.camera.effects import ASPHALT_GREY, PAINT_GREY
from lgmd_gym.camera.objects import (
    MODEL_BARRIER,
    MODEL_BOX,
    MODEL_DECK,
    MODEL_MARK,
    MODEL_POST,
    MODEL_RAIL,
    MODEL_TREE,
    is_figure,
    light_of_code,
)
from lgmd_gym.camera.render.ground import PAINT, SHADOW, add_ground_quad
from lgmd_gym.camera.render.ground_band import outside_band
from lgmd_gym.camera.render.order import distance
from lgmd_gym.kernels import kernel

# Legs and wheels keep less of the sky's light from the road than a body close above it.
_FIGURE_SPREAD, _FIGURE_SHARE = 0.3, 0.6


@kernel
def _add_footprint(layer, k, lens, obj, centre, grow, weight):
    """Add an object's rectangle on the ground, around `centre` and grown on all sides, to channel k."""
    x, y = centre
    hx, hy = 0.5 * obj.length + grow, 0.5 * obj.width + grow
    quad = layer.quad
    for i in range(4):
        lx = -hx if i < 2 else hx
        ly = -hy if i == 0 or i == 3 else hy
        quad[2 * i] = x + lx * obj.cos - ly * obj.sin
        quad[2 * i + 1] = y + lx * obj.sin + ly * obj.cos
    add_ground_quad(layer, k, lens, quad, weight)


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
    if outside_band(lens, ahead, 0.5 * (obj.length + obj.width) + 1.5 * widest):
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
