"""Reflections of the dashboard in the windscreen: faint light that is fixed in the frame."""

import math
from functools import lru_cache

import numba as nb
import numpy as np

from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pose import seed_of
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load_part, madd, splat, store_part

_WAVES = 8


def dashboard_key(p: CameraParams) -> tuple[float, ...]:
    """Return what the pattern in the windscreen depends on beside the frame's size; () for none."""
    return (seed_of(p), p.focal_px) if p.windscreen > 0.0 else ()


@lru_cache(maxsize=64)
def dashboard_pattern(key: tuple[float, ...], shape: tuple[int, int]) -> np.ndarray:
    """Return the light that the windscreen reflects, with a mean of 1 straight ahead.

    It is a sum of waves 30° long or longer, and grows downwards. The pattern is in angles: lenses with the
    same seed show parts of the same one.

    Args:
        key: See `dashboard_key`.
        shape: `(height, width)` of the frames.

    Returns:
        float32, shape (height, width); shape (0, 0) without reflections.
    """
    if not key:
        return np.zeros((0, 0), dtype=np.float32)
    seed, focal = key
    rng = np.random.default_rng([int(seed), 11])
    height, width = shape
    down = ((np.arange(height) + 0.5 - 0.5 * height) / focal)[:, None]
    right = ((np.arange(width) + 0.5 - 0.5 * width) / focal)[None, :]
    waves = np.zeros(shape)
    for _ in range(_WAVES):
        number, turn, phase = (
            rng.uniform(3.0, 12.0),
            rng.uniform(0.0, math.pi),
            rng.uniform(0.0, 2.0 * math.pi),
        )
        waves += np.cos(number * (math.cos(turn) * right + math.sin(turn) * down) + phase)
    # Each wave has a variance of 1/2. The light is 0 to 2 from the top to the bottom.
    light = 2.0 / (1.0 + np.exp(-4.0 * down)) * np.maximum(1.0 + 0.4 * waves / math.sqrt(0.5 * _WAVES), 0.0)
    return light.astype(np.float32)


@kernel
def add_reflections(image, pattern, light):
    """Add `light` times the pattern in the windscreen to an image."""
    height, width = image.shape
    gain = splat(nb.float32(light))
    for i in range(height):
        for j in range(0, width, LANES):
            at, count = i * width + j, width - j
            store_part(
                image, at, count, madd(gain, load_part(pattern, at, count), load_part(image, at, count))
            )
