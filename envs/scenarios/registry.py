"""Registry of the scenario families."""

import inspect
from collections.abc import Callable

from lgmd_gym.envs.scenarios.scenario import Scenario
from lgmd_gym.errors import check_keys, check_known

Family = Callable[..., Scenario]
FAMILIES: dict[str, Family] = {}
"""Scenario functions by family name; importing `lgmd_gym.envs.scenarios` fills it."""


def family(name: str) -> Callable[[Family], Family]:
    """Register a scenario function under a family name; its environment id is `LGMD/<name>-v0`.

    Raises:
        ValueError: If the name is taken.
    """

    def register(function: Family) -> Family:
        if name in FAMILIES:
            raise ValueError(f"scenario family {name!r} is defined twice; choose another name")
        FAMILIES[name] = function
        return function

    return register


def make_scenario(name: str, **arguments: object) -> Scenario:
    """Return the scenario of a family.

    Args:
        name: A key of `FAMILIES`.
        **arguments: Arguments of the family's function.

    Raises:
        ValueError: If the family or an argument is unknown, or a value is out of range.
    """
    check_known("scenario", name, FAMILIES)
    function = FAMILIES[name]
    check_keys(f"argument of {name}", arguments, inspect.signature(function).parameters)
    return function(**arguments)
