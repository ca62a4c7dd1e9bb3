"""Base class of all agents: one agent in N environments, and its use in a single one."""

import copy
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeAlias, cast

import numpy as np

from lgmd_gym.agents.stages import Evidence, StageParams, demands_of, next_stages
from lgmd_gym.aliases import Config, Info
from lgmd_gym.errors import check_within

if TYPE_CHECKING:
    from lgmd_gym.neuron import NeuronSpec
    from lgmd_gym.sensing.channel import ChannelSpec

BRAKE = -1.0  # demand for full braking
HOLD = 0.0  # demand for the scripted speed
FPS = 30.0  # frame and decision rate for which all agents are tuned [Hz]
TRACE = "lgmd/trace"  # key of the infos

Observations: TypeAlias = Mapping[str, np.ndarray]
"""Observations of `LGMDObservation` by name, arrays of shape (N, …)."""
State: TypeAlias = dict[str, bool | float | np.ndarray]
"""State of an agent in one environment, by name."""


def to_action(demand: float) -> np.ndarray:
    """Return a longitudinal demand in [-1, 1] as an action of `ContinuousDemand`: float32, shape (1,)."""
    return np.array([check_within("demand", demand, -1.0, 1.0)], dtype=np.float32)


class Infos(Protocol):
    """Infos of N environments: a mapping of arrays of shape (N,), and the info of each environment.

    ``lgmd/trace`` is absent, or a sequence of `TraceFrame` of arrays, of shape (N,) and (N, cameras): the
    camera frames since the last decision, oldest first. The `time` of a frame is NaN in environments that
    have fewer frames.
    """

    def __getitem__(self, key: str, /) -> Any: ...

    def __contains__(self, key: object, /) -> bool: ...

    def row(self, index: int, /) -> Info:
        """Return the info of one environment, as a single environment returns it."""
        ...


class InfoArrays(Info):
    """`Infos` from arrays by name; arrays of `lgmd/trace` as described there."""

    def row(self, index: int) -> Info:
        """Return the info of one environment."""
        info = {key: _plain(values[index]) for key, values in self.items() if key != TRACE}
        if TRACE in self:
            frames = (frame for frame in self[TRACE] if not np.isnan(frame.time[index]))
            info[TRACE] = [_frame(frame, lambda values: _plain(values[index])) for frame in frames]
        return info


class _SingleInfo:
    """`Infos` of one environment."""

    def __init__(self, info: Info) -> None:
        self._info = info

    def __contains__(self, key: object) -> bool:
        return key in self._info

    def __getitem__(self, key: str) -> Any:
        value = self._info[key]
        if key == TRACE:
            return [_frame(frame, lambda item: np.asarray(item)[None]) for frame in value]
        return np.asarray([value])

    def row(self, index: int) -> Info:
        return self._info


class BatchAgent:
    """Base class of agents: maps the observations of N environments to longitudinal demands.

    An agent reads the observations and the keys of the infos under `lgmd/`. All other keys are ground truth,
    which only oracles read. Its demands in one environment depend neither on N nor on the others. Subclasses
    implement `demands`, and `initial` if they have a state. A state in attributes of their own must not
    change in environments that are not active.

    Attributes:
        name: Name in agent strings, rows and tables.
        include_frame: Whether the observations must contain the camera frames.
        reads_neuron: Whether its demands depend on the neuron.
        config: Configuration of `BrakingEnv` that the agent requires.
        fps: Frame rate of its cameras [Hz]; None for 30.
        num_envs: Number of environments N.
        state: State by name, arrays of shape (N, …); see `initial`.
        alerts: Whether the agent warns, after the last `act`, bool, shape (N,); by default the alerts of the
            neurons.
        failures: Exceptions of a user's agent in the last `act`, by environment.
    """

    name = "agent"
    include_frame = False
    reads_neuron = True
    config: Config = {}  # noqa: RUF012  (never changed)
    fps: float | None = None

    def __init__(self) -> None:
        self._allocate(1)

    @property
    def camera(self) -> "ChannelSpec | None":
        """Cameras of the agent, used unless the user specifies others; None for no preference."""
        return None

    @property
    def neuron(self) -> "NeuronSpec":
        """Neuron parameters for the agent's own cameras; None for those of the paper."""
        return None

    @classmethod
    def options(cls) -> dict[str, object]:
        """Return the options of the agent's string with their defaults."""
        return {item.name: item.default for item in inspect.signature(cls).parameters.values()}

    def initial(self) -> State:
        """Return the state of one environment at the start of an episode: numbers or arrays by name."""
        return {}

    def for_envs(self, num_envs: int) -> Self:
        """Return the same agent, with a state of its own, for `num_envs` environments."""
        agent = copy.copy(self)
        agent._allocate(num_envs)
        return agent

    def reset(
        self, mask: np.ndarray | None = None, seeds: Sequence[int | None] | np.ndarray | None = None
    ) -> None:
        """Start new episodes.

        Args:
            mask: Selection of the environments, bool, shape (N,); None for all.
            seeds: Seeds of random agents, one per environment; those of other environments are not read.
        """
        selected = np.ones(self.num_envs, np.bool_) if mask is None else mask
        for name, value in self.initial().items():
            self.state[name][selected] = value
        self.alerts = self.alerts & ~selected

    def act(self, observations: Observations, infos: Infos, active: np.ndarray | None = None) -> np.ndarray:
        """Return the demands for one observation of every active environment; the others keep their state.

        Args:
            observations: Observations, arrays of shape (N, …). The rows of other environments are undefined.
            infos: Infos, see `Infos`.
            active: Selection of the environments, bool, shape (N,); None for all.

        Returns:
            Demands in [-1, 1], float64, shape (N,), rounded to the float32 of an action. The rows of other
            environments are undefined.

        Raises:
            ValueError: If `demands` returns another shape.
        """
        if active is None:
            active = np.ones(self.num_envs, np.bool_)
        if "lgmd/alert" in infos:
            self.alerts = np.array(infos["lgmd/alert"], np.bool_)
        kept = {} if active.all() else {name: values[~active] for name, values in self.state.items()}
        demands = self.demands(observations, infos, active)
        for name, values in kept.items():
            self.state[name] = np.array(self.state[name])  # an agent may have set a read-only one
            self.state[name][~active] = values
        demands = np.asarray(demands, np.float32)
        if demands.shape != (self.num_envs,):
            shape = (self.num_envs,)
            raise ValueError(f"demands of agent {self.name} must have shape {shape}, got {demands.shape}")
        return demands.astype(np.float64)

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the longitudinal demands in [-1, 1], shape (N,); arguments as of `act`."""
        raise NotImplementedError

    def _allocate(self, num_envs: int) -> None:
        """Make the state of new episodes in `num_envs` environments."""
        self.num_envs = num_envs
        self.failures: dict[int, BaseException] = {}
        self.alerts = np.zeros(num_envs, np.bool_)
        self.state = {
            name: np.repeat(np.asarray(value)[None], num_envs, axis=0)
            for name, value in self.initial().items()
        }


class StagedAgent(BatchAgent):
    """Base class: warns, brakes and releases the brake by the evidence of a threat, see `agents.stages`.

    Subclasses implement `evidence`.

    Attributes:
        brake: Parameters of the brake; by default it latches until the episode ends.
    """

    brake = StageParams()

    def initial(self) -> State:
        """Return a released brake."""
        return {"stage": 0, "clear_s": 0.0}

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the demands of the stages; the alerts are the stages from the warning on."""
        evidence = self.evidence(observations, infos, active)
        speeds = observations["ego_speed"][:, 0] if "ego_speed" in observations else infos["ego_speed"]
        self.state["stage"], self.state["clear_s"] = next_stages(
            self.state["stage"], self.state["clear_s"], evidence, np.asarray(speeds), self.brake, 1.0 / FPS
        )
        self.alerts = self.state["stage"] >= Evidence.WARNING
        return demands_of(self.state["stage"], self.brake)

    def evidence(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the `Evidence` of a threat, int64, shape (N,); called once per decision, in order."""
        raise NotImplementedError


class LatchingAgent(StagedAgent):
    """Base class: brakes fully once `brake_conditions` returns True, and latches until the episode ends."""

    def evidence(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return `FULL` where to begin braking, else `PRESENT`, which keeps a brake."""
        conditions = self.brake_conditions(observations, infos, active)
        return np.where(conditions, Evidence.FULL, Evidence.PRESENT)

    def brake_conditions(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return whether to begin braking, bool, shape (N,); called once per decision, in order."""
        raise NotImplementedError


class Driver(Protocol):
    """What drives in a single environment; an `Agent` is one."""

    @property
    def alert(self) -> bool:
        """Whether it warns."""
        ...

    def reset(self, seed: int | None = None) -> None:
        """Start a new episode."""
        ...

    def act(self, observation: Mapping[str, np.ndarray], info: Info) -> np.ndarray:
        """Return the action for an observation."""
        ...


class Agent:
    """An agent in a single environment.

    Args:
        agent: The agent, which must have one environment.

    Attributes:
        agent: The agent.
        name: Name in agent strings, rows and tables.
    """

    def __init__(self, agent: BatchAgent) -> None:
        self.agent = agent
        self.name = agent.name

    @property
    def include_frame(self) -> bool:
        """Whether the observation must contain the camera frames."""
        return self.agent.include_frame

    @property
    def reads_neuron(self) -> bool:
        """Whether the demand depends on the neuron."""
        return self.agent.reads_neuron

    @property
    def camera(self) -> "ChannelSpec | None":
        """Cameras of the agent, used unless the user specifies others; None for no preference."""
        return self.agent.camera

    @property
    def neuron(self) -> "NeuronSpec":
        """Neuron parameters for the agent's own cameras; None for those of the paper."""
        return self.agent.neuron

    @property
    def config(self) -> Config:
        """Configuration of `BrakingEnv` that the agent requires."""
        return self.agent.config

    @property
    def fps(self) -> float | None:
        """Frame rate of its cameras [Hz]; None for 30."""
        return self.agent.fps

    @property
    def alert(self) -> bool:
        """Whether the agent warns."""
        return bool(self.agent.alerts[0])

    def reset(self, seed: int | None = None) -> None:
        """Start a new episode; `seed` seeds random agents."""
        self.agent.reset(seeds=[seed])

    def act(self, observation: Mapping[str, np.ndarray] | np.ndarray, info: Info) -> np.ndarray:
        """Return the action for an observation: float32, shape (1,), in [-1, 1].

        Without a camera, the observation is that of the environment, an array, which agents do not read.
        """
        items = observation.items() if isinstance(observation, Mapping) else ()
        observations = {name: np.asarray(values)[None] for name, values in items}
        demands = self.agent.act(observations, _SingleInfo(info))
        for error in self.agent.failures.values():
            raise error
        return to_action(float(demands[0]))


def rows_of(observations: Observations, index: int) -> dict[str, np.ndarray]:
    """Return the observation of one environment."""
    return {name: values[index] for name, values in observations.items()}


def _frame(frame: Any, function: Callable[[Any], Any]) -> Any:
    """Return a `TraceFrame` with a function applied to its arrays."""
    response = frame.response._make(map(function, frame.response))
    return frame._replace(time=function(frame.time), ego_speed=function(frame.ego_speed), response=response)


def _plain(value: object) -> object:
    """Return a scalar as a Python number, and a copy of an array."""
    if isinstance(value, np.generic):
        return cast(Any, value).item()
    return np.array(cast(np.ndarray, value)) if isinstance(value, np.ndarray) else value
