"""EgoCamera: what the driver of a highway-env car sees, as grey frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pinhole import project
from lgmd_gym.camera.render.context import RenderContext, object_buffer, read_objects, scene_of


class EgoCamera:
    """A camera on the ego car of any highway-env environment.

    Frames are grey, uint8, shape (height, width), row 0 at the top. The same seed and the same road
    state give the same frame, in any process. The ego's own body is not drawn. Several cameras on one
    car are drawn faster by a `CameraRig`.

    Args:
        params: A preset's name, `CameraParams`, a dict of its fields, or None for `wide`.
        fields: Fields of `CameraParams` to change.

    Attributes:
        stage: Buffers and tables of this camera alone.

    Example:
        >>> EgoCamera("fovea", mount_height=1.4).params.hfov_deg
        10.0
    """

    def __init__(self, params: Any = None, **fields: Any) -> None:
        self._params = CameraParams.make(params, **fields)
        self.stage = RenderContext([self._params])
        self._objects = object_buffer()
        self._cam: np.ndarray | None = None

    @property
    def params(self) -> CameraParams:
        """The parameters of this camera."""
        return self._params

    @property
    def shape(self) -> tuple[int, int]:
        """`(height, width)` of the frames [px]."""
        return self._params.shape

    @property
    def light(self) -> np.ndarray:
        """Light of `render`'s last frame before the sensor, float32, shape (height, width) [grey levels]."""
        return self.stage.image

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
        if out is None:
            out = np.empty(self._params.shape, dtype=np.uint8)
        else:
            check_frame(out, self._params.shape)
        scene = scene_of(env)
        poses = self.stage.aim(scene, gaze)
        count = read_objects(self._objects, scene, self._params, poses)
        self.stage.draw(out[None], scene, self._objects, count)
        self._cam = self.stage.cams[0, 0]
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

    def seen_from(self, cam: np.ndarray) -> None:
        """Take over the pose of a frame that a `CameraRig` has drawn, for `project`."""
        self._cam = cam


def check_frame(out: np.ndarray, shape: tuple[int, int]) -> None:
    """Refuse a frame of another shape or type."""
    if out.shape != shape or out.dtype != np.uint8:
        raise ValueError(f"out must be uint8 of shape {shape}, got {out.dtype} {out.shape}")
