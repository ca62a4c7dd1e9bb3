"""EgoCamera: the view from the ego car of a highway-env environment."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from lgmd_gym.camera.batch import CameraBatch
from lgmd_gym.camera.camera import Camera, CameraItem
from lgmd_gym.camera.effects import in_scene
from lgmd_gym.camera.pinhole import project
from lgmd_gym.camera.render.buffers import Buffers
from lgmd_gym.camera.render.raster import Workspace
from lgmd_gym.camera.road_pool import RoadPool, road_key
from lgmd_gym.camera.scene import Scene
from lgmd_gym.camera.scene_table import SceneTable, sector_of
from lgmd_gym.errors import check_positive

if TYPE_CHECKING:
    import gymnasium as gym


_UINT8 = np.dtype(np.uint8)


class EgoCamera:
    """A camera on the ego car of any highway-env environment.

    Frames are grey, uint8, shape (height, width), with row 0 at the top. The same seed and the same road
    state give the same frame, in any process. The ego's own body is not drawn.

    Args:
        camera: A preset's name, a `Camera`, a mapping of its fields, or None for `wide`.
        scene: A `Scene` or a mapping of its fields; None for the laboratory.
        **changes: Fields of `Camera` to change.

    Attributes:
        camera: The camera.
        scene: The scene.

    Example:
        >>> EgoCamera("fovea", {"weather": "fog"}, mount={"height_m": 1.4}).camera.hfov_deg
        10.0
    """

    def __init__(
        self,
        camera: CameraItem | None = None,
        scene: Scene | Mapping[str, object] | None = None,
        **changes: object,
    ) -> None:
        self.camera, self.scene = Camera.make(camera, **changes), Scene.make(scene)
        self._stage: _Stage | None = _Stage(self.camera, self.scene)
        self._lens: np.void | None = None

    @classmethod
    def posed(cls, camera: Camera, scene: Scene, lens: np.void) -> "EgoCamera":
        """Return a camera posed as in a frame that a `CameraBatch` has drawn.

        Args:
            camera: The camera.
            scene: The scene.
            lens: `LENS` record of the frame.
        """
        posed = cls.__new__(cls)
        posed.camera, posed.scene, posed._stage, posed._lens = camera, scene, None, lens
        return posed

    @property
    def shape(self) -> tuple[int, int]:
        """`(height, width)` of the frames [px]."""
        return self.camera.shape

    @property
    def buffers(self) -> Buffers:
        """Scratch memory; `image` is the light of the last frame before the sensor."""
        return self._own_stage().workspace.buffers

    @property
    def light(self) -> np.ndarray:
        """Light of the last `render` before the sensor, float32, shape (height, width) [grey levels]."""
        return self.buffers.image

    def render(
        self, env: "gym.Env", out: np.ndarray | None = None, gaze: tuple[float, float] | None = None
    ) -> np.ndarray:
        """Render the present frame.

        Args:
            env: A highway-env environment, wrapped or not, after its first reset.
            out: Frame to draw into, uint8, shape (height, width); a new one if None.
            gaze: Turn of the optical axis to the right and upwards on top of the mount, for this frame only
                [degrees]; replaces the gaze of the camera.

        Raises:
            ValueError: If the environment has no road or ego yet, or a pose is not finite.
        """
        if out is None:
            out = np.empty(self.camera.shape, dtype=np.uint8)
        else:
            check_frame(out, self.camera.shape)
        stage = self._own_stage()
        stage.render(env, out, gaze)
        self._lens = stage.batch.lenses[0, 0, 0]
        return out

    def project(self, points_m: ArrayLike) -> np.ndarray:
        """Project world points with the pose of the last frame.

        Args:
            points_m: Points (x, y, z), float, shape (..., 3) [m]; z is up from the road.

        Returns:
            Pixel coordinates (u to the right, v down), float64, shape (..., 2). Pixel [row, column]
            covers column <= u < column + 1, row <= v < row + 1. NaN behind the lens.
        """
        if self._lens is None:
            raise ValueError("no frame yet: call render() before project()")
        return project(self._lens, points_m)

    def corners(self, distance_m: float) -> np.ndarray:
        """Return the world points at the corners of the last frame.

        Args:
            distance_m: Distance of the points along the optical axis, > 0 [m].

        Returns:
            Points (x, y, z) of the corners top left, top right, bottom right and bottom left, float64, shape
            (4, 3) [m].
        """
        if self._lens is None:
            raise ValueError("no frame yet: call render() before corners()")
        lens, (height, width) = self._lens, self.shape
        scale = check_positive("distance_m", distance_m) / lens["focal"]
        right = scale * (np.array([0.0, width, width, 0.0]) - lens["centre_u"])
        down = scale * (np.array([0.0, 0.0, height, height]) - lens["centre_v"])
        right, down = (
            right * lens["cos_roll"] - down * lens["sin_roll"],
            down * lens["cos_roll"] + right * lens["sin_roll"],
        )
        ahead = distance_m * lens["cos_pitch"] + down * lens["sin_pitch"]
        up = distance_m * lens["sin_pitch"] - down * lens["cos_pitch"]
        x = lens["x"] + ahead * lens["cos_yaw"] - right * lens["sin_yaw"]
        y = lens["y"] + ahead * lens["sin_yaw"] + right * lens["cos_yaw"]
        return np.stack([x, y, lens["z"] + up], axis=-1)

    @property
    def yaw_px(self) -> int:
        """Yaw of the last frame of a derotated view in whole pixels, + to the right; 0 for other views.

        The difference of two frames is the argument `turn_px` of `FrameNeuron.step`.
        """
        return 0 if self._lens is None else int(self._lens["yaw_px"])

    def _own_stage(self) -> "_Stage":
        if self._stage is None:
            self._stage = _Stage(self.camera, self.scene)
        return self._stage


class _Stage:
    """What one camera needs to draw frames by itself."""

    def __init__(self, camera: Camera, scene: Scene) -> None:
        self.batch = CameraBatch([camera], camera.shape)
        self.batch.set_scene(0, scene)
        self.workspace = Workspace(camera.shape)
        self._scene, self._key = scene, road_key(scene)
        self._scene_table, self._roads = SceneTable(), RoadPool(1)
        self._sector = sector_of([in_scene(camera, scene)], scene)
        self._selected = np.ones((1, 1), np.bool_)
        self._turned = False  # whether the last frame had another gaze than that of the camera

    def render(self, env: "gym.Env", out: np.ndarray, gaze: tuple[float, float] | None) -> None:
        """Draw the present frame into `out`."""
        if gaze is not None or self._turned:
            self.batch.turn(0, self._scene, gaze)
            self._turned = gaze is not None
        ego = self._scene_table.read(env, None if self._turned else self._sector)
        self._roads.assign(0, ego.road, self._key)
        self.batch.draw(
            0,
            1,
            self._scene_table.bundle,
            self._roads.bundle,
            out[None, None],
            self._selected,
            self.workspace,
        )


def check_frame(out: np.ndarray, shape: tuple[int, int]) -> None:
    """Raise ValueError for a frame of another shape or dtype.

    Raises:
        ValueError: If `out` is not uint8 of this shape.
    """
    if out.shape != shape or out.dtype != _UINT8:
        raise ValueError(f"out must be uint8 of shape {shape}, got {out.dtype} {out.shape}")
