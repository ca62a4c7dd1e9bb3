"""Registry of the scenario families."""

import inspect
import re
from collections.abc import Callable
from typing import Any

from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.errors import check_keys, check_known, shown

Family = Callable[..., Any]
"""A function that returns a `Scenario`, or a class with a method `scenario` that does."""
FAMILIES: dict[str, Family] = {}
"""Families by name; importing `lgmd_gym.envs.families` fills it."""
_NAME = re.compile(r"[\w.-]+")  # allowed in ids of Gymnasium and in names of cases


def family(name: str) -> Callable[[Family], Family]:
    """Register a scenario function or class under a family name; its environment id is `LGMD/<name>-v0`.

    The same function of the same module may be defined again, as in a notebook.

    Raises:
        ValueError: If the name is taken, or contains other characters than letters, digits, ".", "_", "-".
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise ValueError(f"family must consist of letters, digits and . _ -, got {shown(name)}")

    def register(function: Family) -> Family:
        if not callable(function):  # pyright: ignore[reportUnnecessaryComparison]
            raise ValueError(f"family {name!r} must be a function or class, got {shown(function)}")
        if name in FAMILIES and _origin(FAMILIES[name]) != _origin(function):
            raise ValueError(f"scenario family {name!r} is defined twice; choose another name")
        FAMILIES[name] = function
        return function

    return register


def make_scenario(name: str, **arguments: object) -> Scenario:
    """Return the scenario of a family.

    Args:
        name: A key of `FAMILIES`.
        **arguments: Arguments of the family's function or class.

    Raises:
        ValueError: If the family or an argument is unknown, a value is out of range, or the family returns
            anything else than a scenario of its name.
    """
    check_known("scenario", name, FAMILIES)
    function = FAMILIES[name]
    check_keys(f"argument of {name}", arguments, inspect.signature(function).parameters)
    made = function(**arguments)
    if isinstance(function, type):
        made = made.scenario()
    if not isinstance(made, Scenario):
        raise ValueError(f"family {name!r} must return a Scenario, got {shown(made)}")
    if made.family != name:
        raise ValueError(
            f"family {name!r} returned a Scenario with family={made.family!r}; write family={name!r} there"
        )
    return made


def _origin(function: Family) -> tuple[Any, Any]:
    return getattr(function, "__module__", None), getattr(function, "__qualname__", function)
