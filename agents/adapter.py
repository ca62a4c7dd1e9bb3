"""User-defined agents: classes with a method `act`, given as "module:Class"."""

import inspect
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.agents.base import Agent
from lgmd_gym.agents.options import check_options, parse_agent
from lgmd_gym.errors import check_flag, shown, unknown_name
from lgmd_gym.processes.user_modules import error_reason, import_user_module

if TYPE_CHECKING:
    from lgmd_gym.camera import CameraSpec
    from lgmd_gym.neuron import NeuronSpec


TOLERANCE = 1e-6  # of rounding in actions beyond ±1
OBSERVATION_KEY = "observation key"


class _Named(dict[str, Any]):
    """A dict whose KeyError suggests the closest key."""

    def __init__(self, kind: str, values: dict[str, Any]) -> None:
        super().__init__(values)
        self._kind = kind

    def __missing__(self, key: object) -> Any:
        is_frame = self._kind == OBSERVATION_KEY and str(key).startswith("frame")
        hint = "set include_frame = True in the class for camera frames" if is_frame else ""
        raise KeyError(str(unknown_name(self._kind, key, self, hint)))


class AgentAdapter(Agent):
    """Adapt a user's object to the interface of `Agent`.

    Optional attributes of the object (`reset`, `alert`, `camera`, `neuron`, `include_frame`) replace the
    defaults of `Agent`.

    Args:
        name: Name in rows and tables.
        agent: Object with `act(observation, info)`, which returns a number or an array of one number.
    """

    def __init__(self, name: str, agent: Any) -> None:
        self.name = name
        self.agent = agent
        self.include_frame = check_flag("include_frame", getattr(agent, "include_frame", False))

    @property
    def camera(self) -> "CameraSpec | None":
        """The object's attribute `camera`; None if it has none."""
        return getattr(self.agent, "camera", None)

    @property
    def neuron(self) -> "NeuronSpec":
        """The object's attribute `neuron`; None if it has none."""
        return getattr(self.agent, "neuron", None)

    @property
    def alert(self) -> bool:
        """The object's attribute `alert`; the alert of the neuron if it has none."""
        return bool(getattr(self.agent, "alert", self._alert))

    def reset(self, seed: int | None = None) -> None:
        """Call the object's `reset(seed)`, if it has one."""
        super().reset(seed)
        reset = getattr(self.agent, "reset", None)
        if reset is not None:
            reset(seed)

    def act(self, observation: dict[str, Any], info: dict[str, Any]) -> np.ndarray:
        """Return the object's action as an array of shape (1,), float32.

        Raises:
            ValueError: If the action is not one number in [-1, 1]; a bool is none.
        """
        self._alert = bool(info.get("lgmd/alert", False))
        returned = self.agent.act(_Named(OBSERVATION_KEY, observation), _Named("info key", info))
        wanted = f"agent {self.name!r} must return one number in [-1, 1]"
        try:
            action = np.asarray(returned)
            is_bool = action.dtype == bool  # True, meant as an alarm, would be the demand 1 and never brake
            action = action.astype(np.float32).reshape(-1)
        except (TypeError, ValueError, RuntimeError) as error:
            raise ValueError(f"{wanted}, got {shown(returned)} ({error})") from None
        if is_bool or action.size != 1 or not abs(action[0]) <= 1.0 + TOLERANCE:
            raise ValueError(f"{wanted}, got {shown(returned)}; return -1.0 for full braking, 0.0 for none")
        return action.clip(-1.0, 1.0)


def make_user_agent(text: str) -> AgentAdapter:
    """Return the agent for "module:Class[:option=value,…]"; modules may be in the working directory.

    Raises:
        ValueError: If the class cannot be imported, has no `act`, or does not accept an option.
    """
    module, class_name, *rest = text.split(":", 2)
    name = f"{module}:{class_name}"
    names = vars(import_user_module(module, f"agent {shown(name)}"))
    if class_name not in names:
        classes = [f"{module}:{item}" for item, value in names.items() if isinstance(value, type)]
        raise unknown_name("agent class", name, classes)
    agent_class = names[class_name]
    if not hasattr(agent_class, "act"):
        raise ValueError(f"agent {shown(name)} has no method act(observation, info)")
    options = parse_agent(f"{module}:{''.join(rest)}")[1]
    check_options(name, agent_class, options)
    try:
        agent = agent_class(**options)
    except Exception as error:  # of the class's own code
        raise ValueError(f"agent {shown(name)} cannot be created ({error_reason(error)})") from error
    _check_signature(name, "act", agent.act, {"observation": {}, "info": {}})
    if callable(getattr(agent, "reset", None)):
        _check_signature(name, "reset", agent.reset, {"seed": None})
    return AgentAdapter(name, agent)


def _check_signature(name: str, method_name: str, method: Any, arguments: dict[str, Any]) -> None:
    """Raise ValueError if a method cannot be called with positional arguments."""
    try:
        signature = inspect.signature(method)
    except (TypeError, ValueError):  # compiled code without a signature
        return
    try:
        signature.bind(*arguments.values())
    except TypeError:
        wanted = f"{method_name}({', '.join(['self', *arguments])})"
        raise ValueError(
            f"agent {shown(name)} must have the method {wanted}, got {method_name}{signature}"
        ) from None
