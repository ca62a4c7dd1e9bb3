"""EgoCamera: what the driver of a highway-env car sees, as grey frames."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera.conditions import (
    LOOK_PAVED,
    beam_of,
    body_pitch,
    clock_of,
    look_of,
    noise_offset,
    noise_table,
)
from lgmd_gym.camera.models import all_models
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pinhole import Pose, camera_vector, mounted_pose, project
from lgmd_gym.camera.raster import draw_frame
from lgmd_gym.camera.scene import (
    MAX_DRAWN,
    OBJ_SIZE,
    ego_of,
    objects_into,
    road_geometry,
)
from lgmd_gym.camera.sky import skyline
from lgmd_gym.camera.texture import ground_texture

_PATH_S = 1.0  # how far ahead in time the gaze "path" looks [s]
_PATH_MAX = math.radians(40.0)


class EgoCamera:
    """A camera on the ego car of any highway-env environment.

    Frames are grey, uint8, shape (height, width), row 0 at the top. The same seed and the same road
    state give the same frame, in any process. The ego's own body is not drawn.

    Args:
        params: A preset's name, `CameraParams`, a dict of its fields, or None for `wide`.
        fields: Fields of `CameraParams` to change.

    Example:
        >>> EgoCamera("fovea", mount_height=1.4).params.hfov_deg
        10.0
    """

    def __init__(self, params: Any = None, **fields: Any) -> None:
        self._params = CameraParams.make(params, **fields)
        height, width = self._params.shape
        centre = camera_vector(Pose(0.0, 0.0, 0.0, 0.0, 0.0), self._params.focal_px, self._params.shape)
        self._image = np.zeros((height, width), dtype=np.float32)
        self._sky = np.zeros((height, width), dtype=np.float32)
        self._objects = np.zeros((MAX_DRAWN, OBJ_SIZE))
        self._model = all_models()
        self._scratch = (
            np.zeros((height, width + 2, 3), dtype=np.float32),  # ground accumulator
            np.zeros((6, width + 2), dtype=np.float32),  # rows of the ground
            np.zeros((16, 3)),  # corners in camera axes
            np.zeros((5, 3)),  # axes of an object
            np.zeros((20, 2)),  # projected corners
            np.zeros((len(self._model.corners_used), 2)),  # grey and light of polygons
            np.zeros(8),  # a quad on the ground
            beam_of(centre, width),  # low beam over the columns
            np.zeros(MAX_DRAWN, dtype=np.int64),  # order
            np.zeros(MAX_DRAWN),  # distances
            np.zeros((height, width + 2, 2), dtype=np.float32),  # accumulator of the solids
        )
        self._textures = (
            *ground_texture("asphalt", self._params.seed),
            *ground_texture("verge", self._params.seed),
        )
        self._noise = noise_table(self._params.seed)
        self._line = skyline(self._params.seed)
        self._look = look_of(self._params)
        self._sky_of: tuple[float, ...] = ()
        self._cam: np.ndarray | None = None

    @property
    def params(self) -> CameraParams:
        """The parameters of this camera."""
        return self._params

    @property
    def shape(self) -> tuple[int, int]:
        """`(height, width)` of the frames [px]."""
        return self._params.shape

    def render(
        self, env: Any, out: np.ndarray | None = None, gaze: tuple[float, float] | None = None
    ) -> np.ndarray:
        """Return what the ego car of `env` sees now.

        Args:
            env: A highway-env environment, wrapped or not, after its first reset.
            out: Frame to draw into, uint8, shape (height, width); a new one if None.
            gaze: Turn of the optical axis to the right and upwards on top of the mount, for this
                frame only [degrees]; replaces the `path` gaze.

        Raises:
            ValueError: If there is no road or ego yet, or a pose is not finite.
        """
        out = self._checked_out(out)
        p = self._params
        road, ego = ego_of(env)
        ticks, time_s = clock_of(env)
        pose = self._pose(ego, gaze, time_s)
        cam = camera_vector(pose, p.focal_px, p.shape)
        geometry = road_geometry(road, p.roadside, p.seed)
        look = (math.cos(pose.yaw), math.sin(pose.yaw))
        boxes = p.vehicles == "box"
        count = objects_into(self._objects, road, ego, pose.x, pose.y, look, p.seed, boxes)
        turned = self._sky_of != pose[3:]
        self._sky_of = pose[3:]
        self._look[LOOK_PAVED] = float(geometry.paved)
        draw_frame(
            out,
            self._image,
            self._sky,
            turned,
            cam,
            self._look,
            (geometry.surface, geometry.lines, geometry.roadside),
            self._textures,
            self._line,
            self._model,
            self._objects,
            count,
            (self._noise, noise_offset(p.seed, ticks, pose.x, pose.y, pose.yaw)),
            self._scratch,
        )
        self._cam = cam
        return out

    def render_batch(self, scenes: Sequence[Any], out: np.ndarray | None = None) -> np.ndarray:
        """Render several environments with this camera.

        Args:
            scenes: Environments, as for `render`.
            out: Frames to draw into, uint8, shape (N, height, width); new ones if None.

        Returns:
            Frames, uint8, shape (N, height, width). `project` then speaks of the last of them.
        """
        shape = (len(scenes), *self._params.shape)
        if out is None:
            out = np.empty(shape, dtype=np.uint8)
        elif out.shape != shape:
            raise ValueError(f"out must be uint8 of shape {shape}, got {out.dtype} {out.shape}")
        for env, frame in zip(scenes, out, strict=True):
            self.render(env, frame)
        return out

    def project(self, points_m: Any) -> np.ndarray:
        """Project world points with the pose of the last frame.

        Args:
            points_m: Points (x, y, z), float, shape (..., 3) [m]; z is up from the road.

        Returns:
            Pixel coordinates (u to the right, v down), float64, shape (..., 2). Pixel [row, column]
            covers column <= u < column + 1, row <= v < row + 1. NaN behind the lens.
        """
        if self._cam is None:
            raise ValueError("no frame yet: call render() before project()")
        return project(self._cam, np.asarray(points_m, dtype=np.float64))

    def _pose(self, ego: Any, gaze: tuple[float, float] | None, time_s: float) -> Pose:
        p = self._params
        px, py = float(ego.position[0]), float(ego.position[1])
        heading = float(ego.heading)
        if not math.isfinite(px + py + heading):
            raise ValueError(f"the ego vehicle has position ({px}, {py}) and heading {heading}")
        x, y, z = mounted_pose(px, py, heading, ego.LENGTH, p.mount_height, p.mount_setback, p.mount_left)
        yaw, pitch = p.yaw_deg, p.pitch_deg
        if gaze is not None:
            yaw, pitch = yaw + gaze[0], pitch + gaze[1]
        elif p.gaze == "path":
            yaw += math.degrees(_path_yaw(ego))
        return Pose(x, y, z, heading + math.radians(yaw), math.radians(pitch) + body_pitch(p, ego, time_s))

    def _checked_out(self, out: np.ndarray | None) -> np.ndarray:
        if out is None:
            return np.empty(self._params.shape, dtype=np.uint8)
        if out.shape != self._params.shape or out.dtype != np.uint8:
            raise ValueError(f"out must be uint8 of shape {self._params.shape}, got {out.dtype} {out.shape}")
        return out


def _path_yaw(ego: Any) -> float:
    """Direction, from the car's heading, of where it will be in a second on its present circle [rad]."""
    steering = (getattr(ego, "action", None) or {}).get("steering", 0.0)
    slip = math.atan(0.5 * math.tan(steering))
    turn = ego.speed * math.sin(slip) / (0.5 * ego.LENGTH) * _PATH_S
    return max(-_PATH_MAX, min(_PATH_MAX, slip + 0.5 * turn))
