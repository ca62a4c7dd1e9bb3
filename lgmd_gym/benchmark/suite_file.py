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
[cases.scenario]                    # a scenario of one's own, see `lgmd_gym.envs.families.data`
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
from lgmd_gym.benchmark.scenario_file import OWN, distinct, is_scenario, own_case, read_scenario
from lgmd_gym.benchmark.suites import SUITES, TRAFFIC, Suite, find_suite
from lgmd_gym.benchmark.trust import check_named
from lgmd_gym.envs.families import FAMILIES
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.envs.registration import (
    APPEARANCE,
    RANDOM,
    SCENARIO,
    SCENARIO_ARGUMENT,
    import_families,
    is_own,
    make_source,
)
from lgmd_gym.errors import check_items, check_keys, check_known, check_path, check_text, counted
from lgmd_gym.openscenario import read, read_all

SUITE_KEYS = ("name", "about", "module", "cases")
DATA_FILES = (".toml", ".json")
FILES = (*DATA_FILES, ".xosc")
FILE_KIND = "suite or scenario file"
MAX_LISTED = 10  # cases that a message lists
Source = str | Scenario | tuple[str | Scenario, ...]
"""What `get_suite` reads: a name, a path, a scenario, or several paths and scenarios."""


def is_file(suite: Source) -> bool:
    """Return whether a suite is given by files, a folder or scenarios instead of a name."""
    if not isinstance(suite, str) or suite.endswith(FILES):
        return True
    try:
        return bool(suite) and suite not in (*SUITES, TRAFFIC) and Path(suite).is_dir()
    except (OSError, ValueError):  # no path, such as a very long name
        return False


def get_suite(source: Source, modules: tuple[str, ...] = ()) -> Suite:
    """Return a suite.

    Args:
        source: Name of a suite; path of a suite file or scenario file (".toml" or ".json") or of an
            OpenSCENARIO file (".xosc"); path of a folder with OpenSCENARIO files; a `Scenario`; or several
            paths and scenarios.
        modules: Modules with scenario families of the user, see `import_families`; code from outside this
            package runs only if it is named here.

    Raises:
        ValueError: If the name is unknown, a file is not a valid suite or scenario, or a module cannot be
            imported.
    """
    import_families(modules)
    if isinstance(source, tuple):
        return _combine(source, modules)
    if isinstance(source, Scenario):
        return _combine((source,), modules)
    if check_text("suite", source).endswith(DATA_FILES):
        return load_suite(check_path("suite", source), modules)
    if source.endswith(".xosc"):
        return read(check_path("suite", source))
    return read_all([source]) if is_file(source) else find_suite(source)


def find_own_case(source: Source, name: str | None = None, modules: tuple[str, ...] = ()) -> Case:
    """Return one case of a suite that is given by files or scenarios.

    Args:
        source: See `get_suite`.
        name: Name of the case, with or without the name of the suite; None if there is only one.
        modules: See `get_suite`.

    Raises:
        ValueError: See `get_suite`; or if the name is unknown, or missing although there are several cases.
    """
    suite = get_suite(source, modules)
    cases = {case.name: case for case in suite.cases}
    if name is not None:
        full = name if name in cases else f"{suite.name}/{name}"
        return cases[check_known("case", full, cases)]
    if len(cases) > 1:
        listed = ", ".join([*cases][:MAX_LISTED]) + (", ..." if len(cases) > MAX_LISTED else "")
        raise ValueError(f"{suite.name!r} has {len(cases)} cases; choose one with --case NAME: {listed}")
    return suite.cases[0]


def _combine(sources: tuple[str | Scenario, ...], modules: tuple[str, ...]) -> Suite:
    """Return the suite of several files, folders and scenarios."""
    for source in sources:
        if not isinstance(source, Scenario) and not is_file(check_text("suite", source)):
            raise ValueError(
                f"of several suites each must be a file {FILES}, a folder or a Scenario, got {source!r}"
            )
    texts = [source for source in sources if isinstance(source, str) and not source.endswith(DATA_FILES)]
    if len(texts) == len(sources):
        return read_all(texts)
    cases: list[Case] = []
    for source in sources:
        cases += [own_case(source)] if isinstance(source, Scenario) else get_suite(source, modules).cases
    return Suite(OWN, distinct(cases), counted(len(cases), "scenario"))


def declared_modules(suite: str) -> tuple[str, ...]:
    """Return the modules that a suite or scenario file names; none for others. They are not imported.

    Raises:
        ValueError: If the file cannot be read, or `module` is not a string or a list of strings.
    """
    if not suite.endswith(DATA_FILES):
        return ()
    path = check_path("suite", suite)
    return _modules_of(path, read_data(path, FILE_KIND))


def _modules_of(path: Path, values: dict[str, Any]) -> tuple[str, ...]:
    given = values.get("module", [])
    try:
        return check_items("module", [given] if isinstance(given, str) else given, str, "strings")
    except ValueError as error:
        raise ValueError(f"{FILE_KIND} {str(path)!r}: {error}") from None


def load_suite(path: Path, modules: tuple[str, ...] = ()) -> Suite:
    """Read a suite or scenario file and build every case once, to find invalid values before an episode.

    Args:
        path: Suite file or scenario file.
        modules: See `get_suite`; they must include those that the file names.

    Raises:
        ValueError: If the file cannot be read, a key, family or argument is unknown, a value is out of
            range, a case is defined twice, or the file names another module.
    """
    values = read_data(path, FILE_KIND)
    declared = _modules_of(path, values)
    check_named(declared, modules, path)
    import_families(declared)
    kind = "scenario file" if is_scenario(values) else "suite file"
    try:
        if is_scenario(values):
            case = read_scenario(path, values)
            _check_cases((case,))
            return Suite(case.suite, (case,), f"scenario file {path.name}")
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
        raise ValueError(f"{kind} {str(path)!r}: {error}") from None
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
            text = str(error)
            if case.family not in (*FAMILIES, RANDOM, SCENARIO) and not text.endswith("?"):
                text += "; a family of your own requires module = 'my_scenarios' in the file"
            raise ValueError(f"case {case.name!r}: {text}") from None


def copy_suite(source: Source | Path, target: Path, modules: tuple[str, ...] = ()) -> None:
    """Write a suite given by files or scenarios to a suite file, with one table per case.

    The scenarios of OpenSCENARIO files and of the user's families become data, so that neither a run nor its
    worker processes need their sources again.
    """
    suite = get_suite(str(source) if isinstance(source, Path) else source, modules)
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
