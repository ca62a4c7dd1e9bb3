"""Rows of `episodes.jsonl` for tests of the analysis."""

from lgmd_gym.benchmark.case import Case, case_fields
from lgmd_gym.benchmark.metrics import KEYS
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.envs.dynamics.units import KMH

_CASES = {case.name: case for suite in SUITES.values() for case in suite.cases}


def threat_row(agent="a", case="suite/family/v1", seed=0, **values):
    """Return the row of a threat with the fields of its case; all other values are undefined."""
    known = _CASES.get(case) or Case(*[*case.split("/", 2), "", ""][:3])
    identity = {"agent": agent, "suite": known.suite, "case": case, "seed": seed, "condition": "clear"}
    return dict.fromkeys(KEYS) | case_fields(known) | identity | {"threat": True} | values


def suite_rows(suite, has_contact):
    """Return one row per case of a suite; `has_contact(case, speed_kmh)` selects full-speed contacts."""
    rows = []
    for case in SUITES[suite].cases:
        speed = case.scenario.ego_speed
        contact = has_contact(case.name, round(speed / KMH))
        values = {"impact_speed": speed, "relative_impact_speed": speed} if contact else {}
        values |= {"ego_speed": speed, "target_speed": 0.0, "fcw_driver": case.fcw_driver}
        rows.append(threat_row(case=case.name, collision=contact, **values))
    return rows
