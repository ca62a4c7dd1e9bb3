"""The suites without targets, and the draws of threats without their targets."""

import pytest

from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.envs.families.distribution import EXTRA_FAMILIES, draw_scenario, level_generator
from lgmd_gym.envs.families.scenario import without_target


@pytest.mark.parametrize("suite", ["ncap2023", "ncap2023-vru"])
def test_each_case_is_a_threat_without_its_target(suite):
    cases, threats = SUITES[f"{suite}-without-target"].cases, SUITES[suite].cases
    for case, with_target in zip(cases, threats, strict=True):
        assert (case.family, case.variant) == (with_target.family, with_target.variant)
        assert case.fcw_driver is with_target.fcw_driver
        assert case.scenario == without_target(with_target.scenario)
        assert case.scenario.actors == with_target.scenario.actors[1:]


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
