"""Tables of suite files as cases: one case, one per speed, or one per combination of a sweep."""

import re
from collections.abc import Collection
from inspect import signature
from typing import Any

from lgmd_gym.benchmark.case import Case, scenario_case, to_mps
from lgmd_gym.benchmark.sweep import SPEED, Axis, combine, make_axis, read_values
from lgmd_gym.envs.families import FAMILIES
from lgmd_gym.envs.families.data import scenario_from_data
from lgmd_gym.envs.registration import APPEARANCE
from lgmd_gym.errors import check_flag, check_keys, check_type, is_number

CASE_KEYS = ("family", "name", "speeds_kmh", "sweep", "fcw_driver", "arguments", "scenario")
_NAME = re.compile(r"[\w.+-]+(/[\w.+-]+)*")  # names become parts of file names


def read_cases(suite: str, table: Any) -> list[Case]:
    """Return the cases of one table of a suite file.

    Raises:
        ValueError: If a key is unknown, a value is invalid, or a sweep is empty.
    """
    if not isinstance(table, dict):
        raise ValueError(f"cases must be [[cases]] tables, got {table!r}")
    check_table("a case", table, CASE_KEYS)
    family = read_name(table, "family")
    arguments = check_type("arguments", table.get("arguments", {}), dict)
    fcw_driver = check_flag("fcw_driver", table.get("fcw_driver", False))
    if "scenario" in table:
        return [_scenario_case(suite, family, table, fcw_driver)]
    axes = _axes(family, table, arguments)
    name = read_name(table, "name") if "name" in table or not axes else ""
    cases = []
    for variant, swept in combine(axes):
        parts = [suite, family, *filter(None, (variant, name))]
        cases.append(Case("/".join(parts), family, tuple((arguments | swept).items()), fcw_driver))
    return cases


def check_table(kind: str, table: dict[str, Any], known: Collection[str]) -> None:
    """Raise ValueError for an unknown key; for an argument of the family, the message states its place."""
    family = str(table.get("family"))
    arguments = signature(FAMILIES[family]).parameters if family in FAMILIES else ()
    for key in table:
        if key not in known and key in arguments:
            place = f"arguments = {{ {key} = ... }}"
            place += f", or sweep = {{ {key} = [...] }}" if "sweep" in known else ""
            raise ValueError(f"{key} is an argument of {family}, not a key of {kind}; write {place}")
    check_keys(f"key of {kind}", table, known)


def read_name(table: dict[str, Any], key: str) -> str:
    """Return a name in a table, whose characters are allowed in names of suites and cases."""
    value = table.get(key)
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        raise ValueError(f"{key} must consist of letters, digits and . _ + - /, got {value!r}")
    return value


def _axes(family: str, table: dict[str, Any], arguments: dict[str, Any]) -> list[Axis]:
    """Return the swept arguments, the speed first."""
    axes = [_speeds(table["speeds_kmh"])] if "speeds_kmh" in table else []
    if axes and SPEED in arguments:
        raise ValueError("speeds_kmh and arguments.ego_speed exclude each other; remove one of them")
    sweep = check_type("sweep", table.get("sweep", {}), dict)
    if "sweep" in table and not sweep:
        raise ValueError("sweep is empty; write for example sweep = { gap = [6, 8, 10] }, or remove it")
    if axes and SPEED in sweep:
        raise ValueError("speeds_kmh and sweep.ego_speed exclude each other; remove one of them")
    for name in sweep:
        if name in arguments:
            raise ValueError(f"arguments.{name} and sweep.{name} exclude each other; remove one of them")
    names = sorted(sweep, key=lambda name: name != SPEED)
    return axes + [make_axis(family, name, sweep[name]) for name in names]


def _speeds(given: Any) -> Axis:
    """Return the axis of `speeds_kmh`."""
    values = given if isinstance(given, list) else read_values("speeds_kmh", given)
    if not values or not all(is_number(speed) and speed > 0 for speed in values):
        raise ValueError(f"speeds_kmh must be a list of numbers > 0, got {given!r}")
    return Axis(SPEED, [to_mps(speed) for speed in values], [f"v{speed:g}" for speed in values])


def _scenario_case(suite: str, family: str, table: dict[str, Any], fcw_driver: bool) -> Case:
    """Return the case of a table with a scenario, whose family is that of the table."""
    arguments, data = table.get("arguments", {}), table["scenario"]
    check_keys("argument of a case with a scenario", arguments, APPEARANCE)
    for key in ("speeds_kmh", "sweep"):
        if key in table:
            raise ValueError(f"{key} and scenario exclude each other; write one table per scenario")
    data = {"family": family} | data if isinstance(data, dict) else data
    scenario = scenario_from_data(data)
    if scenario.family != family:
        raise ValueError(
            f"family {family!r} and scenario.family {scenario.family!r} differ; remove the second"
        )
    return scenario_case(suite, read_name(table, "name"), scenario, fcw_driver, **arguments)
