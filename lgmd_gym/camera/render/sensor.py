# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""The image sensor: motion blur, exposure and contrast control, tone curve and noise.

The mean approximates the true light where nothing moves by more than two pixels between images. The number of
images follows from the motion in the frame; each costs as much as a sharp frame.

The state of a camera is an array of seven numbers: the gain, the gain that the last frame called for, and the
time of the last frame [s]; mean and deviation of the greys that the contrast control applies, and those of
the last frame. They are NaN before the first frame.
"""

import math

import numba as nb

from lgmd_gym.camera.effects import NOISE_LOG2
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import (
    LANES,
    load_part,
    madd,
    maximum,
    minimum,
    splat,
    square_root,
    store_bytes,
    total,
)

MAX_STEPS = 8
"""Maximum number of images per frame."""


@kernel
def blur_steps(lens, before, shutter_s, objects, count):
    """Return the number of images for an exposure: 1 without motion, else one per two pixels, 2 to 8.

    Args:
        lens: Lens at the end of the exposure.
        before: Lens at its start.
        shutter_s: Exposure time [s].
        objects: Objects at the end of the exposure.
        count: Number of objects.
    """
    f, reach = lens.focal, 1.3 * lens.centre_u / lens.focal
    way = math.sqrt((lens.x - before.x) ** 2 + (lens.y - before.y) ** 2)
    turn = abs(lens.yaw - before.yaw) + abs(lens.pitch - before.pitch)
    # Roll moves the corners of the frame most.
    turn += abs(lens.roll - before.roll) * math.sqrt(lens.centre_u**2 + lens.centre_v**2) / f
    # The ground in the lowest row: a point at the distance Z moves down by f·h·way/Z².
    fall = lens.centre_v * lens.cos_pitch - f * lens.sin_pitch
    lowest = max(lens.z * f / fall, 1.0) if fall > 1e-6 else 1e6
    pixels = f * turn + f * lens.z * way / (lowest * lowest)
    for i in range(count):
        obj = objects[i]
        dx, dy = obj.x - lens.x, obj.y - lens.y
        ahead = dx * lens.cos_yaw + dy * lens.sin_yaw
        across = dy * lens.cos_yaw - dx * lens.sin_yaw
        half = 0.5 * obj.length
        if ahead < -half or abs(across) > max(ahead, 0.0) * reach + half + 3.0:
            continue
        near = max(ahead - half, 1.0)
        ux = obj.speed * shutter_s * obj.cos - (lens.x - before.x)
        uy = obj.speed * shutter_s * obj.sin - (lens.y - before.y)
        sideways = abs(uy * lens.cos_yaw - ux * lens.sin_yaw)
        closer = abs(ux * lens.cos_yaw + uy * lens.sin_yaw)
        edge = min(abs(across) + half, near * reach)
        pixels = max(pixels, f * turn + f * (sideways + closer * edge / near) / near)
    if not pixels > 0.01:
        return 1
    return int(min(max(math.ceil(0.5 * pixels), 2.0), float(MAX_STEPS)))


@kernel
def lens_before(end, start, ago, out):
    """Write the lens at `ago` before the end of the exposure, as a share of it, to the record `out`."""
    out.x = end.x + ago * (start.x - end.x)
    out.y = end.y + ago * (start.y - end.y)
    out.z = end.z + ago * (start.z - end.z)
    out.yaw = end.yaw + ago * (start.yaw - end.yaw)
    out.pitch = end.pitch + ago * (start.pitch - end.pitch)
    out.roll = end.roll + ago * (start.roll - end.roll)
    out.focal, out.centre_u, out.centre_v, out.turn = end.focal, end.centre_u, end.centre_v, end.turn
    out.cos_yaw, out.sin_yaw = math.cos(out.yaw), math.sin(out.yaw)
    out.cos_pitch, out.sin_pitch = math.cos(out.pitch), math.sin(out.pitch)
    out.cos_roll, out.sin_roll = math.cos(out.roll), math.sin(out.roll)


@kernel
def move_objects(objects, count, time_s):
    """Move all objects along their headings for `time_s` [s]."""
    for i in range(count):
        obj = objects[i]
        obj.x += time_s * obj.speed * obj.cos
        obj.y += time_s * obj.speed * obj.sin
        obj.travelled += time_s * obj.speed


@kernel
def add_weighted(total, image, weight):
    """Add `weight` times an image to the light summed so far."""
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            total[i, j] += nb.float32(weight) * image[i, j]


@kernel
def overwrite(image, light):
    """Replace an image by another."""
    for i in range(image.shape[0]):
        for j in range(image.shape[1]):
            image[i, j] = light[i, j]


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
