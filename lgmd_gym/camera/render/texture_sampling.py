"""Kernels that sample a ground texture along an image row, sixteen pixels at a time."""

import math
from typing import NamedTuple

import numba as nb

from lgmd_gym.camera.render.texture import TEXEL_M
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import as_floats, as_integers, gather_words, lane_numbers, madd, maximum, splat


class TextureLine(NamedTuple):
    """A straight line over one level of a rip-map.

    Attributes:
        start: Index of the level's first texel.
        x: Texel of pixel 0 along x.
        y: Texel of pixel 0 along y.
        dx: Texels per pixel along x.
        dy: Texels per pixel along y.
        log_x: log2 of the level's size along x.
        log_y: log2 of the level's size along y.
        bend: Change of the scale along the line due to roll, as a share per pixel; 0 for even spacing.
        middle: Column coordinate where `dx` and `dy` hold [px].
    """

    start: int
    x: float
    y: float
    dx: float
    dy: float
    log_x: int
    log_y: int
    bend: float
    middle: float


@kernel
def _ground_point(lens, row):
    """Return the middle of the part of an image row that is below the horizon.

    Returns:
        Its column relative to the middle of the frame [px]; its fall, the slope towards the ground, scaled,
            at least 1e-6; its distance ahead and across [m]; the metres per unit of its direction.
    """
    f, c, s = lens.focal, lens.cos_pitch, lens.sin_pitch
    v = row + 0.5 - lens.centre_v
    u, down, right = 0.0, v, 0.0
    if lens.sin_roll != 0.0:
        tilt = lens.sin_roll * c
        level = v * lens.cos_roll * c - f * s  # fall in the middle
        if level < abs(tilt) * lens.centre_u:
            side = math.copysign(lens.centre_u, tilt)
            u = min(max(0.5 * (side - level / tilt), -lens.centre_u), lens.centre_u)
        down, right = v * lens.cos_roll + u * lens.sin_roll, u * lens.cos_roll - v * lens.sin_roll
    fall = max(down * c - f * s, 1e-6)
    reach = lens.z / fall
    return u, fall, reach * (f * c + down * s), reach * right, reach


@kernel
def distance_ahead(lens, row):
    """Return the distance of the ground at the middle of an image row, at most 100 km [m].

    If the lens rolls, it is the middle of the part of the row that is below the horizon.
    """
    return min(_ground_point(lens, row)[2], 1e5)


@kernel
def _level(square, top):
    """Return the level of the rip-map with texels as large as a footprint, given its square [texels²]."""
    # round(log2(footprint)), without a logarithm: level i begins at a square of 2^(2i - 1).
    level, limit = 0, 2.0
    while level < top and not square < limit:
        level += 1
        limit *= 4.0
    return level


@kernel
def texture_line(lens, row, level_start):
    """Return the `TextureLine` of an image row below the horizon; see `Texture.level_start`."""
    u, fall, ahead, across, reach = _ground_point(lens, row)
    c, s = lens.cos_yaw, lens.sin_yaw
    # Metres ahead and across per pixel; the perspective changes them along the row if the lens rolls.
    bend = lens.sin_roll * lens.cos_pitch / fall
    d_ahead = lens.sin_roll * lens.sin_pitch * reach - bend * ahead
    d_across = lens.cos_roll * reach - bend * across
    along = lens.focal * reach / max(fall, 0.3)
    # The pixel's footprint along the axes of the texture.
    wide_x = ((along * c) ** 2 + (reach * s) ** 2) * (1.0 / TEXEL_M**2)
    wide_y = ((along * s) ** 2 + (reach * c) ** 2) * (1.0 / TEXEL_M**2)
    top_x, top_y = level_start.shape[0] - 1, level_start.shape[1] - 1
    i, j = _level(wide_x, top_x), _level(wide_y, top_y)
    log_x, log_y = top_x - i, top_y - j
    scale_x, scale_y = 1.0 / (TEXEL_M * (1 << i)), 1.0 / (TEXEL_M * (1 << j))
    first = 0.5 - lens.centre_u - u
    ahead, across = ahead + first * d_ahead, across + first * d_across
    x = (lens.x + ahead * c - across * s) * scale_x - 0.5
    y = (lens.y + ahead * s + across * c) * scale_y - 0.5
    x -= math.floor(x / (1 << log_x)) * (1 << log_x)
    y -= math.floor(y / (1 << log_y)) * (1 << log_y)
    dx, dy = (d_ahead * c - d_across * s) * scale_x, (d_ahead * s + d_across * c) * scale_y
    return TextureLine(level_start[i, j], x, y, dx, dy, log_x, log_y, bend, lens.centre_u + u)


@kernel
def _fixed(texels, rounding):
    """Return texels in 16.16 fixed point, modulo 2^16: no level has more; `rounding` is 0.0 or 0.5."""
    return nb.int32(nb.int64(math.floor(texels * 65536.0 + rounding)))


@kernel
def fixed_line(line):
    """Return the texels (x, y) of sixteen pixels from pixel 0 and the steps to the next sixteen, 16.16."""
    step_x, step_y = _fixed(line.dx, 0.5), _fixed(line.dy, 0.5)
    lanes = lane_numbers()
    x = splat(_fixed(line.x, 0.0)) + lanes * splat(step_x)
    y = splat(_fixed(line.y, 0.0)) + lanes * splat(step_y)
    return x, y, splat(nb.int32(16) * step_x), splat(nb.int32(16) * step_y)


class Bend(NamedTuple):
    """Places of the pixels of a row that is not evenly spaced: t / (1 + rate·t) steps from a column.

    Attributes:
        rate: Change of the scale per pixel.
        least: Lower bound of 1 + rate·t, which keeps texels within the range of int32; 0 is the horizon.
        x: Texels along x per t² / (1 + rate·t), in 16.16 fixed point.
        y: Texels along y, likewise.
        first: t of pixel 0 [px].
    """

    rate: float
    least: float
    x: float
    y: float
    first: float


@kernel
def bend_of(line, width):
    """Return the `Bend` of a line over a row of `width` pixels."""
    x, y = -65536.0 * line.bend * line.dx, -65536.0 * line.bend * line.dy
    least = max(1e-3, max(abs(x), abs(y)) * width * width / 2e9)
    return Bend(line.bend, least, x, y, 0.5 - line.middle)


@kernel
def bent_texels(bend, t):
    """Return the texels (x, y) from even spacing to the places of sixteen pixels, in 16.16 fixed point."""
    scale = maximum(
        madd(splat(nb.float32(bend.rate)), t, splat(nb.float32(1.0))), splat(nb.float32(bend.least))
    )
    late = t * t / scale
    return as_integers(late * splat(nb.float32(bend.x))), as_integers(late * splat(nb.float32(bend.y)))


@kernel
def sample(data, line, x, y):
    """Return sixteen samples (stored values minus 128, bilinear) at texels in 16.16 fixed point."""
    bits, low, fraction = splat(nb.int32(16)), splat(nb.int32(255)), splat(nb.int32(65535))
    one, eight, shift = splat(nb.int32(1)), splat(nb.int32(8)), splat(nb.int32(line.log_y))
    mask_x = splat(nb.int32((1 << line.log_x) - 1))
    column = ((y >> bits) & splat(nb.int32((1 << line.log_y) - 1))) + splat(nb.int32(line.start))
    row = (x >> bits) & mask_x
    next_row = (row + one) & mask_x
    # A row is one texel longer than the level is wide.
    near = gather_words(data, column + (row << shift) + row)
    far = gather_words(data, column + (next_row << shift) + next_row)
    scale = splat(nb.float32(1.0 / 65536.0))
    wx, wy = as_floats(x & fraction) * scale, as_floats(y & fraction) * scale
    a, c = as_floats(near & low), as_floats(far & low)
    a = madd(wy, as_floats((near >> eight) & low) - a, a)
    c = madd(wy, as_floats((far >> eight) & low) - c, c)
    return madd(wx, c - a, a) - splat(nb.float32(128.0))
