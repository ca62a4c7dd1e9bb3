"""A user's own suite: a TOML file, strictly read.

name = "mine"
about = "dark cars, by day"

[[cases]]
family = "CCRs"
speeds_kmh = [10, 20, 30]           # cases mine/CCRs/v10/dark …; arguments are SI
name = "dark"
arguments = { shade = 40 }

[[cases]]
family = "CCRm"
name = "warned"                     # mine/CCRm/warned
fcw_driver = true
arguments = { ego_speed = 13.89, target_speed = 5.56 }
"""

import re
import tomllib
from pathlib import Path
from typing import Any

import tomli_w

from lgmd_gym.benchmark.case import Case, metres
from lgmd_gym.benchmark.suites import SUITES, Suite, find_suite
from lgmd_gym.errors import check_keys

SUITE_KEYS = ("name", "about", "cases")
CASE_KEYS = ("family", "name", "speeds_kmh", "fcw_driver", "arguments")
NAME = re.compile(r"[\w.+-]+(/[\w.+-]+)*")  # file names and case names are made of it


def get_suite(text: str) -> Suite:
    """Return the suite of a name, or of a path that ends in ".toml".

    Raises:
        ValueError: For an unknown name (the nearest is named) or a file that is no suite.
    """
    return load_suite(Path(text)) if text.endswith(".toml") else find_suite(text)


def load_suite(path: Path) -> Suite:
    """Read a suite; every case is built once, so that a bad value is found before anything is played.

    Raises:
        ValueError: For a file that cannot be read, an unknown key, family or argument (the nearest is
            named), a value out of its range, or a case that comes twice.
    """
    values = read_toml(path, "suite file")
    try:
        check_keys("key of a suite", values, SUITE_KEYS)
        name = _text(values, "name")
        if name in SUITES or name == "traffic":
            raise ValueError(f"name {name!r} is a shipped suite's; choose another")
        given = values.get("cases")
        if not isinstance(given, list) or not given:
            raise ValueError("cases needs at least one [[cases]] table")
        cases = tuple(case for table in given for case in _cases(name, table))
        seen: set[str] = set()
        for case in cases:
            if case.name in seen:
                raise ValueError(f"case {case.name!r} comes twice; give one another name")
            seen.add(case.name)
            _ = case.scenario
    except (TypeError, ValueError) as error:
        raise ValueError(f"suite file {str(path)!r}: {error}") from None
    return Suite(name, cases, str(values.get("about", "a user's own")))


def save_suite(suite: Suite, path: Path) -> None:
    """Write a suite so that `load_suite` reads the same cases back."""
    tables = []
    for case in suite.cases:
        what = case.name.split("/", 2)[2]
        table: dict[str, Any] = {"family": case.family, "name": what, "arguments": dict(case.arguments)}
        tables.append(table | ({"fcw_driver": True} if case.fcw_driver else {}))
    text = tomli_w.dumps({"name": suite.name, "about": suite.about, "cases": tables})
    path.write_text(text, encoding="utf-8")


def read_toml(path: Path, kind: str) -> dict[str, Any]:
    """Return a TOML file's values.

    Raises:
        ValueError: If it cannot be read or is no TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{kind} {str(path)!r} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{kind} {str(path)!r} is not TOML: {error}") from None


def _cases(suite: str, table: Any) -> list[Case]:
    """Return the cases of one [[cases]] table: one, or one per speed."""
    if not isinstance(table, dict):
        raise ValueError(f"cases must be [[cases]] tables, got {table!r}")
    check_keys("key of a case", table, CASE_KEYS)
    family, arguments = _text(table, "family"), table.get("arguments", {})
    warned = table.get("fcw_driver", False)
    if not isinstance(arguments, dict):
        raise ValueError(f"arguments must be a table, got {arguments!r}")
    if not isinstance(warned, bool):
        raise ValueError(f"fcw_driver must be true or false, got {warned!r}")
    speeds = table.get("speeds_kmh")
    if speeds is None:
        return [Case(f"{suite}/{family}/{_text(table, 'name')}", family, tuple(arguments.items()), warned)]
    if not isinstance(speeds, list) or not speeds or not all(_is_speed(speed) for speed in speeds):
        raise ValueError(f"speeds_kmh must be a list of numbers > 0, got {speeds!r}")
    if "ego_speed" in arguments:
        raise ValueError("give either speeds_kmh or arguments.ego_speed")
    tail = f"/{_text(table, 'name')}" if "name" in table else ""
    return [
        Case(
            f"{suite}/{family}/v{speed:g}{tail}",
            family,
            tuple((arguments | {"ego_speed": metres(speed)}).items()),
            warned,
        )
        for speed in speeds
    ]


def _is_speed(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0


def _text(table: dict[str, Any], key: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not NAME.fullmatch(value):
        raise ValueError(f"{key} must be letters, digits, '.', '_', '+', '-', '/', got {value!r}")
    return value
