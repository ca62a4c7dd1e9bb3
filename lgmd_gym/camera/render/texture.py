# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Ground textures: noise with features, filtered copies, and samples of them along the rows of a frame.

A texture is an array of deviations in units of its standard deviation, shape (texels along x, along y),
periodic in both directions; see `TEXEL_M` for the size of a texel.

A texture is a tile of grey deviations with natural (1/f) statistics, periodic in both directions, with all
its box averages over 2^i x 2^j texels (a rip-map). The footprints of far pixels are metres long and
centimetres wide; a mip-map with square footprints would blur them to a plain grey.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numba as nb
import numpy as np

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import as_floats, as_integers, gather_words, lane_numbers, madd, maximum, splat

EXPONENTS = {
    "asphalt": 0.85,
    "verge": 1.1,
    "fresh": 0.5,
    "aged": 0.85,
    "patched": 0.85,
    "cracked": 0.8,
    "coarse": 0.35,
    "concrete": 0.7,
    "grass": 0.9,
    "gravel": 0.3,
    "soil": 1.2,
    "paving": 0.6,
}
"""Exponent of the amplitude spectrum, 1/frequency^exponent, by kind of ground."""

STREAMS = {kind: number for number, kind in enumerate(EXPONENTS, start=1)}
"""Second seed of the random generator of each kind of ground."""

_JOINT = 128  # texels between the joints of concrete slabs, 5.12 m
_SETT = 16  # texels of a paving stone, 0.64 m


def add_features(kind: str, tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add the features of a kind of ground to noise of unit variance, in place."""
    if kind == "asphalt":
        _add_seams(tile, rng, seams=14, patches=8)
    elif kind == "aged":
        _add_seams(tile, rng, seams=8, patches=3)
    elif kind == "patched":
        _add_seams(tile, rng, seams=22, patches=34)
    elif kind == "cracked":
        _add_cracks(tile, rng)
    elif kind == "concrete":
        _add_slabs(tile, rng)
    elif kind == "paving":
        _add_stones(tile, rng)
    elif kind == "grass":
        _add_tufts(tile, rng)


def _add_seams(tile: np.ndarray, rng: np.random.Generator, seams: int, patches: int) -> None:
    """Add the sealed cracks and patches of an older road."""
    long, wide = tile.shape
    for _ in range(seams):
        x, y = int(rng.integers(long)), int(rng.integers(wide))
        span, thick = int(rng.integers(60, 220)), int(rng.integers(2, 4))
        wander = np.cumsum(rng.integers(-1, 2, span))
        for step in range(span):
            rows = (x + wander[step] + np.arange(thick)) % long
            tile[rows, (y + step) % wide] -= 2.2
    for _ in range(patches):
        x, y = int(rng.integers(long)), int(rng.integers(wide))
        rows = (x + np.arange(int(rng.integers(40, 160)))) % long
        cols = (y + np.arange(int(rng.integers(25, 80)))) % wide
        tile[np.ix_(rows, cols)] += float(rng.choice((-0.9, 0.8)))


def _add_cracks(tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add cracks that wander along and across the road, some of them sealed with dark or light filler."""
    long, wide = tile.shape
    for _ in range(60):
        along, span = rng.random() < 0.6, int(rng.integers(80, 400))
        thick, depth = int(rng.integers(1, 4)), float(rng.choice((-2.6, -1.6, 1.2)))
        steps, drift = np.arange(span), np.cumsum(rng.integers(-1, 2, span))
        x = int(rng.integers(long)) + (steps if along else drift)
        y = int(rng.integers(wide)) + (drift if along else steps)
        for k in range(thick):
            tile[(x + (0 if along else k)) % long, (y + (k if along else 0)) % wide] += depth


def _add_slabs(tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add concrete slabs of 5.12 m with different tones, and their dark joints."""
    long, wide = tile.shape
    tones = rng.normal(0.0, 0.8, (long // _JOINT, wide // _JOINT))
    tile += np.repeat(np.repeat(tones, _JOINT, axis=0), _JOINT, axis=1).astype(np.float32)
    for offset in range(2):
        tile[offset::_JOINT] -= 2.8
        tile[:, offset::_JOINT] -= 1.8


def _add_stones(tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add paving stones with different tones, and their joints."""
    long, wide = tile.shape
    tones = rng.normal(0.0, 0.7, (long // _SETT, wide // _SETT))
    tile += np.repeat(np.repeat(tones, _SETT, axis=0), _SETT, axis=1).astype(np.float32)
    tile[::_SETT] -= 1.6
    tile[:, ::_SETT] -= 1.6


def _add_tufts(tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add dark and light tufts of grass."""
    long, wide = tile.shape
    for _ in range(500):
        x, y, size = int(rng.integers(long)), int(rng.integers(wide)), int(rng.integers(4, 20))
        rows, cols = (x + np.arange(size)) % long, (y + np.arange(size)) % wide
        tile[np.ix_(rows, cols)] += float(rng.choice((-1.4, 1.1)))


TEXEL_M = 0.04
"""Size of a texel [m]. The near ground of a 60° lens at 160 px has 3 to 8 cm per pixel."""
_LONG_LOG2, _WIDE_LOG2 = 12, 9  # 164 m along x, 20 m along y
_LABORATORY = ("asphalt", "verge")  # kinds of ground of the laboratory
_STD_CODE = 36.0  # standard deviation of the stored bytes around 128


class Texture(NamedTuple):
    """Rip-map: box averages of a texture over 2^i x 2^j texels."""

    # all levels, uint8, flat; 128 is the mean, and 36 one standard deviation of the finest level. Each row of
    # a level, along y, ends with a copy of its first texel: two neighbouring texels are next to each other in
    # memory, at the end of the period too
    data: np.ndarray
    # index of the first texel of level (i, j), int64, shape (levels along x, along y)
    level_start: np.ndarray


@lru_cache(maxsize=24)
def ground_texture(kind: str, tile: int) -> Texture:
    """Return a ground texture, built once per process.

    Args:
        kind: A kind of ground: "asphalt" or "verge" of the laboratory, or a kind of drawn worlds.
        tile: Number of the texture.
    """
    rng = np.random.default_rng([tile, STREAMS[kind]])
    # The many textures of numbered worlds are half as long, so that all of them fit into 85 MB.
    deviations = _noise(rng, EXPONENTS[kind], _LONG_LOG2 - (kind not in _LABORATORY))
    add_features(kind, deviations, rng)
    deviations -= deviations.mean()
    deviations /= deviations.std()
    np.clip(deviations, -3.4, 3.4, out=deviations)
    deviations *= _STD_CODE
    deviations += 128.0
    return _ripmap(deviations)


def _noise(rng: np.random.Generator, exponent: float, long_log2: int) -> np.ndarray:
    """Return periodic noise with amplitude 1/frequency^exponent; float32, unit variance."""
    shape = (1 << long_log2, 1 << _WIDE_LOG2)
    white = rng.standard_normal(shape, dtype=np.float32)
    spectrum = np.fft.rfft2(white)
    fx = np.fft.fftfreq(shape[0]).astype(np.float32)[:, None]
    fy = np.fft.rfftfreq(shape[1]).astype(np.float32)[None, :]
    # The spectrum is flat below one wave in 12 m, which avoids visibly repeating blotches.
    floor = TEXEL_M / 12.0
    weight = fx * fx + fy * fy + np.float32(floor * floor)
    np.power(weight, np.float32(-0.5 * exponent), out=weight)
    spectrum *= weight
    spectrum[0, 0] = 0.0
    del white, weight
    tile = np.fft.irfft2(spectrum, shape).astype(np.float32, copy=False)
    tile /= tile.std()
    return tile


def _ripmap(tile: np.ndarray) -> Texture:
    long_log2 = tile.shape[0].bit_length() - 1
    level_start = np.zeros((long_log2 + 1, _WIDE_LOG2 + 1), dtype=np.int64)
    widths = sum((1 << j) + 1 for j in range(_WIDE_LOG2 + 1))
    # Pairs of texels are read as words of four bytes.
    data = np.zeros(((2 << long_log2) - 1) * widths + 2, dtype=np.uint8)
    at = 0
    for i in range(long_log2 + 1):
        level = tile
        for j in range(_WIDE_LOG2 + 1):
            level_start[i, j] = at
            long, wide = level.shape
            texels = data[at : at + long * (wide + 1)].reshape(long, wide + 1)
            # Adding 0.5 and truncating rounds in place, without another array of floats.
            np.add(level, np.float32(0.5), out=texels[:, :wide], casting="unsafe")
            texels[:, wide] = texels[:, 0]
            at += texels.size
            if j < _WIDE_LOG2:
                level = np.float32(0.5) * (level[:, 0::2] + level[:, 1::2])
        if i < long_log2:
            tile = np.float32(0.5) * (tile[0::2] + tile[1::2])
    return Texture(data, level_start)


class TextureLine(NamedTuple):
    """A straight line over one level of a rip-map."""

    start: int  # index of the level's first texel
    x: float  # texel of pixel 0 along x
    y: float  # texel of pixel 0 along y
    dx: float  # texels per pixel along x
    dy: float  # texels per pixel along y
    log_x: int  # log2 of the level's size along x
    log_y: int  # log2 of the level's size along y
    bend: float  # change of the scale along the line due to roll, as a share per pixel; 0 for even spacing
    middle: float  # column coordinate where `dx` and `dy` hold [px]


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
    return TextureLine(
        start=level_start[i, j],
        x=x,
        y=y,
        dx=dx,
        dy=dy,
        log_x=log_x,
        log_y=log_y,
        bend=bend,
        middle=lens.centre_u + u,
    )


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


class RowBend(NamedTuple):
    """Places of the pixels of a row that is not evenly spaced: t / (1 + rate·t) steps from a column."""

    rate: float  # change of the scale per pixel
    least: float  # lower bound of 1 + rate·t, which keeps texels within the range of int32; 0 is the horizon
    x: float  # texels along x per t² / (1 + rate·t), in 16.16 fixed point
    y: float  # texels along y, likewise
    first: float  # t of pixel 0 [px]


@kernel
def bend_of(line, width):
    """Return the `RowBend` of a line over a row of `width` pixels."""
    x, y = -65536.0 * line.bend * line.dx, -65536.0 * line.bend * line.dy
    least = max(1e-3, max(abs(x), abs(y)) * width * width / 2e9)
    return RowBend(rate=line.bend, least=least, x=x, y=y, first=0.5 - line.middle)


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
