"""Scenario files: one scenario as TOML or JSON, a family with arguments or explicit actors.

family = "CutIn"                    # a family of this package or of `module`
arguments = { ego_speed = 19.44, gap = 8.0, excess = -5.56 }    # optional, in SI units
name = "close"                      # last part of the case's name; optional
module = "my_scenarios"             # see `import_families`; optional

or

[scenario]                          # see `lgmd_gym.envs.families.data`
ego_speed = 19.44
duration = 9.0
actors = [{ gap = 40.0, lateral_offset = 1.0 }]
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lgmd_gym.benchmark.case import Case, scenario_case
from lgmd_gym.benchmark.case_table import check_table, read_cases
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.openscenario.names import file_name

SCENARIO_KEYS = ("name", "module", "family", "arguments", "scenario", "fcw_driver")
OWN = "scenarios"  # name of a suite of scenarios without a file


def is_scenario(values: dict[str, Any]) -> bool:
    """Return whether the values of a file are those of a scenario file instead of a suite file."""
    return "cases" not in values and ("family" in values or "scenario" in values)


def read_scenario(path: Path, values: dict[str, Any]) -> Case:
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
        table["family"] = given.get("family", suite) if isinstance(given, dict) else suite
    (case,) = read_cases(suite, {"name": "unnamed"} | table)
    if "name" in values:
        return case
    return replace(case, name=f"{suite}/{table['family']}/{speed_name(case.scenario)}")


def own_case(scenario: Scenario) -> Case:
    """Return the case `scenarios/family/v70` of a scenario, with the ego's speed in km/h."""
    return scenario_case(OWN, speed_name(scenario), scenario)


def distinct(cases: Sequence[Case]) -> tuple[Case, ...]:
    """Return cases of the suite `scenarios`; the second of equal names gets "/2", and so on."""
    seen: dict[str, int] = {}
    named = []
    for case in cases:
        name = f"{OWN}/{case.name.split('/', 1)[1]}"
        seen[name] = seen.get(name, 0) + 1
        named.append(replace(case, name=name if seen[name] == 1 else f"{name}/{seen[name]}"))
    return tuple(named)


def speed_name(scenario: Scenario) -> str:
    """Return the ego's initial speed in km/h as part of a name, such as "v70"."""
    return f"v{scenario.ego_speed / KMH:.3g}"
