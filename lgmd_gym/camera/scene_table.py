"""SceneTable: what the cameras of many environments see, apart from the roads."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera.aim import MAX_TURN
from lgmd_gym.camera.body_motion import MAX_DEG, PITCH, ROLL, YAW
from lgmd_gym.camera.bounds import MIN_STOP
from lgmd_gym.camera.objects import MAX_DRAWN, OBJECT, View, read_objects
from lgmd_gym.camera.params import ROADS, CameraParams
from lgmd_gym.camera.scene import SCENE, Ego, read_scene
from lgmd_gym.kernels.bundle import Bundle

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

    def read(self, env: Any, view: View | None, index: int = 0) -> Ego:
        """Read the present state of a highway-env environment.

        Args:
            env: The environment, wrapped or not, after its first reset.
            view: See `read_objects`.
            index: Index of the environment.

        Raises:
            ValueError: If the environment has no road or ego yet, or a pose is not finite.
        """
        ego = read_scene(env, self._scene_bytes, index)
        self.object_counts[index] = read_objects(ego, view, self._object_bytes, index)
        return ego

    def at(self, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the views of the arrays that belong to one environment; the first axes have length 1."""
        here = slice(index, index + 1)
        return self.scenes[here], self.objects[here], self.object_counts[here]

    def _take_views(self) -> None:
        self._scene_bytes = self.scenes.view(np.uint8).data
        self._object_bytes = self.objects.reshape(-1).view(np.uint8).data

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if not name.endswith("_bytes")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._take_views()


def view_of(cameras: Sequence[CameraParams]) -> View | None:
    """Return the directions that cameras look in; None if they look all around, or if there are none."""
    if not cameras or any(_may_look_behind(p) for p in cameras):
        return None
    margins = [_max_turn_deg(p) + ROADS[p.road] * MAX_DEG[YAW] for p in cameras]
    first = min(p.yaw_deg - margin for p, margin in zip(cameras, margins, strict=True))
    last = max(p.yaw_deg + margin for p, margin in zip(cameras, margins, strict=True))
    if math.radians(last - first) > _MAX_SPREAD:
        return None
    reach = max(abs(p.mount_setback) for p in cameras) + max(abs(p.mount_left) for p in cameras)
    return View(math.radians(first), math.radians(last), reach)


def _max_turn_deg(p: CameraParams) -> float:
    """Return the largest turn of a lens relative to its mount [degrees]."""
    if p.gaze == "fixed":
        return 0.0
    aside = math.atan(abs(p.offset_m) / _least_depth(p)) if p.gaze == "stopping" else 0.0
    return math.degrees(MAX_TURN + aside)


def _least_depth(p: CameraParams) -> float:
    """Return the least distance of the aim of the gaze `"stopping"` from the lens [m]."""
    return MIN_STOP * p.reach + p.mount_setback


def _may_look_behind(p: CameraParams) -> bool:
    """Return whether a pitched camera may see what is straight below or above it, or behind it."""
    # To the side of the car, its pitch is roll.
    roll = ROADS[p.road] * (MAX_DEG[PITCH] + MAX_DEG[ROLL])
    pitch_deg, focal = abs(p.pitch_deg), p.focal_px
    if p.gaze == "stopping":
        depth = _least_depth(p)
        pitch_deg += math.degrees(abs(p.lift) * math.atan((p.mount_height + 0.1) / depth))
        focal = p.shape[1] * depth / p.span_m
    pitch = math.radians(min(pitch_deg + _MAX_DECELERATION * p.dive_deg + roll, 90.0))
    half_height = 0.5 * (p.shape[0] + p.shape[1] * math.sin(math.radians(roll)))
    return focal * math.cos(pitch) <= (half_height + 1.0) * math.sin(pitch)
