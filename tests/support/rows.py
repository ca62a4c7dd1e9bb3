"""Rows of `episodes.jsonl` for tests of the analysis."""

from lgmd_gym.benchmark.rows import KEYS
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.envs.dynamics.units import KMH


def threat_row(agent="a", case="suite/family/v1", seed=0, **values):
    """Return the row of a threat; all other values are undefined."""
    identity = {"agent": agent, "case": case, "seed": seed, "condition": "clear", "threat": True}
    return dict.fromkeys(KEYS) | identity | values


def suite_rows(suite, has_contact):
    """Return one row per case of a suite; `has_contact(case, speed_kmh)` selects full-speed contacts."""
    rows = []
    for case in SUITES[suite].cases:
        speed = case.scenario.ego_speed
        contact = has_contact(case.name, round(speed / KMH))
        values = {"impact_speed": speed, "relative_impact_speed": speed} if contact else {}
        rows.append(
            threat_row(case=case.name, ego_speed=speed, target_speed=0.0, collision=contact, **values)
        )
    return rows
