"""The kernel that draws one frame: sky, ground, solids from far to near, then the sensor."""

from __future__ import annotations

import math

import numba as nb

from lgmd_gym.camera.conditions import (
    LOOK_EXTINCTION,
    LOOK_GROUND,
    LOOK_HAZE,
    LOOK_NIGHT,
    LOOK_PAVED,
    LOOK_SKY,
    develop,
    lamp_light,
    weather_row,
)
from lgmd_gym.camera.ground import ROAD, add_ground_quad, distance_ahead, shade_row
from lgmd_gym.camera.jit import kernel
from lgmd_gym.camera.markings import add_lines
from lgmd_gym.camera.order import order_objects, visible
from lgmd_gym.camera.pinhole import (
    CAM_COS_PITCH,
    CAM_COS_YAW,
    CAM_CV,
    CAM_FOCAL,
    CAM_SIN_PITCH,
    CAM_SIN_YAW,
    CAM_X,
    CAM_Y,
)
from lgmd_gym.camera.scene import MODEL_MARK, OBJ_MODEL, OBJ_RANGE, OBJ_X, OBJ_Y, PLANT_RANGE
from lgmd_gym.camera.sky import draw_sky
from lgmd_gym.camera.solids import add_shadow, draw_object


@kernel
def horizon_of(cam):
    """Row coordinate of the horizon [px]."""
    return cam[CAM_CV] + cam[CAM_FOCAL] * cam[CAM_SIN_PITCH] / cam[CAM_COS_PITCH]


@kernel
def add_flats(cam, geometry, objects, order, n, scratch):
    """Add roads, markings, shadows and marks to the ground accumulator."""
    acc, pts, uv, quad = scratch[0], scratch[2], scratch[4], scratch[6]
    for i in range(geometry[0].shape[0]):
        add_ground_quad(acc, ROAD, cam, geometry[0][i], 1.0, pts, uv)
    add_lines(acc, cam, geometry[1], pts, uv)
    for i in range(n):
        add_shadow(acc, cam, objects[order[i]], pts, uv, quad)


@kernel
def draw_ground(image, cam, look, textures, scratch):
    """Draw what `add_flats` has added, over asphalt and verge, below the horizon."""
    acc, rows, beam = scratch[0], scratch[1], scratch[7]
    height, width = image.shape
    horizon = horizon_of(cam)
    start = int(min(max(math.floor(horizon), 0.0), float(height)))
    if look[LOOK_PAVED] > 0.0:
        for i in range(start, height):
            acc[i, 0, ROAD] = 1.0
    if start > 0:
        # Rounding may put the far end of a road into the row above the horizon.
        acc[start - 1] = 0.0
    weather = look[LOOK_NIGHT] > 0.0 or look[LOOK_EXTINCTION] > 0.0
    for i in range(start, height):
        part = nb.float32(min(1.0, i + 1.0 - horizon))
        grey = image[i] if part == 1.0 else rows[5, :width]
        shade_row(acc, cam, i, look[LOOK_GROUND:], textures, rows, grey)
        if weather:
            weather_row(grey, cam, distance_ahead(cam, i), look, beam)
        if part < 1.0:  # the horizon runs through this row
            for j in range(width):
                image[i, j] += part * (grey[j] - image[i, j])


@kernel
def gather_roadside(cam, roadside, objects, count):
    """Append the posts and trees within range to the objects; returns the new count."""
    n = roadside.shape[0]
    low, high = 0, n
    start = cam[CAM_X] - PLANT_RANGE
    while low < high:
        middle = (low + high) // 2
        if roadside[middle, OBJ_X] < start:
            low = middle + 1
        else:
            high = middle
    while low < n and roadside[low, OBJ_X] < cam[CAM_X] + PLANT_RANGE and count < objects.shape[0]:
        dx, dy = roadside[low, OBJ_X] - cam[CAM_X], roadside[low, OBJ_Y] - cam[CAM_Y]
        if dx * dx + dy * dy < PLANT_RANGE * PLANT_RANGE and visible(cam, roadside[low]):
            objects[count] = roadside[low]
            count += 1
        low += 1
    return count


@kernel
def draw_frame(
    out, image, sky, fresh, cam, look, geometry, textures, line, model, objects, count, noise, scratch
):
    """Draw one frame.

    Args:
        out: uint8, shape (height, width).
        image: Scratch, float32, shape (height, width).
        sky: float32, shape (height, width): the sky of the last frame.
        fresh: Whether the lens has turned since, so that the sky must be drawn.
        cam: `camera_vector(...)`.
        look: Grey levels and conditions, float64, shape (16,).
        geometry: (surface, lines, roadside) of `RoadGeometry`.
        textures: (asphalt, its offsets, verge, its offsets).
        line: `skyline(seed)`.
        model: `models.Model`.
        objects: float64, shape (>= count, 11).
        count: Number of objects.
        noise: (`noise_table(seed)`, where this frame's noise starts).
        scratch: see `EgoCamera.__init__`.
    """
    height = out.shape[0]
    order, nearness, solid_acc = scratch[8], scratch[9], scratch[10]
    pts, frame, uv, greys = scratch[2], scratch[3], scratch[4], scratch[5]
    count = gather_roadside(cam, geometry[2], objects, count)
    n = order_objects(cam, objects, count, order, nearness)
    horizon = horizon_of(cam)
    if fresh:
        draw_sky(sky, cam, line, look[LOOK_SKY:], horizon)
    for i in range(int(min(max(math.ceil(horizon), 0.0), height))):
        image[i] = sky[i]
    add_flats(cam, geometry, objects, order, n, scratch)
    draw_ground(image, cam, look, textures, scratch)
    for i in range(n):
        obj = objects[order[i]]
        if obj[OBJ_MODEL] == MODEL_MARK:
            continue
        dx, dy = obj[OBJ_X] - cam[CAM_X], obj[OBJ_Y] - cam[CAM_Y]
        away, ahead = math.sqrt(dx * dx + dy * dy), dx * cam[CAM_COS_YAW] + dy * cam[CAM_SIN_YAW]
        light = lamp_light(ahead, dy * cam[CAM_COS_YAW] - dx * cam[CAM_SIN_YAW], look[LOOK_NIGHT])
        # What is far off fades in.
        fade = min(1.0, 6.0 * (1.0 - away / obj[OBJ_RANGE]))
        clear = math.exp(-away * look[LOOK_EXTINCTION]) if look[LOOK_EXTINCTION] > 0.0 else 1.0
        air = (light, clear, look[LOOK_HAZE], look[LOOK_NIGHT], fade)
        draw_object(image, solid_acc, cam, obj, model, air, frame, pts, uv, greys)
    develop(out, image, look, noise[0], noise[1])
