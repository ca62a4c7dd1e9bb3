"""The suites without targets, detections, and the draws of threats without their targets."""

from dataclasses import replace

import pytest
from support.examples import load
from support.rows import threat_row

from lgmd_gym.benchmark import RunConfig
from lgmd_gym.benchmark.run_folder import StoredRun
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.envs.families.distribution import EXTRA_FAMILIES, draw_scenario, level_generator
from lgmd_gym.envs.families.scenario import without_target

detected_rows = load("detections").detected_rows
CONFIG = RunConfig(suite="ncap2023", agents=("no-brake",), seeds=1)


@pytest.mark.parametrize("suite", ["ncap2023", "ncap2023-vru"])
def test_each_case_is_a_threat_without_its_target(suite):
    cases, threats = SUITES[f"{suite}-without-target"].cases, SUITES[suite].cases
    for case, with_target in zip(cases, threats, strict=True):
        assert (case.family, case.variant) == (with_target.family, with_target.variant)
        assert case.fcw_driver is with_target.fcw_driver
        assert case.scenario == without_target(with_target.scenario)
        assert case.scenario.actors == with_target.scenario.actors[1:]


def stored_run(suite, outcomes, **values):
    """Return a run of agent "a" with the given values of a key by variant."""
    ((key, by_variant),) = outcomes.items()
    rows = [
        threat_row(case=f"{suite}/CCCscp/{name}", world=8000, **{key: value}, **values)
        for name, value in by_variant.items()
    ]
    return StoredRun(replace(CONFIG, suite=suite), rows, False)


def test_a_contact_is_detected_where_the_agent_is_quiet_without_the_target():
    run = stored_run("ncap2023", {"avoided": {"v20": True, "v30": True, "v40": False, "v50": False}})
    brakes = {"v20": False, "v30": True, "v40": False, "v50": True}
    alone = stored_run("ncap2023-without-target", {"false_activation": brakes})
    assert [row["avoided"] for row in detected_rows(run, alone)] == [True, False, False, False]
    assert [row["avoided"] for row in run.rows] == [True, True, False, False]
    further = alone._replace(config=replace(alone.config, agents=("no-brake", "ttc-oracle")))
    assert detected_rows(run, further) == detected_rows(run, alone)


def test_a_failed_episode_is_no_detection():
    run = stored_run("ncap2023", {"avoided": {"v20": True}})
    alone = stored_run("ncap2023-without-target", {"false_activation": {"v20": None}})
    assert [row["avoided"] for row in detected_rows(run, alone)] == [False]


def test_runs_that_do_not_belong_together():
    run = stored_run("ncap2023", {"avoided": {"v20": True, "v30": True}})
    alone = stored_run("ncap2023-without-target", {"false_activation": {"v20": False}})
    with pytest.raises(ValueError, match=r"lacks ncap2023/CCCscp/v30 of a, seed 0; run both suites"):
        detected_rows(run, alone)
    smooth = alone._replace(config=replace(alone.config, road="smooth"))
    with pytest.raises(
        ValueError, match="ncap2023-without-target have other settings; run both with the same"
    ):
        detected_rows(run, smooth)
    with pytest.raises(
        ValueError, match=r"a run of ncap2023-without-target is required .*, got one of ncap2023$"
    ):
        detected_rows(run, run)


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
