"""The kernel that renders frames: sky, ground, solids from far to near, glare, sensor."""

import math

import numba as nb

from lgmd_gym.camera.objects import MODEL_MARK, is_figure, light_of_code
from lgmd_gym.camera.render.blur import add_weighted, blur_steps, lens_before, move_objects, overwrite
from lgmd_gym.camera.render.buffers import Buffers, GroundLayer, SolidLayer, Tables, View, Views
from lgmd_gym.camera.render.cast_shadows import add_cast_shadows
from lgmd_gym.camera.render.exposure import adapt_contrast, adapt_exposure
from lgmd_gym.camera.render.figures import draw_figure
from lgmd_gym.camera.render.glare import BUDGET_PX, add_glare, add_sun_glare
from lgmd_gym.camera.render.ground import ROAD, add_ground_quad, shade_row
from lgmd_gym.camera.render.ground_band import above_or_below
from lgmd_gym.camera.render.horizon import horizon_of
from lgmd_gym.camera.render.markings import add_lines
from lgmd_gym.camera.render.models import Models
from lgmd_gym.camera.render.order import distance, first_from, order_objects, visible
from lgmd_gym.camera.render.panorama import draw_panorama
from lgmd_gym.camera.render.sensor import expose, fixed_tone
from lgmd_gym.camera.render.shadows import add_shadow
from lgmd_gym.camera.render.sky import draw_sky
from lgmd_gym.camera.render.solids import Air, draw_object
from lgmd_gym.camera.render.veil import add_sky_veil
from lgmd_gym.camera.render.weather import light_at
from lgmd_gym.camera.roadside import PLANT_RANGE
from lgmd_gym.kernels import kernel


@kernel
def append_roadside(lens, roadside, look, lamps, objects, count):
    """Append the roadside within range to the objects; returns the new count.

    At night, objects with a lamp above or below the frame are kept: their halos may be in it. `lamps` is that
    of `Models`.
    """
    n, low = roadside.shape[0], first_from(roadside, lens.x - PLANT_RANGE)
    while low < n and roadside[low].x < lens.x + PLANT_RANGE and count < objects.shape[0]:
        dx, dy = roadside[low].x - lens.x, roadside[low].y - lens.y
        near = dx * dx + dy * dy < PLANT_RANGE * PLANT_RANGE
        lit = look.night > 0.0 and lamps[roadside[low].model, 1] != 0.0
        if near and visible(lens, roadside[low]) and (lit or not above_or_below(lens, roadside[low])):
            objects[count] = roadside[low]
            if objects[count].model != MODEL_MARK:
                objects[count].shade = light_of_code(objects[count].shade, look.linear)
            count += 1
        low += 1
    return count


@kernel
def draw_distance(image, view, tables, horizon, buffers):
    """Draw the sky and skyline, or the panorama; reuse them while the lens does not turn."""
    lens, sky, aim = view.lens, view.sky, view.sky_aim
    if aim[0] != lens.yaw or aim[1] != lens.pitch or aim[2] != lens.roll:
        aim[0], aim[1], aim[2] = lens.yaw, lens.pitch, lens.roll
        if tables.panorama.shape[0] > 0:
            draw_panorama(sky, lens, tables.panorama, horizon)
        else:
            draw_sky(sky, lens, tables.skyline, view.look, horizon, buffers)
    rows = int(min(max(math.ceil(horizon.bottom), 0.0), image.shape[0]))
    for i in range(rows):
        for j in range(image.shape[1]):
            image[i, j] = sky[i, j]
    if view.look.veil > 0.0:
        add_sky_veil(image, view, rows)


@kernel
def add_flats(layer, view, road, objects, order, n):
    """Add roads, markings, shadows and marks to the ground layer."""
    lens, look = view.lens, view.look
    for i in range(road.surface.shape[0]):
        add_ground_quad(layer, ROAD, lens, road.surface[i], 1.0)
    add_lines(layer, lens, road.lines, look)
    for i in range(n):
        add_shadow(layer, lens, objects[order[i]], look)


@kernel
def draw_ground(image, view, coverage, tables, horizon):
    """Draw the ground layer over asphalt and verge, below the horizon."""
    height = image.shape[0]
    start = int(min(max(math.floor(horizon.top), 0.0), float(height)))
    if view.look.paved > 0.0:
        for i in range(start, height):
            coverage[ROAD, i, 0] = 1.0
    if start > 0:
        # Rounding may put the far end of a road into the row above the horizon.
        coverage[:, start - 1] = 0.0
    if horizon.slope != 0.0:
        # Edges left of the frame may be higher than its horizon; they cancel up to rounding.
        coverage[:, :start, 0] = 0.0
    for i in range(start, height):
        shade_row(image, i, horizon, coverage, view, tables)


@kernel
def draw_solids(image, view, models, objects, order, n, layer):
    """Draw the solid objects from far to near, and their glare."""
    lens, look = view.lens, view.look
    along, aside = math.cos(lens.turn), math.sin(lens.turn)
    budget = BUDGET_PX
    for i in range(n):
        obj = objects[order[i]]
        if obj.model == MODEL_MARK:
            continue
        dx, dy = obj.x - lens.x, obj.y - lens.y
        away, ahead = distance(lens, obj), dx * lens.cos_yaw + dy * lens.sin_yaw
        across = dy * lens.cos_yaw - dx * lens.sin_yaw
        # The headlights are fixed to the car.
        light = light_at(ahead * along - across * aside, across * along + ahead * aside, look)
        # Objects fade in over the last sixth of their range.
        opacity = min(1.0, 6.0 * (1.0 - away / obj.range))
        clear = math.exp(-away * look.extinction) if look.extinction > 0.0 else 1.0
        if is_figure(obj.model):
            draw_figure(image, view, obj, models.figures, Air(light, clear, opacity, away), layer)
        else:
            draw_object(image, view, obj, models, Air(light, clear, opacity, away), layer)
        if look.night > 0.0:
            budget = add_glare(image, lens, obj, models.lamps[obj.model], clear * opacity, budget)


@kernel
def draw_light(view, road, tables, models, objects, count, buffers):
    """Draw the light at one time of the exposure to `buffers.image`; see `draw_frames`."""
    image, lens, order = buffers.image, view.lens, buffers.order
    cast_shadows = view.look.cast > 0.0
    vehicles = count
    count = append_roadside(lens, road.roadside, view.look, models.lamps, objects, count)
    n = order_objects(lens, objects, count, order, buffers.distances, buffers.extents)
    horizon = horizon_of(lens)
    draw_distance(image, view, tables, horizon, buffers)
    ground = GroundLayer(buffers.ground, buffers.corners, buffers.uv, buffers.quad)
    add_flats(ground, view, road, objects, order, n)
    if cast_shadows:
        add_cast_shadows(ground, view, objects, vehicles, road.roadside)
    draw_ground(image, view, buffers.ground, tables, horizon)
    solids = SolidLayer(
        buffers.solids, buffers.corners, buffers.uv, buffers.axes, buffers.greys, buffers.joints
    )
    draw_solids(image, view, models, objects, order, n, solids)
    if view.look.glare > 0.0:
        add_sun_glare(image, lens, view.look)


@kernel
def draw_frames(out, lenses, views, road, tables, models, objects, count, buffers):
    """Draw one frame of each of several cameras on one car.

    Args:
        out: Frames, uint8, shape (cameras, height, width).
        lenses: `LENS` records at the end and at the start of the exposure, shape (cameras, 2).
        views: The fields of `Views` (plain tuples are cheaper to pass from Python than named ones).
        road: `RoadGeometry`.
        tables: The fields of `Tables`.
        models: The fields of `Models`.
        objects: `OBJECT` records, shape (512,); the roadside is appended to them.
        count: Number of objects.
        buffers: The fields of `Buffers`.
    """
    views, tables, models, buffers = Views(*views), Tables(*tables), Models(*models), Buffers(*buffers)
    image, total, moment = buffers.image, buffers.exposure, buffers.lens[0]
    for k in range(out.shape[0]):
        end, start = lenses[k, 0], lenses[k, 1]
        look, beam, sky, sky_aim = views.looks[k], views.beams[k], views.skies[k], views.sky_aims[k]
        steps = blur_steps(end, start, look.shutter_s, objects, count) if look.shutter_s > 0.0 else 1
        if steps == 1:
            view = View(end, look, beam, sky, sky_aim)
            draw_light(view, road, tables, models, objects, count, buffers)
        else:
            total[:] = nb.float32(0.0)
            for step in range(steps):
                ago = (step + 0.5) / steps
                lens_before(end, start, ago, moment)
                move_objects(objects, count, -ago * look.shutter_s)
                view = View(moment, look, beam, sky, sky_aim)
                draw_light(view, road, tables, models, objects, count, buffers)
                move_objects(objects, count, ago * look.shutter_s)
                add_weighted(total, image, nb.float32(1.0 / steps))
            overwrite(image, total)
        gain = adapt_exposure(views.exposures[k], image, look) if look.auto_exposure_s > 0.0 else 1.0
        tone = fixed_tone(look)
        if look.contrast_s > 0.0:
            tone = adapt_contrast(views.exposures[k], image, look, gain, tone[0])
        expose(out[k], image, look, gain, tone, tables.noise, views.noise_starts[k])
