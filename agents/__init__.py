"""Agents: rules on the neuron, baselines without sensors, learned policies and oracles."""

from lgmd_gym.agents.base import BRAKE, HOLD, Agent, to_action
from lgmd_gym.agents.baselines import AlwaysBrake, NoBrake, RandomBrake
from lgmd_gym.agents.field_rules import DangerZone, NestedFields
from lgmd_gym.agents.image_rules import FlowDivergence, FrameDifference
from lgmd_gym.agents.oracles import EtaOracle, StoppingDistanceOracle, TauOracle, TTCOracle
from lgmd_gym.agents.policies.policy import Policy
from lgmd_gym.agents.registry import AGENTS, make_agent, register_agent
from lgmd_gym.agents.rule import Rule
from lgmd_gym.agents.spike_rules import AdaptiveThreshold, Graded, SpeedGated, SpikeThreshold
from lgmd_gym.agents.stopping_zone import StoppingZone

__all__ = ["AGENTS", "BRAKE", "HOLD", "Agent", "Policy", "Rule", "make_agent", "register_agent", "to_action"]
__all__ += ["AlwaysBrake", "NoBrake", "RandomBrake"]
__all__ += ["AdaptiveThreshold", "Graded", "SpeedGated", "SpikeThreshold"]
__all__ += ["DangerZone", "NestedFields", "StoppingZone"]
__all__ += ["FlowDivergence", "FrameDifference"]
__all__ += ["EtaOracle", "StoppingDistanceOracle", "TTCOracle", "TauOracle"]
