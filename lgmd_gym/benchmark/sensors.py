"""What agents see through: the user's choice, or each agent's own eye."""

from dataclasses import asdict, dataclass, is_dataclass, replace
from typing import Any

from lgmd_gym.camera import CONDITIONS
from lgmd_gym.errors import unknown_name

DEFAULT_CAMERA = "fovea"
CLEAR = "clear"


@dataclass(frozen=True, slots=True)
class SensorConfig:
    """What the agents see through.

    Attributes:
        camera: See `LGMDObservation`. None leaves it to the agent: the eye it states (`Agent.camera`), or
            "fovea" if it states none.
        params: See `LGMDObservation`. None leaves it to the agent, too, if the eye is its own.
        condition: A named condition laid over every camera ("clear", "night", "fog", "degraded").
        include_frame: Whether the frames are part of what is observed.
    """

    camera: Any = None
    params: Any = None
    condition: str = CLEAR
    include_frame: bool = False

    def of(self, agent: Any = None) -> "SensorConfig":
        """Return what an agent sees through, with nothing left open; None for an agent without wishes."""
        frame = self.include_frame or bool(getattr(agent, "include_frame", False))
        camera, params = self.camera, self.params
        if camera is None:
            camera = getattr(agent, "camera", None)
            params = getattr(agent, "neuron", None) if params is None else params
        return SensorConfig(DEFAULT_CAMERA if camera is None else camera, params, self.condition, frame)

    @property
    def plain(self) -> "SensorConfig":
        """The same as plain values, which JSON and TOML can hold."""
        return replace(self, camera=_plain(self.camera), params=_plain(self.params))

    def under(self, condition: str) -> "SensorConfig":
        """Return the same under a named camera condition, such as "degraded".

        Raises:
            ValueError: For an unknown condition, or a camera that knows none.
        """
        if condition not in CONDITIONS:
            raise unknown_name("camera condition", condition, CONDITIONS)
        _under(self.camera, condition)
        return replace(self, condition=condition)

    @property
    def arguments(self) -> dict[str, Any]:
        """What `LGMDObservation` takes of it.

        Raises:
            ValueError: For a camera that no condition can be laid over.
        """
        camera = _under(self.camera, self.condition)
        return {"camera": camera, "params": self.params, "include_frame": self.include_frame}

    @property
    def label(self) -> str:
        """The cameras' names for rows and titles, as in "fovea" or "zone8+upright8"."""
        return _name(self.camera) if self.camera is not None else "each agent's own"


def _under(camera: Any, condition: str) -> Any:
    """Return a camera argument with a condition laid over it."""
    if condition == CLEAR:
        return camera
    if camera is None:
        return None
    if isinstance(camera, list | tuple):
        return [_under(item, condition) for item in camera]
    if camera == "birdseye":
        raise ValueError(f"condition {condition!r} cannot be laid over the view from above; use 'clear'")
    if isinstance(camera, str):
        return {"name": camera, "condition": condition}
    if isinstance(camera, dict):
        return {**camera, "condition": condition}
    return camera.with_condition(condition)


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _name(camera: Any) -> str:
    if isinstance(camera, list | tuple):
        return "+".join(map(_name, camera))
    if isinstance(camera, dict):
        return str(camera.get("name", "custom"))
    return str(getattr(camera, "name", camera))
