"""World-anchored ground textures, prefiltered for every footprint of a pixel.

A texture is a tile of grey deviations with natural (1/f) statistics, periodic in both directions, with all
its box averages over 2^i x 2^j texels (a rip-map). The footprints of far pixels are metres long and
centimetres wide; a mip-map with square footprints would blur them to a plain grey.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.render.ground_features import EXPONENTS, STREAMS, add_features

TEXEL_M = 0.04
"""Size of a texel [m]. The near ground of a 60° lens at 160 px has 3 to 8 cm per pixel."""
_LONG_LOG2, _WIDE_LOG2 = 12, 9  # 164 m along x, 20 m along y
_LABORATORY = ("asphalt", "verge")  # kinds of ground of the laboratory
_STD_CODE = 36.0  # standard deviation of the stored bytes around 128


class Texture(NamedTuple):
    """Rip-map: box averages of a texture over 2^i x 2^j texels.

    Attributes:
        data: All levels, uint8, flat; 128 is the mean, and 36 one standard deviation of the finest level.
            Each row of a level, along y, ends with a copy of its first texel: two neighbouring texels are
            next to each other in memory, at the end of the period too.
        level_start: Index of the first texel of level (i, j), int64, shape (levels along x, along y).
    """

    data: np.ndarray
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
