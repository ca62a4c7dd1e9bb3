"""The kernel that draws one frame: sky, ground, solids from far to near, then the sensor."""

from __future__ import annotations

import math

import numba as nb

from lgmd_gym.camera.effects import (
    LOOK_EXTINCTION,
    LOOK_GROUND,
    LOOK_HAZE,
    LOOK_NIGHT,
    LOOK_PAVED,
    LOOK_SHUTTER,
    LOOK_SKY,
    develop,
    lamp_light,
    weather_row,
)
from lgmd_gym.camera.pinhole import (
    CAM_COS_PITCH,
    CAM_COS_YAW,
    CAM_CV,
    CAM_FOCAL,
    CAM_PITCH,
    CAM_SIN_PITCH,
    CAM_SIN_YAW,
    CAM_X,
    CAM_Y,
    CAM_YAW,
)
from lgmd_gym.camera.render.blur import add_share, blur_steps, lens_at, move_objects
from lgmd_gym.camera.render.glare import BUDGET_PX, add_glare
from lgmd_gym.camera.render.ground import ROAD, add_ground_quad, distance_ahead, shade_row
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.render.markings import add_lines
from lgmd_gym.camera.render.order import order_objects, visible
from lgmd_gym.camera.render.panorama import draw_panorama
from lgmd_gym.camera.render.sky import draw_sky
from lgmd_gym.camera.render.solids import add_shadow, draw_object
from lgmd_gym.camera.scene import MODEL_MARK, OBJ_MODEL, OBJ_RANGE, OBJ_X, OBJ_Y, PLANT_RANGE


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
def draw_ground(image, cam, look, beam, textures, scratch):
    """Draw what `add_flats` has added, over asphalt and verge, below the horizon."""
    acc, rows = scratch[0], scratch[1]
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
def draw_light(image, sky, sky_of, cam, look, beam, geometry, tables, model, objects, count, scratch):
    """Draw the light that falls on the sensor; see `draw_frames` for the arguments."""
    height = image.shape[0]
    order, nearness, solid_acc = scratch[7], scratch[8], scratch[9]
    pts, frame, uv, greys = scratch[2], scratch[3], scratch[4], scratch[5]
    count = gather_roadside(cam, geometry[2], objects, count)
    n = order_objects(cam, objects, count, order, nearness)
    horizon = horizon_of(cam)
    if sky_of[0] != cam[CAM_YAW] or sky_of[1] != cam[CAM_PITCH]:
        sky_of[0], sky_of[1] = cam[CAM_YAW], cam[CAM_PITCH]
        if tables[3].shape[0] > 0:
            draw_panorama(sky, cam, tables[3], horizon)
        else:
            draw_sky(sky, cam, tables[1], look[LOOK_SKY:], horizon)
    for i in range(int(min(max(math.ceil(horizon), 0.0), height))):
        image[i] = sky[i]
    add_flats(cam, geometry, objects, order, n, scratch)
    draw_ground(image, cam, look, beam, tables[0], scratch)
    budget = BUDGET_PX
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
        draw_object(image, solid_acc, scratch[1], cam, obj, model, air, frame, pts, uv, greys)
        if look[LOOK_NIGHT] > 0.0:
            budget = add_glare(image, cam, obj, clear * fade, budget)


@kernel
def draw_frames(out, image, cams, views, geometry, tables, model, objects, count, scratch):
    """Draw one frame of each of several cameras on one car.

    Args:
        out: uint8, shape (cameras, height, width).
        image: Scratch, float32, shape (height, width).
        cams: `camera_vector(...)` at the end and at the start of the exposure, shape (cameras, 2, 12).
        views: Per camera: grey levels and conditions (17,), low beam (width,), sky (height, width),
            yaw and pitch that the sky was drawn for (2,), where the frame's noise starts.
        geometry: (surface, lines, roadside) of `RoadGeometry`.
        tables: (asphalt, its offsets, verge, its offsets), `skyline(seed)`, `noise_table(seed)`,
            `panorama_table(...)`.
        model: `models.Model`.
        objects: float64, shape (>= count, 12).
        count: Number of objects.
        scratch: see `lgmd_gym.camera.render.context`.
    """
    looks, beams, skies, sky_of, starts = views
    for k in range(out.shape[0]):
        look, beam, sky = looks[k], beams[k], skies[k]
        steps = 1
        if look[LOOK_SHUTTER] > 0.0:
            steps = blur_steps(cams[k], look[LOOK_SHUTTER], objects, count)
        if steps == 1:
            draw_light(
                image,
                sky,
                sky_of[k],
                cams[k, 0],
                look,
                beam,
                geometry,
                tables,
                model,
                objects,
                count,
                scratch,
            )
        else:
            cam, total = scratch[11], scratch[10]
            total[:] = nb.float32(0.0)
            for step in range(steps):
                ago = (step + 0.5) / steps
                lens_at(cams[k], ago, cam)
                move_objects(objects, count, -ago * look[LOOK_SHUTTER])
                draw_light(
                    image, sky, sky_of[k], cam, look, beam, geometry, tables, model, objects, count, scratch
                )
                move_objects(objects, count, ago * look[LOOK_SHUTTER])
                add_share(total, image, nb.float32(1.0 / steps))
            image[:] = total
        develop(out[k], image, look, tables[2], starts[k])
