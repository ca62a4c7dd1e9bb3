"""Camera and neuron of the agents under test: the user's choice, or each agent's own."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from lgmd_gym.agents import Agent
from lgmd_gym.camera import CLEAR, CameraSpec, with_condition
from lgmd_gym.camera.spec import plain_values
from lgmd_gym.neuron import NeuronSpec

DEFAULT_CAMERA = "fovea"


@dataclass(frozen=True, slots=True)
class SensorConfig:
    """Camera, neuron parameters and camera condition.

    Attributes:
        camera: See `LGMDObservation`. None selects the agent's own camera (`Agent.camera`), or "fovea" for
            an agent without one.
        params: See `LGMDObservation`. None selects the agent's own parameters if the camera is its own.
        condition: Named condition applied to every camera: "clear", "night", "fog", "rain" or "low_sun".
        include_frame: Whether the frames are part of the observation.
    """

    camera: CameraSpec | None = None
    params: NeuronSpec = None
    condition: str = CLEAR
    include_frame: bool = False

    def for_agent(self, agent: Agent | None = None) -> "SensorConfig":
        """Return the config with the agent's own camera and parameters in place of None."""
        include_frame = self.include_frame or bool(getattr(agent, "include_frame", False))
        camera, params = self.camera, self.params
        if camera is None:
            camera = getattr(agent, "camera", None)
            params = getattr(agent, "neuron", None) if params is None else params
        return SensorConfig(
            DEFAULT_CAMERA if camera is None else camera, params, self.condition, include_frame
        )

    @property
    def plain(self) -> "SensorConfig":
        """The same config as plain values, for JSON and TOML."""
        return replace(self, camera=plain_values(self.camera), params=plain_values(self.params))

    def with_condition(self, condition: str) -> "SensorConfig":
        """Return the config under a named camera condition.

        Raises:
            ValueError: If the condition is unknown or the camera supports none.
        """
        with_condition(DEFAULT_CAMERA if self.camera is None else self.camera, condition)
        return replace(self, condition=condition)

    @property
    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of `LGMDObservation`.

        Raises:
            ValueError: If the camera does not support the condition.
        """
        camera = None if self.camera is None else with_condition(self.camera, self.condition)
        return {"camera": camera, "params": self.params, "include_frame": self.include_frame}

    @property
    def label(self) -> str:
        """Camera names for rows and titles, as in "fovea" or "zone8+upright8"."""
        return _name(self.camera) if self.camera is not None else "each agent's own"


def _name(camera: Any) -> str:
    if isinstance(camera, list | tuple):
        return "+".join(map(_name, camera))
    if isinstance(camera, Mapping):
        return str(camera.get("name", "custom"))
    return str(getattr(camera, "name", camera))
