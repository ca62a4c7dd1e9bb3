"""Parsing of agent strings and validation of agent options."""

import inspect
from typing import Any

from lgmd_gym.errors import check_keys, shown


def parse_agent(text: str) -> tuple[str, dict[str, Any]]:
    """Split "name:option=value,option=value" into the name and the options.

    Example:
        >>> parse_agent("spike-threshold:threshold=45,frames=2")
        ('spike-threshold', {'threshold': 45, 'frames': 2})
    """
    name, _, rest = text.partition(":")
    return name.strip(), parse_options(rest, text)


def parse_options(options_text: str, text: str) -> dict[str, Any]:
    """Split "option=value,option=value" into the options.

    Args:
        options_text: The options.
        text: Agent string that contains them, for error messages.

    Raises:
        ValueError: For an option without a value, or one that occurs twice.
    """
    options: dict[str, Any] = {}
    for part in filter(None, options_text.split(",")):
        key, equals, value = part.partition("=")
        if not equals:
            raise ValueError(
                f"agent option {shown(part)} in {shown(text)} has no value; write {shown(key)[1:-1]}=VALUE"
            )
        if key.strip() in options:
            raise ValueError(f"agent option {shown(key.strip())} occurs twice in {shown(text)}; use it once")
        options[key.strip()] = _parse_value(value.strip())
    return options


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
