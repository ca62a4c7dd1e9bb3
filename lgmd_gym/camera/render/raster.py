# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""The kernels that pose and draw the cameras of many environments, their tables and scratch memory."""

import math

import numba as nb
import numpy as np

from lgmd_gym.camera.objects import MAX_DRAWN, MODEL_MARK, OBJECT, choose_objects, is_figure, light_of_code
from lgmd_gym.camera.pose import STOPPING, noise_start, pose_lens
from lgmd_gym.camera.render.buffers import (
    Buffers,
    GroundLayer,
    SolidLayer,
    View,
    Views,
    horizon_of,
    make_buffers,
)
from lgmd_gym.camera.render.figures import draw_figure
from lgmd_gym.camera.render.ground import ROAD, above_or_below, add_ground_quad, add_lines, shade_row
from lgmd_gym.camera.render.light import BUDGET_PX, add_glare, add_sky_veil, add_sun_glare, aim_beam, light_at
from lgmd_gym.camera.render.models import Models, all_models
from lgmd_gym.camera.render.sensor import (
    adapt_contrast,
    adapt_exposure,
    add_weighted,
    blur_steps,
    expose,
    fixed_tone,
    follow_exposure,
    lens_before,
    move_objects,
    overwrite,
)
from lgmd_gym.camera.render.shadows import add_cast_shadows, add_shadow
from lgmd_gym.camera.render.sky import draw_panorama, draw_sky
from lgmd_gym.camera.render.solids import Air, distance, draw_object, first_from, order_objects, visible
from lgmd_gym.camera.render.tables import tables_at
from lgmd_gym.camera.road_geometry import RoadGeometry
from lgmd_gym.camera.roadside import PLANT_RANGE
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.bundle import Bundle


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
        air = Air(light=light, transmission=clear, opacity=opacity, away=away)
        if is_figure(obj.model):
            draw_figure(image, view, obj, models.figures, air, layer)
        else:
            draw_object(image, view, obj, models, air, layer)
        if look.night > 0.0:
            budget = add_glare(image, lens, obj, models.lamps[obj.model], clear * opacity, budget)


@kernel
def draw_light(view, road, tables, models, objects, count, buffers):
    """Draw the light at one time of the exposure to `buffers.image`; see `draw_frame`."""
    image, lens, order = buffers.image, view.lens, buffers.order
    cast_shadows = view.look.cast > 0.0
    vehicles = count
    count = append_roadside(lens, road.roadside, view.look, models.lamps, objects, count)
    n = order_objects(lens, objects, count, order, buffers.distances, buffers.extents)
    horizon = horizon_of(lens)
    draw_distance(image, view, tables, horizon, buffers)
    ground = GroundLayer(coverage=buffers.ground, corners=buffers.corners, uv=buffers.uv, quad=buffers.quad)
    add_flats(ground, view, road, objects, order, n)
    if cast_shadows:
        add_cast_shadows(ground, view, objects, vehicles, road.roadside)
    draw_ground(image, view, buffers.ground, tables, horizon)
    solids = SolidLayer(
        coverage=buffers.solids,
        corners=buffers.corners,
        uv=buffers.uv,
        axes=buffers.axes,
        greys=buffers.greys,
        joints=buffers.joints,
    )
    draw_solids(image, view, models, objects, order, n, solids)
    if view.look.glare > 0.0:
        add_sun_glare(image, lens, view.look)


@kernel
def draw_frame(frame, view, opening, road, tables, models, objects, count, buffers):
    """Draw one frame.

    Args:
        frame: Frame, uint8, shape (height, width).
        view: `View` at the end of the exposure.
        opening: `LENS` record at the start of the exposure.
        road: `RoadGeometry`.
        tables: `Tables`.
        models: `Models`.
        objects: `OBJECT` records, shape (512,); the roadside is appended to them.
        count: Number of objects.
        buffers: `Buffers`.
    """
    image, total, moment, look = buffers.image, buffers.exposure, buffers.lens[0], view.look
    end, steps = view.lens, 1
    if look.shutter_s > 0.0:
        steps = blur_steps(end, opening, look.shutter_s, objects, count)
    if steps > 1:
        total[:] = nb.float32(0.0)
    for step in range(steps):
        lens, back = end, 0.0
        if steps > 1:
            ago = (step + 0.5) / steps
            lens_before(end, opening, ago, moment)
            lens, back = moment, ago * look.shutter_s
            move_objects(objects, count, -back)
        present = View(
            lens=lens,
            look=look,
            beam=view.beam,
            sky=view.sky,
            sky_aim=view.sky_aim,
            noise_start=view.noise_start,
            exposure=view.exposure,
        )
        draw_light(present, road, tables, models, objects, count, buffers)
        if steps > 1:
            move_objects(objects, count, back)
            add_weighted(total, image, nb.float32(1.0 / steps))
    if steps > 1:
        overwrite(image, total)
    gain = adapt_exposure(view.exposure, image, look) if look.auto_exposure_s > 0.0 else 1.0
    tone = fixed_tone(look)
    if look.contrast_s > 0.0:
        tone = adapt_contrast(view.exposure, image, look, gain, tone[0])
    expose(frame, image, look, gain, tone, tables.noise, view.noise_start)


class Workspace:
    """Scratch memory of one thread for frames of one size.

    Attributes:
        buffers: `Buffers`; `image` is the light of the last frame before the sensor.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self.buffers: Buffers = make_buffers(shape, len(all_models(linear=False).corners_used))
        self._arrays = np.zeros(MAX_DRAWN, OBJECT), tuple(self.buffers)
        self._shape = shape
        self._parts: tuple[Bundle, ...] = ()
        self._joined = Bundle()

    def join(self, batch: Bundle, scene_table: Bundle, roads: Bundle) -> Bundle:
        """Return the inputs of `draw_cameras`; they are remembered until a road has to move."""
        parts = batch, scene_table, roads
        if parts != self._parts:
            models = tuple(tuple(all_models(linear=linear)) for linear in (False, True))
            self._parts = parts
            self._joined = Bundle(batch.arrays, scene_table.arrays, roads.arrays, models, self._arrays)
        return self._joined

    def __reduce__(self) -> tuple[object, ...]:
        return Workspace, (self._shape,)


@kernel(arrays=True)
def draw_cameras(first, last, frames, selected, inputs):
    """Pose and draw the selected cameras of the environments first..last-1.

    Arrays of shape (environments, members, …) hold one row per camera of this frame size.

    Args:
        first: First environment.
        last: Last environment + 1.
        frames: Frames to draw, uint8, shape (environments, members, height, width).
        selected: Cameras to draw, bool, shape (environments, members); those without tables are skipped.
        inputs: Native bundle of five: that of a `CameraBatch`, of a `SceneTable`, of a `RoadPool`, the fields
            of `Models` in display codes and in light, and as scratch memory, `OBJECT` records of shape (512,)
            and the fields of `Buffers`.
    """
    batch, scene_table, roads, variants, space = inputs.arrays
    places, mounts, lenses, views = batch
    scenes, objects, counts = scene_table
    surface, lines, roadside, spans = roads
    chosen, buffers = space
    views, buffers = Views(*views), Buffers(*buffers)
    coded, light = Models(*variants[0]), Models(*variants[1])
    for env in range(first, last):
        scene = scenes[env]
        for k in range(mounts.shape[1]):
            if not selected[env, k] or places[env, k, 0, 0] == 0:
                continue
            mount, lens, span = mounts[env, k], lenses[env, k, 0], spans[env]
            pose_lens(mount, scene, 0.0, lens)
            if mount.shutter_s > 0.0:
                pose_lens(mount, scene, mount.shutter_s, lenses[env, k, 1])
            if mount.noisy != 0:
                views.noise_starts[env, k] = noise_start(mount, scene, lens)
            views.looks[env, k].paved = float(span[6])
            if mount.gaze == STOPPING and views.looks[env, k].night > 0.0:
                aim_beam(views.beams[env, k], lens)
            if views.looks[env, k].auto_exposure_s > 0.0 or views.looks[env, k].contrast_s > 0.0:
                follow_exposure(views.exposures[env, k], scene, views.looks[env, k])
            count = choose_objects(lens, mount, objects[env], counts[env], chosen)
            road = RoadGeometry(
                surface=surface[span[0] : span[1]],
                lines=lines[span[2] : span[3]],
                roadside=roadside[span[4] : span[5]],
                paved=span[6] != 0,
            )
            view = View(
                lens=lens,
                look=views.looks[env, k],
                beam=views.beams[env, k],
                sky=views.skies[env, k],
                sky_aim=views.sky_aims[env, k],
                noise_start=views.noise_starts[env, k],
                exposure=views.exposures[env, k],
            )
            tables, models = tables_at(places[env, k]), light if view.look.linear > 0.0 else coded
            draw_frame(frames[env, k], view, lenses[env, k, 1], road, tables, models, chosen, count, buffers)
