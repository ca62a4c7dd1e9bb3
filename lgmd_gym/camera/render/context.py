"""RenderContext: the tables and buffers to draw several cameras of one frame size in one call."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera.effects import beam_profile, look_of, noise_start, noise_table
from lgmd_gym.camera.objects import ObjectList
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pinhole import LENS, lens_values
from lgmd_gym.camera.pose import CameraPose, earlier, lens_pose
from lgmd_gym.camera.render.buffers import Tables, Views, make_buffers
from lgmd_gym.camera.render.models import all_models
from lgmd_gym.camera.render.panorama import panorama_table
from lgmd_gym.camera.render.raster import draw_frames
from lgmd_gym.camera.render.sky import skyline
from lgmd_gym.camera.render.texture import ground_texture
from lgmd_gym.camera.road_geometry import road_geometry
from lgmd_gym.camera.scene import SceneState


def context_key(p: CameraParams) -> tuple[Any, ...]:
    """Return the parameters that cameras must have in common to share a `RenderContext`."""
    common = (p.shape, p.seed, p.roadside, p.guard_rail, p.vehicles)
    # The table of a panorama includes light and fog, at the resolution of the lens.
    return common if p.panorama == "skyline" else (*common, p.panorama, p.light, p.visibility_m, p.focal_px)


class RenderContext:
    """Tables and buffers for cameras with equal `context_key`.

    Args:
        cameras: Parameters of the cameras, at least one.

    Attributes:
        params: Parameters of the cameras.
        lenses: `LENS` records at the end and at the start of the exposure, shape (cameras, 2).
        buffers: `Buffers`; `image` is the light of the last camera before the sensor.
    """

    def __init__(self, cameras: Sequence[CameraParams]) -> None:
        self.params = tuple(cameras)
        first, count = self.params[0], len(self.params)
        self.lenses = np.zeros((count, 2), LENS)
        self._focal_px = [p.focal_px for p in self.params]
        self._views = Views(
            looks=np.stack([look_of(p) for p in self.params]),
            beams=np.stack([beam_profile(p) for p in self.params]),
            skies=np.zeros((count, *first.shape), dtype=np.float32),
            sky_aims=np.full((count, 2), np.nan),
            noise_starts=np.zeros(count, dtype=np.int64),
        )
        asphalt, verge = ground_texture("asphalt", first.seed), ground_texture("verge", first.seed)
        tables = Tables(
            asphalt=asphalt.data,
            verge=verge.data,
            level_start=asphalt.level_start,
            skyline=skyline(first.seed),
            noise=noise_table(first.seed),
            panorama=panorama_table(first),
        )
        self._models = tuple(all_models())
        self.buffers = make_buffers(first.shape, len(all_models().corners_used))
        self._plain_views, self._plain_tables = tuple(self._views), tuple(tables)
        self._plain_buffers = tuple(self.buffers)
        self._paved = False

    def aim(self, scene: SceneState, gaze: tuple[float, float] | None = None) -> list[CameraPose]:
        """Pose the lenses in a scene; returns their poses at the end of the exposure."""
        poses = []
        for k, (p, focal) in enumerate(zip(self.params, self._focal_px, strict=True)):
            pose = lens_pose(p, scene, gaze)
            self.lenses[k, 0] = lens_values(pose, focal, p.shape)
            poses.append(pose)
            if p.shutter_s > 0.0:
                before = lens_pose(p, earlier(scene, p.shutter_s), gaze)
                self.lenses[k, 1] = lens_values(before, focal, p.shape)
            if p.shot_noise > 0.0 or p.read_noise > 0.0:
                start = noise_start(p.seed, scene.steps, pose.x, pose.y, pose.yaw)
                self._views.noise_starts[k] = start
        return poses

    def draw(self, out: np.ndarray, scene: SceneState, objects: ObjectList) -> None:
        """Draw the scene of the last `aim`.

        Args:
            out: Frames, uint8, shape (cameras, height, width).
            scene: State of the environment.
            objects: Objects of the scene.
        """
        p = self.params[0]
        road = road_geometry(scene.road, p.roadside, p.seed, p.guard_rail)
        if road.paved != self._paved:
            self._paved = road.paved
            self._views.looks["paved"] = float(road.paved)
        draw_frames(
            out, self.lenses, self._plain_views, road, self._plain_tables, self._models,
            objects.records, objects.count, self._plain_buffers,
        )  # fmt: skip
