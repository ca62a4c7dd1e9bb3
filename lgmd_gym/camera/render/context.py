"""The kernel that poses and draws the cameras of many environments, and its tables and scratch memory."""

from typing import Any

import numpy as np

from lgmd_gym.camera.aim import STOPPING
from lgmd_gym.camera.effects import noise_table
from lgmd_gym.camera.objects import MAX_DRAWN, OBJECT, choose_objects
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pose import noise_start, pose_lens
from lgmd_gym.camera.render.buffers import Buffers, Tables, Views, make_buffers
from lgmd_gym.camera.render.bundle import Bundle
from lgmd_gym.camera.render.exposure import follow_exposure
from lgmd_gym.camera.render.models import all_models
from lgmd_gym.camera.render.panorama import panorama_table
from lgmd_gym.camera.render.raster import draw_frames
from lgmd_gym.camera.render.sky import skyline
from lgmd_gym.camera.render.texture import ground_texture
from lgmd_gym.camera.render.weather import aim_beam
from lgmd_gym.camera.road_geometry import RoadGeometry
from lgmd_gym.camera.worlds import draw_world
from lgmd_gym.kernels import kernel

_MAX_JOINED = 8  # tables that a workspace remembers


def tables_key(p: CameraParams) -> tuple[Any, ...]:
    """Return the parameters that cameras of one frame size must have in common to share `SharedTables`."""
    world = draw_world(p.world)
    key = (world.asphalt, world.verge, world.skyline) if world.drawn else (p.seed, p.linear_light)
    if p.panorama != "skyline":
        # The table of a panorama includes light and fog, at the resolution of the lens.
        key = *key, p.panorama, p.seed, p.light, p.visibility_m, p.focal_px
    return key


class SharedTables:
    """Lookup tables for the cameras with one `tables_key`; copies share the arrays.

    Attributes:
        bundle: The fields of `Tables`, then those of `Models`.
    """

    def __init__(self, p: CameraParams) -> None:
        self._params = p
        world = draw_world(p.world)
        grounds = (world.asphalt, world.verge) if world.drawn else (("asphalt", p.seed), ("verge", p.seed))
        asphalt, verge = (ground_texture(*ground) for ground in grounds)
        tables = Tables(
            asphalt=asphalt.data,
            verge=verge.data,
            level_start=asphalt.level_start,
            skyline=skyline(100_000 + world.skyline if world.drawn else p.seed),
            noise=noise_table(0 if world.drawn else p.seed),
            panorama=panorama_table(p),
        )
        self.bundle = Bundle(tuple(tables), tuple(all_models(linear=p.linear_light)))

    def __deepcopy__(self, memo: dict[int, Any]) -> "SharedTables":
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return SharedTables, (self._params,)


class Workspace:
    """Scratch memory of one thread for frames of one size.

    Attributes:
        buffers: `Buffers`; `image` is the light of the last frame before the sensor.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        self.buffers: Buffers = make_buffers(shape, len(all_models(linear=False).corners_used))
        self._arrays = np.zeros(MAX_DRAWN, OBJECT), tuple(self.buffers)
        self._shape = shape
        self._scene: tuple[Bundle, ...] = ()
        self._joined: dict[Bundle, Bundle] = {}

    def join(self, batch: Bundle, scene_table: Bundle, roads: Bundle, tables: Bundle) -> Bundle:
        """Return the inputs of `draw_cameras`; they are remembered until a road has to move."""
        scene = batch, scene_table, roads
        if scene != self._scene or len(self._joined) > _MAX_JOINED:
            self._scene, self._joined = scene, {}
        joined = self._joined.get(tables)
        if joined is None:
            joined = Bundle(batch.arrays, scene_table.arrays, roads.arrays, tables.arrays, self._arrays)
            self._joined[tables] = joined
        return joined

    def __reduce__(self) -> tuple[Any, ...]:
        return Workspace, (self._shape,)


@kernel(arrays=True)
def draw_cameras(first, last, tables_index, frames, selected, inputs):
    """Pose and draw the selected cameras of the environments first..last-1.

    Arrays of shape (environments, members, …) hold one row per camera of this frame size.

    Args:
        first: First environment.
        last: Last environment + 1.
        tables_index: Index of `tables`; cameras with other tables are skipped.
        frames: Frames to draw, uint8, shape (environments, members, height, width).
        selected: Cameras to draw, bool, shape (environments, members).
        inputs: Native bundle of five: that of a `CameraBatch`, of a `SceneTable`, of a `RoadPool`, of
            `SharedTables`, and as scratch memory, `OBJECT` records of shape (512,) and the fields of
            `Buffers`.
    """
    batch, scene_table, roads, tables, space = inputs.arrays
    tables_indices, cameras, mounts, lenses, views = batch
    scenes, objects, counts = scene_table
    surface, lines, roadside, spans = roads
    lookup_tables, models = tables
    chosen, buffers = space
    views = Views(*views)
    for env in range(first, last):
        scene = scenes[env]
        for k in range(cameras.shape[0]):
            if not selected[env, k] or tables_indices[env, k] != tables_index:
                continue
            mount, lens, span = mounts[env, k], lenses[env, k, 0], spans[env, cameras[k]]
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
                surface[span[0] : span[1]],
                lines[span[2] : span[3]],
                roadside[span[4] : span[5]],
                span[6] != 0,
            )
            rows = (
                views.looks[env, k : k + 1], views.beams[env, k : k + 1], views.skies[env, k : k + 1],
                views.sky_aims[env, k : k + 1], views.noise_starts[env, k : k + 1],
                views.exposures[env, k : k + 1],
            )  # fmt: skip
            draw_frames(
                frames[env, k : k + 1], lenses[env, k : k + 1], rows, road, lookup_tables, models, chosen,
                count, buffers,
            )  # fmt: skip
