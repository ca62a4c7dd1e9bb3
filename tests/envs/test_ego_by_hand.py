"""Delay line, ego and actors: every expected value is computed by hand."""

from math import asin, atan, cos, pi, sin, tan

import numpy as np
import pytest
from support.records import bodies, brake_of, record

from lgmd_gym.envs.dynamics.bodies import BOX, EGO_STATE, move, step_actor, step_ego
from lgmd_gym.envs.dynamics.brake import DELAY_LINE, next_part, put_demand
from lgmd_gym.envs.dynamics.path import path_table
from lgmd_gym.envs.dynamics.script import Bend, Pose, arc

NO_SEGMENTS = np.zeros((0, 4))
ORIGIN = Pose(0.0, 0.0, 0.0)


def delayed(puts, delay, ends):
    """Return the parts of a delay line up to each time in `ends`; `puts` are (time, demand)."""
    line, pending, parts = record(DELAY_LINE), np.zeros((8, 2)), []
    for end in ends:
        for demand in [value for time, value in puts if time == line.time]:
            put_demand(line, pending, delay, demand)
        while True:
            parts.append(tuple(map(float, next_part(line, pending, end))))
            if not line.time < end:
                break
    return parts, int(line["count"])


def test_delay_is_exact():
    parts, count = delayed([(0.0, -1.0)], 0.13, [0.1, 0.2])
    assert parts == [
        (0.1, 0.0),
        (pytest.approx(0.03, abs=1e-12), 0.0),
        (pytest.approx(0.07, abs=1e-12), -1.0),
    ]
    assert count == 0


def test_demand_due_at_the_end_belongs_to_the_next_step():
    parts, count = delayed([(0.0, -1.0)], 0.25, [0.25])
    assert (parts, count) == ([(0.25, 0.0)], 1)
    parts, count = delayed([(0.0, -1.0)], 0.25, [0.25, 0.5])
    assert (parts, count) == ([(0.25, 0.0), (0.25, -1.0)], 0)
    assert delayed([(0.0, -1.0)], 0.0, [0.25]) == ([(0.25, -1.0)], 0)


def test_demands_become_active_in_order_and_repetitions_are_not_stored():
    puts = [(0.0, -1.0), (0.25, -0.5), (0.5, -0.5), (0.75, 0.0)]
    parts, count = delayed(puts, 0.375, [0.25, 0.5, 0.75, 1.0])
    assert parts == [(0.25, 0.0), (0.125, 0.0), (0.125, -1.0), (0.125, -1.0), (0.125, -0.5), (0.25, -0.5)]
    assert count == 1  # the release


def drive(demand, body=(), brake=(), segments=NO_SEGMENTS, on_script=0, dt=0.5, path=None):
    """Return the ego and its state after `dt` [s] under a demand; 10 m/s and a script of 10 m/s."""
    table, paths = bodies({"speed": 10.0, "script_speed": 10.0} | dict(body))
    paths = paths if path is None else path
    table[0].path_end = len(paths)
    state = record(EGO_STATE, on_script=on_script)
    line, pending = record(DELAY_LINE, demand=demand, last_put=demand), np.zeros((8, 2))
    parts = np.zeros((9, 2))
    step_ego(table[0], state, line, pending, brake_of(**dict(brake)), segments, paths, parts, dt)
    return table[0], state


@pytest.mark.parametrize(
    ("demand", "script", "acceleration"),
    [
        (-1.0, 0.0, -8.0),
        (-0.5, 0.0, -4.0),
        (-0.25, -3.0, -3.0),  # 2 m/s² is weaker than the scripted brake
        (-0.5, -3.0, -4.0),
        (-0.375, -3.0, -3.0),
        (0.5, 0.0, 1.5),
        (1.0, 0.0, 3.0),
    ],
)
def test_acceleration_under_a_demand(demand, script, acceleration):
    segments = np.array([[0.0, script, 0.0, 0.0]]) if script else NO_SEGMENTS
    body, _ = drive(demand, {"segment_end": len(segments)}, segments=segments)
    assert body.acceleration == acceleration
    assert body.speed == pytest.approx(10 + 0.5 * acceleration)
    assert body.x == body.travelled == pytest.approx(5 + acceleration / 8)


def test_throttle_ends_at_the_highest_speed():
    assert drive(1.0, {"speed": 39.999})[0].acceleration == 3.0
    assert drive(1.0, {"speed": 40.0})[0].acceleration == 0.0
    assert drive(-1.0, {"speed": 40.0})[0].acceleration == -8.0


@pytest.mark.parametrize(
    ("speed", "acceleration"),
    # The deficit is regained in 0.5 s, at most with 2 m/s², in both directions.
    [(9.5, 1.0), (9.0, 2.0), (8.0, 2.0), (10.0, 0.0), (10.5, -1.0), (11.0, -2.0), (12.0, -2.0)],
)
def test_scripted_speed_is_regained_without_a_demand(speed, acceleration):
    assert drive(0.0, {"speed": speed})[0].acceleration == pytest.approx(acceleration)


def test_regaining_adds_to_the_scripted_acceleration():
    segments = np.array([[0.0, -3.0, 0.0, 0.0]])
    body, _ = drive(0.0, {"speed": 8.0, "script_speed": 10.0, "segment_end": 1}, segments=segments)
    # The script is at 8.5 m/s after the step: a deficit of 0.5 m/s is regained with 1 m/s².
    assert (body.script_speed, body.acceleration) == (8.5, -2.0)


def test_ego_follows_its_script_until_the_first_demand():
    body, state = drive(0.0, {"speed": 9.0}, on_script=1)
    assert (body.speed, body.acceleration, body.x, state.on_script) == (10.0, 0.0, 5.0, 1)
    _, state = drive(-0.5, on_script=1)
    assert state.on_script == 0
    _, state = drive(0.0, on_script=0)
    assert state.on_script == 0


def test_build_up_is_a_ramp():
    body, _ = drive(-1.0, brake={"jerk": 8.0})
    assert (body.acceleration, body.speed) == (-4.0, 9.0)
    assert body.x == pytest.approx(5 - 8 * 0.125 / 6)


def test_yaw_rate_and_steering_on_an_arc():
    path = path_table(ORIGIN, (arc(20.0, -pi / 2),))  # to the right
    body, state = drive(0.0, path=path)
    assert state.yaw_rate == pytest.approx(10 / 20)
    assert body.heading == pytest.approx(5 / 20)
    assert (body.x, body.y) == pytest.approx((20 * sin(0.25), 20 * (1 - cos(0.25))))
    # Bicycle model: sin(slip) = curvature · length/2, tan(steering) = 2 tan(slip).
    assert body.steering == pytest.approx(atan(2 * tan(asin(2 / 20))))
    left = path_table(ORIGIN, (arc(20.0, pi / 2),))
    assert drive(0.0, path=left)[0].steering == pytest.approx(-atan(2 * tan(asin(2 / 20))))
    assert drive(0.0)[0].steering == 0.0


@pytest.mark.parametrize("sign", [1, -1])
def test_steering_is_limited(sign):
    table, _ = bodies({})
    table[0].path_end = 2
    path = path_table(ORIGIN, (Bend(2.0, -1.0 * sign),))  # radius 1 m: sin(slip) would be 2
    table[0].path_end = len(path)
    move(table[0], path, 0.25)
    assert table[0].steering == pytest.approx(sign * atan(2 * tan(asin(0.7))))
    move(table[0], path, 0.0)
    assert table[0].steering == 0.0


def test_actor_follows_its_script_and_boxes_at_rest_stay():
    table, paths = bodies(
        {"speed": 1.0, "script_speed": 4.0, "acceleration": 9.0}, {"kind": BOX, "steering": 0.5}
    )
    step_actor(table[0], NO_SEGMENTS, paths, 0.5)
    assert (table[0].x, table[0].speed, table[0].acceleration) == (2.0, 4.0, 0.0)
    step_actor(table[1], NO_SEGMENTS, paths, 0.5)
    assert table[1].steering == 0.5  # not moved
    table[1].script_speed = 2.0
    step_actor(table[1], NO_SEGMENTS, paths, 0.5)
    assert (table[1].x, table[1].steering) == (1.0, 0.0)
