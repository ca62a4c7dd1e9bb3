"""Camera and neuron of the agents under test: the user's choice, or each agent's own."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, is_dataclass, replace
from typing import Any

from lgmd_gym.camera import CONDITIONS, CameraParams, CameraSpec
from lgmd_gym.errors import unknown_name
from lgmd_gym.neuron import NeuronSpec

DEFAULT_CAMERA = "fovea"
CLEAR = "clear"
BIRDSEYE = "birdseye"


@dataclass(frozen=True, slots=True)
class SensorConfig:
    """Camera, neuron parameters and camera condition.

    Attributes:
        camera: See `LGMDObservation`. None selects the agent's own camera (`Agent.camera`), or "fovea" for
            an agent without one.
        params: See `LGMDObservation`. None selects the agent's own parameters if the camera is its own.
        condition: Named condition applied to every camera: "clear", "night", "fog" or "degraded".
        include_frame: Whether the frames are part of the observation.
    """

    camera: CameraSpec | None = None
    params: NeuronSpec = None
    condition: str = CLEAR
    include_frame: bool = False

    def for_agent(self, agent: Any = None) -> "SensorConfig":
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
        return replace(self, camera=_plain(self.camera), params=_plain(self.params))

    def with_condition(self, condition: str) -> "SensorConfig":
        """Return the config under a named camera condition.

        Raises:
            ValueError: If the condition is unknown or the camera supports none.
        """
        if condition not in CONDITIONS:
            raise unknown_name("camera condition", condition, CONDITIONS)
        _with_condition(self.camera, condition)
        return replace(self, condition=condition)

    @property
    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of `LGMDObservation`.

        Raises:
            ValueError: If the camera does not support the condition.
        """
        camera = _with_condition(self.camera, self.condition)
        return {"camera": camera, "params": self.params, "include_frame": self.include_frame}

    @property
    def label(self) -> str:
        """Camera names for rows and titles, as in "fovea" or "zone8+upright8"."""
        return _name(self.camera) if self.camera is not None else "each agent's own"


def _with_condition(camera: Any, condition: str) -> Any:
    """Return a camera argument under a condition, whose fields replace the camera's."""
    if condition == CLEAR or camera is None:
        return camera
    if isinstance(camera, list | tuple):
        return [_with_condition(item, condition) for item in camera]
    if _name(camera) == BIRDSEYE:
        raise ValueError(f"camera 'birdseye' does not support condition {condition!r}; use 'clear'")
    return CameraParams.make(camera).with_condition(condition)


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value


def _name(camera: Any) -> str:
    if isinstance(camera, list | tuple):
        return "+".join(map(_name, camera))
    if isinstance(camera, Mapping):
        return str(camera.get("name", "custom"))
    return str(getattr(camera, "name", camera))
