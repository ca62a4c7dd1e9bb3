"""Kernels of motion blur: the mean of several sharp images over the exposure time.

The mean approximates the true light where nothing moves by more than two pixels between images. The number of
images follows from the motion in the frame; each costs as much as a sharp frame.
"""

import math

import numba as nb

from lgmd_gym.kernels import kernel

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
