"""Kernels of the exposure: what moves while the shutter is open is drawn several times over.

The mean of a few sharp pictures is close to the true light where nothing moves by more than two pixels
from one to the next; how many that takes is reckoned from the frame itself. Each costs a frame.
"""

from __future__ import annotations

import math

import numba as nb

from lgmd_gym.camera.pinhole import (
    CAM_COS_PITCH,
    CAM_COS_YAW,
    CAM_CU,
    CAM_CV,
    CAM_FOCAL,
    CAM_PITCH,
    CAM_SIN_PITCH,
    CAM_SIN_YAW,
    CAM_X,
    CAM_Y,
    CAM_YAW,
    CAM_Z,
)
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.scene import OBJ_COS, OBJ_LENGTH, OBJ_SIN, OBJ_SPEED, OBJ_X, OBJ_Y

MAX_STEPS = 8
"""No frame is the mean of more pictures than this."""


@kernel
def blur_steps(pair, shutter, objects, count):
    """Pictures that the exposure takes: one for two pixels of the largest motion, two to eight.

    Args:
        pair: `camera_vector(...)` at the end and at the start of the exposure, shape (2, 12).
        shutter: Exposure time [s].
        objects: float64, shape (>= count, 12).
        count: Number of objects.
    """
    cam, before = pair[0], pair[1]
    f, reach = cam[CAM_FOCAL], 1.3 * cam[CAM_CU] / cam[CAM_FOCAL]
    way = math.sqrt((cam[CAM_X] - before[CAM_X]) ** 2 + (cam[CAM_Y] - before[CAM_Y]) ** 2)
    turn = abs(cam[CAM_YAW] - before[CAM_YAW]) + abs(cam[CAM_PITCH] - before[CAM_PITCH])
    # The ground in the lowest row: a point at the distance Z runs down by f·h·way/Z².
    fall = cam[CAM_CV] * cam[CAM_COS_PITCH] - f * cam[CAM_SIN_PITCH]
    lowest = max(cam[CAM_Z] * f / fall, 1.0) if fall > 1e-6 else 1e6
    pixels = f * turn + f * cam[CAM_Z] * way / (lowest * lowest)
    for i in range(count):
        dx, dy = objects[i, OBJ_X] - cam[CAM_X], objects[i, OBJ_Y] - cam[CAM_Y]
        ahead = dx * cam[CAM_COS_YAW] + dy * cam[CAM_SIN_YAW]
        across = dy * cam[CAM_COS_YAW] - dx * cam[CAM_SIN_YAW]
        half = 0.5 * objects[i, OBJ_LENGTH]
        if ahead < -half or abs(across) > max(ahead, 0.0) * reach + half + 3.0:
            continue
        near = max(ahead - half, 1.0)
        speed = objects[i, OBJ_SPEED]
        ux = speed * shutter * objects[i, OBJ_COS] - (cam[CAM_X] - before[CAM_X])
        uy = speed * shutter * objects[i, OBJ_SIN] - (cam[CAM_Y] - before[CAM_Y])
        sideways = abs(uy * cam[CAM_COS_YAW] - ux * cam[CAM_SIN_YAW])
        closer = abs(ux * cam[CAM_COS_YAW] + uy * cam[CAM_SIN_YAW])
        edge = min(abs(across) + half, near * reach)
        pixels = max(pixels, f * turn + f * (sideways + closer * edge / near) / near)
    if not pixels > 0.01:
        return 1
    return int(min(max(math.ceil(0.5 * pixels), 2.0), float(MAX_STEPS)))


@kernel
def lens_at(pair, ago, cam):
    """Write the lens's pose a share `ago` of the exposure before its end to `cam`."""
    for i in range(cam.shape[0]):
        cam[i] = pair[0, i] + ago * (pair[1, i] - pair[0, i])
    cam[CAM_COS_YAW], cam[CAM_SIN_YAW] = math.cos(cam[CAM_YAW]), math.sin(cam[CAM_YAW])
    cam[CAM_COS_PITCH], cam[CAM_SIN_PITCH] = math.cos(cam[CAM_PITCH]), math.sin(cam[CAM_PITCH])


@kernel
def move_objects(objects, count, time):
    """Move all objects along their headings for a time [s]."""
    for i in range(count):
        objects[i, OBJ_X] += time * objects[i, OBJ_SPEED] * objects[i, OBJ_COS]
        objects[i, OBJ_Y] += time * objects[i, OBJ_SPEED] * objects[i, OBJ_SIN]


@kernel
def add_share(total, image, share):
    """Add a share of an image to the light summed so far."""
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            total[i, j] += nb.float32(share) * image[i, j]
