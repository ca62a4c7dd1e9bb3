"""Error messages that state the offending value and suggest a fix."""

from collections.abc import Iterable
from difflib import get_close_matches

MAX_LISTED = 40  # names that a message lists in full


def unknown_name(kind: str, name: object, known: Iterable[str]) -> ValueError:
    """Return a ValueError for an unknown name; its message suggests the closest known name.

    Args:
        kind: Kind of the named thing, for example "agent" or "camera preset".
        name: The unknown name.
        known: Valid names.

    Example:
        >>> unknown_name("agent", "spike-treshold", ["no-brake", "spike-threshold"])
        ValueError("unknown agent 'spike-treshold'; did you mean 'spike-threshold'?")
    """
    names = sorted(known)
    if closest := get_close_matches(str(name), names, n=1, cutoff=0.5):
        fix = f"did you mean {closest[0]!r}?"
    elif len(names) > MAX_LISTED:
        closest = get_close_matches(str(name), names, n=5, cutoff=0.0)
        fix = f"closest of {len(names)} names: {', '.join(closest)}"
    else:
        fix = f"known: {', '.join(names) or 'none'}"
    return ValueError(f"unknown {kind} {name!r}; {fix}")


def check_keys(kind: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Raise `unknown_name` for the first of the given keys that is not known.

    Raises:
        ValueError: For an unknown key.
    """
    names = set(known)
    for key in given:
        if key not in names:
            raise unknown_name(kind, key, names)
