"""Drawing: the cameras of one or more environments, and their frames."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from lgmd_gym.aliases import Values
from lgmd_gym.camera.batch import CameraBatch
from lgmd_gym.camera.birdseye import BirdsEye
from lgmd_gym.camera.camera import Camera
from lgmd_gym.camera.effects import in_scene
from lgmd_gym.camera.ego import EgoCamera
from lgmd_gym.camera.objects import Sector
from lgmd_gym.camera.pose import USUAL_BRAKE, known_deceleration
from lgmd_gym.camera.render.raster import Workspace
from lgmd_gym.camera.road_geometry import RoadGeometry
from lgmd_gym.camera.road_pool import RoadPool, road_key
from lgmd_gym.camera.scene import Scene
from lgmd_gym.camera.scene_table import SceneTable, sector_of
from lgmd_gym.kernels.bundle import Bundle

if TYPE_CHECKING:
    from highway_env.road.road import Road, RoadNetwork


class FrameGroup:
    """Cameras of one frame size in every environment, drawn together.

    Args:
        cameras: The cameras; None for a top view, which is drawn by other means.
        shape: `(height, width)` of the frames [px].
        num_envs: Number of environments.

    Attributes:
        batch: The cameras.
        frames: The last frames, uint8, shape (num_envs, cameras, height, width).
    """

    def __init__(self, cameras: Sequence[Camera | None], shape: tuple[int, int], num_envs: int) -> None:
        self.batch = CameraBatch(cameras, shape, num_envs)
        self.frames = np.zeros((num_envs, len(cameras), *shape), np.uint8)
        self._workspaces: list[Workspace] = []

    def draw(self, first: int, last: int, scene_table: Bundle, roads: Bundle, selected: np.ndarray) -> None:
        """Draw selected cameras, bool, shape (num_envs, cameras), of the environments first..last-1."""
        try:  # threads take and return workspaces; both list operations are atomic
            workspace = self._workspaces.pop()
        except IndexError:
            workspace = Workspace(self.batch.shape)
        self.batch.draw(first, last, scene_table, roads, self.frames, selected, workspace)
        self._workspaces.append(workspace)

    def __getstate__(self) -> Values:
        return self.__dict__ | {"_workspaces": []}


class Drawing:
    """Cameras of one or more environments, in groups that are drawn together.

    Args:
        cameras: Cameras of every environment.
        groups: Indices of the cameras of each group, which have one frame size. Groups with equal cameras,
            such as those of two neurons on one lens, share their frames.
        num_envs: Number of environments.

    Attributes:
        groups: The distinct groups.
        group_of: Index of the distinct group for each group of the arguments.
        scene_table: State of the environments, see `SceneTable`.
        roads: Their roads.
        known_decelerations: The car's estimate of its full braking in each environment, float64, shape
            (num_envs, 1) [m/s²]; None unless a camera uses it.
    """

    def __init__(
        self, cameras: Sequence[Camera | BirdsEye], groups: Sequence[Sequence[int]], num_envs: int
    ) -> None:
        self._cameras = [camera if isinstance(camera, Camera) else None for camera in cameras]
        self._top_views = [
            {
                k: BirdsEye(camera.shape, camera.scaling)
                for k, camera in enumerate(cameras)
                if isinstance(camera, BirdsEye)
            }
            for _ in range(num_envs)
        ]
        self.scene_table, self.roads = SceneTable(num_envs), RoadPool(num_envs)
        self._scenes = [(Scene(), USUAL_BRAKE)] * num_envs
        self._sectors: dict[int, Sector | None] = {}  # by environment
        self.groups: list[FrameGroup] = []
        self.group_of: list[int] = []
        self._locations = {k: (g, row) for g, group in enumerate(groups) for row, k in enumerate(group)}
        known: dict[tuple[Camera | None, ...], int] = {}
        for group in groups:
            members = [self._cameras[k] for k in group]
            key = tuple(_without_name(camera) for camera in members)
            if key not in known or None in key:
                known[key] = len(self.groups)
                self.groups.append(FrameGroup(members, cameras[group[0]].shape, num_envs))
            self.group_of.append(known[key])
        self.known_decelerations: np.ndarray | None = None
        if any(camera.gaze.brake_known for camera in self._cameras if camera is not None):
            self.known_decelerations = np.full((num_envs, 1), USUAL_BRAKE)

    def read(self, env: gym.Env, index: int) -> None:
        """Read the present state of a highway-env environment; see `SensorArray.read`."""
        if index not in self._sectors:
            scene = self._scenes[index][0]
            cameras = [in_scene(camera, scene) for camera in self._cameras if camera is not None]
            self._sectors[index] = sector_of(cameras, scene)
        base: Any = env.unwrapped
        self.scene_table.read(base, self._sectors[index], index)
        self.set_road(index, base.road)

    def render_top_views(self, env: gym.Env, index: int, enabled: np.ndarray) -> None:
        """Render the enabled top views of an environment; `enabled` is bool, shape (cameras,)."""
        for camera, top_view in self._top_views[index].items():
            if enabled[camera]:
                top_view.render(env, self.frame_of(camera, index))

    def set_road(self, index: int, road: "Road | RoadNetwork", geometry: RoadGeometry | None = None) -> None:
        """Set the road of an environment; see `SensorArray.set_road`."""
        self.roads.assign(index, road, road_key(self._scenes[index][0]), geometry)

    def set_scene(self, index: int, scene: Scene, max_deceleration: float) -> None:
        """Set the scene of an environment; see `SensorArray.set_scene`."""
        if (scene, max_deceleration) == self._scenes[index]:
            return
        for group in self.groups:
            group.batch.set_scene(index, scene, max_deceleration)
        if self.known_decelerations is not None:
            self.known_decelerations[index] = known_deceleration(scene, max_deceleration)
        self._scenes[index] = scene, max_deceleration
        self._sectors.pop(index, None)

    def draw(self, group: int, first: int, last: int, selected: np.ndarray) -> None:
        """Draw selected cameras of a distinct group; see `FrameGroup.draw`."""
        self.groups[group].draw(first, last, self.scene_table.bundle, self.roads.bundle, selected)

    def frame_of(self, camera: int, index: int) -> np.ndarray:
        """Return a view of the last frame of one camera of an environment, uint8, (height, width)."""
        group, row = self._locations[camera]
        return self.groups[self.group_of[group]].frames[index, row]

    def camera_of(self, camera: int, index: int) -> EgoCamera | BirdsEye:
        """Return one camera of an environment, posed as in its last frame."""
        lens = self._cameras[camera]
        if lens is None:
            return self._top_views[index][camera]
        group, row = self._locations[camera]
        batch = self.groups[self.group_of[group]].batch
        return EgoCamera.posed(lens, self._scenes[index][0], batch.lenses[index, row, 0])

    def close(self) -> None:
        """Close the cameras that hold resources."""
        for top_views in self._top_views:
            for top_view in top_views.values():
                top_view.close()


def _without_name(camera: Camera | None) -> Camera | None:
    return None if camera is None else Camera.make(camera, name="view")
