"""Suites: the shipped ones, and a user's own as TOML or JSON, strictly checked.

Case names are in km/h, arguments in SI units. docs/howto/own_scenario.md shows suite files, whose [[cases]]
tables are sweeps, single cases or scenarios, and scenario files, which hold one scenario.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import cast

import tomli_w

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import TRAFFIC_SUITES, Case, Suite, file_name, repetitions, scenario_case
from lgmd_gym.benchmark.case_table import check_table, read_cases, read_data, read_name
from lgmd_gym.benchmark.extensions import provided
from lgmd_gym.benchmark.protocols import load_suites
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families import FAMILIES
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.envs.registration import (
    RANDOM,
    SCENARIO,
    SCENARIO_ARGUMENT,
    import_families,
    is_own,
    make_source,
)
from lgmd_gym.errors import (
    check_items,
    check_keys,
    check_known,
    check_path,
    check_text,
    counted,
    unknown_name,
)
from lgmd_gym.processes.files import check_output_file, complete_file

SUITES = load_suites()


def find_suite(name: str) -> Suite:
    """Return the suite of a name.

    Raises:
        ValueError: If the name is unknown.
    """
    if check_text("suite", name) not in SUITES:
        raise unknown_name("suite", name, (*SUITES, *TRAFFIC_SUITES))
    return SUITES[name]


def find_case(name: str) -> Case:
    """Return the case with a full name, such as "quick/CCRs/v30".

    Raises:
        ValueError: If the name is unknown.
    """
    known = {case.name: case for suite in SUITES.values() for case in suite.cases}
    check_known("case", name, known, "lgmd-gym list cases prints all names")
    return known[name]


def template() -> str:
    """Return a commented scenario file to start from."""
    return (files("lgmd_gym.benchmark") / "scenario.toml").read_text(encoding="utf-8")


def write_template(path: Path | str, force: bool = False) -> Path:
    """Write the template of a scenario file; return its path.

    Args:
        path: File to write (".toml").
        force: Whether to replace an existing file.

    Raises:
        ValueError: If the file exists or cannot be created, or its name does not end in ".toml".
    """
    path = check_path("path", path)
    if path.suffix != ".toml":
        raise ValueError(f"a scenario template must have the suffix .toml, got {path.name!r}")
    check_output_file(path, "scenario file", force)
    with complete_file(path) as part:
        part.write_text(template(), encoding="utf-8")
    return path


SCENARIO_KEYS = ("name", "module", "family", "arguments", "scenario", "fcw_driver")
OWN = "scenarios"  # name of a suite of scenarios without a file


def is_scenario(values: Values) -> bool:
    """Return whether the values of a file are those of a scenario file instead of a suite file."""
    return "cases" not in values and ("family" in values or "scenario" in values)


def read_scenario(path: Path, values: Values) -> Case:
    """Return the case `stem/family/name` of a scenario file; without a name it contains the ego's speed.

    Raises:
        ValueError: If a key is unknown or a value is invalid.
    """
    for key in ("sweep", "speeds_kmh"):
        if key in values:
            raise ValueError(
                f"a scenario file has one scenario; write {key} in a [[cases]] table of a suite file"
            )
    check_table("a scenario file", values, SCENARIO_KEYS)
    suite, given = file_name(path.stem), values.get("scenario")
    table = {key: value for key, value in values.items() if key != "module"}
    if "family" not in table:
        given = cast(Values, given) if isinstance(given, dict) else {}
        table["family"] = given.get("family", suite)
    (case,) = read_cases(suite, {"name": "unnamed"} | table)
    if "name" in values:
        return case
    return replace(case, variant=speed_name(case.scenario))


def own_case(scenario: Scenario) -> Case:
    """Return the case `scenarios/family/v70` of a scenario, with the ego's speed in km/h."""
    return scenario_case(OWN, speed_name(scenario), scenario)


def distinct(cases: Sequence[Case]) -> tuple[Case, ...]:
    """Return cases of the suite `scenarios`; the second of equal names gets "/2", and so on."""
    suffixes = repetitions((case.family, case.variant) for case in cases)
    return tuple(
        replace(case, suite=OWN, variant=case.variant + suffix)
        for case, suffix in zip(cases, suffixes, strict=True)
    )


def speed_name(scenario: Scenario) -> str:
    """Return the ego's initial speed in km/h as part of a name, such as "v70"."""
    return f"v{scenario.ego_speed / KMH:.3g}"


SUITE_KEYS = ("name", "about", "module", "cases")
DATA_FILES = (".toml", ".json")
OPENSCENARIO = ".xosc"
FILES = (*DATA_FILES, OPENSCENARIO)
FILE_KIND = "suite or scenario file"
MAX_LISTED = 10  # cases that a message lists
Source = str | Scenario | tuple[str | Scenario, ...]
"""What `get_suite` reads: a name, a path, a scenario, or several paths and scenarios."""


def is_file(suite: Source) -> bool:
    """Return whether a suite is given by files, a folder or scenarios instead of a name."""
    if not isinstance(suite, str) or suite.endswith(FILES):
        return True
    try:
        return bool(suite) and suite not in (*SUITES, *TRAFFIC_SUITES) and Path(suite).is_dir()
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
    return _read_scenarios([source]) if is_file(source) else find_suite(source)


def _read_scenarios(paths: list[str]) -> Suite:
    """Return the suite of OpenSCENARIO files and folders."""
    return provided(OPENSCENARIO)(paths)


def find_own_case(
    source: Source,
    name: str | None = None,
    modules: tuple[str, ...] = (),
    parameters: Mapping[str, str] | None = None,
) -> Case:
    """Return one case of a suite that is given by files or scenarios.

    Args:
        source: See `get_suite`.
        name: Name of the case, with or without the name of the suite; None if there is only one.
        modules: See `get_suite`.
        parameters: Values of parameters of an OpenSCENARIO file, instead of its own.

    Raises:
        ValueError: See `get_suite`; or if the name is unknown, or missing although there are several cases.
    """
    suite = provided(OPENSCENARIO)([source], parameters) if parameters else get_suite(source, modules)
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
        return _read_scenarios(texts)
    cases: list[Case] = []
    for source in sources:
        cases += [own_case(source)] if isinstance(source, Scenario) else get_suite(source, modules).cases
    return Suite(name=OWN, cases=distinct(cases), about=counted(len(cases), "scenario"))


def declared_modules(suite: str) -> tuple[str, ...]:
    """Return the modules that a suite or scenario file names; none for others. They are not imported.

    Raises:
        ValueError: If the file cannot be read, or `module` is not a string or a list of strings.
    """
    if not suite.endswith(DATA_FILES):
        return ()
    path = check_path("suite", suite)
    return _modules_of(path, read_data(path, FILE_KIND))


def _modules_of(path: Path, values: Values) -> tuple[str, ...]:
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
    _check_named(declared, modules, path)
    import_families(declared)
    kind = "scenario file" if is_scenario(values) else "suite file"
    try:
        if is_scenario(values):
            case = read_scenario(path, values)
            _check_cases((case,))
            return Suite(name=case.suite, cases=(case,), about=f"scenario file {path.name}")
        check_keys("key of a suite", values, SUITE_KEYS)
        name = read_name(values, "name")
        if name in (*SUITES, *TRAFFIC_SUITES):
            raise ValueError(f"name {name!r} is the name of a shipped suite; choose another")
        tables: object = values.get("cases")
        if not isinstance(tables, list) or not tables:
            raise ValueError("cases must contain at least one [[cases]] table")
        cases = tuple(case for table in cast(list[object], tables) for case in read_cases(name, table))
        _check_cases(cases)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{kind} {str(path)!r}: {error}") from None
    return Suite(name=name, cases=cases, about=str(values.get("about", "user suite")))


def _check_cases(cases: tuple[Case, ...]) -> None:
    """Raise ValueError if two cases have the same name, or the scenario of one is invalid."""
    names: set[str] = set()
    for case in cases:
        if case.name in names:
            raise ValueError(f"case {case.name!r} is defined twice; rename one of them")
        names.add(case.name)
        try:
            make_source(case.environment, dict(case.arguments))
        except (TypeError, ValueError) as error:
            text = str(error)
            if case.environment not in (*FAMILIES, RANDOM, SCENARIO) and not text.endswith("?"):
                text += "; a family of your own requires module = 'my_scenarios' in the file"
            raise ValueError(f"case {case.name!r}: {text}") from None


def copy_suite(source: Source | Path, target: Path, modules: tuple[str, ...] = ()) -> None:
    """Write a suite given by files or scenarios to a suite file, with one table per case.

    The scenarios of OpenSCENARIO files and of the user's families become data, so that neither a run nor its
    worker processes need their sources again.
    """
    suite = get_suite(str(source) if isinstance(source, Path) else source, modules)
    tables = list[Values]()
    for case in map(_with_data, suite.cases):
        arguments = dict(case.arguments)
        scenario = arguments.pop(SCENARIO_ARGUMENT, None) if case.environment == SCENARIO else None
        family = case.environment if scenario is None else case.family
        table: Values = {"family": family, "name": case.variant}
        table |= {"fcw_driver": True} if case.fcw_driver else {}
        table |= {"cell": dict(case.swept)} if case.swept else {}
        table |= {"arguments": arguments} if arguments else {}
        tables.append(table | ({} if scenario is None else {"scenario": scenario}))
    text = tomli_w.dumps({"name": suite.name, "about": suite.about, "cases": tables})
    target.write_text(text, encoding="utf-8")


def _with_data(case: Case) -> Case:
    """Return a case of a user's family as a case with a given scenario."""
    if case.environment not in FAMILIES or not is_own(case.environment):
        return case
    given = scenario_case(case.suite, case.variant, case.scenario, case.fcw_driver, **case.appearance)
    return replace(given, swept=case.swept)


def _check_named(declared: Iterable[str], named: Iterable[str], source: Path) -> None:
    """Check that the user has named the modules with scenario families that a file declares.

    Raises:
        ValueError: If the user has not named one.
    """
    known = {text.partition(":")[0] for text in named}
    for text in declared:
        module = text.partition(":")[0]
        if module not in known:
            raise ValueError(
                f"{str(source)!r} names module {module!r}, whose code would run; if you trust it, add "
                f"--module {module} or --trust (in Python, modules=[{module!r}])"
            )
