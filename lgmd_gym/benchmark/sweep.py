"""Sweeps of suite files: lists and ranges of arguments, their products, and the names of the cases."""

import inspect
import math
import re
from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

from docstring_parser import DocstringStyle, parse

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.family import FAMILIES
from lgmd_gym.errors import check_finite, check_keys, is_number, shown
from lgmd_gym.openscenario.names import file_name

MAX_CASES = 10_000  # of one table
RANGE_KEYS = ("start", "stop", "step")
SPEED = "ego_speed"  # its part of a name is "v" and the speed in km/h
_UNIT = re.compile(r"\[(m/s²|m/s|m|s|rad)\]")
_SUFFIXES = {"m/s²": "mps2", "m/s": "kmh", "m": "m", "s": "s", "rad": "rad"}


class Axis(NamedTuple):
    """One swept argument.

    Attributes:
        name: Name of the argument.
        values: Its values, in SI units; all are different.
        parts: The part of the case's name for each value; all are different.
    """

    name: str
    values: Sequence[Any]
    parts: Sequence[str]


def read_values(name: str, given: Any) -> list[Any]:
    """Return the values of a list, or of a range { start, stop, step }, which includes `stop`.

    Raises:
        ValueError: If there are none, one occurs twice, or they are not numbers, strings and flags.
    """
    if isinstance(given, dict):
        return _range(name, given)
    if not isinstance(given, list):
        raise ValueError(f"{name} must be a list, or a table with start, stop and step, got {shown(given)}")
    if not given:
        raise ValueError(f"{name} is empty; write at least one value, or remove it")
    for index, value in enumerate(given):
        if not isinstance(value, bool | int | float | str):
            raise ValueError(f"{name} must contain numbers, strings or true and false, got {shown(value)}")
        if value in given[:index]:
            raise ValueError(f"{name} contains {shown(value)} twice; remove one")
    return given


def _range(name: str, given: dict[str, Any]) -> list[Any]:
    check_keys(f"key of {name}", given, RANGE_KEYS)
    for key in RANGE_KEYS:
        if key not in given:
            raise ValueError(f"{name} must have the key {key!r}; a range is {{ start, stop, step }}")
        check_finite(f"{name}.{key}", given[key])
    start, stop, step = (given[key] for key in RANGE_KEYS)
    if step == 0:
        raise ValueError(f"{name}.step must not be 0")
    intervals = (stop - start) / step
    if intervals < 0.0:
        raise ValueError(
            f"{name} is empty: steps of {step:g} lead from {start:g} away from {stop:g}; change the sign"
        )
    if intervals >= MAX_CASES:
        raise ValueError(f"{name} has more than {MAX_CASES} values; use a larger step")
    values = [start + index * step for index in range(math.floor(intervals + 1e-9) + 1)]
    return [round(value, 9) if isinstance(value, float) else value for value in values]


def make_axis(family: str, name: str, given: Any) -> Axis:
    """Return the axis of an argument of a family; its parts have the unit that the docstring states.

    Raises:
        ValueError: See `read_values`.
    """
    values = read_values(f"sweep.{name}", given)
    if name == SPEED and all(map(is_number, values)):
        return Axis(name, values, [f"v{text}" for text in _numbers(values, 1.0 / KMH)])
    label, unit = file_name(name.replace("_", "-")), _unit(family, name)
    if not all(map(is_number, values)):
        return Axis(name, values, [_word(label, value) for value in values])
    factor = 1.0 / KMH if unit == "m/s" else 1.0
    return Axis(
        name, values, [f"{label}{text}{_SUFFIXES.get(unit, '')}" for text in _numbers(values, factor)]
    )


def combine(axes: Sequence[Axis]) -> list[tuple[str, dict[str, Any]]]:
    """Return the variant and the arguments of each combination; the last axis changes first.

    Raises:
        ValueError: If there are more than `MAX_CASES`.
    """
    count = math.prod(len(axis.values) for axis in axes)
    if count > MAX_CASES:
        sizes = " × ".join(f"{len(axis.values)} {axis.name}" for axis in axes)
        raise ValueError(f"a sweep must have at most {MAX_CASES} cases, got {sizes} = {count}")
    cells = product(*(zip(axis.parts, axis.values, strict=True) for axis in axes))
    names = [axis.name for axis in axes]
    return [
        ("/".join(part for part, _ in cell), dict(zip(names, (value for _, value in cell), strict=True)))
        for cell in cells
    ]


def _word(label: str, value: Any) -> str:
    """Return the part of a flag or string: "left" or "not-left", or "side-left"."""
    if isinstance(value, bool):
        return label if value else f"not-{label}"
    return f"{label}-{file_name(str(value))}"


def _numbers(values: Sequence[float], factor: float) -> list[str]:
    """Return numbers times a factor as texts, with as many digits as distinguish them, at least 3."""
    texts: list[str] = []
    for digits in range(3, 18):
        texts = [f"{value * factor:.{digits}g}" for value in values]
        if len({*texts}) == len(values) and not any("e+" in text for text in texts):
            break
    return texts


def _unit(family: str, name: str) -> str:
    """Return the unit of an argument in the docstring of its family; empty without one."""
    parsed = parse(inspect.getdoc(FAMILIES.get(family)) or "", DocstringStyle.GOOGLE)
    texts = [param.description or "" for param in parsed.params if param.arg_name == name]
    found = _UNIT.search(" ".join(texts))
    return found[1] if found else ""
