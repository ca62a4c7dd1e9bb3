"""The seam: being told of every simulation step of a highway-env road."""

from collections.abc import Callable
from typing import Any

import gymnasium as gym


class HookedStep:
    """`Road.step` of one road that also tells a watcher; a class, so that deep copies step their own road."""

    def __init__(self, step: Callable[[float], None], tell: Callable[[], None]) -> None:
        self.step = step
        self.tell: Any = tell

    def __call__(self, dt: float) -> None:
        """Step the road by `dt` [s], then tell."""
        self.step(dt)
        self.tell()


def on_road_step(env: gym.Env, tell: Callable[[], None]) -> None:
    """Have the present road of an environment call a bound method after each of its steps.

    Every reset of a highway-env environment brings a new road, so this is called after each; on a road
    that is kept it changes nothing the second time.
    """
    road: Any = env.unwrapped.road  # type: ignore[attr-defined]
    if not (isinstance(road.step, HookedStep) and road.step.tell == tell):
        road.step = HookedStep(road.step, tell)


def check_highway(env: gym.Env) -> None:
    """Raise ValueError if this is no highway-env environment."""
    base: Any = env.unwrapped
    if not hasattr(base, "road") or "simulation_frequency" not in getattr(base, "config", {}):
        raise ValueError(f"LGMDObservation needs a highway-env environment, got {base!r}")
