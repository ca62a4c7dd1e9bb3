"""Who brakes: rules on the neuron, baselines that do not look, and oracles, imported as `lgmd_gym.agents`."""

from typing import Any

from lgmd_gym.agents.adapter import AgentAdapter, import_agent
from lgmd_gym.agents.base import BRAKE, HOLD, Agent, to_action
from lgmd_gym.agents.baselines import AlwaysBrake, NoBrake, RandomBrake
from lgmd_gym.agents.field_rules import DangerZone, NestedFields
from lgmd_gym.agents.image_rules import FlowDivergence, FrameDifference
from lgmd_gym.agents.options import check_options, parse
from lgmd_gym.agents.oracles import EtaOracle, StoppingDistanceOracle, TauOracle, TTCOracle
from lgmd_gym.agents.policies.policy import Policy
from lgmd_gym.agents.rule import Rule
from lgmd_gym.agents.spike_rules import AdaptiveThreshold, Graded, SpeedGated, SpikeThreshold
from lgmd_gym.agents.stopping_zone import StoppingZone
from lgmd_gym.errors import unknown_name

__all__ = [
    "AGENTS",
    "BRAKE",
    "HOLD",
    "Agent",
    "AlwaysBrake",
    "NoBrake",
    "Policy",
    "RandomBrake",
    "Rule",
    "SpikeThreshold",
    "StoppingZone",
    "TTCOracle",
    "make_agent",
    "to_action",
]

AGENTS: dict[str, type[Agent]] = {
    agent.name: agent
    for agent in (
        NoBrake,
        AlwaysBrake,
        RandomBrake,
        SpikeThreshold,
        AdaptiveThreshold,
        Graded,
        SpeedGated,
        NestedFields,
        DangerZone,
        StoppingZone,
        FrameDifference,
        FlowDivergence,
        TTCOracle,
        StoppingDistanceOracle,
        EtaOracle,
        TauOracle,
    )
}


def make_agent(text: str) -> Agent:
    """Return the agent that a string names.

    Args:
        text: "name", or "name:option=value,…" as in "spike-threshold:threshold=45,frames=2"; a rule's option
            `toml` names a file of options, as in "stopping-zone:toml=mine.toml". A user's own agent is
            "module:Class" or "module:Class:option=value,…", any class with `act`; a policy of
            `lgmd-gym train` is "policy:FILE.zip" (loading one runs what its author pickled into it).

    Raises:
        ValueError: For an unknown agent or option (the nearest is named), or a value out of its range.
    """
    head, _, rest = text.partition(":")
    if "," in head:
        raise ValueError(f"agent {text!r} holds a comma before any option; separate agents by spaces")
    if head == Policy.name:
        return Policy(rest)
    class_name, _, options_text = rest.partition(":")
    if head not in AGENTS and class_name.isidentifier():
        name = f"{head}:{class_name}"
        foreign: Any = import_agent(name)
        options = parse(f"agent:{options_text}")[1]
        check_options(name, foreign, options)
        return AgentAdapter(name, foreign(**options))
    name, options = parse(text)
    if name not in AGENTS:
        raise unknown_name("agent", name, AGENTS)
    known: Any = AGENTS[name]
    if not issubclass(known, Rule):  # a rule's parameters check themselves
        check_options(name, known, options)
    return known(**options)
