"""BirdsEye: highway-env's top view as greyscale frames."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.aliases import Config, Values
from lgmd_gym.camera.camera import BIRDSEYE, MAX_WIDTH
from lgmd_gym.camera.ego import check_frame
from lgmd_gym.errors import check_size, check_within

if TYPE_CHECKING:
    import gymnasium as gym


@dataclass(eq=False)
class BirdsEye:
    """highway-env's top view of the road, with the interface of `EgoCamera`.

    Frames are grey (BT.601 luma), uint8, shape (height, width), with world x to the right and y down. The
    ego is at `centering_position` of the environment. No display and no `render_mode` is required. The
    environment's config, metadata and viewer stay unchanged.

    Args:
        shape: `(height, width)` [px].
        scaling: Pixels per metre; None shows as many metres across as the environment's own rendering.

    Attributes:
        name: "birdseye".
        shape: The same.
        scaling: The same.
    """

    shape: tuple[int, int] = (90, 160)
    scaling: float | None = None
    name: str = field(default=BIRDSEYE, init=False)

    def __post_init__(self) -> None:
        self.shape = check_size("camera shape", self.shape, 4, MAX_WIDTH)
        if self.scaling is not None:
            self.scaling = check_within("scaling", self.scaling, 1e-3, 1e3, "px/m")
        self._viewer: Any = None
        self._oversampling = 1
        self._env: object = None

    def render(self, env: "gym.Env", out: np.ndarray | None = None) -> np.ndarray:
        """Render the present top view.

        Args:
            env: A highway-env environment, wrapped or not, after its first reset.
            out: Frame to draw into, uint8, shape (height, width); a new one if None.
        """
        if out is not None:
            check_frame(out, self.shape)
        base: Any = getattr(env, "unwrapped", env)
        if getattr(base, "road", None) is None:
            raise ValueError("the environment has no road: call reset() before render()")
        if self._viewer is None or self._env is not base:
            self._viewer, self._env = self._open(base), base
        viewer = self._viewer
        viewer.display()
        from pygame import surfarray

        rgb = surfarray.array3d(viewer.sim_surface).swapaxes(0, 1)
        luma = rgb @ np.array([0.299, 0.587, 0.114], dtype=np.float32)
        height, width = self.shape
        k = self._oversampling
        if k > 1:
            luma = luma.reshape(height, k, width, k).mean(axis=(1, 3))
        grey = (luma + 0.5).astype(np.uint8)
        if out is None:
            return grey
        out[...] = grey
        return out

    def __getstate__(self) -> Values:
        """Copies have no viewer: a surface of pygame cannot be copied."""
        return self.__dict__ | {"_viewer": None, "_env": None}

    def close(self) -> None:
        """Release the environment and the surface."""
        # EnvViewer.close() would quit pygame for every viewer of the process, including the environment's.
        self._viewer = self._env = None

    def _open(self, base: Any) -> Any:
        from highway_env.envs.common.graphics import EnvViewer

        height, width = self.shape
        config: Config = base.config
        # The viewer's lines are at least a pixel wide: draw at the environment's resolution, then average.
        self._oversampling = max(1, -(-config["screen_width"] // width))
        scaling = self.scaling
        if scaling is None:
            scaling = config.get("scaling", 5.5) * width / config["screen_width"]
        viewer = EnvViewer(
            base,
            {
                **config,
                "screen_width": width * self._oversampling,
                "screen_height": height * self._oversampling,
                "scaling": scaling * self._oversampling,
                "offscreen_rendering": True,
            },
        )
        # A dummy display driver disables the viewer, but nothing is displayed here.
        viewer.enabled = True
        return viewer
