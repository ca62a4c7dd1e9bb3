"""Automatic exposure: a gain that follows the light of the frames before.

The state of a camera is an array of three numbers: the gain, the gain that the last frame called for, and the
time of the last frame [s]. They are NaN before the first frame.
"""

import math

import numba as nb

from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.simd import LANES, load_part, maximum, minimum, splat, square_root, total

_EVERY = 4  # rows between those that are measured
_GAIN, _CALLED, _TIME = 0, 1, 2


@kernel
def follow_exposure(exposure, scene, time_constant_s):
    """Bring the gain to the time of a scene; NaN at the start of an episode.

    The logarithm of the gain approaches that of the gain that the last frame called for. An episode starts at
    simulation step 0, or if the clock goes back.
    """
    passed = scene.time_s - exposure[_TIME]
    if scene.steps > 0 and passed >= 0.0:
        share = 1.0 - math.exp(-passed / time_constant_s)
        exposure[_GAIN] *= (exposure[_CALLED] / exposure[_GAIN]) ** share
    else:
        exposure[_GAIN] = math.nan
    exposure[_TIME] = scene.time_s


@kernel
def adapt_exposure(exposure, image, look):
    """Return the gain of a frame, and note the gain that it calls for, which is also that of a first frame.

    Args:
        exposure: State of the camera.
        image: Light, float32, shape (height, width).
        look: Target and bounds of the gain.
    """
    wanted = look.target_grey / max(_mean_grey(image, look.linear > 0.0), 1e-2)
    if look.linear > 0.0:
        wanted = wanted * wanted
    exposure[_CALLED] = min(max(wanted, look.least_gain), look.most_gain)
    if math.isnan(exposure[_GAIN]):
        exposure[_GAIN] = exposure[_CALLED]
    return exposure[_GAIN]


@kernel
def _mean_grey(image, linear):
    """Return the mean grey of every fourth row of the lower two thirds, at most white in each pixel.

    The weight of the road keeps a bright sky from darkening it, as in cameras of cars.
    """
    height, width = image.shape
    white, sums, count = splat(nb.float32(255.0)), splat(nb.float32(0.0)), 0
    zero = splat(nb.float32(0.0))
    for i in range(height // 3, height, _EVERY):
        for j in range(0, width, LANES):
            light = minimum(maximum(load_part(image, i * width + j, width - j), zero), white)
            sums = sums + (square_root(light * white) if linear else light)
        count += width
    return total(sums) / count
