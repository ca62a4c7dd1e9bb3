"""Callbacks after each simulation step of a highway-env road."""

from collections.abc import Callable
from typing import Any

import gymnasium as gym

from lgmd_gym.errors import shown


class HookedStep:
    """Wrapper of `Road.step` that calls a bound method afterwards; it supports deep copies of the road."""

    def __init__(self, step: Callable[[float], None], callback: Callable[[], None]) -> None:
        self.step = step
        self.callback = callback

    def __call__(self, dt: float) -> None:
        """Step the road by `dt` [s]."""
        self.step(dt)
        self.callback()


def on_road_step(env: gym.Env, callback: Callable[[], None]) -> None:
    """Register a bound method that the current road calls after each step.

    A reset of a highway-env environment creates a new road, so call this function after each reset. A
    repeated call for the same road has no effect.
    """
    road: Any = env.unwrapped.road  # type: ignore[attr-defined]
    if not (isinstance(road.step, HookedStep) and road.step.callback == callback):
        road.step = HookedStep(road.step, callback)


def check_highway_env(env: gym.Env) -> None:
    """Raise ValueError for an environment that is not a highway-env environment."""
    base: Any = getattr(env, "unwrapped", None)
    if not hasattr(base, "road") or "simulation_frequency" not in getattr(base, "config", {}):
        raise ValueError(f"env must be a highway-env environment, got {shown(env if base is None else base)}")
