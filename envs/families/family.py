"""Declaration of a scenario family: its function, the bounds of its arguments, and its random levels.

For example::

    @family("Wall", Level("Wall", 2.0, lambda rng: {"ego_speed": rng.uniform(5.0, 20.0)}), threat=True)
    def approach_wall(ego_speed: Annotated[float, speed("Ego speed")] = 10.0) -> Scenario:
        ...
"""

import inspect
import re
from collections.abc import Callable
from functools import wraps
from textwrap import wrap
from typing import Any, NamedTuple, TypeVar

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.errors import check_keys, check_known, shown
from lgmd_gym.fields import Declaration, declaration_of

Family = Callable[..., Any]
"""A function that returns a `Scenario`, or a class with a method `scenario` that does."""
_F = TypeVar("_F", bound=Family)
FAMILIES: dict[str, Family] = {}
"""Families by name; importing `lgmd_gym.envs.families` fills it."""
_NAME = re.compile(r"[\w.-]+")  # allowed in ids of Gymnasium and in names of cases


class Level(NamedTuple):
    """How often random levels contain a family, and with which arguments."""

    name: str  # name by which levels are selected: that of the family or of a variant, such as "FastCCRs"
    weight: float  # relative frequency among the threats or the non-threats
    draw: Callable[[np.random.Generator], Arguments]  # function that draws the arguments of the family
    family: str = ""  # name of the family
    threat: bool | None = None  # whether the ego has contact without braking; None for that of the family
    twin: bool = False  # whether levels without the target are declared, too, see `family`
    has_target: bool = True  # whether the scenario has its target, or is without it, see `without_target`


LEVELS: dict[str, Level] = {}
"""Random levels by name; `distribution` orders them."""


def family(name: str, *levels: Level, threat: bool = False, twin: bool = False) -> Callable[[_F], _F]:
    """Register a scenario function or class under a family name; its environment id is `LGMD/<name>-v0`.

    Arguments that are annotated with a declaration of `lgmd_gym.fields`, as in
    `Annotated[float, number(...)]`, are checked before the function is called, and are added to its
    docstring. The same function of the same module may be defined again, as in a notebook.

    Args:
        name: Name of the family.
        levels: The family in random levels, and its variants.
        threat: Whether the ego has contact without braking in these levels, unless one states it itself.
        twin: Whether the first level has a twin. A level with a twin is also drawn without its target, as
            `<name>WithoutTarget` with half the weight, so that a policy cannot infer the threat from the road
            alone.

    Raises:
        ValueError: If the name is taken, or contains other characters than letters, digits, ".", "_", "-".
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise ValueError(f"family must consist of letters, digits and . _ -, got {shown(name)}")

    def register(function: _F) -> _F:
        if not callable(function):  # pyright: ignore[reportUnnecessaryComparison]
            raise ValueError(f"family {name!r} must be a function or class, got {shown(function)}")
        if name in FAMILIES and _origin(FAMILIES[name]) != _origin(function):
            raise ValueError(f"scenario family {name!r} is defined twice; choose another name")
        FAMILIES[name] = made = _checked(function)
        for number, level in enumerate(levels):
            declared = level._replace(family=name, threat=threat if level.threat is None else level.threat)
            LEVELS[level.name] = declared
            if level.twin or (twin and number == 0):
                without = f"{level.name}WithoutTarget"
                LEVELS[without] = declared._replace(
                    name=without, weight=level.weight / 2.0, threat=False, has_target=False
                )
        return made

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


def _checked(function: Family) -> Any:
    """Return a function that checks its declared arguments, with their documentation in its docstring."""
    if isinstance(function, type):
        return function
    signature = inspect.signature(function)
    declared = {
        name: item
        for name, parameter in signature.parameters.items()
        if (item := declaration_of(parameter.annotation)) is not None
    }
    if not declared:
        return function

    @wraps(function)
    def call(*args: object, **kwargs: object) -> object:
        given = signature.bind(*args, **kwargs).arguments if args else kwargs
        for name, item in declared.items():
            if name in given:
                given[name] = item.check(name, given[name])
        return function(**given)

    plain = [
        parameter.replace(annotation=parameter.annotation.__origin__) if name in declared else parameter
        for name, parameter in signature.parameters.items()
    ]
    changed: Any = call
    changed.__signature__ = signature.replace(parameters=plain)
    arguments = [line for name, item in declared.items() for line in _documentation(name, item)]
    text = inspect.cleandoc(function.__doc__ or "")
    changed.__doc__ = "\n".join([text, "", "Args:", *arguments, ""])
    return changed


def _documentation(name: str, item: Declaration) -> list[str]:
    """Return the lines of an argument in a docstring: meaning up to ";", range and unit, the rest."""
    meaning, semicolon, rest = item.doc.partition(";")
    limits = f", in {item.bounds.removesuffix(', or None')}" if item.interval or item.unit else ""
    unit = f" [{item.unit}]" if item.unit else ""
    text = f"{name}: {meaning}{limits}{unit}{semicolon}{rest}."
    return wrap(text, 104, initial_indent="    ", subsequent_indent="        ")


def _origin(function: Family) -> tuple[object, object]:
    return getattr(function, "__module__", None), getattr(function, "__qualname__", function)
