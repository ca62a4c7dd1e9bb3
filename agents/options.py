"""Agents from strings, and the checks of their options."""

import inspect
from math import isfinite
from typing import Any

from lgmd_gym.errors import check_keys


def positive(name: str, value: Any) -> float:
    """Return `value` as a finite float > 0, or raise ValueError."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value) or value <= 0.0:
        raise ValueError(f"{name} must be a number > 0, got {value!r}")
    return float(value)


def whole(name: str, value: Any, low: int) -> int:
    """Return `value` as an int >= low, or raise ValueError."""
    if isinstance(value, bool) or not isinstance(value, int | float) or value != int(value) or value < low:
        raise ValueError(f"{name} must be a whole number >= {low}, got {value!r}")
    return int(value)


def parse(text: str) -> tuple[str, dict[str, Any]]:
    """Split "name:key=value,key=value" into the name and its options.

    Example:
        >>> parse("spike-threshold:threshold=45,frames=2")
        ('spike-threshold', {'threshold': 45, 'frames': 2})
    """
    name, _, rest = text.partition(":")
    options: dict[str, Any] = {}
    for part in filter(None, rest.split(",")):
        key, equals, value = part.partition("=")
        if not equals:
            raise ValueError(f"agent option {part!r} in {text!r} needs a value; write {key}=VALUE")
        options[key.strip()] = _number(value.strip())
    return name.strip(), options


def check_options(name: str, cls: type, options: dict[str, Any]) -> None:
    """Refuse an option that the agent's constructor does not take, naming the nearest."""
    check_keys(f"option of agent {name}", options, inspect.signature(cls).parameters)


def _number(text: str) -> int | float | str:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
