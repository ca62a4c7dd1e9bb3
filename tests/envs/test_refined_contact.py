"""Contact within a step: closed forms for straight braking, and a fine time step in a bend."""

from math import hypot, sqrt

import numpy as np
import pytest

from lgmd_gym.envs import BrakingEnv
from lgmd_gym.envs.dynamics.bend import arc
from lgmd_gym.envs.dynamics.refined_contact import progress
from lgmd_gym.envs.dynamics.segment import Segment
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.scenarios.scenario import Actor, Scenario

HOLD = np.array([0.0], np.float32)


def contact(scenario, hz):
    """Return the environment and the info at the first contact without a demand."""
    env = BrakingEnv(scenario, {"simulation_frequency": hz, "policy_frequency": 15})
    env.reset(seed=0)
    ended = False
    while not ended:
        _, _, terminated, truncated, info = env.step(HOLD)
        ended = terminated or truncated
    return env, info


@pytest.mark.parametrize("hz", [15, 30, 60])
@pytest.mark.parametrize("target_speed", [0.0, 3.0])
@pytest.mark.parametrize("missing", [0.0001, 0.001, 0.005])  # [m] to a stop before the target
def test_slow_impacts_equal_the_closed_form(missing, target_speed, hz):
    closing, deceleration, start = 5.0, 7.0, 1.01
    gap = closing * start + closing**2 / (2.0 * deceleration) - missing
    braking = Segment(start=start, acceleration=-deceleration, final_speed=0.0)
    scenario = Scenario(
        family="Own",
        ego_speed=target_speed + closing,
        duration=10.0,
        ego_profile=(braking,),
        actors=(Actor(gap=gap, speed=target_speed),),
    )
    _, info = contact(scenario, hz)
    expected = sqrt(2.0 * deceleration * missing)
    assert info["relative_impact_speed"] == pytest.approx(expected, abs=0.03 * KMH)
    assert info["impact_speed"] == pytest.approx(target_speed + expected, abs=0.03 * KMH)


@pytest.mark.parametrize("offset", [-1.0, 0.5, 1.4])
def test_contact_in_a_bend_includes_the_rotation_within_a_step(offset):
    radius, angle = 12.0, 0.9
    x, y = radius * np.sin(angle), radius * (1.0 - np.cos(angle))
    target = Actor(gap=float(x) - 4.0, lateral_offset=float(y) + offset, heading=0.5)
    scenario = Scenario(
        family="Own", ego_speed=9.0, duration=5.0, ego_path=(arc(radius, 2.0),), actors=(target,)
    )
    exact, _ = contact(scenario, 960)
    for hz, close in ((15, 0.008), (60, 0.002)):
        env, _ = contact(scenario, hz)
        assert hypot(*(env.ego.position - exact.ego.position)) < close


def test_progress_of_a_body_that_stops_within_the_step():
    # From 2 m/s with 10 m/s²: standstill after 0.2 s and 0.2 m.
    for part, time in ((0.0, 0.0), (0.25, 0.1), (0.5, 0.2), (1.0, 0.2)):
        share, speed = progress(2.0, 0.0, 0.2, 0.4, part)
        assert share * 0.2 == pytest.approx(2.0 * time - 5.0 * time**2)
        assert speed == pytest.approx(2.0 - 10.0 * time)
    assert progress(2.0, 4.0, 1.2, 0.4, 0.5) == pytest.approx((0.5 / 1.2, 3.0))
    assert progress(3.0, 3.0, 1.2, 0.4, 0.3) == (0.3, 3.0)
