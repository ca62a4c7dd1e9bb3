"""A module with scenario families of a user, for several test files."""

import sys

import gymnasium as gym

from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.families import LEVELS

MODULE = '''
from dataclasses import dataclass, replace
from pathlib import Path

from lgmd_gym.envs import Actor, Scenario, make_scenario, register_family

Path(__file__).with_name("loaded").touch()

@register_family("Squeeze")
def squeeze(ego_speed: float = 19.44, gap: float = 8.0, excess: float = -5.56) -> Scenario:
    """A slower car cuts in behind a truck.

    Args:
        gap: Gap [m].
    """
    cut_in = make_scenario("CutIn", ego_speed=ego_speed, gap=gap, excess=excess)
    truck = Actor(gap=60.0, speed=ego_speed, length=12.0, width=2.5, height=3.5)
    return replace(cut_in, family="Squeeze", actors=(*cut_in.actors, truck))

@dataclass
class Parked:
    ego_speed: float = 10.0
    gap: float = 60.0

    def scenario(self) -> Scenario:
        actors = (Actor(gap=self.gap),)
        return Scenario(family="Parked", ego_speed=self.ego_speed, duration=2.0, actors=actors)

def misnamed() -> Scenario:
    return Scenario(family="other", ego_speed=1.0, duration=1.0)

def nothing() -> None:
    return None
'''
SUITE = """
name = "own"
module = "my_scenarios:Parked"

[[cases]]
family = "Squeeze"
name = "dusk"
sweep.gap = [6.5, 8]
arguments = { weather = "night" }

[[cases]]
family = "Parked"
speeds_kmh = [30]
"""


def forget_families():
    """Remove the families that are not of this package, and the module of the user."""
    for name in [name for name, made in FAMILIES.items() if not made.__module__.startswith("lgmd_gym.")]:
        del FAMILIES[name]
        for level in [level.name for level in LEVELS.values() if level.family == name]:
            del LEVELS[level]
        gym.registry.pop(env_id(name), None)
    sys.modules.pop("my_scenarios", None)
