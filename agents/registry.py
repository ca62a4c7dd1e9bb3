"""Registry of agents: `AGENTS` maps names to classes, `make_agent` builds an agent from a string."""

from typing import Any, TypeVar

from lgmd_gym.agents.base import Agent, BatchAgent
from lgmd_gym.agents.baselines import AlwaysBrake, NoBrake, RandomBrake
from lgmd_gym.agents.image_rules import FlowDivergence, FrameDifference
from lgmd_gym.agents.oracles import (
    EtaOracle,
    LastMomentOracle,
    StoppingDistanceOracle,
    TauOracle,
    TTCOracle,
)
from lgmd_gym.agents.policies.policy import Policy, shipped_policies
from lgmd_gym.agents.rules import AdaptiveThreshold, DangerZone, Rule, SpikeThreshold, StoppingZone
from lgmd_gym.agents.user_agents import check_options, make_user_agent, parse_agent
from lgmd_gym.aliases import Arguments
from lgmd_gym.errors import check_keys, check_known, check_text, shown
from lgmd_gym.fields import parse_options

AGENTS: dict[str, type[BatchAgent]] = {}
_A = TypeVar("_A", bound=type[BatchAgent])


def register_agent(agent: _A) -> _A:
    """Add an agent class to `AGENTS` under its `name`; usable as a class decorator.

    Raises:
        ValueError: If the name is taken.
    """
    given: Any = agent
    if not isinstance(given, type) or not issubclass(given, BatchAgent):
        raise TypeError(f"agent must be a subclass of BatchAgent, got {shown(agent)}")
    if agent.name in AGENTS:
        raise ValueError(f"agent {agent.name!r} is already registered; choose another name")
    AGENTS[agent.name] = agent
    return agent


for _group in (
    (NoBrake, AlwaysBrake, RandomBrake),
    (SpikeThreshold, AdaptiveThreshold),
    (DangerZone, StoppingZone),
    (FrameDifference, FlowDivergence),
    (LastMomentOracle, TTCOracle, StoppingDistanceOracle, EtaOracle, TauOracle),
):
    for _agent in _group:
        register_agent(_agent)


def make_agent(text: str) -> Agent:
    """Return the agent for a string, in a single environment; arguments and errors as of `make_agents`."""
    return Agent(make_agents(text, 1))


def make_agents(text: str, num_envs: int) -> BatchAgent:
    """Return the agent for a string, in N environments.

    Args:
        text: "NAME[:OPTION=VALUE,…]" for a registered agent, as in "spike-threshold:threshold=45,frames=2";
            "RULE:toml=FILE" for a rule with options from a TOML file; "MODULE:CLASS[:OPTION=VALUE,…]" for a
            user's class with a method `act`; "policy:NAME" or "policy:FILE.zip" for a learned policy, with
            ":margin=X" for a margin of its log odds. A file whose card does not describe the network is
            unpickled and can run arbitrary code.
        num_envs: Number of environments N.

    Raises:
        ValueError: For an unknown agent or option, or a value out of bounds.
    """
    name, _, rest = check_text("agent", text).partition(":")
    if "," in name:
        raise ValueError(
            f"agent {shown(text)} contains a comma before its options; separate agents by spaces"
        )
    if name == Policy.name:
        file, options = _split_policy(rest)
        check_keys("option of agent policy", options, ("margin",))
        return Policy(file, **options).for_envs(num_envs)
    if _is_user_class(name, rest):
        return make_user_agent(text).for_envs(num_envs)
    name, options = parse_agent(text)
    check_known("agent", name, AGENTS, "an agent of your own is MODULE:CLASS")
    agent: Any = AGENTS[name]
    if not issubclass(agent, Rule):  # the parameters of a rule check their own names
        check_options(name, agent, options)
    return agent(**options).for_envs(num_envs)


def outside_code(text: str) -> str | None:
    """Return what `make_agent` would execute from outside this package; None for nothing.

    Args:
        text: Agent string, see `make_agent`.

    Example:
        >>> outside_code("my_module:MyAgent")
        "module 'my_module'"
    """
    name, _, rest = text.partition(":")
    if name == Policy.name:
        file, _ = _split_policy(rest)
        return None if file in shipped_policies() else f"policy file {file!r}"
    return f"module {name!r}" if _is_user_class(name, rest) else None


def _split_policy(text: str) -> tuple[str, Arguments]:
    """Split "FILE:OPTION=VALUE,…" into the file, which may contain ":" and "=", and the options."""
    file, _, options = text.rpartition(":")
    option, equals, _ = options.partition("=")
    if not file or not equals or not option.strip().isidentifier():
        return text, {}
    return file, parse_options("agent", options, f"{Policy.name}:{text}")


def _is_user_class(name: str, rest: str) -> bool:
    return name not in AGENTS and rest.partition(":")[0].isidentifier()
