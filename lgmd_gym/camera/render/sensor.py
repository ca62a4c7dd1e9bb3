"""Kernel of the image sensor: from light to grey values."""

import math

import numba as nb

from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.simd import LANES, load_part, maximum, minimum, splat, store_bytes


@kernel
def expose(out, image, look, noise, start):
    """Add the sensor's noise to the light and round it to grey values.

    Args:
        out: Frame, uint8, shape (height, width).
        image: The noise is added in place.
        look: Noise levels.
        noise: Standard normal numbers, float32, a power of two of them.
        start: Index of this frame's first number in `noise`.
    """
    height, width = out.shape
    zero = nb.float32(0.0)
    black, half, white = splat(zero), splat(nb.float32(0.5)), splat(nb.float32(255.0))
    noisy = look.shot_noise > 0.0 or look.read_noise > 0.0
    shot, read = nb.float32(look.shot_noise**2 / 128.0), nb.float32(look.read_noise**2)
    mask = noise.shape[0] - 1
    for i in range(height):
        if noisy:
            for j in range(width):
                g = noise[(start + i * width + j) & mask]
                image[i, j] += g * math.sqrt(read + shot * max(image[i, j], zero))
        for j in range(0, width, LANES):
            at, count = i * width + j, width - j
            light = minimum(maximum(load_part(image, at, count), black), white)
            store_bytes(out, at, count, light + half)
