"""All scenario families: SI arguments in, one `Scenario` out. Each name is an id `LGMD/<name>-v0`."""

import inspect

from lgmd_gym.envs.scenarios import (  # noqa: F401  (importing a module registers its families)
    adjacent,
    crossing,
    obstacles,
    rear,
    turning,
)
from lgmd_gym.envs.scenarios.registry import FAMILIES
from lgmd_gym.envs.scenarios.scenario import Scenario
from lgmd_gym.errors import check_keys, unknown_name

__all__ = ["FAMILIES", "make_scenario"]


def make_scenario(name: str, **arguments: object) -> Scenario:
    """Return the scenario of a family.

    Raises:
        ValueError: For an unknown family or argument (naming the nearest), or a value out of its range.
    """
    if name not in FAMILIES:
        raise unknown_name("scenario", name, FAMILIES)
    function = FAMILIES[name]
    check_keys(f"argument of {name}", arguments, inspect.signature(function).parameters)
    return function(**arguments)
