"""Stages of the brake: every expected value is computed by hand."""

import numpy as np
import pytest

from lgmd_gym.agents import make_agents
from lgmd_gym.agents.stages import Evidence, StageParams, demands_of, next_stages

CLEAR, PRESENT, WARNING, PARTIAL, FULL = Evidence
PARAMS = StageParams(release_s=0.3, partial_demand=0.25, hold_speed=1.5)


def stages_of(evidence, speed=10.0, params=PARAMS, decision_s=0.1):
    """Return the stage after each decision of one brake."""
    stages, clear_s, found = np.zeros(1, int), np.zeros(1), []
    for item in evidence:
        stages, clear_s = next_stages(
            stages, clear_s, np.array([item]), np.array([speed]), params, decision_s
        )
        found.append(int(stages[0]))
    return found


def test_stages_rise_at_once_and_do_not_follow_weaker_evidence():
    evidence = [CLEAR, PRESENT, WARNING, PRESENT, PARTIAL, WARNING, FULL, PARTIAL, PRESENT]
    assert stages_of(evidence) == [0, 0, 2, 2, 3, 3, 4, 4, 4]


def test_a_brake_is_released_after_a_time_without_evidence():
    assert stages_of([FULL, CLEAR, CLEAR, CLEAR, CLEAR]) == [4, 4, 4, 0, 0]  # 0.3 s
    assert stages_of([FULL, CLEAR, CLEAR, PRESENT, CLEAR, CLEAR, CLEAR]) == [4, 4, 4, 4, 4, 4, 0]
    assert stages_of([WARNING, CLEAR, CLEAR, CLEAR]) == [2, 2, 2, 0]
    assert stages_of([FULL, CLEAR, CLEAR, CLEAR, WARNING, FULL]) == [4, 4, 4, 0, 2, 4]


def test_a_standing_car_is_held():
    evidence = [FULL, *[CLEAR] * 9]
    assert stages_of(evidence, speed=1.5) == [4] * 10
    assert stages_of(evidence, speed=1.501)[-1] == 0
    assert stages_of([WARNING, *[CLEAR] * 9], speed=0.0)[-1] == 0  # a warning ends at standstill, too


def test_a_latched_brake_is_never_released():
    assert stages_of([FULL, *[CLEAR] * 99], params=StageParams()) == [4] * 100


def test_demands():
    assert demands_of(np.array([0, 2, 3, 4]), PARAMS).tolist() == [0.0, 0.0, -0.25, -1.0]


@pytest.mark.parametrize(("agent", "demands"), [("ttc-oracle", [0.0, 0.0, -1.0, -1.0, -1.0])])
def test_an_oracle_warns_before_it_brakes_and_latches(agent, demands):
    oracle, found, alerts = make_agents(agent, 1), [], []
    for ttc in (4.6, 4.5, 2.0, 9.0, np.inf):
        found += oracle.act({}, {"ttc": np.array([ttc]), "ego_speed": np.array([10.0])}).tolist()
        alerts += oracle.alerts.tolist()
    assert found == demands
    assert alerts == [False, True, True, True, True]


def test_the_rule_releases_when_the_ground_fields_are_quiet():
    """All fields at K = 0.999, an excitation of 6.9, then at K = 0.5, an excitation of 0."""
    rule = make_agents("stopping-zone:release_s=0.2", 1)
    motion = {"ego_speed": np.full((1, 1), 10.0), "ego_yaw_rate": np.zeros((1, 1))}

    def act(potential):
        fields = {"membrane_potential": np.full((1, 17), potential), "spike_frequency": np.zeros((1, 17))}
        return float(rule.act(motion | fields, {})[0]), bool(rule.alerts[0])

    excited = [act(0.999) for _ in range(4)]  # the upright fields must be excited for four frames
    assert excited == [(0.0, False)] * 3 + [(-1.0, True)]
    quiet = [act(0.5) for _ in range(8)]
    # Upright and low fields count for six frames, the ground fields at once: 0.2 s after the last one.
    assert quiet == [(-1.0, True)] * 5 + [(0.0, False)] * 3
