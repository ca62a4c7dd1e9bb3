"""What an agent is: it sees observations and the `lgmd/` keys of `info`, and answers with a demand."""

import inspect
from typing import Any

import numpy as np

BRAKE = -1.0  # full braking, see `BrakingEnv`
HOLD = 0.0  # the scripted speed


def to_action(demand: float) -> np.ndarray:
    """Return a longitudinal demand in [-1, 1] as an action of `ContinuousDemand`, shape (1,), float32."""
    return np.array([demand], dtype=np.float32)


class Agent:
    """Base of all agents; any object with the same methods will do.

    An agent reads the observation and the `info` keys under `lgmd/`. Everything else in `info` is ground
    truth, for oracles alone.
    """

    name = "agent"
    include_frame = False  # whether it needs the frames themselves in the observation

    def __init__(self) -> None:
        self._alert = False

    @property
    def camera(self) -> Any:
        """The eye it wants where the user names none, as `LGMDObservation` takes it; None for no wish."""
        return None

    @property
    def neuron(self) -> dict[str, Any] | None:
        """The `params` of `LGMDObservation` that it wants behind its own eye; None for the paper's."""
        return None

    @classmethod
    def options(cls) -> dict[str, Any]:
        """Return what its string may set, with the defaults."""
        return {item.name: item.default for item in inspect.signature(cls).parameters.values()}

    @property
    def alert(self) -> bool:
        """Whether the agent warns at present; by default the neuron's own alert."""
        return self._alert

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode; `seed` feeds whatever the agent draws."""
        self._alert = False

    def act(self, observation: dict[str, Any], info: dict[str, Any]) -> np.ndarray:
        """Return the action for an observation: an array of shape (1,) in [-1, 1]."""
        self._alert = bool(info.get("lgmd/alert", False))
        return to_action(self.demand(observation, info))

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return the longitudinal demand in [-1, 1]; what a subclass defines."""
        raise NotImplementedError
