"""Braking scenarios on highway-env, imported as `lgmd_gym.envs`.

Importing this package registers nothing and loads no highway-env; `import lgmd_gym` registers the ids.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lgmd_gym.envs.braking import BrakingEnv
    from lgmd_gym.envs.dynamics.path import Bend
    from lgmd_gym.envs.dynamics.speed_profile import Segment
    from lgmd_gym.envs.registration import env_id, register_envs
    from lgmd_gym.envs.scenarios.catalogue import FAMILIES, make_scenario
    from lgmd_gym.envs.scenarios.scenario import Actor, RoadPlan, Scenario

__all__ = [
    "FAMILIES",
    "Actor",
    "Bend",
    "BrakingEnv",
    "RoadPlan",
    "Scenario",
    "Segment",
    "env_id",
    "make_scenario",
    "register_envs",
]

_HOMES = {
    "BrakingEnv": "braking",
    "FAMILIES": "scenarios.catalogue",
    "make_scenario": "scenarios.catalogue",
    "env_id": "registration",
    "register_envs": "registration",
    "Actor": "scenarios.scenario",
    "Bend": "dynamics.path",
    "Segment": "dynamics.speed_profile",
    "RoadPlan": "scenarios.scenario",
    "Scenario": "scenarios.scenario",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
