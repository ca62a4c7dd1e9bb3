# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""The kernels that pose and draw the cameras of many environments, their tables and scratch memory."""

import math

import numba as nb

from lgmd_gym.camera.objects import MODEL_MARK, choose_objects, is_figure
from lgmd_gym.camera.pose import STOPPING, no_shake, noise_start, pose_lens
from lgmd_gym.camera.render.buffers import (
    CAST_SHADOWS,
    GROUND,
    LINES,
    POSE,
    ROADSIDE,
    SELECTION,
    SENSOR,
    SKY,
    SOFT_SHADOWS,
    VEHICLES,
    Buffers,
    GroundLayer,
    SolidLayer,
    View,
    Views,
    horizon_of,
    make_buffers,
)
from lgmd_gym.camera.render.figures import draw_figure
from lgmd_gym.camera.render.ground import ROAD, add_lines, add_road, shade_row
from lgmd_gym.camera.render.light import BUDGET_PX, add_glare, add_sky_veil, add_sun_glare, aim_beam, light_at
from lgmd_gym.camera.render.models import Models, all_models, most_polygons
from lgmd_gym.camera.render.seen import MAX_EYE, Seen, aim_frustum, distance, make_seen, order_objects, see
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
from lgmd_gym.camera.render.shadows import add_cast_shadows, add_shadow, find_casters
from lgmd_gym.camera.render.sky import draw_panorama, draw_sky
from lgmd_gym.camera.render.solids import Air, draw_object
from lgmd_gym.camera.render.tables import tables_at
from lgmd_gym.camera.road_geometry import RoadGeometry
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.bundle import Bundle
from lgmd_gym.kernels.clock import START, mark


@kernel
def draw_distance(image, view, tables, horizon, buffers):
    """Draw the sky and skyline, or the panorama; reuse them while the lens does not turn."""
    lens, sky, aim = view.lens, view.sky, view.sky_aim
    rows = int(min(max(math.ceil(horizon.bottom), 0.0), image.shape[0]))
    if rows == 0:
        return
    if aim[0] != lens.yaw or aim[1] != lens.pitch or aim[2] != lens.roll:
        aim[0], aim[1], aim[2] = lens.yaw, lens.pitch, lens.roll
        if tables.panorama.shape[0] > 0:
            draw_panorama(sky, lens, tables.panorama, horizon)
        else:
            draw_sky(sky, lens, tables.skyline, view.look, horizon, buffers)
    for i in range(rows):
        for j in range(image.shape[1]):
            image[i, j] = sky[i, j]
    if view.look.veil > 0.0:
        add_sky_veil(image, view, rows)


@kernel
def add_flats(layer, view, road, seen, n, member, clock):
    """Add roads, markings, shadows and marks to the ground layer."""
    lens, look = view.lens, view.look
    add_road(layer, lens, road.surface)
    add_lines(layer, lens, road.lines, look)
    mark(clock, LINES)
    for i in range(n):
        j = seen.order[i]
        if seen.lenses[j] >> member & 1 != 0:
            add_shadow(layer, lens, seen.objects[j], look)
    mark(clock, SOFT_SHADOWS)


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
def draw_solids(image, view, models, seen, n, member, vehicles, layer, clock):
    """Draw the solid objects that a lens sees from far to near, and their glare."""
    lens, look = view.lens, view.look
    along, aside = math.cos(lens.turn), math.sin(lens.turn)
    budget = BUDGET_PX
    for i in range(n):
        index = seen.order[i]
        obj = seen.objects[index]
        if obj.model == MODEL_MARK or seen.lenses[index] >> member & 1 == 0:
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
            draw_object(image, view, obj, index, models, air, layer, seen)
        if look.night > 0.0:
            budget = add_glare(image, lens, obj, models.lamps[obj.model], clear * opacity, budget)
        mark(clock, VEHICLES if index < vehicles else ROADSIDE)


@kernel
def draw_light(view, road, tables, models, seen, member, vehicles, buffers):
    """Draw the light at one time of the exposure to `buffers.image`; see `draw_frame`."""
    image, lens, clock, n = buffers.image, view.lens, buffers.clock, seen.counts[1]
    horizon = horizon_of(lens)
    draw_distance(image, view, tables, horizon, buffers)
    mark(clock, SKY)
    ground = GroundLayer(
        coverage=buffers.ground,
        corners=buffers.corners,
        uv=buffers.uv,
        outline=buffers.outline,
        frustum=seen.frusta[member],
    )
    add_flats(ground, view, road, seen, n, member, clock)
    if view.look.cast > 0.0:
        add_cast_shadows(ground, view, seen, road.roadside)
    mark(clock, CAST_SHADOWS)
    draw_near(view, tables, models, seen, member, vehicles, horizon, buffers)


@kernel
def draw_near(view, tables, models, seen, member, vehicles, horizon, buffers):
    """Draw the ground layer, the solid objects and the glare of the sun; see `draw_frame`."""
    image, clock = buffers.image, buffers.clock
    draw_ground(image, view, buffers.ground, tables, horizon)
    mark(clock, GROUND)
    solids = SolidLayer(
        coverage=buffers.solids,
        corners=buffers.corners,
        uv=buffers.uv,
        axes=buffers.axes,
        greys=buffers.greys,
        joints=buffers.joints,
    )
    draw_solids(image, view, models, seen, seen.counts[1], member, vehicles, solids, clock)
    if view.look.glare > 0.0:
        add_sun_glare(image, view.lens, view.look)


@kernel
def draw_frame(frame, view, opening, road, tables, models, seen, member, vehicles, buffers):
    """Draw one frame.

    Args:
        frame: Frame, uint8, shape (height, width).
        view: `View` at the end of the exposure.
        opening: `LENS` record at the start of the exposure.
        road: `RoadGeometry`.
        tables: `Tables`.
        models: `Models`.
        seen: `Seen`, what the lenses of this eye see at the end of the exposure; with a shutter, the eye has
            one lens, and this is brought to other times.
        member: Index of the lens in the eye.
        vehicles: Number of vehicles and obstacles in `seen`, before the roadside.
        buffers: `Buffers`.
    """
    image, total, moment, look = buffers.image, buffers.exposure, buffers.lens[0], view.look
    end, steps = view.lens, 1
    if look.shutter_s > 0.0:
        steps = blur_steps(end, opening, look.shutter_s, seen.objects, vehicles)
    if steps == 1:
        draw_light(view, road, tables, models, seen, member, vehicles, buffers)
    else:
        total[:] = nb.float32(0.0)
        for step in range(steps):
            ago = (step + 0.5) / steps
            lens_before(end, opening, ago, moment)
            move_objects(seen.objects, vehicles, -ago * look.shutter_s)
            aim_frustum(moment, seen.frusta[0])
            see(1, moment.focal, road.roadside, look, models.lamps, vehicles, seen)
            find_casters(moment, look, vehicles, road.roadside, seen)
            present = View(
                lens=moment,
                look=look,
                beam=view.beam,
                sky=view.sky,
                sky_aim=view.sky_aim,
                noise_start=view.noise_start,
                exposure=view.exposure,
            )
            draw_light(present, road, tables, models, seen, member, vehicles, buffers)
            move_objects(seen.objects, vehicles, ago * look.shutter_s)
            add_weighted(total, image, nb.float32(1.0 / steps))
        overwrite(image, total)
    expose_frame(frame, view, tables, buffers)


@kernel
def expose_frame(frame, view, tables, buffers):
    """Turn the light in `buffers.image` into a frame; see `draw_frame`."""
    image, look = buffers.image, view.look
    gain = adapt_exposure(view.exposure, image, look) if look.auto_exposure_s > 0.0 else 1.0
    tone = fixed_tone(look)
    if look.contrast_s > 0.0:
        tone = adapt_contrast(view.exposure, image, look, gain, tone[0])
    expose(frame, image, look, gain, tone, tables.noise, view.noise_start)
    mark(buffers.clock, SENSOR)


class Workspace:
    """Scratch memory of one thread for frames of one size.

    Attributes:
        buffers: `Buffers`; `image` is the light of the last frame before the sensor.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        models = all_models(linear=False)
        self.buffers: Buffers = make_buffers(shape, len(models.corners_used))
        self._arrays = tuple(make_seen(most_polygons(models))), no_shake(), tuple(self.buffers)
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


@kernel
def _pose(mount, scene, lenses, views, env, k, shake):
    """Pose a camera, and set what depends on its pose."""
    lens, look = lenses[env, k, 0], views.looks[env, k]
    pose_lens(mount, scene, 0.0, shake, lens)
    if mount.shutter_s > 0.0:
        pose_lens(mount, scene, mount.shutter_s, shake, lenses[env, k, 1])
    if mount.noisy != 0:
        views.noise_starts[env, k] = noise_start(mount, scene, lens)
    if mount.gaze == STOPPING and look.night > 0.0:
        aim_beam(views.beams[env, k], lens)
    if look.auto_exposure_s > 0.0 or look.contrast_s > 0.0:
        follow_exposure(views.exposures[env, k], scene, look)


@kernel
def _is_ready(selected, places, k):
    """Return whether a camera is selected and has tables."""
    return selected[k] and places[k, 0, 0] != 0


@kernel
def _end_of_eye(lenses, mounts, selected, places, first):
    """Return the last + 1 of the cameras from `first` on that are at its place, see `Seen`."""
    end, lens, mount = first + 1, lenses[first, 0], mounts[first]
    while end < mounts.shape[0] and end - first < MAX_EYE and mount.shutter_s == 0.0:
        other, near = mounts[end], lenses[end, 0]
        if not (_is_ready(selected, places, end) and other.shutter_s == 0.0 and other.linear == mount.linear):
            break
        if not (near.x == lens.x and near.y == lens.y and near.z == lens.z):
            break
        end += 1
    return end


@kernel
def _see_from(lenses, mount, objects, count, roadside, look, lamps, seen):
    """Find what some lenses at one place see, see `Seen`.

    Returns the number of vehicles and obstacles, and whether the order of the objects is that of each lens.
    """
    n, focal = lenses.shape[0], math.inf
    for k in range(n):
        aim_frustum(lenses[k, 0], seen.frusta[k])
        focal = min(focal, lenses[k, 0].focal)
    vehicles = choose_objects(seen.frusta, n, mount, objects, count, seen.objects)
    find_casters(lenses[0, 0], look, vehicles, roadside, seen)
    return vehicles, see(n, focal, roadside, look, lamps, vehicles, seen)


@kernel(arrays=True)
def draw_last_stages(frames, inputs):
    """Draw what is near and expose the frame of the first camera.

    These stages are a third of `draw_cameras`. A second process compiles them for numba's cache; this
    function has no other purpose. The arguments are as there.
    """
    batch, _, _, variants, space = inputs.arrays
    places, _, lenses, views = batch
    seen, _, buffers = space
    views, seen, buffers, models = Views(*views), Seen(*seen), Buffers(*buffers), Models(*variants[0])
    view = View(
        lens=lenses[0, 0, 0],
        look=views.looks[0, 0],
        beam=views.beams[0, 0],
        sky=views.skies[0, 0],
        sky_aim=views.sky_aims[0, 0],
        noise_start=views.noise_starts[0, 0],
        exposure=views.exposures[0, 0],
    )
    tables = tables_at(places[0, 0])
    draw_near(view, tables, models, seen, 0, 0, horizon_of(view.lens), buffers)
    expose_frame(frames[0, 0], view, tables, buffers)


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
            of `Models` in display codes and in light, and as scratch memory the fields of `Seen`, a `SHAKE`
            record and the fields of `Buffers`.
    """
    batch, scene_table, roads, variants, space = inputs.arrays
    places, mounts, lenses, views = batch
    scenes, objects, counts = scene_table
    surface, lines, roadside, spans = roads
    seen, shake, buffers = space
    views, seen, buffers = Views(*views), Seen(*seen), Buffers(*buffers)
    coded, light = Models(*variants[0]), Models(*variants[1])
    for env in range(first, last):
        mark(buffers.clock, START)
        span = spans[env]
        road = RoadGeometry(
            surface=surface[span[0] : span[1]],
            lines=lines[span[2] : span[3]],
            roadside=roadside[span[4] : span[5]],
            paved=span[6] != 0,
        )
        for k in range(mounts.shape[1]):
            if _is_ready(selected[env], places[env], k):
                views.looks[env, k].paved = float(span[6])
                _pose(mounts[env, k], scenes[env], lenses, views, env, k, shake[0])
        mark(buffers.clock, POSE)
        end = 0
        while end < mounts.shape[1]:
            start = end
            if not _is_ready(selected[env], places[env], start):
                end += 1
                continue
            end = _end_of_eye(lenses[env], mounts[env], selected[env], places[env], start)
            models = light if views.looks[env, start].linear > 0.0 else coded
            mark(buffers.clock, START)
            vehicles, ordered = _see_from(
                lenses[env, start:end],
                mounts[env, start],
                objects[env],
                counts[env],
                road.roadside,
                views.looks[env, start],
                models.lamps,
                seen,
            )
            mark(buffers.clock, SELECTION)
            for k in range(start, end):
                view = View(
                    lens=lenses[env, k, 0],
                    look=views.looks[env, k],
                    beam=views.beams[env, k],
                    sky=views.skies[env, k],
                    sky_aim=views.sky_aims[env, k],
                    noise_start=views.noise_starts[env, k],
                    exposure=views.exposures[env, k],
                )
                # Of objects that hide each other in turn, each lens sees others.
                if not ordered and end - start > 1:
                    order_objects(seen.frusta[k - start], lenses[env, k, 0].focal, 1 << (k - start), seen)
                tables, opening = tables_at(places[env, k]), lenses[env, k, 1]
                draw_frame(
                    frames[env, k], view, opening, road, tables, models, seen, k - start, vehicles, buffers
                )
