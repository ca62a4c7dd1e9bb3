"""Kernels that sample a ground texture along an image row, sixteen pixels at a time."""

import math
from typing import NamedTuple

import numba as nb

from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.render.texture import TEXEL_M
from lgmd_gym.simd import as_floats, gather_words, lane_numbers, madd, splat


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
    """

    start: int
    x: float
    y: float
    dx: float
    dy: float
    log_x: int
    log_y: int


@kernel
def distance_ahead(lens, row):
    """Return the distance of the ground at the middle of an image row, at most 100 km [m]."""
    v = row + 0.5 - lens.centre_v
    fall = max(v * lens.cos_pitch - lens.focal * lens.sin_pitch, 1e-6)
    return min(lens.z / fall * (lens.focal * lens.cos_pitch + v * lens.sin_pitch), 1e5)


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
    v = row + 0.5 - lens.centre_v
    fall = v * lens.cos_pitch - lens.focal * lens.sin_pitch
    reach = lens.z / max(fall, 1e-6)
    ahead = reach * (lens.focal * lens.cos_pitch + v * lens.sin_pitch)
    c, s = lens.cos_yaw, lens.sin_yaw
    along = lens.focal * reach / max(fall, 0.3)
    # The pixel's footprint along the axes of the texture.
    wide_x = ((along * c) ** 2 + (reach * s) ** 2) * (1.0 / TEXEL_M**2)
    wide_y = ((along * s) ** 2 + (reach * c) ** 2) * (1.0 / TEXEL_M**2)
    top_x, top_y = level_start.shape[0] - 1, level_start.shape[1] - 1
    i, j = _level(wide_x, top_x), _level(wide_y, top_y)
    log_x, log_y = top_x - i, top_y - j
    scale_x, scale_y = 1.0 / (TEXEL_M * (1 << i)), 1.0 / (TEXEL_M * (1 << j))
    left = (0.5 - lens.centre_u) * reach
    x = (lens.x + ahead * c - left * s) * scale_x - 0.5
    y = (lens.y + ahead * s + left * c) * scale_y - 0.5
    x -= math.floor(x / (1 << log_x)) * (1 << log_x)
    y -= math.floor(y / (1 << log_y)) * (1 << log_y)
    return TextureLine(level_start[i, j], x, y, -s * reach * scale_x, c * reach * scale_y, log_x, log_y)


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
