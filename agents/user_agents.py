"""Agents of the user, given as "module:Class[:option=value,…]", and the options of agent strings."""

import inspect
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Never

import numpy as np

from lgmd_gym.agents.base import Agent, BatchAgent, Infos, Observations, rows_of
from lgmd_gym.agents.rules import Rule
from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.errors import check_flag, check_keys, check_positive, shown, unknown_name
from lgmd_gym.fields import parse_options
from lgmd_gym.processes.user_modules import error_reason, import_user_module

if TYPE_CHECKING:
    from lgmd_gym.neuron import NeuronSpec
    from lgmd_gym.sensing.channel import ChannelSpec


TOLERANCE = 1e-6  # of rounding in actions beyond ±1
OBSERVATION_KEY = "observation key"


class _Named(Values):
    """A dict whose KeyError suggests the closest key."""

    def __init__(self, kind: str, values: Values) -> None:
        super().__init__(values)
        self._kind = kind

    def __missing__(self, key: object) -> Never:
        is_frame = self._kind == OBSERVATION_KEY and str(key).startswith("frame")
        hint = "set include_frame = True in the class for camera frames" if is_frame else ""
        raise KeyError(str(unknown_name(self._kind, key, self, hint)))


class UserAgents(BatchAgent):
    """A user's class for a single environment, with one object per environment.

    Optional attributes of the objects (`reset`, `alert`, `camera`, `neuron`, `fps`, `include_frame`) replace
    the defaults of `BatchAgent`. An object that has acted is made anew for the next episode.

    Args:
        name: Name in rows and tables.
        make: Returns an object with `act(observation, info)`, which returns a number or an array of one.

    Attributes:
        objects: The objects, one per environment.
    """

    def __init__(self, name: str, make: Callable[[], Any]) -> None:
        self.name = name
        self._make = make
        super().__init__()
        self.include_frame = check_flag("include_frame", getattr(self.objects[0], "include_frame", False))
        fps = getattr(self.objects[0], "fps", None)
        self.fps = None if fps is None else check_positive("fps", fps)

    @property
    def camera(self) -> "ChannelSpec | None":
        """The attribute `camera` of the objects; None if they have none."""
        return getattr(self.objects[0], "camera", None)

    @property
    def neuron(self) -> "NeuronSpec":
        """The attribute `neuron` of the objects; None if they have none."""
        return getattr(self.objects[0], "neuron", None)

    def reset(
        self, mask: np.ndarray | None = None, seeds: Sequence[int | None] | np.ndarray | None = None
    ) -> None:
        """Make the objects anew that have acted, and call their `reset(seed)`, if they have one."""
        super().reset(mask, seeds)
        for index in range(self.num_envs) if mask is None else np.flatnonzero(mask).tolist():
            if self._used[index]:
                self.objects[index], self._used[index] = self._make(), False
            reset = getattr(self.objects[index], "reset", None)
            if reset is not None:
                seed = None if seeds is None else seeds[index]
                reset(None if seed is None else int(seed))

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the demands of the objects; exceptions are kept in `failures`."""
        demands, self.failures = np.zeros(self.num_envs), {}
        for index in np.flatnonzero(active).tolist():
            self._used[index], agent = True, self.objects[index]
            observation = _Named(OBSERVATION_KEY, rows_of(observations, index))
            try:
                returned = agent.act(observation, _Named("info key", infos.row(index)))
                demands[index] = self._checked(returned)
                self.alerts[index] = bool(getattr(agent, "alert", self.alerts[index]))
            except (Exception, SystemExit) as error:  # an exit() would end the worker process
                self.failures[index] = error
        return demands

    def _allocate(self, num_envs: int) -> None:
        super()._allocate(num_envs)
        self.objects = [self._make() for _ in range(num_envs)]
        self._used = [False] * num_envs

    def _checked(self, returned: object) -> np.float32:
        """Return the demand of an action; raise ValueError unless it is one number in [-1, 1], not a bool."""
        wanted = f"agent {self.name!r} must return one number in [-1, 1]"
        try:
            action = np.asarray(returned)
            is_bool = action.dtype == bool  # True, meant as an alarm, would be the demand 1 and never brake
            action = action.astype(np.float32).reshape(-1)
        except (TypeError, ValueError, RuntimeError) as error:
            raise ValueError(f"{wanted}, got {shown(returned)} ({error})") from None
        if is_bool or action.size != 1 or not abs(action[0]) <= 1.0 + TOLERANCE:
            raise ValueError(f"{wanted}, got {shown(returned)}; return -1.0 for full braking, 0.0 for none")
        return action.clip(-1.0, 1.0)[0]


def make_user_agent(text: str) -> BatchAgent:
    """Return the agent for "module:Class[:option=value,…]"; modules may be in the working directory.

    A subclass of `BatchAgent` acts in N environments; of another class there is one object for each.

    Raises:
        ValueError: If the class cannot be imported, has no `act`, or does not accept an option.
    """
    module, class_name, *rest = text.split(":", 2)
    name = f"{module}:{class_name}"
    names = vars(import_user_module(module, f"agent {shown(name)}"))
    if class_name not in names:
        public = {item: value for item, value in names.items() if not item.startswith("_")}
        classes = [f"{module}:{item}" for item, value in public.items() if isinstance(value, type)]
        raise unknown_name("agent class", name, classes)
    agent_class = names[class_name]
    if not callable(getattr(agent_class, "act", None)):
        raise ValueError(f"agent {shown(name)} has no method act(observation, info)")
    options = parse_agent(f"{module}:{''.join(rest)}")[1]
    kind = agent_class if isinstance(agent_class, type) else object
    if issubclass(kind, Agent):
        raise ValueError(
            f"agent {shown(name)} must not be a subclass of Agent, which wraps agents; derive it from "
            "BatchAgent or from no class"
        )
    has_params = issubclass(kind, Rule) and kind.__init__ is Rule.__init__  # which check their own names
    if not has_params:
        check_options(name, agent_class, options)

    def make() -> Any:
        try:
            return agent_class(**options)
        except Exception as error:  # of the class's own code
            if has_params and isinstance(error, ValueError):
                raise
            raise ValueError(f"agent {shown(name)} cannot be created ({error_reason(error)})") from error

    if issubclass(kind, BatchAgent):
        return make()
    agents = UserAgents(name, make)
    (agent,) = agents.objects
    _check_signature(name, "act", agent.act, {"observation": {}, "info": {}})
    if callable(getattr(agent, "reset", None)):
        _check_signature(name, "reset", agent.reset, {"seed": None})
    return agents


def parse_agent(text: str) -> tuple[str, Arguments]:
    """Split "name:option=value,option=value" into the name and the options.

    Example:
        >>> parse_agent("spike-threshold:threshold=45,frames=2")
        ('spike-threshold', {'threshold': 45, 'frames': 2})
    """
    name, _, rest = text.partition(":")
    return name.strip(), parse_options("agent", rest, text)


def check_options(name: str, cls: type, options: Arguments) -> None:
    """Raise ValueError for an option that the constructor of an agent does not accept."""
    check_keys(f"option of agent {name}", options, inspect.signature(cls).parameters)


def _check_signature(
    name: str, method_name: str, method: Callable[..., object], arguments: Arguments
) -> None:
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
