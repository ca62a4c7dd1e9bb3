"""Kernel of the image sensor: from light to grey values."""

import math

import numba as nb

from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.simd import LANES, load_part, maximum, minimum, splat, square_root, store_bytes

_MID_GREY = 128.0  # where the noise levels hold
_MID_LIGHT = _MID_GREY**2 / 255.0  # its linear light
_MID_SLOPE = 2.0 * _MID_GREY / 255.0  # light per grey level there


@kernel
def _noise_levels(look):
    """Return the variance of photon noise per unit of light, and that of read noise."""
    if look.linear > 0.0:
        square = _MID_SLOPE**2
        return square * look.shot_noise**2 / _MID_LIGHT, square * look.read_noise**2
    return look.shot_noise**2 / _MID_GREY, look.read_noise**2


@kernel
def expose(out, image, look, gain, noise, start):
    """Add the sensor's noise to the light, amplify, encode and round it to grey values.

    The noise is that of the light before the gain: a gain of 4 doubles the photon noise of a grey.

    Args:
        out: Frame, uint8, shape (height, width).
        image: Light; the noise is added in place.
        look: Noise levels, and whether the light is linear.
        gain: Amplification of light and noise.
        noise: Standard normal numbers, float32, a power of two of them.
        start: Index of this frame's first number in `noise`.
    """
    height, width = out.shape
    zero = nb.float32(0.0)
    black, half, white = splat(zero), splat(nb.float32(0.5)), splat(nb.float32(255.0))
    noisy, linear = look.shot_noise > 0.0 or look.read_noise > 0.0, look.linear > 0.0
    shot, read = _noise_levels(look)
    shot, read = nb.float32(shot), nb.float32(read)
    scale = splat(nb.float32(gain * 255.0 if linear else gain))
    plain = gain == 1.0 and not linear
    mask = noise.shape[0] - 1
    for i in range(height):
        if noisy:
            for j in range(width):
                g = noise[(start + i * width + j) & mask]
                image[i, j] += g * math.sqrt(read + shot * max(image[i, j], zero))
        for j in range(0, width, LANES):
            at, count = i * width + j, width - j
            light = maximum(load_part(image, at, count), black)
            if not plain:
                light = light * scale
                if linear:
                    light = square_root(light)
            store_bytes(out, at, count, minimum(light, white) + half)
