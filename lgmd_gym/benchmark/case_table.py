"""Tables of suite files as cases: one case, one per speed, or one per combination of a sweep."""

import inspect
import math
import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from inspect import signature
from itertools import product
from pathlib import Path
from typing import NamedTuple, TypeAlias, cast

from docstring_parser import DocstringStyle, parse

from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.benchmark.case import Case, file_name, scenario_case, to_mps
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families import FAMILIES
from lgmd_gym.envs.families.data import scenario_from_data
from lgmd_gym.envs.registration import APPEARANCE
from lgmd_gym.errors import check_finite, check_flag, check_keys, check_text, check_type, is_number, shown
from lgmd_gym.processes.inputs import read_json, read_toml

Argument: TypeAlias = bool | int | float | str
"""A value of a swept argument."""
MAX_CASES = 10_000  # of one table
RANGE_KEYS = ("start", "stop", "step")
SPEED = "ego_speed"  # its part of a name is "v" and the speed in km/h
_UNIT = re.compile(r"\[(m/s²|m/s|m|s|rad)\]")
_SUFFIXES = {"m/s²": "mps2", "m/s": "kmh", "m": "m", "s": "s", "rad": "rad"}


def read_data(path: Path, kind: str) -> Values:
    """Return the values of a TOML file, or of a JSON file if its name ends in ".json".

    Raises:
        ValueError: If it cannot be read, is not TOML or JSON, or states a key twice.
    """
    is_json = path.suffix == ".json"
    try:
        values: object = read_json(path, _unique) if is_json else read_toml(path)
    except OSError as error:
        raise ValueError(f"{kind} {str(path)!r} cannot be read: {error.strerror}") from None
    except ValueError as error:  # also of the decoders of TOML, JSON and UTF-8
        raise ValueError(f"{kind} {str(path)!r} is not {'JSON' if is_json else 'TOML'}: {error}") from None
    if not isinstance(values, dict):
        raise ValueError(f"{kind} {str(path)!r} must contain an object {{...}}, got {type(values).__name__}")
    return cast(Values, values)


def _unique(pairs: list[tuple[str, object]]) -> Values:
    """Return an object; the JSON module silently keeps the last of several values of a key."""
    values: Values = {}
    for key, value in pairs:
        if key in values:
            raise ValueError(f"key {key!r} is stated twice")
        values[key] = value
    return values


class SweptArgument(NamedTuple):
    """One swept argument."""

    name: str  # name of the argument
    values: Sequence[Argument]  # its values, in SI units; all are different
    parts: Sequence[str]  # the part of the case's name for each value; all are different


def read_values(name: str, given: object) -> list[Argument]:
    """Return the values of a list, or of a range { start, stop, step }, which includes `stop`.

    Raises:
        ValueError: If there are none, one occurs twice, or they are not numbers, strings and flags.
    """
    if isinstance(given, dict):
        return _range(name, cast(Values, given))
    if not isinstance(given, list):
        raise ValueError(f"{name} must be a list, or a table with start, stop and step, got {shown(given)}")
    if not given:
        raise ValueError(f"{name} is empty; write at least one value, or remove it")
    values = cast(list[object], given)
    for index, value in enumerate(values):
        if not isinstance(value, bool | int | float | str):
            raise ValueError(f"{name} must contain numbers, strings or true and false, got {shown(value)}")
        if value in values[:index]:
            raise ValueError(f"{name} contains {shown(value)} twice; remove one")
    return cast(list[Argument], values)


def _range(name: str, given: Arguments) -> list[Argument]:
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
    # + 0.0 changes the sign of -0.0, which would be part of the name of a case.
    return [round(value, 9) + 0.0 if isinstance(value, float) else value for value in values]


def make_axis(family: str, name: str, given: object) -> SweptArgument:
    """Return the axis of an argument of a family; its parts have the unit that the docstring states.

    Raises:
        ValueError: See `read_values`.
    """
    values = read_values(f"sweep.{name}", given)
    numbers = [value for value in values if is_number(value)]
    if name == SPEED and len(numbers) == len(values):
        return SweptArgument(name, values, [f"v{text}" for text in _numbers(numbers, 1.0 / KMH)])
    label, unit = file_name(name.replace("_", "-")), _unit(family, name)
    if len(numbers) < len(values):
        return SweptArgument(name, values, [_word(label, value) for value in values])
    factor = 1.0 / KMH if unit == "m/s" else 1.0
    return SweptArgument(
        name, values, [f"{label}{text}{_SUFFIXES.get(unit, '')}" for text in _numbers(numbers, factor)]
    )


def combine(axes: Sequence[SweptArgument]) -> list[tuple[str, Values]]:
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


def _word(label: str, value: Argument) -> str:
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
    found = _UNIT.search(argument_text(family, name))
    return found[1] if found else ""


def argument_text(family: str, name: str) -> str:
    """Return the description of an argument in the docstring of its family; empty without one."""
    parsed = parse(inspect.getdoc(FAMILIES.get(family)) or "", DocstringStyle.GOOGLE)
    return " ".join(param.description or "" for param in parsed.params if param.arg_name == name)


CASE_KEYS = ("family", "name", "speeds_kmh", "sweep", "fcw_driver", "arguments", "scenario", "cell")
_NAME = re.compile(r"[\w.+-]+(/[\w.+-]+)*")  # names become parts of file names


def read_cases(suite: str, table: object) -> list[Case]:
    """Return the cases of one table of a suite file.

    Raises:
        ValueError: If a key is unknown, a value is invalid, or a sweep is empty.
    """
    if not isinstance(table, dict):
        raise ValueError(f"cases must be [[cases]] tables, got {table!r}")
    table = cast(Values, table)
    check_table("a case", table, CASE_KEYS)
    family = read_name(table, "family")
    arguments = check_type("arguments", table.get("arguments", {}), dict)
    fcw_driver = check_flag("fcw_driver", table.get("fcw_driver", False))
    if "scenario" in table:
        return [_scenario_case(suite, family, table, fcw_driver)]
    axes = _axes(family, table, arguments)
    name = read_name(table, "name") if "name" in table or not axes else ""
    cases: list[Case] = []
    for variant, swept in combine(axes):
        parts = "/".join(filter(None, (variant, name)))
        cells = _swept(table) or tuple(zip(swept, variant.split("/"), strict=False)) * ("sweep" in table)
        values = tuple((arguments | swept).items())
        cases.append(Case(suite, family, parts, values, fcw_driver=fcw_driver, swept=cells))
    return cases


def _swept(table: Values) -> tuple[tuple[str, str], ...]:
    """Return the swept arguments of a case that the copy of a suite in a run folder states."""
    given = check_type("cell", table.get("cell", {}), dict)
    return tuple((str(name), check_text(f"cell.{name}", part)) for name, part in given.items())


def check_table(kind: str, table: Values, known: Collection[str]) -> None:
    """Raise ValueError for an unknown key; for an argument of the family, the message states its place."""
    family = str(table.get("family"))
    arguments = signature(FAMILIES[family]).parameters if family in FAMILIES else ()
    for key in table:
        if key not in known and key in arguments:
            place = f"arguments = {{ {key} = ... }}"
            place += f", or sweep = {{ {key} = [...] }}" if "sweep" in known else ""
            raise ValueError(f"{key} is an argument of {family}, not a key of {kind}; write {place}")
    check_keys(f"key of {kind}", table, known)


def read_name(table: Values, key: str) -> str:
    """Return a name in a table, whose characters are allowed in names of suites and cases."""
    if key not in table:
        raise ValueError(f'{key} is missing; add {key} = "..."')
    value = table[key]
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        raise ValueError(f"{key} must consist of letters, digits and . _ + - /, got {value!r}")
    return value


def _axes(family: str, table: Values, arguments: Arguments) -> list[SweptArgument]:
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


def _speeds(given: object) -> SweptArgument:
    """Return the axis of `speeds_kmh`."""
    values = cast(list[object], given) if isinstance(given, list) else read_values("speeds_kmh", given)
    speeds = [speed for speed in values if is_number(speed) and speed > 0]
    if not values or len(speeds) < len(values):
        raise ValueError(f"speeds_kmh must be a list of numbers > 0, got {given!r}")
    return SweptArgument(SPEED, [to_mps(speed) for speed in speeds], [f"v{speed:g}" for speed in speeds])


def _scenario_case(suite: str, family: str, table: Values, fcw_driver: bool) -> Case:
    """Return the case of a table with a scenario, whose family is that of the table."""
    arguments, data = table.get("arguments", {}), table["scenario"]
    check_keys("argument of a case with a scenario", arguments, APPEARANCE)
    for key in ("speeds_kmh", "sweep"):
        if key in table:
            raise ValueError(f"{key} and scenario exclude each other; write one table per scenario")
    data = {"family": family} | cast(Values, data) if isinstance(data, dict) else data
    scenario = scenario_from_data(data)
    if scenario.family != family:
        raise ValueError(
            f"family {family!r} and scenario.family {scenario.family!r} differ; remove the second"
        )
    case = scenario_case(suite, read_name(table, "name"), scenario, fcw_driver, **arguments)
    return replace(case, swept=_swept(table))
