"""Automatic exposure and contrast control: gains that follow the light of the frames before.

The state of a camera is an array of seven numbers: the gain, the gain that the last frame called for, and the
time of the last frame [s]; mean and deviation of the greys that the contrast control applies, and those of
the last frame. They are NaN before the first frame.
"""

import math

import numba as nb

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load_part, madd, maximum, minimum, splat, square_root, total

_EVERY = 4  # rows between those that are measured
_GAIN, _CALLED, _TIME, _MEAN, _DEVIATION, _LAST_MEAN, _LAST_DEVIATION = range(7)
STATE_SIZE = 7
CONTRAST_GREY, CONTRAST_MEAN = 25.0, 110.0
"""Deviation and mean to which the contrast control brings the greys of a frame."""
CONTRAST_GAINS = (0.5, 3.0)
"""Least and largest gain of the contrast control."""


@kernel
def follow_exposure(exposure, scene, look):
    """Bring the state to the time of a scene; NaN at the start of an episode.

    The logarithm of the gain approaches that of the gain that the last frame called for, mean and deviation
    approach those of the last frame. An episode starts at simulation step 0, or if the clock goes back.
    """
    passed = scene.time_s - exposure[_TIME]
    if scene.steps > 0 and passed >= 0.0:
        if look.auto_exposure_s > 0.0:
            share = 1.0 - math.exp(-passed / look.auto_exposure_s)
            exposure[_GAIN] *= (exposure[_CALLED] / exposure[_GAIN]) ** share
        if look.contrast_s > 0.0:
            share = 1.0 - math.exp(-passed / look.contrast_s)
            exposure[_MEAN] += share * (exposure[_LAST_MEAN] - exposure[_MEAN])
            exposure[_DEVIATION] += share * (exposure[_LAST_DEVIATION] - exposure[_DEVIATION])
    else:
        exposure[:] = math.nan
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


@kernel
def adapt_contrast(exposure, image, look, gain, slope):
    """Return slope and offset of a tone curve with contrast control, and note mean and deviation of a frame.

    The control brings the deviation of the greys to `CONTRAST_GREY`, with a gain within `CONTRAST_GAINS`, and
    their mean to `CONTRAST_MEAN`.

    Args:
        exposure: State of the camera.
        image: Light, float32, shape (height, width).
        look: Whether the light is linear.
        gain: Gain of the exposure.
        slope: Slope of the tone curve without contrast control.
    """
    mean, deviation = _moments(image, look.linear > 0.0, gain)
    exposure[_LAST_MEAN], exposure[_LAST_DEVIATION] = mean, slope * deviation
    if math.isnan(exposure[_MEAN]):
        exposure[_MEAN], exposure[_DEVIATION] = mean, slope * deviation
    least, most = CONTRAST_GAINS
    slope *= min(max(CONTRAST_GREY / max(exposure[_DEVIATION], 1e-3), least), most)
    return slope, CONTRAST_MEAN - slope * exposure[_MEAN]


@kernel
def _moments(image, linear, gain):
    """Return mean and standard deviation of the codes of a frame, at most white in each pixel."""
    height, width = image.shape
    zero, white, scale = splat(nb.float32(0.0)), splat(nb.float32(255.0)), splat(nb.float32(gain))
    sums, squares = zero, zero
    for i in range(height):
        for j in range(0, width, LANES):
            # Lanes beyond the row are loaded as 0 and add nothing.
            light = maximum(load_part(image, i * width + j, width - j), zero) * scale
            code = minimum(square_root(light * white) if linear else light, white)
            sums, squares = sums + code, madd(code, code, squares)
    count = height * width
    mean = total(sums) / count
    return mean, math.sqrt(max(total(squares) / count - mean * mean, 0.0))
