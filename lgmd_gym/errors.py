"""Checks of arguments, and error messages of one line that state the offending value and suggest a fix."""

from collections.abc import Collection, Iterable
from difflib import SequenceMatcher, get_close_matches
from math import inf, isinf, isnan
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeGuard, TypeVar, cast, overload

import numpy as np

from lgmd_gym.aliases import Values

_T = TypeVar("_T")
MAX_LISTED = 20  # names that a message lists in full
MAX_CLOSEST = 3  # names that it suggests from a longer list
SIMILARITY_MARGIN = 0.1  # of names that are suggested beside the closest one
MAX_SHOWN = 160  # characters of a value in a message


class InputNote(UserWarning):
    """Part of a valid file that has no effect, such as an event that never starts; commands print it."""


def shown(value: object) -> str:
    """Return a value for a message: its `repr` in one line, shortened to `MAX_SHOWN` characters."""
    try:
        text = " ".join(repr(value).split("\n"))
    except ValueError:  # of an integer with more than 4300 digits
        return f"a very long {type(value).__name__}"
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 20]}… ({len(text)} characters)"


def counted(number: int, noun: str) -> str:
    """Return a number with a noun that has a regular plural.

    Example:
        >>> counted(1, "seed"), counted(20, "world")
        ('1 seed', '20 worlds')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def check_number(name: str, value: object) -> float:
    """Return `value` as float, which may be infinite.

    Raises:
        ValueError: If it is a bool, not a real number, NaN, or an integer beyond the range of float.
    """
    if type(value) is not float:
        if isinstance(value, bool) or not isinstance(value, Real):
            raise ValueError(f"{name} must be a number, got {shown(value)}")
        try:
            value = float(value)
        except OverflowError:
            raise ValueError(f"{name} must be below 1e308, got a longer integer") from None
    if isnan(value):
        raise ValueError(f"{name} must be finite, got nan")
    return value


def check_finite(name: str, value: object) -> float:
    """Return `value` as float, or raise ValueError if it is not a finite number."""
    number = check_number(name, value)
    if isinf(number):
        raise ValueError(f"{name} must be finite, got {shown(value)}")
    return number


def check_within(name: str, value: object, low: float, high: float, unit: str = "") -> float:
    """Return `value` as float if it is in [low, high], or raise ValueError."""
    number = check_finite(name, value)
    if not low <= number <= high:
        text = f"[{low:g}, {high:g}]{f' {unit}' if unit else ''}"
        raise ValueError(f"{name} must be in {text}, got {shown(value)}")
    return number


def check_positive(name: str, value: object) -> float:
    """Return `value` as float if it is a finite number > 0, or raise ValueError."""
    number = check_finite(name, value) if is_number(value) else 0.0
    if not number > 0.0:
        raise ValueError(f"{name} must be a number > 0, got {shown(value)}")
    return number


def check_whole(name: str, value: object, low: int, high: float = inf) -> int:
    """Return `value` as int if it is a whole number in [low, high], or raise ValueError."""
    if not is_number(value) or check_finite(name, value) != int(value) or not low <= value <= high:
        interval = f">= {low}" if high == inf else f"in [{low}, {high}]"
        raise ValueError(f"{name} must be a whole number {interval}, got {shown(value)}")
    return int(value)


def check_flag(name: str, value: object) -> bool:
    """Return `value` as bool if it is one, or raise ValueError."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} must be true or false, got {shown(value)}")
    return bool(cast(object, value))


def check_flags(**flags: object) -> None:
    """Raise ValueError for the first argument that is not a bool."""
    for name, value in flags.items():
        check_flag(name, value)


def check_text(name: str, value: object) -> str:
    """Return `value` if it is a string, or raise ValueError."""
    if not isinstance(value, str):
        raise ValueError(f"{name} must be a string, got {shown(value)}")
    return value


@overload
def check_type(name: str, value: object, types: type[dict[Any, Any]], /) -> Values: ...
@overload
def check_type(name: str, value: object, *types: type[_T]) -> _T: ...
def check_type(name: str, value: object, *types: type) -> Any:
    """Return `value` if it is an instance of one of the types, or raise ValueError.

    Not a TypeError, which `gym.make` repeats in several lines with all arguments.
    """
    if not isinstance(value, types):
        expected = " or ".join(item.__name__ for item in types)
        raise ValueError(f"{name} must be {expected}, got {shown(value)}")
    return value


def check_mapping(name: str, value: object) -> Values:
    """Return a copy of a dict, {} for None, or raise ValueError."""
    return {} if value is None else dict(check_type(name, value, dict))


def check_path(name: str, value: object) -> Path:
    """Return a path, or raise ValueError if the value is no path, or one that no file can have."""
    path = Path(check_type(name, value, str, Path))
    try:
        path.exists()
    except (OSError, ValueError) as error:  # too long, or with a null character
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"{name} {shown(str(path))} is not a path: {reason}") from None
    return path


def check_items(name: str, values: object, types: type, kind: str = "") -> tuple[Any, ...]:
    """Return a sequence as a tuple if it is a list or tuple of instances of a type, or raise ValueError."""
    items = as_tuple(values)
    if items is None or not all(isinstance(item, types) for item in items):
        raise ValueError(f"{name} must be a list of {kind or types.__name__}, got {shown(values)}")
    return items


def check_size(
    name: str, value: object, low: int, high: int, axes: str = "(height, width)"
) -> tuple[int, int]:
    """Return two integers in [low, high], or raise ValueError; also of an array of them."""
    message = f"{name} must be {axes}, each {low} to {high} px, got {shown(value)}"
    items = as_tuple(value.tolist() if isinstance(value, np.ndarray) else value)
    if items is None or len(items) != 2 or not all(map(is_integer, items)):
        raise ValueError(message)
    first, second = items
    if not (low <= first <= high and low <= second <= high):
        raise ValueError(message)
    return int(first), int(second)


def as_tuple(value: object) -> tuple[Any, ...] | None:
    """Return a list or tuple as a tuple, None for other values."""
    return tuple(cast(Iterable[Any], value)) if isinstance(value, list | tuple) else None


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number; bools are not."""
    return not isinstance(value, bool) and isinstance(value, Real)


def is_integer(value: object) -> TypeGuard[int]:
    """Return whether a value is an integer; bools are not."""
    return not isinstance(value, bool) and isinstance(value, Integral)


def check_known(kind: str, name: object, known: Collection[str], hint: str = "") -> str:
    """Return `name` if it is one of the known strings, or raise `unknown_name`."""
    if not isinstance(name, str) or name not in known:
        raise unknown_name(kind, name, known, hint)
    return name


def unknown_name(kind: str, name: object, known: Iterable[str], hint: str = "") -> ValueError:
    """Return a ValueError for an unknown name; its message suggests the closest known name.

    Args:
        kind: Kind of the named thing, for example "agent" or "camera preset".
        name: The unknown name.
        known: Valid names; of more than `MAX_LISTED`, the closest `MAX_CLOSEST` are suggested.
        hint: How to list all of them, for example "lgmd-gym list cases prints all names".

    Example:
        >>> unknown_name("agent", "spike-treshold", ["no-brake", "spike-threshold"])
        ValueError("unknown agent 'spike-treshold'; did you mean 'spike-threshold'?")
    """
    names, text = sorted(known), name[:MAX_SHOWN] if isinstance(name, str) else shown(name)
    count = MAX_CLOSEST if len(names) > MAX_LISTED else 1
    if closest := get_close_matches(text, names, n=count, cutoff=0.5):
        *others, last = map(repr, _as_close_as_the_first(text, closest))
        fix = f"did you mean {', '.join(others)}{' or ' if others else ''}{last}?"
    elif len(names) > MAX_LISTED:
        closest = get_close_matches(text, names, n=count, cutoff=0.0)
        fix = f"closest of {len(names)} names: {', '.join(closest)}"
    else:
        fix = f"known: {', '.join(names) or 'none'}"
    separator = " " if fix.endswith("?") else "; "
    return ValueError(f"unknown {kind} {shown(name)}; {fix}{separator if hint else ''}{hint}")


def _as_close_as_the_first(text: str, names: list[str]) -> list[str]:
    """Return those of some names, the closest first, that are almost as similar to a text as the first."""
    ratios = [SequenceMatcher(None, name, text).ratio() for name in names]
    return [name for name, ratio in zip(names, ratios, strict=True) if ratio >= ratios[0] - SIMILARITY_MARGIN]


def check_keys(kind: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Raise `unknown_name` for the first of the given keys that is not known.

    Raises:
        ValueError: For an unknown key.
    """
    names = set(known)
    for key in given:
        check_known(kind, key, names)
