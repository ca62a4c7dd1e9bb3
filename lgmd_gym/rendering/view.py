"""LGMDView: wrapper that renders camera, neuron and road in one picture."""

from typing import Any, SupportsFloat

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import ArrayLike

from lgmd_gym.aliases import Arguments, Info, Values
from lgmd_gym.errors import check_known, check_text
from lgmd_gym.rendering.display import OVERLAYS, DisplayState, checked_overlays
from lgmd_gym.wrappers.observation import LGMDObservation

MODES = ("rgb_array", "human")


class LGMDView(gym.Wrapper, RecordConstructorArgs):
    """Render camera frame, neuron and road in one picture of 1280×720 pixels.

    The picture shows the camera frame with overlays; the layers that the neuron declares, such as P, I, S
    and G of the LGMD; spikes and spike frequency of the last 5 s with the alert level; highway-env's top
    view; bars for speed, gap, time to contact and deceleration; and lamps for alert, braking and contact.
    Quantities that stock highway-env environments do not provide (gap, time to contact) are left blank.
    Observations, rewards and infos are unchanged, and the render mode of the wrapped environment does not
    matter.

    Args:
        env: An environment with `LGMDObservation` among its wrappers.
        render_mode: "rgb_array": `render` returns the picture, for example for Gymnasium's `RecordVideo`.
            "human": `reset` and `step` show the picture in a window, in real time.
        title: Title at the top; None for the id of the environment.
        overlays: Overlays on the camera frame: "zone", the edges of `danger_zone`, and "targets", boxes
            around bodies ahead. They require an `EgoCamera`.
        camera: Name of the camera to enlarge, with its layers; None for the first one. Other cameras are
            insets. Of more than four cameras, None enlarges the one with the highest spike frequency.

    Attributes:
        agent_alert: Alert of the agent for the lamp; None for the alert of the neuron.

    Raises:
        ValueError: If `env` has no `LGMDObservation` or has a window of its own, a mode, overlay or camera
            is unknown, or mode "human" has no display.

    Example:
        >>> import gymnasium as gym, lgmd_gym
        >>> env = lgmd_gym.LGMDView(gym.make("LGMD/CCRs-v0", ego_speed=8.0))
        >>> observation, info = env.reset(seed=1)
        >>> env.render().shape
        (720, 1280, 3)
    """

    def __init__(
        self,
        env: gym.Env,
        render_mode: str = "rgb_array",
        title: str | None = None,
        overlays: tuple[str, ...] = OVERLAYS,
        camera: str | None = None,
    ) -> None:
        self._observer = find_observation_wrapper(env)
        gym.Wrapper.__init__(self, env)
        check_known("render mode", render_mode, MODES)
        if env.render_mode == "human":
            raise ValueError(
                "env must not have render_mode 'human', which opens a second window; pass "
                "render_mode='human' to LGMDView only"
            )
        if camera is not None:
            check_known("camera", camera, self._observer.sensors.names)
        self._mode, self._camera = render_mode, camera
        self._overlays = checked_overlays(overlays)
        RecordConstructorArgs.__init__(
            self, render_mode=render_mode, title=title, overlays=list(overlays), camera=camera
        )
        if title is None:
            title = env.spec.id if env.spec is not None else str(env)
        self._title = " ".join(check_text("title", title).split())
        self._dashboard: Any = None
        self._window: Any = None
        self._info: Info = {}
        self._trace_requested = self._observer.trace
        self._observer.trace = True  # the spike raster needs every camera frame, also within decisions
        self.metadata = {"render_modes": list(MODES), "render_fps": env.unwrapped.config["policy_frequency"]}  # type: ignore[attr-defined]
        self.agent_alert: bool | None = None

    @property
    def render_mode(self) -> str:
        """Render mode of this wrapper, not of the wrapped environment."""
        return self._mode

    @property
    def window(self) -> Any:
        """The `Window` of mode "human"; None before the first picture."""
        return self._window

    def reset(self, *, seed: int | None = None, options: Arguments | None = None) -> tuple[Any, Info]:
        """Reset the environment and the trace; in mode "human", show the picture."""
        observation, info = self.env.reset(seed=seed, options=options)
        self.agent_alert = None
        if self._dashboard is None:
            from lgmd_gym.rendering.dashboard import Dashboard

            self._dashboard = Dashboard(self._observer, self._title, self._overlays, self._camera)
        self._dashboard.clear()
        return observation, self._update(info)

    def step(self, action: ArrayLike) -> tuple[Any, SupportsFloat, bool, bool, Info]:
        """Step the environment; in mode "human", show the picture."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated, truncated, self._update(info)

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """Return the current picture, uint8, shape (720, 1280, 3); in mode "human", show it instead.

        Raises:
            RuntimeError: Before the first reset.
        """
        if self._dashboard is None:
            raise RuntimeError("reset must be called before render")
        state = DisplayState.from_info(self.env.unwrapped, self._info, self.agent_alert)
        picture: np.ndarray = self._dashboard.draw(state)
        if self._mode == "rgb_array":
            return picture
        if self._window is None:
            from lgmd_gym.rendering.window import Window

            size = picture.shape[1], picture.shape[0]
            self._window = Window(self._title, size, self.metadata["render_fps"])
        self._window.show(picture)
        return None

    def close(self) -> None:
        """Close the window, then the environment."""
        if self._window is not None:
            self._window.close()
        super().close()

    def _update(self, info: Info) -> Values:
        """Add the outputs of the neurons to the trace; return the info as without this wrapper."""
        self._info = info
        self._dashboard.add(info["lgmd/trace"])
        if not self._trace_requested:
            info = {key: value for key, value in info.items() if key != "lgmd/trace"}
        if self._mode == "human":
            self.render()
        return info


def find_observation_wrapper(env: gym.Env) -> LGMDObservation:
    """Return the `LGMDObservation` among the wrappers of an environment.

    Raises:
        ValueError: If there is none.
    """
    layer: object = env
    while isinstance(layer, gym.Wrapper):
        if isinstance(layer, LGMDObservation):
            return layer
        layer = layer.env
    raise ValueError(f"env must have an LGMDObservation among its wrappers, got {env}; wrap it first")
