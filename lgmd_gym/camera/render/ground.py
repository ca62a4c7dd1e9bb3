"""Kernels of the ground: asphalt, verge and everything flat on them.

A row of the image is a straight line over the texture, also if the lens rolls. Without roll, it is at one
distance ahead, and its pixels are evenly spaced. The level of the rip-map, the fog and the headlights are
those of the middle of the part of the row below the horizon; with a roll of 0.5°, they are 0.7 rows off at
the sides of a frame of 160 columns.
"""

import math
from typing import Any, NamedTuple

import numba as nb
import numpy as np

from lgmd_gym.camera.render.coverage import NEAR, add_polygon, clip_and_project, sum_differences, winding
from lgmd_gym.camera.render.ground_band import ground_band
from lgmd_gym.camera.render.texture_sampling import (
    bend_of,
    bent_texels,
    distance_ahead,
    fixed_line,
    sample,
    texture_line,
)
from lgmd_gym.camera.render.weather import row_air, through_air
from lgmd_gym.kernels import kernel
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


@kernel
def add_ground_quad(layer, k, lens, quad, weight):
    """Add a quad of the ground, given as x, y of its four corners, to channel k."""
    corners = layer.corners
    nearest, farthest = math.inf, -math.inf
    for i in range(4):
        dx, dy = quad[2 * i] - lens.x, quad[2 * i + 1] - lens.y
        ahead = dx * lens.cos_yaw + dy * lens.sin_yaw
        nearest, farthest = min(nearest, ahead), max(farthest, ahead)
        corners[i, 0] = ahead * lens.cos_pitch - lens.z * lens.sin_pitch
        corners[i, 1] = dy * lens.cos_yaw - dx * lens.sin_yaw
        corners[i, 2] = ahead * lens.sin_pitch + lens.z * lens.cos_pitch
    near, far = ground_band(lens)
    if farthest > near and nearest < far:
        add_quad(layer, k, lens, weight)


@kernel
def add_quad(layer, k, lens, weight):
    """Add the quad in `layer.corners`, given for a lens without roll, of either winding, to channel k."""
    corners, uv = layer.corners, layer.uv
    c, s = lens.cos_roll, lens.sin_roll
    for i in range(4):
        right, down = corners[i, 1], corners[i, 2]
        corners[i, 1], corners[i, 2] = right * c + down * s, down * c - right * s
    if max(max(corners[0, 0], corners[1, 0]), max(corners[2, 0], corners[3, 0])) < NEAR:
        return
    n = clip_and_project(lens, corners, 4, uv)
    if n >= 3:
        add_polygon(layer.coverage, k, uv, n, weight if winding(uv, n) > 0.0 else -weight, 0.0)


@kernel
def _without_traces(road):
    """Return the coverage of the road, 0 to 1, without traces of verge on the road and of road on the verge.

    They come from rounding, and from lanes that overlap.
    """
    road = replace_above(road, splat(nb.float32(0.9999)), splat(nb.float32(1.0)))
    return at_least(road, splat(nb.float32(1e-4)))


class Surface(NamedTuple):
    """Light of the ground in all lanes of a vector; see `LOOK` for the terms.

    Attributes:
        sunny: Whether the sun casts shadows.
    """

    asphalt: Any
    asphalt_gain: Any
    verge: Any
    verge_gain: Any
    paint: Any
    shadow_limit: Any
    cast: Any
    sunny: bool


@kernel(inline=True)
def _surface_of(look):
    """Return the `Surface` of a `LOOK` record, once per row: in loops, compilers read records again."""
    return Surface(
        splat(nb.float32(look.asphalt)), splat(nb.float32(look.asphalt_gain)),
        splat(nb.float32(look.verge)), splat(nb.float32(look.verge_gain)), splat(nb.float32(look.paint)),
        splat(nb.float32(look.shadow_limit)), splat(nb.float32(look.cast)), look.cast > 0.0,
    )  # fmt: skip


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
                cover_road * inverse, cover_paint * inverse, cover_shadow * inverse, cover_cast * inverse,
            )  # fmt: skip
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
