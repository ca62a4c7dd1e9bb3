"""Braking and traffic environments on highway-env, imported as `lgmd_gym.envs`.

`import lgmd_gym` registers the environment ids. Importing this package does not load highway-env.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lgmd_gym.envs.braking import BrakingEnv
    from lgmd_gym.envs.dynamics.script import Bend, Segment
    from lgmd_gym.envs.families import FAMILIES, make_scenario
    from lgmd_gym.envs.families.scenario import Actor, RoadPlan, Scenario
    from lgmd_gym.envs.registration import env_id, import_families, register_envs, register_family

__all__ = [
    "FAMILIES",
    "Actor",
    "Bend",
    "BrakingEnv",
    "RoadPlan",
    "Scenario",
    "Segment",
    "env_id",
    "import_families",
    "make_scenario",
    "register_envs",
    "register_family",
]

_MODULES = {
    "BrakingEnv": "braking",
    "FAMILIES": "families",
    "make_scenario": "families",
    "env_id": "registration",
    "register_envs": "registration",
    "register_family": "registration",
    "import_families": "registration",
    "Actor": "families.scenario",
    "Bend": "dynamics.script",
    "Segment": "dynamics.script",
    "RoadPlan": "families.scenario",
    "Scenario": "families.scenario",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
