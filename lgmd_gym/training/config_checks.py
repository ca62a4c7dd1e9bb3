"""Checks of the values of a `TrainConfig` that depend on each other."""

from collections.abc import Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

from lgmd_gym.agents import HOLD
from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.policies.features import LATCH_DEMAND
from lgmd_gym.errors import check_items, check_within, shown
from lgmd_gym.training.extra_episodes import parse_levels, parse_traffic

if TYPE_CHECKING:
    from lgmd_gym.training.config import TrainConfig

RANDOM_ID = "LGMD/RandomBraking-v0"


def check_demands(algo: str, demands: Sequence[float]) -> None:
    """Raise ValueError for demands without a brake, repeated ones, or those of another algorithm."""
    for demand in check_items("demands", demands, Real, "numbers"):
        check_within("demands", demand, -1.0, 1.0)
    if demands and (min(demands) >= 0.0 or len({*demands}) < len(demands)):
        raise ValueError(
            f"demands must be distinct, with one below 0 that brakes, got {list(demands)}; "
            "use for example --demands 0 -1"
        )
    if algo == "dqn" and not demands:
        raise ValueError("dqn requires discrete demands; use for example --demands 0 -1")
    if algo == "sac" and demands:
        raise ValueError(f"sac requires a continuous demand, got demands {list(demands)}; omit them")


def check_rates(env_kwargs: dict[str, Any]) -> None:
    """Raise ValueError for a frame rate or decision rate at which no agent runs."""
    config = env_kwargs.get("config") or {}
    rates = {"fps": env_kwargs.get("fps"), "policy_frequency": config.get("policy_frequency")}
    for name, rate in rates.items():
        if rate not in (None, FPS):
            raise ValueError(
                f"{name} in env_kwargs must be {FPS:g} Hz, the rate of agents, got {shown(rate)}; "
                "use PolicyWrapper's repeat for fewer decisions"
            )


def check_extra_episodes(config: "TrainConfig") -> None:
    """Raise ValueError for texts that name no episodes, or the same levels twice."""
    for text in config.extra_traffic:
        parse_traffic(text)
    families = [family for text in config.extra_levels for family in parse_levels(text).names]
    repeated = next((family for family in families if families.count(family) > 1), None)
    if repeated is not None:  # the sets start at the same seed
        raise ValueError(
            f"extra_levels names {repeated!r} in two sets, which would contain the same levels; "
            "increase the number of one set"
        )
    if families and config.env_id != RANDOM_ID:
        raise ValueError(f"extra_levels requires env {RANDOM_ID!r}, got {config.env_id!r}; omit it")


def check_offline(config: "TrainConfig") -> None:
    """Raise ValueError for values that recorded episodes do not support."""
    demands = config.demands
    if sorted(demands)[1:] != [HOLD] or min(demands) > LATCH_DEMAND:
        raise ValueError(
            f"demands of algo 'offline' must be 0 and one of {LATCH_DEMAND} or less, "
            f"got {list(demands)}; use for example --demands 0 -1"
        )
    if not config.features.latch:
        raise ValueError("algo 'offline' requires latch: true in its hyperparameters")
    changed = set(config.env_kwargs.get("config") or {}) - {"action"}
    if changed and (config.traffic_episodes or config.extra_traffic):
        raise ValueError(
            f"traffic episodes have the default {', '.join(sorted(changed))}, got others in config of "
            "env_kwargs; omit them, or traffic_episodes and extra_traffic"
        )
    if config.videos:
        raise ValueError("videos requires algo 'dqn', 'ppo' or 'sac', got 'offline'; omit it")
    if "speed_change" in config.features.inputs:
        # A policy with this input braked in traffic whenever the driver accelerated.
        raise ValueError(
            "algo 'offline' does not support the input 'speed_change': the ego never accelerates in "
            "recorded levels; remove it from the inputs"
        )
