"""Errors that name the value and the mend: the nearest known name for an unknown one."""

from collections.abc import Iterable
from difflib import get_close_matches


def unknown_name(kind: str, name: object, known: Iterable[str]) -> ValueError:
    """Return the ValueError for a name that is not among the known ones.

    Args:
        kind: What is named, for the message ("agent", "camera preset", ...).
        name: What was given.
        known: The names that would have been accepted.

    Example:
        >>> unknown_name("agent", "spike-treshold", ["no-brake", "spike-threshold"])
        ValueError("unknown agent 'spike-treshold'; did you mean 'spike-threshold'?")
    """
    names = sorted(known)
    nearest = get_close_matches(str(name), names, n=1, cutoff=0.5)
    mend = f"did you mean {nearest[0]!r}?" if nearest else f"known: {', '.join(names) or 'none'}"
    return ValueError(f"unknown {kind} {name!r}; {mend}")


def check_keys(kind: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Refuse the first key in `given` that is not in `known`, naming the nearest.

    Raises:
        ValueError: For an unknown key.
    """
    names = set(known)
    for key in given:
        if key not in names:
            raise unknown_name(kind, key, names)
