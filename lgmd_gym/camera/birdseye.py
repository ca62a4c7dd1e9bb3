"""BirdsEye: highway-env's own top view as grey frames."""

from __future__ import annotations

from typing import Any

import numpy as np

from lgmd_gym.camera.params import CameraParams


class BirdsEye:
    """highway-env's own picture of the road from above, through the interface of `EgoCamera`.

    Frames are grey (BT.601 luma), uint8, shape (height, width), world x to the right and y down,
    the ego at `centering_position` of the environment. Works without a display and without
    `render_mode`, and leaves the environment's config, metadata and viewer alone.

    Args:
        shape: `(height, width)` [px].
        scaling: Pixels per metre; None keeps as many metres across as the environment's own picture.
    """

    def __init__(self, shape: tuple[int, int] = (90, 160), scaling: float | None = None) -> None:
        self._shape = CameraParams(shape=shape).shape
        if scaling is not None and not scaling > 0.0:
            raise ValueError(f"scaling must be above 0 px per m, got {scaling!r}")
        self._scaling = scaling
        self._viewer: Any = None
        self._fine = 1
        self._env: Any = None

    @property
    def shape(self) -> tuple[int, int]:
        """`(height, width)` of the frames [px]."""
        return self._shape

    def render(self, env: Any, out: np.ndarray | None = None) -> np.ndarray:
        """Return the top view of `env` as it is now.

        Args:
            env: A highway-env environment, wrapped or not, after its first reset.
            out: Frame to draw into, uint8, shape (height, width); a new one if None.
        """
        base = getattr(env, "unwrapped", env)
        if getattr(base, "road", None) is None:
            raise ValueError("the environment has no road: call reset() before render()")
        if self._viewer is None or self._env is not base:
            self._viewer, self._env = self._open(base), base
        viewer = self._viewer
        viewer.display()
        from pygame import surfarray

        rgb = surfarray.array3d(viewer.sim_surface).swapaxes(0, 1)
        luma = rgb @ np.array([0.299, 0.587, 0.114], dtype=np.float32)
        height, width = self._shape
        k = self._fine
        if k > 1:
            luma = luma.reshape(height, k, width, k).mean(axis=(1, 3))
        grey = (luma + 0.5).astype(np.uint8)
        if out is None:
            return grey
        if out.shape != self._shape or out.dtype != np.uint8:
            raise ValueError(f"out must be uint8 of shape {self._shape}, got {out.dtype} {out.shape}")
        out[...] = grey
        return out

    def close(self) -> None:
        """Let go of the environment and the surface."""
        # EnvViewer.close() quits pygame for every viewer of the process, the environment's own too.
        self._viewer = self._env = None

    def _open(self, base: Any) -> Any:
        from highway_env.envs.common.graphics import EnvViewer

        height, width = self._shape
        config = base.config
        # Its lines are never thinner than a pixel: draw as finely as the environment would, then average.
        self._fine = max(1, -(-config["screen_width"] // width))
        scaling = self._scaling
        if scaling is None:
            scaling = config.get("scaling", 5.5) * width / config["screen_width"]
        viewer = EnvViewer(
            base,
            {
                **config,
                "screen_width": width * self._fine,
                "screen_height": height * self._fine,
                "scaling": scaling * self._fine,
                "offscreen_rendering": True,
            },
        )
        # A dummy display driver must not switch the picture off: nothing is shown anyway.
        viewer.enabled = True
        return viewer
