"""Parsing of agent strings and validation of agent options."""

import inspect
import sys
from typing import Any

from lgmd_gym.errors import check_keys

MAX_FLOAT = sys.float_info.max  # YAML and JSON have longer integers


def positive(name: str, value: Any) -> float:
    """Return `value` as a finite float > 0, or raise ValueError."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value <= MAX_FLOAT:
        raise ValueError(f"{name} must be a number > 0, got {value!r}")
    return float(value)


def whole(name: str, value: Any, low: int) -> int:
    """Return `value` as an int >= `low`, or raise ValueError."""
    number = not isinstance(value, bool) and isinstance(value, int | float) and low <= value <= MAX_FLOAT
    if not number or value != int(value):
        raise ValueError(f"{name} must be a whole number >= {low}, got {value!r}")
    return int(value)


def parse_agent(text: str) -> tuple[str, dict[str, Any]]:
    """Split "name:option=value,option=value" into the name and the options.

    Example:
        >>> parse_agent("spike-threshold:threshold=45,frames=2")
        ('spike-threshold', {'threshold': 45, 'frames': 2})
    """
    name, _, rest = text.partition(":")
    options: dict[str, Any] = {}
    for part in filter(None, rest.split(",")):
        key, equals, value = part.partition("=")
        if not equals:
            raise ValueError(f"agent option {part!r} in {text!r} has no value; write {key}=VALUE")
        options[key.strip()] = _parse_value(value.strip())
    return name.strip(), options


def check_options(name: str, cls: type, options: dict[str, Any]) -> None:
    """Raise ValueError for an option that the constructor of an agent does not accept."""
    check_keys(f"option of agent {name}", options, inspect.signature(cls).parameters)


def _parse_value(text: str) -> int | float | str:
    """Return an int or float if `text` is a number, else `text`."""
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text
