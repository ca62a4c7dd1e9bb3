"""Names of cells, from the parameters that vary in a file."""

import re
from collections.abc import Sequence

_SHORT = (
    (re.compile(r"Ego_(final_?|init_?)?speed(_kph)?", re.I), "v"),
    (re.compile(r"\w+_(final_?|init_?)?speed(_kph)?", re.I), "target"),
    (re.compile(r"ImpactLocation", re.I), "impact"),
    (re.compile(r"\w*overlap", re.I), "overlap"),
    (re.compile(r"\w*headway", re.I), "headway"),
    (re.compile(r"\w*deceleration", re.I), "decel"),
    (re.compile(r"ImpactSide", re.I), "side"),
)
_FIRST = ("v", "target", "overlap", "impact", "headway", "decel")
_UNNAMED = re.compile(r"[^\w.+-]+")


def file_name(text: str) -> str:
    """Return a text with the characters of names of suites and cases only."""
    return _UNNAMED.sub("-", text).strip("-") or "cell"


def short_name(parameter: str) -> str:
    """Return the short name of a parameter, such as "v" for the ego's speed."""
    for pattern, short in _SHORT:
        if pattern.fullmatch(parameter):
            return short
    return file_name(parameter.split("_")[-1]).lower()


def variants(cells: Sequence[dict[str, str]], speeds: Sequence[float]) -> list[str]:
    """Return a name for each cell; all names are different.

    A name contains the ego's speed in km/h and the values of the parameters that, together with it,
    distinguish the cells; parameters that vary along with them are left out.

    Args:
        cells: Values of the varied parameters of each cell; the keys of all cells are the same.
        speeds: Initial ego speed of each cell [m/s].
    """
    parts: list[list[str]] = [[f"v{_number(speed * 3.6)}"] for speed in speeds]
    names = list(cells[0]) if cells else []
    names.sort(key=lambda name: _rank(name, cells[0][name]))
    for name in names:
        if short_name(name) == "v" or len({cell[name] for cell in cells}) == 1:
            continue
        longer = [[*part, _text(name, cell[name])] for part, cell in zip(parts, cells, strict=True)]
        if len({*map(tuple, longer)}) > len({*map(tuple, parts)}):
            parts = longer
    found = ["/".join(part) for part in parts]
    seen: dict[str, int] = {}
    for index, name in enumerate(found):
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            found[index] = f"{name}/{seen[name]}"
    return found


def _rank(name: str, value: str) -> int:
    """Return the place of a parameter in names: known ones first, paths of files last."""
    short = short_name(name)
    return _FIRST.index(short) if short in _FIRST else len(_FIRST) + ("/" in value)


def _text(name: str, value: str) -> str:
    try:
        return f"{short_name(name)}{_number(float(value))}"
    except ValueError:
        return file_name(value.rsplit("/", 1)[-1].rsplit("_", 1)[-1]).lower()


def _number(value: float) -> str:
    return f"{round(value, 6):g}"
