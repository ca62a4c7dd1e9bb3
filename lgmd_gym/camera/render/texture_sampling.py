"""Kernels that sample a ground texture along an image row."""

import math
from typing import NamedTuple

import numba as nb

from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.render.texture import TEXEL_M


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
def _level(footprint, top):
    """Return the level of the rip-map whose texels are as large as the footprint [texels]."""
    if not footprint < 1e12:
        return top
    return min(math.floor(math.log2(max(footprint, 1.0)) + 0.5), top)


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
    wide_x = math.sqrt((along * c) ** 2 + (reach * s) ** 2) / TEXEL_M
    wide_y = math.sqrt((along * s) ** 2 + (reach * c) ** 2) / TEXEL_M
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
def sample_row(data, line, out, j0, j1):
    """Write pixels j0 to j1 - 1 of a texture (stored values minus 128, bilinear) along a `TextureLine`."""
    # 16.16 fixed point wraps and floors without branches; unsigned indices are never negative.
    px = nb.uint64(nb.int64(math.floor((line.x + line.dx * j0) * 65536.0)))
    py = nb.uint64(nb.int64(math.floor((line.y + line.dy * j0) * 65536.0)))
    sx = nb.uint64(nb.int64(math.floor(line.dx * 65536.0 + 0.5)))
    sy = nb.uint64(nb.int64(math.floor(line.dy * 65536.0 + 0.5)))
    one, shift, bits = nb.uint64(1), nb.uint64(line.log_y), nb.uint64(16)
    mask_x, mask_y = (one << nb.uint64(line.log_x)) - one, (one << shift) - one
    fraction, start = nb.uint64(65535), nb.uint64(line.start)
    scale = nb.float32(1.0 / 65536.0)
    for j in range(j0, j1):
        ix, iy = px >> bits, py >> bits
        r0 = start + ((ix & mask_x) << shift)
        r1 = start + (((ix + one) & mask_x) << shift)
        c0, c1 = iy & mask_y, (iy + one) & mask_y
        wx, wy = scale * nb.float32(px & fraction), scale * nb.float32(py & fraction)
        a, b = nb.float32(data[r0 + c0]), nb.float32(data[r0 + c1])
        c, d = nb.float32(data[r1 + c0]), nb.float32(data[r1 + c1])
        near = a + wy * (b - a)
        far = c + wy * (d - c)
        out[j] = near + wx * (far - near) - nb.float32(128.0)
        px += sx
        py += sy
