"""The suite without-target, and the draws of threats without their targets."""

import pytest

from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.envs.scenarios.distribution import EXTRA_FAMILIES, draw_scenario, level_generator

THREATS = {
    case.name.split("/", 1)[1]: case
    for suite in ("ncap2023", "ncap2023-vru")
    for case in SUITES[suite].cases
    if not case.fcw_driver
}


def test_each_case_is_a_threat_without_its_target():
    cases = SUITES["without-target"].cases
    assert len(cases) == 134
    for case in cases:
        threat = THREATS.pop(case.name.split("/", 1)[1]).scenario
        assert case.scenario.actors == threat.actors[1:]
        for name in ("family", "ego_speed", "ego_profile", "ego_path", "road", "duration"):
            assert getattr(case.scenario, name) == getattr(threat, name)
    kept = {(case.scenario.family, case.scenario.ego_speed) for case in cases}
    assert {(case.scenario.family, case.scenario.ego_speed) for case in THREATS.values()} <= kept


@pytest.mark.parametrize("name", [name for name in EXTRA_FAMILIES if name.endswith("WithoutTarget")])
def test_levels_without_target_are_those_with_it(name):
    """The same level of the family alone has one actor more, the first one."""
    for level in range(50):
        alone, threat = (
            draw_scenario(level_generator("train", level), [family])
            for family in (name, name.removesuffix("WithoutTarget"))
        )
        assert alone.family == threat.family
        assert alone.actors == threat.actors[1:]
        assert (alone.ego_speed, alone.ego_path, alone.road) == (
            threat.ego_speed,
            threat.ego_path,
            threat.road,
        )
