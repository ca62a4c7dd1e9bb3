# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""The ground in a frame: visible band, road and paint, and the shading of its rows.

A narrow field below the horizon contains a few metres of road, and most objects of a roadside are beyond it.
What these kernels exclude would add nothing to the frame, so that frames are the same to the bit.

A row of the image is a straight line over the texture, also if the lens rolls. Without roll, it is at one
distance ahead, and its pixels are evenly spaced. The level of the rip-map, the fog and the headlights are
those of the middle of the part of the row below the horizon; with a roll of 0.5°, they are 0.7 rows off at
the sides of a frame of 160 columns.
"""

import math
from typing import NamedTuple

import numba as nb
import numpy as np

from lgmd_gym.camera.render.coverage import NEAR, add_polygon, project_eight, sum_differences, winding
from lgmd_gym.camera.render.light import row_air, through_air
from lgmd_gym.camera.render.seen import outside_view
from lgmd_gym.camera.render.texture import (
    bend_of,
    bent_texels,
    distance_ahead,
    fixed_line,
    sample,
    texture_line,
)
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.doubles import (
    greatest_double,
    least_double,
    load_doubles,
    madd_doubles,
    splat_double,
)
from lgmd_gym.kernels.simd import (
    LANES,
    any_above,
    as_floats,
    at_least,
    lane_numbers,
    load_part,
    madd,
    maximum,
    minimum,
    replace_above,
    splat,
    store_part,
)

# Channels of the ground layer; int64, because kernels are compiled anew for each literal argument.
ROAD, PAINT, SHADOW, CAST = np.int64(0), np.int64(1), np.int64(2), np.int64(3)


RECTANGLE = np.array([(-1.0, -1.0, 1.0, 1.0, *[-1.0] * 4), (-1.0, 1.0, 1.0, -1.0, *[-1.0] * 4)])
"""Corners of a rectangle along and across, as shares of half its sides, then the first one again."""


@kernel
def add_level_polygon(layer, k, lens, ahead, across, n, weight):
    """Add a polygon of the ground, of either winding, to channel k.

    Args:
        layer: `GroundLayer`.
        k: Channel.
        lens: The lens.
        ahead: Distances of up to eight corners ahead of the lens, lanes of float64 [m]; unused lanes repeat a
            corner.
        across: Distances to the right, likewise.
        n: Number of corners.
        weight: Weight.
    """
    if not (greatest_double(ahead) > layer.frustum.near and least_double(ahead) < layer.frustum.far):
        return
    height, cos, sin = splat_double(lens.z), splat_double(lens.cos_pitch), splat_double(lens.sin_pitch)
    c, s = splat_double(lens.cos_roll), splat_double(lens.sin_roll)
    depth, down = ahead * cos - height * sin, madd_doubles(ahead, sin, height * cos)
    if greatest_double(depth) < NEAR:
        return
    n, _ = project_eight(lens, depth, madd_doubles(across, c, down * s), down * c - across * s, n, layer)
    if n >= 3:
        add_polygon(layer.coverage, k, layer.uv, n, weight if winding(layer.uv, n) > 0.0 else -weight, 0.0)


@kernel
def add_ground_polygon(layer, k, lens, x, y, n, weight):
    """Add a polygon of the ground to channel k; `x` and `y` are relative to the lens, see above [m]."""
    c, s = splat_double(lens.cos_yaw), splat_double(lens.sin_yaw)
    add_level_polygon(layer, k, lens, madd_doubles(x, c, y * s), y * c - x * s, n, weight)


@kernel
def add_outline(layer, k, lens, n, weight):
    """Add the polygon with the n corners in `layer.outline` to channel k."""
    outline = layer.outline
    for i in range(n, outline.shape[1]):
        outline[0, i], outline[1, i] = outline[0, 0], outline[1, 0]
    x, y = load_doubles(outline, 0), load_doubles(outline, outline.shape[1])
    add_ground_polygon(layer, k, lens, x, y, n, weight)


@kernel
def add_road(layer, lens, surface):
    """Add the asphalt, `RoadGeometry.surface`, to the ground layer."""
    for i in range(surface.shape[0]):
        quad = surface[i]
        dx, dy = quad.x - lens.x, quad.y - lens.y
        ahead, across = dx * lens.cos_yaw + dy * lens.sin_yaw, dy * lens.cos_yaw - dx * lens.sin_yaw
        if outside_view(layer.frustum, ahead, across, quad.radius):
            continue
        for k in range(4):
            layer.outline[0, k] = quad.corners[2 * k] - lens.x
            layer.outline[1, k] = quad.corners[2 * k + 1] - lens.y
        add_outline(layer, ROAD, lens, 4, 1.0)


@kernel
def _without_traces(road):
    """Return the coverage of the road, 0 to 1, without traces of verge on the road and of road on the verge.

    They come from rounding, and from lanes that overlap.
    """
    road = replace_above(road, splat(nb.float32(0.9999)), splat(nb.float32(1.0)))
    return at_least(road, splat(nb.float32(1e-4)))


class Surface(NamedTuple):
    """Light of the ground in all lanes of a vector; see `LOOK` for the terms."""

    asphalt: float
    asphalt_gain: float
    verge: float
    verge_gain: float
    paint: float
    shadow_limit: float
    cast: float
    sunny: bool  # whether the sun casts shadows


@kernel(inline=True)
def _surface_of(look):
    """Return the `Surface` of a `LOOK` record, once per row: in loops, compilers read records again."""
    return Surface(
        asphalt=splat(nb.float32(look.asphalt)),
        asphalt_gain=splat(nb.float32(look.asphalt_gain)),
        verge=splat(nb.float32(look.verge)),
        verge_gain=splat(nb.float32(look.verge_gain)),
        paint=splat(nb.float32(look.paint)),
        shadow_limit=splat(nb.float32(look.shadow_limit)),
        cast=splat(nb.float32(look.cast)),
        sunny=look.cast > 0.0,
    )


@kernel(inline=True)
def _ground_light(surface, tables, line, x, y, coverages):
    """Return the light of sixteen pixels by day: verge, asphalt, paint and shadow by their coverage."""
    road, paint, shadow, cast = coverages
    zero, one, half = splat(nb.float32(0.0)), splat(nb.float32(1.0)), splat(nb.float32(0.5))
    road = _without_traces(road)
    grain = verge = zero
    if any_above(road, zero) or any_above(paint, zero):
        grain = surface.asphalt_gain * sample(tables.asphalt, line, x, y)
    if any_above(one, road):
        verge = surface.verge_gain * sample(tables.verge, line, x, y)
    asphalt, verge = surface.asphalt + grain, surface.verge + verge
    grey = madd(road, asphalt, (one - road) * verge)
    # Worn paint shows half of the asphalt's grain.
    paint = minimum(maximum(paint, zero), one)
    grey = madd(paint, madd(half, grain, surface.paint) - grey, grey)
    grey = grey * (one - minimum(maximum(shadow, zero), surface.shadow_limit))
    if surface.sunny:
        # Shadows that overlap are no darker than one.
        grey = grey * (one - surface.cast * minimum(maximum(cast, zero), one))
    return grey


@kernel
def shade_row(image, row, horizon, coverage, view, tables):
    """Draw one row of the ground layer over a row of the image, and clear its coverage.

    Args:
        image: Light, float32, shape (height, width) [grey levels].
        row: Row of the image, at least partly below the horizon.
        horizon: `Horizon`.
        coverage: Coverage differences, see `Buffers.ground`.
        view: `View`.
        tables: `Tables`.
    """
    width, stride = image.shape[1], coverage.shape[2]
    road, paint, shadow, cast = coverage[ROAD], coverage[PAINT], coverage[SHADOW], coverage[CAST]
    surface = _surface_of(view.look)
    line = texture_line(view.lens, row, tables.level_start)
    x, y, step_x, step_y = fixed_line(line)
    whole, bent = row >= horizon.bottom, line.bend != 0.0
    # Share of each pixel below the horizon.
    below = splat(nb.float32(row + 1.0 - horizon.left - 0.5 * horizon.slope))
    fall, lanes = splat(nb.float32(-horizon.slope)), as_floats(lane_numbers())
    bend = bend_of(line, width)
    t, next_t = lanes + splat(nb.float32(bend.first)), splat(nb.float32(LANES))
    zero, one, least = splat(nb.float32(0.0)), splat(nb.float32(1.0)), splat(nb.float32(1e-3))
    share = inverse = one
    air = row_air(view.look, distance_ahead(view.lens, row), view.lens.z)
    sum_road = sum_paint = sum_shadow = sum_cast = cover_cast = zero
    for j in range(0, width, LANES):
        at, pixel, count = row * stride + j, row * width + j, width - j
        cover_road, sum_road = sum_differences(road, at, count, sum_road)
        cover_paint, sum_paint = sum_differences(paint, at, count, sum_paint)
        cover_shadow, sum_shadow = sum_differences(shadow, at, count, sum_shadow)
        if surface.sunny:
            cover_cast, sum_cast = sum_differences(cast, at, count, sum_cast)
        coverages = (cover_road, cover_paint, cover_shadow, cover_cast)
        if not whole:
            share = madd(fall, lanes + splat(nb.float32(j)), below)
            share = minimum(maximum(share, zero), one)
            # As shares of the ground in these pixels.
            inverse = one / maximum(share, least)
            coverages = (
                cover_road * inverse,
                cover_paint * inverse,
                cover_shadow * inverse,
                cover_cast * inverse,
            )
        at_x, at_y = x, y
        if bent:
            away_x, away_y = bent_texels(bend, t)
            at_x, at_y = x + away_x, y + away_y
        grey = _ground_light(surface, tables, line, at_x, at_y, coverages)
        grey = through_air(grey, air, view.beam, j)
        if not whole:
            behind = load_part(image, pixel, count)
            grey = madd(share, grey - behind, behind)
        store_part(image, pixel, count, grey)
        x, y, t = x + step_x, y + step_y, t + next_t
    # Edges at the right side of the frame.
    for j in range(width, width + 2):
        road[row, j] = paint[row, j] = shadow[row, j] = cast[row, j] = nb.float32(0.0)


_FAR = 2000.0  # markings end at this distance [m]


class ViewedLine(NamedTuple):
    """Start [m] and unit direction of a straight line, ahead of and across the lens; its width [m]."""

    ahead: float
    across: float
    d_ahead: float
    d_across: float
    width: float


@kernel
def _add_stroke(layer, lens, line, a, b, weight):
    """Add the part [a, b] of a `ViewedLine` [m]; `weight` is 1, or the share that is painted."""
    along, side = load_doubles(RECTANGLE, 0), load_doubles(RECTANGLE, RECTANGLE.shape[1])
    middle, half = splat_double(0.5 * (a + b)), splat_double(0.5 * (b - a))
    t = madd_doubles(along, half, middle)
    ha, hc = splat_double(-0.5 * line.width * line.d_across), splat_double(0.5 * line.width * line.d_ahead)
    ahead = madd_doubles(t, splat_double(line.d_ahead), madd_doubles(side, ha, splat_double(line.ahead)))
    across = madd_doubles(t, splat_double(line.d_across), madd_doubles(side, hc, splat_double(line.across)))
    add_level_polygon(layer, PAINT, lens, ahead, across, 4, weight)


@kernel
def _visible_part(frustum, line, length):
    """Return the part [a, b] of a line between the near plane, the far end and the sides of the view [m].

    The lower side of the frame also bounds it: a narrow view begins tens of metres ahead.
    """
    ahead, across, d_ahead, d_across, width = line
    tan, rise, drop = frustum.tangent, frustum.slope, frustum.z * frustum.drop
    a, b = 0.0, length
    for side in range(5 if tan >= 0.0 else 0):
        if side == 0:
            p, q = ahead + 0.5, d_ahead
        elif side == 1:
            p, q = _FAR - ahead, -d_ahead
        elif side == 2:
            p, q = tan * ahead + across + 2.0, tan * d_ahead + d_across
        elif side == 3:
            p, q = tan * ahead - across + 2.0, tan * d_ahead - d_across
        else:
            p, q = rise * ahead - drop + abs(rise) * width, rise * d_ahead
        # Keep where p + q·t >= 0.
        if abs(q) < 1e-12:
            if p < 0.0:
                return 1.0, 0.0
        elif q > 0.0:
            a = max(a, -p / q)
        else:
            b = min(b, -p / q)
    return a, b


@kernel
def _separate_stripes(lens, line, a, b, period):
    """Return the part of [a, b] drawn as separate stripes: up to three periods per pixel [m]."""
    along, across = abs(line.d_ahead), abs(line.d_across)
    f, h = lens.focal, lens.z
    # along·Z²/(f·h) + across·Z/f = 3 periods, solved for the distance ahead Z.
    p, q, r = along / (f * h), across / f, 3.0 * period
    limit = (math.sqrt(q * q + 4.0 * p * r) - q) / (2.0 * p) if p > 1e-9 else r / max(q, 1e-9)
    if abs(line.d_ahead) < 1e-9:
        return (a, b) if line.ahead < limit else (b, b)
    t = (limit - line.ahead) / line.d_ahead
    # The near part is striped, in either direction of the line.
    return (a, min(max(t, a), b)) if line.d_ahead > 0.0 else (min(max(t, a), b), b)


@kernel
def _add_striped(layer, lens, line, s0, a, b, look):
    """Add the part [a, b] of a striped line that starts s0 along its lane [m]; far stripes as their mean."""
    dash, period = look.dash, look.dash_period
    near_a, near_b = _separate_stripes(lens, line, a, b, period)
    if near_a > a:
        _add_stroke(layer, lens, line, a, near_a, dash / period)
    if near_b < b:
        _add_stroke(layer, lens, line, near_b, b, dash / period)
    k = math.floor((s0 + near_a) / period)
    while k * period < s0 + near_b:
        start = max(k * period - s0, near_a)
        end = min(k * period + dash - s0, near_b)
        if end > start:
            _add_stroke(layer, lens, line, start, end, 1.0)
        k += 1


@kernel
def add_lines(layer, lens, lines, look):
    """Add all markings, `RoadGeometry.lines`, to the ground layer, in the style of a `LOOK` record."""
    c, s = lens.cos_yaw, lens.sin_yaw
    for i in range(lines.shape[0]):
        piece = lines[i]
        x0, y0, half = piece.x - lens.x, piece.y - lens.y, 0.5 * piece.length
        line = ViewedLine(
            ahead=x0 * c + y0 * s,
            across=y0 * c - x0 * s,
            d_ahead=piece.cos * c + piece.sin * s,
            d_across=piece.sin * c - piece.cos * s,
            width=look.line_width,
        )
        ahead, across = line.ahead + half * line.d_ahead, line.across + half * line.d_across
        if outside_view(layer.frustum, ahead, across, half + line.width):
            continue
        a, b = _visible_part(layer.frustum, line, piece.length)
        if not b > a:
            continue
        if piece.striped == 0.0:
            _add_stroke(layer, lens, line, a, b, 1.0)
        else:
            _add_striped(layer, lens, line, piece.start, a, b, look)
