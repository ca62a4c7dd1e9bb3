"""Suite files: a user's own suite as TOML, strictly checked.

name = "mine"
about = "dark cars, by day"

[[cases]]
family = "CCRs"
speeds_kmh = [10, 20, 30]           # cases mine/CCRs/v10/dark, ...; arguments in SI units
name = "dark"
arguments = { shade = 40 }

[[cases]]
family = "CCRm"
name = "warned"                     # mine/CCRm/warned
fcw_driver = true
arguments = { ego_speed = 13.89, target_speed = 5.56 }

[[cases]]
family = "parked"                   # any name
name = "v30"                        # mine/parked/v30
arguments = { condition = "night" }
[cases.scenario]                    # a scenario of one's own, see `lgmd_gym.envs.scenarios.data`
ego_speed = 8.33
duration = 9.0
actors = [{ gap = 40.0, lateral_offset = 1.0 }]
"""

import re
import tomllib
from pathlib import Path
from typing import Any

import tomli_w

from lgmd_gym.benchmark.case import Case, scenario_case, to_mps
from lgmd_gym.benchmark.openscenario import read, read_all
from lgmd_gym.benchmark.suites import SUITES, TRAFFIC, Suite, find_suite
from lgmd_gym.envs.registration import SCENARIO, SCENARIO_ARGUMENT
from lgmd_gym.envs.scenarios.data import scenario_from_data
from lgmd_gym.errors import check_items, check_keys, check_path, check_text

SUITE_KEYS = ("name", "about", "cases")
CASE_KEYS = ("family", "name", "speeds_kmh", "fcw_driver", "arguments", "scenario")
FILES = (".toml", ".xosc")
NAME = re.compile(r"[\w.+-]+(/[\w.+-]+)*")  # names become parts of file names


def is_file(suite: str | tuple[str, ...]) -> bool:
    """Return whether a suite is given by files or a folder instead of a name."""
    if not isinstance(suite, str) or suite.endswith(FILES):
        return True
    try:
        return bool(suite) and suite not in SUITES and Path(suite).is_dir()
    except (OSError, ValueError):  # no path, such as a very long name
        return False


def get_suite(text: str | tuple[str, ...]) -> Suite:
    """Return a suite.

    Args:
        text: Name of a suite; path of a suite file (".toml") or of an OpenSCENARIO file (".xosc"); path of a
            folder with OpenSCENARIO files; or several paths of OpenSCENARIO files and folders.

    Raises:
        ValueError: If the name is unknown or a file is not a valid suite.
    """
    if isinstance(text, tuple):
        return read_all(_scenario_files(text))
    if check_text("suite", text).endswith(".toml"):
        return load_suite(check_path("suite", text))
    if text.endswith(".xosc"):
        return read(check_path("suite", text))
    return read_all([text]) if is_file(text) else find_suite(text)


def _scenario_files(paths: tuple[str, ...]) -> tuple[str, ...]:
    for path in check_items("suite", paths, str, "strings"):
        if not path.endswith(".xosc") and not check_path("suite", path).is_dir():
            raise ValueError(f"of several suites each must be a .xosc file or a folder, got {path!r}")
    return paths


def load_suite(path: Path) -> Suite:
    """Read a suite and build every case once, to find invalid values before the first episode.

    Raises:
        ValueError: If the file cannot be read, a key, family or argument is unknown, a value is out of
            range, or a case is defined twice.
    """
    values = read_toml(path, "suite file")
    try:
        check_keys("key of a suite", values, SUITE_KEYS)
        name = _text(values, "name")
        if name in SUITES or name == TRAFFIC:
            raise ValueError(f"name {name!r} is the name of a shipped suite; choose another")
        tables = values.get("cases")
        if not isinstance(tables, list) or not tables:
            raise ValueError("cases must contain at least one [[cases]] table")
        cases = tuple(case for table in tables for case in _cases(name, table))
        names: set[str] = set()
        for case in cases:
            if case.name in names:
                raise ValueError(f"case {case.name!r} is defined twice; rename one of them")
            names.add(case.name)
            _ = case.scenario
    except (TypeError, ValueError) as error:
        raise ValueError(f"suite file {str(path)!r}: {error}") from None
    return Suite(name, cases, str(values.get("about", "user suite")))


def copy_suite(source: str | Path | tuple[str, ...], target: Path) -> None:
    """Write a suite given by files to a suite file, with one table per case.

    The scenarios of OpenSCENARIO files become data, so that a run does not need its sources again.
    """
    suite = get_suite(source if isinstance(source, tuple) else str(source))
    tables = []
    for case in suite.cases:
        _, family, variant = case.name.split("/", 2)
        arguments = dict(case.arguments)
        scenario = arguments.pop(SCENARIO_ARGUMENT, None) if case.family == SCENARIO else None
        table: dict[str, Any] = {"family": case.family if scenario is None else family, "name": variant}
        table |= {"fcw_driver": True} if case.fcw_driver else {}
        table |= {"arguments": arguments} if arguments else {}
        tables.append(table | ({} if scenario is None else {"scenario": scenario}))
    text = tomli_w.dumps({"name": suite.name, "about": suite.about, "cases": tables})
    target.write_text(text, encoding="utf-8")


def read_toml(path: Path, kind: str) -> dict[str, Any]:
    """Return the values of a TOML file.

    Args:
        path: File to read.
        kind: Kind of file, for the message.

    Raises:
        ValueError: If it cannot be read or is not TOML.
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
    fcw_driver = table.get("fcw_driver", False)
    if not isinstance(arguments, dict):
        raise ValueError(f"arguments must be a table, got {arguments!r}")
    if not isinstance(fcw_driver, bool):
        raise ValueError(f"fcw_driver must be true or false, got {fcw_driver!r}")
    if "scenario" in table:
        return [_scenario_case(suite, family, table, fcw_driver)]
    speeds = table.get("speeds_kmh")
    if speeds is None:
        name = f"{suite}/{family}/{_text(table, 'name')}"
        return [Case(name, family, tuple(arguments.items()), fcw_driver)]
    if not isinstance(speeds, list) or not speeds or not all(_is_speed(speed) for speed in speeds):
        raise ValueError(f"speeds_kmh must be a list of numbers > 0, got {speeds!r}")
    if "ego_speed" in arguments:
        raise ValueError("speeds_kmh and arguments.ego_speed exclude each other; remove one of them")
    tail = f"/{_text(table, 'name')}" if "name" in table else ""
    return [
        Case(
            f"{suite}/{family}/v{speed:g}{tail}",
            family,
            tuple((arguments | {"ego_speed": to_mps(speed)}).items()),
            fcw_driver,
        )
        for speed in speeds
    ]


def _scenario_case(suite: str, family: str, table: dict[str, Any], fcw_driver: bool) -> Case:
    """Return the case of a table with a scenario, whose family is that of the table."""
    arguments, data = table.get("arguments", {}), table["scenario"]
    check_keys("argument of a case with a scenario", arguments, ("condition", "road", "world"))
    if "speeds_kmh" in table:
        raise ValueError("speeds_kmh and scenario exclude each other; write one table per speed")
    data = {"family": family} | data if isinstance(data, dict) else data
    scenario = scenario_from_data(data)
    if scenario.family != family:
        raise ValueError(
            f"family {family!r} and scenario.family {scenario.family!r} differ; remove the second"
        )
    return scenario_case(suite, _text(table, "name"), scenario, fcw_driver, **arguments)


def _is_speed(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0


def _text(table: dict[str, Any], key: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not NAME.fullmatch(value):
        raise ValueError(f"{key} must consist of letters, digits and . _ + - /, got {value!r}")
    return value
