"""Who brakes: rules on the neuron, baselines that do not look, and oracles, imported as `lgmd_gym.agents`."""

from typing import Any

from lgmd_gym.agents.base import BRAKE, HOLD, Agent, demand
from lgmd_gym.agents.baselines import AlwaysBrake, NoBrake, RandomBrake
from lgmd_gym.agents.options import check_options, parse
from lgmd_gym.agents.oracles import TTCOracle
from lgmd_gym.agents.rules import SpikeThreshold
from lgmd_gym.errors import unknown_name

__all__ = [
    "AGENTS",
    "BRAKE",
    "HOLD",
    "Agent",
    "AlwaysBrake",
    "NoBrake",
    "RandomBrake",
    "SpikeThreshold",
    "TTCOracle",
    "demand",
    "make_agent",
]

AGENTS: dict[str, type[Agent]] = {
    agent.name: agent for agent in (NoBrake, AlwaysBrake, RandomBrake, SpikeThreshold, TTCOracle)
}


def make_agent(text: str) -> Agent:
    """Return the agent that a string such as "spike-threshold:threshold=45,frames=2" names.

    Raises:
        ValueError: For an unknown agent or option (the nearest is named), or a value out of its range.
    """
    name, options = parse(text)
    if name not in AGENTS:
        raise unknown_name("agent", name, AGENTS)
    cls: Any = AGENTS[name]
    check_options(name, cls, options)
    return cls(**options)
