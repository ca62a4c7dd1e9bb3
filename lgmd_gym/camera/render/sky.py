"""Sky and skyline, at infinite distance."""

import math
from functools import lru_cache

import numba as nb
import numpy as np

from lgmd_gym.camera.render.jit import kernel

_LOG2 = 15  # 0.011° per entry, finer than a pixel of a 5° lens at 160 px
_HILLS, _TREES, _LEAVES = 0, 1, 2


@lru_cache(maxsize=16)
def skyline(seed: int) -> np.ndarray:
    """Return the skyline over 360°, natural 1/f^k profiles periodic in azimuth; float32, shape (3, 32768).

    Rows: elevation of the hills and of the tree line (tangent of the angle), grey of the trees (in standard
    deviations).
    """
    rng = np.random.default_rng([seed, 3])
    n = 1 << _LOG2
    hills = _profile(rng, n, exponent=1.6, lowest=3)
    trees = _profile(rng, n, exponent=0.95, lowest=12)
    leaves = _profile(rng, n, exponent=0.7, lowest=60)
    out = np.empty((3, n), dtype=np.float32)
    out[_HILLS] = np.clip(0.012 + 0.010 * hills, 0.0, 0.05)
    out[_TREES] = np.clip(0.011 + 0.009 * trees, 0.002, 0.05)
    out[_LEAVES] = leaves
    return out


def _profile(rng: np.random.Generator, n: int, exponent: float, lowest: int) -> np.ndarray:
    """Return periodic noise, 1/frequency^exponent above `lowest` waves per turn; unit variance."""
    frequency = np.maximum(np.arange(n // 2 + 1), lowest).astype(np.float64)
    spectrum = np.fft.rfft(rng.standard_normal(n)) * frequency**-exponent
    spectrum[0] = 0.0
    # Details under 0.05° are left out: no lens here resolves them.
    spectrum *= np.exp(-((np.arange(n // 2 + 1) / 7000.0) ** 2))
    profile = np.fft.irfft(spectrum, n)
    return profile / profile.std()


@kernel
def draw_sky(image, lens, line, look, horizon):
    """Fill the rows above the horizon; `line` is `skyline(seed)`."""
    height, width = image.shape
    f = lens.focal
    rows = int(min(max(math.ceil(horizon), 0.0), height))
    for i in range(rows):
        # Elevation of the row in the middle of the frame; the gradient ends at 40°.
        up = (horizon - (i + 0.5)) / f
        t = 1.0 - math.exp(-3.0 * max(up, 0.0))
        grey = nb.float32(look.horizon + (look.zenith - look.horizon) * t)
        for j in range(width):
            image[i, j] = grey
    n = line.shape[1]
    c, s = lens.cos_pitch, lens.sin_pitch
    for j in range(width):
        u = j + 0.5 - lens.centre_u
        turn = lens.yaw + math.atan2(u, f * c)
        at = turn * n / (2.0 * math.pi)
        cell = math.floor(at)
        w = at - cell
        a, b = int(cell) & (n - 1), (int(cell) + 1) & (n - 1)
        for layer in range(2):
            scale = look.hill_scale if layer == _HILLS else look.tree_scale
            tan = scale * (line[layer, a] + w * (line[layer, b] - line[layer, a]))
            # Row of the direction with elevation atan(tan) in this column.
            away = math.hypot(f, u)
            top = (
                horizon - tan * away
                if s == 0.0
                else lens.centre_v + f * (s * f - tan * c * away) / (c * f + tan * s * away)
            )
            grey = look.hills
            if layer == _TREES:
                grey = look.trees + look.leaf_gain * (
                    line[_LEAVES, a] + w * (line[_LEAVES, b] - line[_LEAVES, a])
                )
            first = int(min(max(math.floor(top), 0.0), rows))
            for i in range(first, rows):
                # Of the part of the row above the horizon.
                bottom = min(i + 1.0, horizon)
                cover = min(1.0, (bottom - top) / (bottom - i))
                deep = 1.0 - 0.02 * look.leaf_gain * min(1.0, max(0.0, (i - top) / (horizon - top + 1.0)))
                image[i, j] += nb.float32(cover) * (nb.float32(grey * deep) - image[i, j])
