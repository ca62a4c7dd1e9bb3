"""Base class of all agents, and the two demands of an agent that only brakes."""

import inspect
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.errors import check_within

if TYPE_CHECKING:
    from lgmd_gym.camera import CameraSpec
    from lgmd_gym.neuron import NeuronSpec

BRAKE = -1.0  # demand for full braking
HOLD = 0.0  # demand for the scripted speed
FPS = 30.0  # frame and decision rate for which all agents are tuned [Hz]


def to_action(demand: float) -> np.ndarray:
    """Return a longitudinal demand in [-1, 1] as an action of `ContinuousDemand`: float32, shape (1,)."""
    return np.array([check_within("demand", demand, -1.0, 1.0)], dtype=np.float32)


class Agent:
    """Base class: maps an observation to a longitudinal demand.

    An agent reads the observation and the `info` keys under `lgmd/`. All other keys of `info` are ground
    truth, which only oracles read. Subclasses implement `demand`.

    Attributes:
        name: Name in agent strings, rows and tables.
        include_frame: Whether the observation must contain the camera frames.
        reads_neuron: Whether its demand depends on the neuron.
    """

    name = "agent"
    include_frame = False
    reads_neuron = True
    _alert = False

    @property
    def camera(self) -> "CameraSpec | None":
        """Cameras of the agent, used unless the user specifies others; None for no preference."""
        return None

    @property
    def neuron(self) -> "NeuronSpec":
        """Neuron parameters for the agent's own cameras; None for those of the paper."""
        return None

    @classmethod
    def options(cls) -> dict[str, Any]:
        """Return the options of the agent's string with their defaults."""
        return {item.name: item.default for item in inspect.signature(cls).parameters.values()}

    @property
    def alert(self) -> bool:
        """Whether the agent warns; by default the alert of the neuron."""
        return self._alert

    def reset(self, seed: int | None = None) -> None:
        """Start a new episode; `seed` seeds random agents."""
        self._alert = False

    def cameras_in_use(
        self, speed: np.ndarray, yaw_rate: np.ndarray, potential: np.ndarray | None = None
    ) -> np.ndarray | None:
        """Return when the agent reads which cameras, so that the others are not drawn; None for always all.

        The benchmark in traffic calls this method with the motion of an episode in which the agent does not
        brake. The answer to the first call, without `potential`, are the cameras whose readings matter on
        their own. In the second call, `potential` holds these readings, and the answer adds the cameras that
        matter because of them. All other readings may be arbitrary. Cameras are drawn for some time before
        they are read, for the filters of their neurons.

        Args:
            speed: Ego speed at each decision, which is also each camera frame, shape (decisions,) [m/s].
            yaw_rate: Mean yaw rate of each decision, + to the right, shape (decisions,) [rad/s].
            potential: Membrane potentials, shape (decisions, cameras), valid where the first answer is True.

        Returns:
            Whether a reading can affect the agent, bool, shape (decisions, cameras), or None.
        """
        return None

    def act(self, observation: dict[str, Any], info: dict[str, Any]) -> np.ndarray:
        """Return the action for an observation: float32, shape (1,), in [-1, 1]."""
        self._alert = bool(info.get("lgmd/alert", False))
        return to_action(self.demand(observation, info))

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return the longitudinal demand in [-1, 1]."""
        raise NotImplementedError

    def batch(self, num_envs: int) -> BatchAgent | None:
        """Return this agent for `num_envs` environments with one camera frame per decision.

        None, the default, for an agent that acts in one environment only; a caller with several environments
        makes one agent for each.
        """
        return None


class LatchingAgent(Agent):
    """Base class: brakes fully once `brake_condition` returns True, and latches until the episode ends."""

    _latched = False

    @property
    def alert(self) -> bool:
        """Whether the agent brakes."""
        return self._latched

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        self._latched = False

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return `BRAKE` once the agent has latched, else `HOLD`."""
        self._latched = self.brake_condition(observation, info) or self._latched
        return BRAKE if self._latched else HOLD

    def brake_condition(self, observation: dict[str, Any], info: dict[str, Any]) -> bool:
        """Return whether to begin braking; called once per decision, in order."""
        raise NotImplementedError
