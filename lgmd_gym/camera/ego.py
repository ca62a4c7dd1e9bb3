"""EgoCamera: the view from the ego car of a highway-env environment."""

from typing import Any

import numpy as np

from lgmd_gym.camera.objects import ObjectList
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pinhole import project
from lgmd_gym.camera.render.context import RenderContext
from lgmd_gym.camera.scene import scene_of
from lgmd_gym.camera.spec import CameraItem

_UINT8 = np.dtype(np.uint8)


class EgoCamera:
    """A camera on the ego car of any highway-env environment.

    Frames are grey, uint8, shape (height, width), with row 0 at the top. The same seed and the same road
    state give the same frame, in any process. The ego's own body is not drawn. A `CameraRig` renders several
    cameras on one car faster.

    Args:
        params: A preset's name, `CameraParams`, a dict of its fields, or None for `wide`.
        fields: Fields of `CameraParams` to change, or `condition`.

    Attributes:
        context: Tables and buffers of this camera.

    Example:
        >>> EgoCamera("fovea", mount_height=1.4).params.hfov_deg
        10.0
    """

    def __init__(self, params: CameraItem | None = None, **fields: Any) -> None:
        self._params = CameraParams.make(params, **fields)
        self.context = RenderContext([self._params])
        self._objects = ObjectList()
        self._lens: Any = None

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
        """Light of the last `render` before the sensor, float32, shape (height, width) [grey levels]."""
        return self.context.buffers.image

    def render(
        self, env: Any, out: np.ndarray | None = None, gaze: tuple[float, float] | None = None
    ) -> np.ndarray:
        """Render the present frame.

        Args:
            env: A highway-env environment, wrapped or not, after its first reset.
            out: Frame to draw into, uint8, shape (height, width); a new one if None.
            gaze: Turn of the optical axis to the right and upwards on top of the mount, for this frame only
                [degrees]; replaces the `path` gaze.

        Raises:
            ValueError: If the environment has no road or ego yet, or a pose is not finite.
        """
        if out is None:
            out = np.empty(self._params.shape, dtype=np.uint8)
        else:
            check_frame(out, self._params.shape)
        scene = scene_of(env)
        poses = self.context.aim(scene, gaze)
        self._objects.read(scene, self._params, poses)
        self.context.draw(out[None], scene, self._objects)
        self._lens = self.context.lenses[0, 0]
        return out

    def project(self, points_m: Any) -> np.ndarray:
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

    def set_lens(self, lens: Any) -> None:
        """Set the `LENS` record that `project` uses, after a frame rendered by a `CameraRig`."""
        self._lens = lens


def check_frame(out: np.ndarray, shape: tuple[int, int]) -> None:
    """Raise ValueError for a frame of another shape or dtype.

    Raises:
        ValueError: If `out` is not uint8 of this shape.
    """
    if out.shape != shape or out.dtype != _UINT8:
        raise ValueError(f"out must be uint8 of shape {shape}, got {out.dtype} {out.shape}")
