"""What an agent is: it sees observations and the `lgmd/` keys of `info`, and answers with a demand."""

from typing import Any

import numpy as np

BRAKE = -1.0  # full braking, see `BrakingEnv`
HOLD = 0.0  # the scripted speed


def demand(value: float) -> np.ndarray:
    """Return a longitudinal demand in [-1, 1] as an action of `ContinuousDemand`, shape (1,), float32."""
    return np.array([value], dtype=np.float32)


class Agent:
    """Base of all agents; any object with the same methods will do.

    An agent reads the observation and the `info` keys under `lgmd/`. Everything else in `info` is ground
    truth, for oracles alone.
    """

    name = "agent"
    camera: Any = None  # what it was made to look through, as for `LGMDObservation`; None: whatever there is

    def __init__(self) -> None:
        self._alert = False

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
        return demand(self.choose(observation, info))

    def choose(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return the longitudinal demand in [-1, 1]; what a subclass defines."""
        raise NotImplementedError
