"""Contact within a step: closed forms for straight braking, and a fine time step in a bend."""

from math import hypot, inf, nan, sqrt

import numpy as np
import pytest
from support.records import bodies, records

from lgmd_gym.envs import BrakingEnv
from lgmd_gym.envs.dynamics.bodies import STEP_START
from lgmd_gym.envs.dynamics.episode import StepMotion, progress
from lgmd_gym.envs.dynamics.script import Segment, arc
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.scenario import Actor, Scenario


def contact(scenario, hz, demand=0.0, config=None):
    """Return the environment and the info at the first contact under a constant demand."""
    env = BrakingEnv(scenario, {"simulation_frequency": hz, "policy_frequency": 15} | (config or {}))
    env.reset(seed=0)
    ended = False
    while not ended:
        _, _, terminated, truncated, info = env.step(np.array([demand], np.float32))
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


@pytest.mark.parametrize("hz", [15, 30, 60])
@pytest.mark.parametrize("build_up", [0.0, 0.2])
def test_contact_in_the_step_in_which_braking_begins(build_up, hz):
    """10 m/s for 0.12 s, then 9 m/s² at once or with 45 m/s³; the contact is 20 to 60 ms later."""
    for late in (0.02, 0.04, 0.06):
        covered = 10.0 * (0.12 + late) - (7.5 * late**3 if build_up else 4.5 * late**2)
        scenario = Scenario(
            family="Own", ego_speed=10.0, duration=5.0, actors=(Actor(gap=covered, speed=0.0),)
        )
        config = {"latency": 0.02, "dead_time": 0.1, "build_up": build_up}
        _, info = contact(scenario, hz, -1.0, config)
        expected = 10.0 - (22.5 * late**2 if build_up else 9.0 * late)
        assert info["impact_speed"] == pytest.approx(expected, abs=2e-4 * KMH)


def progress_of(part, parts=((inf, nan),), i=0, jerk=inf, segments=(), **start):
    """Return distance and speed after a part of 0.4 s of a body that has another speed at the end."""
    starts = records(STEP_START, start, start, {})
    table, paths = bodies({"speed": -1.0}, {"speed": -1.0})
    rows = np.array(segments, dtype=float).reshape(-1, 4)
    return progress(table, i, StepMotion(starts, np.array(parts), jerk, rows, paths, 0.4), part)


@pytest.mark.parametrize("part", [0.0, 0.25, 0.5, 1.0])
def test_progress_of_a_body_that_stops_within_the_step(part):
    # From 2 m/s with 10 m/s²: standstill after 0.2 s and 0.2 m, under a demand or by a script.
    time, script = min(0.4 * part, 0.2), {"script_speed": 2.0, "segment_end": 1}
    expected = pytest.approx((2.0 * time - 5.0 * time**2, 2.0 - 10.0 * time))
    assert progress_of(part, ((inf, -10.0),), speed=2.0) == expected
    for i in (0, 1):
        assert progress_of(part, i=i, segments=[(0.0, -10.0, 0.0, 0.0)], speed=2.0, **script) == expected


def test_progress_of_an_ego_whose_demand_changes_within_the_step():
    # 6 m/s on the script for 0.1 s; then -4 m/s² for 0.1 s; then a ramp of 20 m/s³.
    parts, start = ((0.1, nan), (0.1, -4.0), (inf, 4.0)), {"speed": 6.0, "script_speed": 6.0}
    for part, distance, speed in ((0.25, 0.6, 6.0), (0.125, 0.3, 6.0)):
        assert progress_of(part, parts, **start) == pytest.approx((distance, speed))
    assert progress_of(0.5, parts, **start) == pytest.approx((0.6 + 0.6 - 4.0 / 2 * 0.01, 5.6))
    jerk = {"jerk": 20.0}  # -2 m/s² after the second part, 0 after another 0.1 s
    assert progress_of(0.5, parts, **start, **jerk)[1] == pytest.approx(6.0 - 0.1)
    assert progress_of(0.75, parts, **start, **jerk)[1] == pytest.approx(6.0 - 0.2)


def test_progress_of_a_body_at_constant_speed():
    starts, (table, paths) = records(STEP_START, {"speed": 3.0}, {}), bodies({"speed": 3.0, "travelled": 1.2})
    step = StepMotion(starts, np.array([(inf, nan)]), inf, np.zeros((0, 4)), paths, 0.4)
    assert progress(table, 0, step, 0.3) == (0.3 * 1.2, 3.0)
