"""Kernel of the image sensor: from light to grey values."""

import math

import numba as nb

from lgmd_gym.camera.effects import NOISE_LOG2
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load_part, madd, maximum, minimum, splat, square_root, store_bytes

_MID_GREY = 128.0  # where the noise levels of a sensor without a display curve hold


@kernel
def fixed_tone(look):
    """Return slope and offset of the tone curve of a world: none without linear light."""
    if look.linear > 0.0:
        return look.contrast, look.target_grey * (1.0 - look.contrast)
    return 1.0, 0.0


@kernel
def expose(out, image, look, gain, tone, noise, start):
    """Amplify and encode the light, add the sensor's noise and round to grey values.

    Args:
        out: Frame, uint8, shape (height, width).
        image: Light; the noise is added in place unless the light is linear.
        look: Noise levels, and whether the light is linear.
        gain: Amplification of light and noise.
        tone: Slope of the tone curve, and the grey that it adds, see `fixed_tone`.
        noise: Standard normal numbers, see `noise_table`.
        start: Index of this frame's first number in `noise`.
    """
    height, width = out.shape
    mask = (1 << NOISE_LOG2) - 1
    if look.linear > 0.0:
        _encode(out, image, look, gain, tone, noise, start, mask)
        return
    zero = nb.float32(0.0)
    black, half, white = splat(zero), splat(nb.float32(0.5)), splat(nb.float32(255.0))
    noisy, scale = look.shot_noise > 0.0 or look.read_noise > 0.0, splat(nb.float32(gain))
    slope, shift = splat(nb.float32(tone[0])), splat(nb.float32(tone[1]))
    shot, read = nb.float32(look.shot_noise**2 / _MID_GREY), nb.float32(look.read_noise**2)
    for i in range(height):
        if noisy:
            for j in range(width):
                g = noise[(start + i * width + j) & mask]
                image[i, j] += g * math.sqrt(read + shot * max(image[i, j], zero))
        for j in range(0, width, LANES):
            at, count = i * width + j, width - j
            light = maximum(load_part(image, at, count), black)
            if gain != 1.0:
                light = light * scale
            if tone[0] != 1.0 or tone[1] != 0.0:
                light = maximum(madd(light, slope, shift), black)
            store_bytes(out, at, count, minimum(light, white) + half)


@kernel
def _encode(out, image, look, gain, tone, noise, start, mask):
    """Encode linear light as its square root, with noise.

    The square root of a number of photons has the same deviation for any number, so the photon noise of the
    code depends on the gain only: a gain of 4 means a quarter of the photons and twice the noise. Then the
    tone curve raises the contrast around the target of the exposure.
    """
    height, width = out.shape
    black, half, white = splat(nb.float32(0.0)), splat(nb.float32(0.5)), splat(nb.float32(255.0))
    scale = splat(nb.float32(gain * 255.0))
    level = math.sqrt(gain) * math.sqrt(look.shot_noise**2 + look.read_noise**2)
    slope, shift = splat(nb.float32(tone[0])), splat(nb.float32(tone[1]))
    noisy, level16 = level > 0.0, splat(nb.float32(level))
    for i in range(height):
        first = (start + i * width) & mask
        for j in range(0, width, LANES):
            at, count = i * width + j, width - j
            code = square_root(maximum(load_part(image, at, count), black) * scale)
            if noisy:
                code = madd(level16, load_part(noise, first + j, count), code)
            code = madd(slope, code, shift)
            store_bytes(out, at, count, minimum(maximum(code, black), white) + half)
