"""SceneTable: what the cameras of many environments see, apart from the roads."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from lgmd_gym.camera.body_motion import MAX_DEG, PITCH, ROLL, YAW
from lgmd_gym.camera.camera import Camera, Fixed, ToStoppingPoint
from lgmd_gym.camera.env_state import SCENE, Ego, read_scene
from lgmd_gym.camera.objects import MAX_DRAWN, OBJECT, Sector, read_objects
from lgmd_gym.camera.pose import MAX_TURN
from lgmd_gym.camera.scene import ROADS, Scene
from lgmd_gym.kernels.bundle import Bundle

if TYPE_CHECKING:
    import gymnasium as gym


_MAX_SPREAD = math.radians(170.0)
_MAX_DECELERATION = 12.0  # bound of the deceleration in `pose` [m/s²]


class SceneTable:
    """Egos, clocks and objects of many environments.

    Args:
        num_envs: Number of environments.

    Attributes:
        scenes: `SCENE` records, shape (num_envs,).
        objects: `OBJECT` records, shape (num_envs, 512), in the order of the road's lists: vehicles, then
            objects, without the ego.
        object_counts: Number of objects, int64, shape (num_envs,).
        bundle: These arrays.
    """

    def __init__(self, num_envs: int = 1) -> None:
        self.scenes = np.zeros(num_envs, SCENE)
        self.objects = np.zeros((num_envs, MAX_DRAWN), OBJECT)
        self.object_counts = np.zeros(num_envs, dtype=np.int64)
        self.bundle = Bundle(self.scenes, self.objects, self.object_counts)
        self._take_views()

    def read(self, env: "gym.Env", sector: Sector | None, index: int = 0) -> Ego:
        """Read the present state of a highway-env environment.

        Args:
            env: The environment, wrapped or not, after its first reset.
            sector: See `read_objects`.
            index: Index of the environment.

        Raises:
            ValueError: If the environment has no road or ego yet, or a pose is not finite.
        """
        ego = read_scene(env, self._scene_bytes, index)
        self.object_counts[index] = read_objects(ego, sector, self._object_bytes, index)
        return ego

    def _take_views(self) -> None:
        self._scene_bytes = self.scenes.view(np.uint8).data
        self._object_bytes = self.objects.reshape(-1).view(np.uint8).data

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in self.__dict__.items() if not name.endswith("_bytes")}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._take_views()


def sector_of(cameras: Sequence[Camera], scene: Scene) -> Sector | None:
    """Return the directions that cameras look in; None if they look all around, or if there are none."""
    if not cameras or any(_may_look_behind(camera, scene) for camera in cameras):
        return None
    shake = ROADS[scene.road] * MAX_DEG[YAW]
    margins = [_max_turn_deg(camera) + shake for camera in cameras]
    first = min(camera.mount.yaw_deg - margin for camera, margin in zip(cameras, margins, strict=True))
    last = max(camera.mount.yaw_deg + margin for camera, margin in zip(cameras, margins, strict=True))
    if math.radians(last - first) > _MAX_SPREAD:
        return None
    mounts = [camera.mount for camera in cameras]
    reach = max(abs(mount.setback_m) for mount in mounts) + max(abs(mount.left_m) for mount in mounts)
    return Sector(math.radians(first), math.radians(last), reach)


def _max_turn_deg(camera: Camera) -> float:
    """Return the largest turn of a lens relative to its mount [degrees]."""
    if isinstance(camera.gaze, Fixed):
        return 0.0
    aside = 0.0
    if isinstance(camera.gaze, ToStoppingPoint):
        aside = math.atan(abs(camera.gaze.offset_m) / camera.least_depth_m)
    return math.degrees(MAX_TURN + aside)


def _may_look_behind(camera: Camera, scene: Scene) -> bool:
    """Return whether a pitched camera may see what is straight below or above it, or behind it."""
    # To the side of the car, its pitch is roll.
    roll = ROADS[scene.road] * (MAX_DEG[PITCH] + MAX_DEG[ROLL])
    (height, width), gaze = camera.shape, camera.gaze
    pitch_deg, focal = abs(camera.mount.pitch_deg), camera.focal_px
    if isinstance(gaze, ToStoppingPoint):
        depth = camera.least_depth_m
        pitch_deg += math.degrees(abs(gaze.lift) * math.atan((camera.mount.height_m + 0.1) / depth))
        focal = width * depth / gaze.span_m
    pitch = math.radians(min(pitch_deg + _MAX_DECELERATION * scene.dive_deg + roll, 90.0))
    half_height = 0.5 * (height + width * math.sin(math.radians(roll)))
    return focal * math.cos(pitch) <= (half_height + 1.0) * math.sin(pitch)
