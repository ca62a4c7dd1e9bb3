"""`LGMDView`: the composed picture of eye, neuron and road as a Gymnasium wrapper."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from lgmd_gym.errors import unknown_name
from lgmd_gym.rendering.overlays import OVERLAYS, check_overlays
from lgmd_gym.rendering.state import Moment
from lgmd_gym.wrappers.observation import LGMDObservation

MODES = ("rgb_array", "human")


class LGMDView(gym.Wrapper, RecordConstructorArgs):
    """Render what the eye sees, what its neuron says and where the cars are, in one 1280×720 picture.

    The picture has the eye's frame, the layers P, I, S and G, the spikes and the spike frequency of the last
    5 s with the alert level, highway-env's view from above, bars for speed, gap, time to contact and braking,
    and lamps for alert, braking and contact. It works on any highway-env environment inside
    `LGMDObservation`, whatever that environment's own render mode; what highway-env's own environments do not
    tell (gap, time to contact) is left blank. Observations, rewards and infos pass unchanged.

    Args:
        env: An environment with `LGMDObservation` among its wrappers.
        render_mode: "rgb_array": `render` returns the picture, so that Gymnasium's `RecordVideo` works
            outside this wrapper. "human": every reset and step shows it in a window, in real time.
        title: Shown at the top; None for the environment's id.
        overlays: Drawn over the eye's frame: "zone", the lane of `danger_zone`; "targets", boxes around
            who is ahead. Only an `EgoCamera` has them.
        camera: Name of the camera shown large, with its layers; None for the first. Others are insets.

    Raises:
        ValueError: For an environment without an eye or with a window of its own, an unknown mode, overlay
            or camera, or "human" on a machine without a display.

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
        RecordConstructorArgs.__init__(
            self, render_mode=render_mode, title=title, overlays=list(overlays), camera=camera
        )
        gym.Wrapper.__init__(self, env)
        if render_mode not in MODES:
            raise unknown_name("render mode", render_mode, MODES)
        if env.render_mode == "human":
            raise ValueError(
                "the environment shows a window of its own; make it without render_mode='human' and pass "
                "that to LGMDView"
            )
        self._observer = find_observer(env)
        if camera is not None and camera not in self._observer.sensors.names:
            raise unknown_name("camera", camera, self._observer.sensors.names)
        self._mode, self._camera = render_mode, camera
        self._overlays = check_overlays(overlays)
        self._title = title if title is not None else (env.spec.id if env.spec is not None else str(env))
        self._picture: Any = None
        self._window: Any = None
        self._info: dict[str, Any] = {}
        self._traced = self._observer.trace
        self._observer.trace = True  # every camera frame belongs into the raster, also between decisions
        self.metadata = {"render_modes": list(MODES), "render_fps": self._host.config["policy_frequency"]}
        self.agent_alert: bool | None = None
        """What the agent says about an alert; None shows the neuron's."""

    @property
    def render_mode(self) -> str:
        """The mode of this wrapper, not of the environment inside."""
        return self._mode

    @property
    def window(self) -> Any:
        """The `Window` of mode "human" once something was shown; None before."""
        return self._window

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Reset the environment and forget the last episode's trace."""
        observation, info = self.env.reset(seed=seed, options=options)
        self.agent_alert = None
        if self._picture is None:
            from lgmd_gym.rendering.dashboard import Picture

            self._picture = Picture(self._observer, self._title, self._overlays, self._camera)
        self._picture.clear()
        return observation, self._took(info)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step the environment; in mode "human", show the picture."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated, truncated, self._took(info)

    def render(self) -> Any:
        """Return the present picture, uint8, shape (720, 1280, 3); in mode "human" show it.

        Raises:
            RuntimeError: Before the first reset.
        """
        if self._picture is None:
            raise RuntimeError("nothing to draw yet; call reset first")
        picture: np.ndarray = self._picture.draw(Moment.of(self._host, self._info, self.agent_alert))
        if self._mode == "rgb_array":
            return picture
        self._show(picture)
        return None

    def close(self) -> None:
        """Close the window, then the environment."""
        if self._window is not None:
            self._window.close()
        super().close()

    @property
    def _host(self) -> Any:
        """The highway-env environment underneath."""
        return self.env.unwrapped

    def _took(self, info: dict[str, Any]) -> dict[str, Any]:
        """Take over the neurons' answers, and hand on the info as it would be without this wrapper."""
        self._info = info
        self._picture.take(info["lgmd/trace"])
        if not self._traced:
            info = {key: value for key, value in info.items() if key != "lgmd/trace"}
        if self._mode == "human":
            self.render()
        return info

    def _show(self, picture: np.ndarray) -> None:
        from lgmd_gym.rendering.window import Window

        if self._window is None:
            size = picture.shape[1], picture.shape[0]
            self._window = Window(self._title, size, self.metadata["render_fps"])
        self._window.show(picture)


def find_observer(env: gym.Env) -> LGMDObservation:
    """Return the `LGMDObservation` among an environment's wrappers, or raise ValueError."""
    layer: Any = env
    while isinstance(layer, gym.Wrapper):
        if isinstance(layer, LGMDObservation):
            return layer
        layer = layer.env
    raise ValueError(f"{env} has no LGMDObservation among its wrappers; wrap it first")
