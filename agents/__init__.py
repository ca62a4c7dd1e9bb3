"""Agents: rules on the neuron, baselines without sensors, learned policies and oracles."""

from lgmd_gym.agents.base import BRAKE, HOLD, Agent, BatchAgent, to_action
from lgmd_gym.agents.baselines import AlwaysBrake, NoBrake, RandomBrake
from lgmd_gym.agents.image_rules import FlowDivergence, FrameDifference
from lgmd_gym.agents.oracles import (
    EtaOracle,
    LastMomentOracle,
    StoppingDistanceOracle,
    TauOracle,
    TTCOracle,
)
from lgmd_gym.agents.policies.policy import Policy
from lgmd_gym.agents.registry import AGENTS, make_agent, make_agents, register_agent
from lgmd_gym.agents.rules import AdaptiveThreshold, DangerZone, Rule, SpikeThreshold, StoppingZone

__all__ = ["AGENTS", "BRAKE", "HOLD", "Agent", "BatchAgent", "Policy", "Rule"]
__all__ += ["make_agent", "make_agents", "register_agent", "to_action"]
__all__ += ["AlwaysBrake", "NoBrake", "RandomBrake"]
__all__ += ["AdaptiveThreshold", "DangerZone", "SpikeThreshold", "StoppingZone"]
__all__ += ["FlowDivergence", "FrameDifference"]
__all__ += ["EtaOracle", "LastMomentOracle", "StoppingDistanceOracle", "TTCOracle", "TauOracle"]
