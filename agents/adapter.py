"""A user's own agent: any class with `act`, named as "module:Class"."""

import os
import sys
from importlib import import_module
from typing import Any

import numpy as np

from lgmd_gym.agents.base import Agent


class AgentAdapter(Agent):
    """Gives a user's agent what it leaves out: a name, a reset, and the neuron's alert.

    Args:
        name: What it is called in rows and tables.
        agent: An object with `act(observation, info)`, which returns a number or an array of one.
    """

    def __init__(self, name: str, agent: Any) -> None:
        super().__init__()
        self.name = name
        self.agent = agent
        self.include_frame = bool(getattr(agent, "include_frame", False))

    @property
    def camera(self) -> Any:
        """The eye it wants, if it says so."""
        return getattr(self.agent, "camera", None)

    @property
    def neuron(self) -> dict[str, Any] | None:
        """The neurons' parameters it wants behind its own eye, if it says so."""
        return getattr(self.agent, "neuron", None)

    @property
    def alert(self) -> bool:
        """Whether the agent warns; the neuron's alert if it does not say."""
        return bool(getattr(self.agent, "alert", self._alert))

    def reset(self, seed: int | None = None) -> None:
        """Reset the agent, if it knows how."""
        super().reset(seed)
        reset = getattr(self.agent, "reset", None)
        if reset is not None:
            reset(seed)

    def act(self, observation: dict[str, Any], info: dict[str, Any]) -> np.ndarray:
        """Return the agent's action as an array of shape (1,), float32.

        Raises:
            ValueError: If it is not one finite number.
        """
        self._alert = bool(info.get("lgmd/alert", False))
        action = np.asarray(self.agent.act(observation, info), dtype=np.float32).reshape(-1)
        if action.size != 1 or not np.isfinite(action[0]):
            raise ValueError(f"agent {self.name!r} must act with one finite number, got {action.tolist()}")
        return action


def import_agent(text: str) -> type:
    """Return the class that "package.module:Class" names; the working folder is searched, too.

    Raises:
        ValueError: If the module or the class cannot be found, or has no `act`.
    """
    module_name, _, class_name = text.partition(":")
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        found = getattr(import_module(module_name), class_name)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"agent {text!r} cannot be imported ({error}); write module:Class") from None
    if not hasattr(found, "act"):
        raise ValueError(f"agent {text!r} has no method act(observation, info)")
    return found
