"""Suite files: a user's own suite as TOML or JSON, strictly checked.

name = "mine"
about = "dark cars, by day"
module = "my_scenarios"             # or "my_scenarios:MyFamily", see `import_families`; optional

[[cases]]
family = "CCRs"
speeds_kmh = [10, 20, 30]           # cases mine/CCRs/v10/dark, ...; arguments in SI units
name = "dark"
arguments = { shade = 40 }

[[cases]]
family = "CutIn"                    # all combinations: mine/CutIn/v70/gap6m/excess-10.8kmh, ...
sweep.ego_speed = { start = 19.444, stop = 25.0, step = 2.778 }     # includes 25.0
sweep.gap = [6, 8, 10]
sweep.excess = [-3.0, -6.0]

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

from pathlib import Path
from typing import Any

import tomli_w

from lgmd_gym.benchmark.case import Case, scenario_case
from lgmd_gym.benchmark.case_table import read_cases, read_name
from lgmd_gym.benchmark.data_file import read_data
from lgmd_gym.benchmark.openscenario import read, read_all
from lgmd_gym.benchmark.suites import SUITES, TRAFFIC, Suite, find_suite
from lgmd_gym.benchmark.trust import check_named
from lgmd_gym.envs.own_families import import_families, is_own
from lgmd_gym.envs.registration import APPEARANCE, SCENARIO, SCENARIO_ARGUMENT, make_source
from lgmd_gym.envs.scenarios import FAMILIES
from lgmd_gym.errors import check_items, check_keys, check_path, check_text

SUITE_KEYS = ("name", "about", "module", "cases")
DATA_FILES = (".toml", ".json")
FILES = (*DATA_FILES, ".xosc")


def is_file(suite: str | tuple[str, ...]) -> bool:
    """Return whether a suite is given by files or a folder instead of a name."""
    if not isinstance(suite, str) or suite.endswith(FILES):
        return True
    try:
        return bool(suite) and suite not in SUITES and Path(suite).is_dir()
    except (OSError, ValueError):  # no path, such as a very long name
        return False


def get_suite(text: str | tuple[str, ...], modules: tuple[str, ...] = ()) -> Suite:
    """Return a suite.

    Args:
        text: Name of a suite; path of a suite file (".toml" or ".json") or of an OpenSCENARIO file (".xosc");
            path of a folder with OpenSCENARIO files; or several paths of OpenSCENARIO files and folders.
        modules: Modules with scenario families of the user, see `import_families`; code from outside this
            package runs only if it is named here.

    Raises:
        ValueError: If the name is unknown, a file is not a valid suite, or a module cannot be imported.
    """
    import_families(modules)
    if isinstance(text, tuple):
        return read_all(_scenario_files(text))
    if check_text("suite", text).endswith(DATA_FILES):
        return load_suite(check_path("suite", text), modules)
    if text.endswith(".xosc"):
        return read(check_path("suite", text))
    return read_all([text]) if is_file(text) else find_suite(text)


def _scenario_files(paths: tuple[str, ...]) -> tuple[str, ...]:
    for path in check_items("suite", paths, str, "strings"):
        if not path.endswith(".xosc") and not check_path("suite", path).is_dir():
            raise ValueError(f"of several suites each must be a .xosc file or a folder, got {path!r}")
    return paths


def declared_modules(suite: str) -> tuple[str, ...]:
    """Return the modules that a suite file names; none for other suites. They are not imported.

    Raises:
        ValueError: If the file cannot be read, or `module` is not a string or a list of strings.
    """
    if not suite.endswith(DATA_FILES):
        return ()
    path = check_path("suite", suite)
    return _modules_of(path, read_data(path, "suite file"))


def _modules_of(path: Path, values: dict[str, Any]) -> tuple[str, ...]:
    given = values.get("module", [])
    try:
        return check_items("module", [given] if isinstance(given, str) else given, str, "strings")
    except ValueError as error:
        raise ValueError(f"suite file {str(path)!r}: {error}") from None


def load_suite(path: Path, modules: tuple[str, ...] = ()) -> Suite:
    """Read a suite and build every case once, to find invalid values before the first episode.

    Args:
        path: Suite file.
        modules: See `get_suite`; they must include those that the file names.

    Raises:
        ValueError: If the file cannot be read, a key, family or argument is unknown, a value is out of
            range, a case is defined twice, or the file names another module.
    """
    values = read_data(path, "suite file")
    declared = _modules_of(path, values)
    check_named(declared, modules, path)
    import_families(declared)
    try:
        check_keys("key of a suite", values, SUITE_KEYS)
        name = read_name(values, "name")
        if name in SUITES or name == TRAFFIC:
            raise ValueError(f"name {name!r} is the name of a shipped suite; choose another")
        tables = values.get("cases")
        if not isinstance(tables, list) or not tables:
            raise ValueError("cases must contain at least one [[cases]] table")
        cases = tuple(case for table in tables for case in read_cases(name, table))
        _check_cases(cases)
    except (TypeError, ValueError) as error:
        raise ValueError(f"suite file {str(path)!r}: {error}") from None
    return Suite(name, cases, str(values.get("about", "user suite")))


def _check_cases(cases: tuple[Case, ...]) -> None:
    """Raise ValueError if two cases have the same name, or the scenario of one is invalid."""
    names: set[str] = set()
    for case in cases:
        if case.name in names:
            raise ValueError(f"case {case.name!r} is defined twice; rename one of them")
        names.add(case.name)
        try:
            make_source(case.family, dict(case.arguments))
        except (TypeError, ValueError) as error:
            raise ValueError(f"case {case.name!r}: {error}") from None


def copy_suite(source: str | Path | tuple[str, ...], target: Path, modules: tuple[str, ...] = ()) -> None:
    """Write a suite given by files to a suite file, with one table per case.

    The scenarios of OpenSCENARIO files and of the user's families become data, so that neither a run nor its
    worker processes need their sources again.
    """
    suite = get_suite(source if isinstance(source, tuple) else str(source), modules)
    tables = []
    for case in map(_with_data, suite.cases):
        _, family, variant = case.name.split("/", 2)
        arguments = dict(case.arguments)
        scenario = arguments.pop(SCENARIO_ARGUMENT, None) if case.family == SCENARIO else None
        table: dict[str, Any] = {"family": case.family if scenario is None else family, "name": variant}
        table |= {"fcw_driver": True} if case.fcw_driver else {}
        table |= {"arguments": arguments} if arguments else {}
        tables.append(table | ({} if scenario is None else {"scenario": scenario}))
    text = tomli_w.dumps({"name": suite.name, "about": suite.about, "cases": tables})
    target.write_text(text, encoding="utf-8")


def _with_data(case: Case) -> Case:
    """Return a case of a user's family as a case with a given scenario."""
    if case.family not in FAMILIES or not is_own(case.family):
        return case
    variant = case.name.split("/", 2)[2]
    chosen = {name: value for name, value in case.arguments if name in APPEARANCE}
    return scenario_case(case.suite, variant, case.scenario, case.fcw_driver, **chosen)
