"""Info, reward and surrogate safety measures: every expected value is computed by hand."""

from math import inf, pi

import numpy as np
import pytest
from support.records import bodies, record

from lgmd_gym.envs.dynamics.bodies import (
    BICYCLE,
    BOX,
    CAR,
    EGO_STATE,
    MOTORCYCLE,
    PEDESTRIAN,
    ROAD_MARKING,
    ego_braking,
)
from lgmd_gym.envs.dynamics.brake import BRAKE, BrakeParams
from lgmd_gym.envs.dynamics.episode import EPISODE
from lgmd_gym.envs.dynamics.path import path_table, pose_at
from lgmd_gym.envs.dynamics.script import Pose, arc
from lgmd_gym.envs.info import INFO, write_info
from lgmd_gym.envs.reward import REWARD, RewardParams, step_reward
from lgmd_gym.envs.surrogate_safety import (
    contact_time,
    headway,
    is_approached,
    lead_of,
    rate_to_avoid_crash,
)

WEIGHTS = {"contact": 10.0, "impact": 8.0, "progress": 1.0, "brake": 2.0, "jerk": 0.5, "need_ttc": 4.0}


def info_of(*rows, ego_state=None, **episode):
    """Return the info of bodies, the ego first."""
    table, paths = bodies(*rows)
    info = record(INFO)
    state = record(EGO_STATE, **(ego_state or {"on_script": 1}))
    write_info(table, record(EPISODE, bodies=len(rows), **episode), state, paths, info)
    return info


EGO = {"speed": 10.0}


@pytest.mark.parametrize(
    ("heading", "gap", "closing"),
    [
        (0.0, 20 - 2 - 2, 10 - 4),  # same direction: rear of the lead car, 4 m long
        (pi / 2, 20 - 2 - 1, 10),  # crossing: side of the lead car, 2 m wide
        (pi, 20 - 2 - 2, 10 + 4),  # oncoming
    ],
)
def test_drac_uses_the_speed_along_the_heading_of_the_ego(heading, gap, closing):
    info = info_of(EGO, {"x": 20.0, "heading": heading, "speed": 4.0})
    assert info.gap == pytest.approx(gap)
    assert info.thw == pytest.approx(gap / 10)
    assert info.drac == pytest.approx(closing**2 / (2 * gap))
    assert info.required_deceleration == pytest.approx(closing**2 / (2 * gap))


def test_closing_speed_is_relative_to_the_heading_of_the_ego():
    # Ego and lead car at 90°: the same as both at 0°.
    info = info_of({"speed": 10.0, "heading": pi / 2}, {"y": 20.0, "heading": pi / 2, "speed": 4.0})
    assert info.drac == pytest.approx(36 / 32)


@pytest.mark.parametrize(
    ("acceleration", "required"),
    # DRAC is 6²/(2·16) = 1.125; a lead car that brakes requires more, one that accelerates less, at least 0.
    [(0.0, 1.125), (-3.0, 4.125), (1.0, 0.125), (1.125, 0.0), (2.0, 0.0)],
)
def test_required_deceleration_is_drac_minus_the_acceleration_of_the_lead_car(acceleration, required):
    info = info_of(EGO, {"x": 20.0, "speed": 4.0, "acceleration": acceleration})
    assert info.drac == pytest.approx(1.125)
    assert info.required_deceleration == pytest.approx(required)


def test_info_without_a_body_ahead():
    info = info_of(EGO, {"x": -20.0, "speed": 3.0}, target=1)
    assert (info.gap, info.thw, info.drac, info.required_deceleration, info.ttc) == (inf, inf, inf, inf, inf)
    assert (info.speed, info.ego_speed, info.target_speed) == (10.0, 10.0, 3.0)
    info = info_of(EGO, {"x": -20.0, "speed": 30.0})
    assert (info.gap, info.ttc) == (inf, pytest.approx(16 / 20))  # a contact at the rear


def test_target_speed_is_that_of_the_target():
    marking = {"x": 10.0, "speed": 1.0, "kind": ROAD_MARKING}
    others = ({"x": 30.0, "speed": 3.0}, {"x": 25.0, "speed": 5.0})
    assert info_of(EGO, marking, *others, target=2).target_speed == 3.0
    assert info_of(EGO, marking, *others, target=3).target_speed == 5.0
    info = info_of(EGO, marking)
    assert (info.target_speed, info.gap, info.ttc) == (inf, inf, inf)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        # Oncoming in the ego's lane: contact after (50 - 4) / 10 s.
        ({"x": 50.0, "heading": pi, "speed": 10.0, "kind": CAR}, True),
        ({"x": 50.0, "heading": pi, "speed": 10.0, "kind": MOTORCYCLE}, True),
        ({"x": 50.0, "heading": pi, "speed": 10.0, "kind": PEDESTRIAN}, False),
        ({"x": 50.0, "heading": pi, "speed": 10.0, "kind": BICYCLE}, False),
        ({"x": 50.0, "heading": pi, "speed": 0.0, "kind": CAR}, False),
        ({"x": 50.0, "heading": pi, "speed": 4.5, "kind": CAR}, False),  # more than 10 s away
        ({"x": 50.0, "speed": 10.0, "kind": CAR}, False),  # drives away
        ({"x": 50.0, "y": 2.01, "heading": pi, "speed": 10.0, "kind": CAR}, False),  # the cars are 2 m wide
        ({"x": 1.0, "y": -30.0, "heading": pi / 2, "speed": 10.0, "kind": CAR}, True),  # into the side
        ({"x": 3.1, "y": -30.0, "heading": pi / 2, "speed": 10.0, "kind": CAR}, False),  # past the front
    ],
)
def test_vehicles_that_are_about_to_touch_a_standing_ego(body, expected):
    table, paths = bodies({"speed": 0.0}, {"x": 500.0}, body)
    assert is_approached(table, 3, paths) is expected


@pytest.mark.parametrize("touched", [0, 1])
def test_info_of_a_contact(touched):
    episode = {"touched": touched, "impact_speed": 7.0, "relative_impact_speed": 5.0}
    info = info_of(EGO, {"x": 20.0}, **episode)
    assert (bool(info.collision), bool(info.crashed)) == (touched == 1, touched == 1)
    assert (info.impact_speed, info.relative_impact_speed) == (7.0, 5.0)


def test_deceleration_is_that_beyond_the_script():
    ego = {"speed": 10.0, "acceleration": -5.0, "script_acceleration": -2.0}
    assert info_of(ego, ego_state={"on_script": 0}).deceleration == 3.0
    assert info_of(ego, ego_state={"on_script": 1}).deceleration == 0.0
    table, _ = bodies(ego | {"acceleration": 1.0})
    assert ego_braking(table[0], record(EGO_STATE, on_script=0)) == 0.0


def test_lead_is_the_nearest_solid_body_on_the_path():
    table, paths = bodies(
        EGO,
        {"x": 30.0},
        {"x": 20.0, "kind": BOX},
        {"x": 10.0, "kind": ROAD_MARKING},
        {"x": 12.0, "y": 2.001},  # beside the path: half widths of 1 m each
    )
    assert lead_of(table, 5, paths) == (pytest.approx(16.0), 2)
    assert lead_of(table, 2, paths) == (pytest.approx(26.0), 1)
    table[4].y = 1.999
    assert lead_of(table, 5, paths) == (pytest.approx(8.0), 4)


@pytest.mark.parametrize(("x", "gap"), [(303.999, 299.999), (304.001, inf)])
def test_lead_is_at_most_300_m_away(x, gap):
    table, paths = bodies(EGO, {"x": x})
    assert lead_of(table, 2, paths)[0] == pytest.approx(gap)


@pytest.mark.parametrize(
    ("body", "ttc"),
    [
        ({"x": 20.0, "speed": 4.0}, 16 / 6),
        ({"x": 20.0, "speed": 4.0, "heading": pi}, 16 / 14),
        ({"x": 63.9, "speed": 4.0}, 59.9 / 6),
        ({"x": 64.1, "speed": 4.0}, inf),  # beyond 10 s
        ({"x": 20.0, "speed": 10.0}, inf),
        # Crossing from the right at 5 m/s: its front reaches the ego's side after 3 s, at x = 30 ± 2 m.
        ({"x": 30.0, "y": -18.0, "heading": pi / 2, "speed": 5.0}, 3.0),
        ({"x": 30.0, "y": 18.0, "heading": -pi / 2, "speed": 5.0}, 3.0),
        # At 1 m/s it is still 12 m away when the ego has passed.
        ({"x": 30.0, "y": -18.0, "heading": pi / 2, "speed": 1.0}, inf),
    ],
)
def test_time_to_contact_of_straight_motion(body, ttc):
    table, paths = bodies(EGO, body)
    assert contact_time(table, 2, paths) == pytest.approx(ttc)


def test_time_to_contact_is_the_first_of_all_bodies():
    table, paths = bodies(EGO, {"x": 44.0}, {"x": 24.0}, {"x": 14.0, "kind": ROAD_MARKING}, {"x": 34.0})
    assert contact_time(table, 5, paths) == pytest.approx(2.0)
    assert contact_time(table, 2, paths) == pytest.approx(4.0)


def test_gap_and_time_to_contact_follow_a_bend():
    """A car at rest 40 m along an arc of 50 m radius: 36 m between the bumpers, less where corners meet."""
    arc_table = path_table(Pose(0.0, 0.0, 0.0), (arc(50.0, -1.2),))
    place = pose_at(arc_table, 40.0)
    table, starts = bodies(EGO, dict(zip(("x", "y", "heading"), place, strict=True)))
    table[0].path_end = table[1].path = len(arc_table)
    table[1].path_end = len(arc_table) + 1
    paths = np.concatenate((arc_table, starts[1:]))
    gap, lead = lead_of(table, 2, paths)
    assert (gap, lead) == (pytest.approx(36.0, abs=0.15), 1)
    assert contact_time(table, 2, paths) == pytest.approx(gap / 10, abs=0.01)


def test_headway_and_drac():
    assert headway(30.0, 10.0) == 3.0
    assert headway(30.0, 0.0) == inf
    assert headway(0.0, 10.0) == 0.0
    assert rate_to_avoid_crash(10.0, 6.0) == pytest.approx(1.8)
    assert rate_to_avoid_crash(10.0, 0.0) == 0.0
    assert rate_to_avoid_crash(10.0, -6.0) == 0.0
    assert rate_to_avoid_crash(0.5, 6.0) == pytest.approx(36.0)
    assert rate_to_avoid_crash(0.0, 6.0) == inf


def reward_of(body=(), episode=(), ttc=inf, on_script=0, dt=0.1):
    """Return the reward of a decision of `dt` [s] at 10 m/s with a scripted speed of 20 m/s."""
    brake = record(BRAKE, max_deceleration=8.0)
    table, _ = bodies({"speed": 10.0} | dict(body))
    state = {"bodies": 1, "top_speed": 20.0, "last_speed": 10.0} | dict(episode)
    return step_reward(
        table[0], record(EGO_STATE, on_script=on_script), record(EPISODE, **state), brake,
        record(REWARD, **WEIGHTS), ttc, dt,
    )  # fmt: skip


def test_progress_is_the_mean_speed_over_the_scripted_speed():
    assert reward_of() == pytest.approx(0.1 * 10 / 20)
    assert reward_of(episode={"last_speed": 14.0}) == pytest.approx(0.1 * 12 / 20)
    assert reward_of(dt=0.2) == pytest.approx(0.2 * 10 / 20)
    assert reward_of({"speed": 20.0}, {"last_speed": 20.0}) == pytest.approx(0.1)
    assert reward_of({"speed": 30.0}, {"last_speed": 30.0}) == pytest.approx(0.1)  # limited


@pytest.mark.parametrize("before", [-2.0, 6.0])  # both changes have the size 4
def test_jerk_costs_the_same_in_both_directions(before):
    change = {"acceleration": 2.0, "script_acceleration": 2.0}
    assert reward_of(change, {"last_acceleration": before}) == pytest.approx(0.05 - 0.5 * 4 / 8)


@pytest.mark.parametrize(
    ("speed", "cost"), [(0.0, 0.0), (5.0, 8 / 16), (10.0, 8 / 4), (20.0, 8.0), (30.0, 8.0)]
)
def test_impact_costs_the_square_of_the_relative_impact_speed_up_to_the_scripted_speed(speed, cost):
    contact = {"touched": 1, "relative_impact_speed": speed}
    assert reward_of(episode=contact) == pytest.approx(0.05 - 10.0 - cost)


def test_contact_replaces_the_cost_of_braking():
    braking = {"acceleration": -4.0}
    last = {"last_acceleration": -4.0}
    assert reward_of(braking, last | {"touched": 1}) == pytest.approx(0.05 - 10.0)
    assert reward_of(braking, last | {"touched": 0}) == pytest.approx(0.05 - 2 * 0.1 * 4 / 8)


@pytest.mark.parametrize(("ttc", "cost"), [(3.999, 0.0), (4.0, 0.1), (4.001, 0.1), (inf, 0.1)])
def test_braking_costs_from_the_needed_ttc_on(ttc, cost):
    braking, last = {"acceleration": -4.0}, {"last_acceleration": -4.0}
    assert reward_of(braking, last, ttc) == pytest.approx(0.05 - cost)
    assert reward_of(braking, last, ttc, on_script=1) == pytest.approx(0.05)


def test_the_weakest_braking_costs():
    braking = {"acceleration": -0.08}
    assert reward_of(braking, {"last_acceleration": -0.08}) == pytest.approx(0.05 - 2 * 0.1 * 0.01)


def test_default_weights():
    assert RewardParams().record().tolist() == (10.0, 10.0, 1.0, 2.0, 0.05, 4.0)
    assert RewardParams(jerk=0.0, contact=1e6).record()["contact"] == 1e6
    for value in (-0.001, 1e6 + 1):
        with pytest.raises(ValueError, match=r"jerk must be in \[0, 1000000\]"):
            RewardParams(jerk=value)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("max_deceleration", 0.1, 12), ("max_acceleration", 0, 12), ("latency", 0, 2), ("dead_time", 0, 2),
        ("build_up", 0, 5), ("regain_acceleration", 0, 12),
    ],
)  # fmt: skip
def test_bounds_of_the_brake(name, low, high):
    for value in (low, high):
        assert getattr(BrakeParams(**{name: value}), name) == value
    for value in (low - 0.001, high + 0.001):
        with pytest.raises(ValueError, match=name):
            BrakeParams(**{name: value})


def test_default_brake():
    brake = BrakeParams()
    assert brake.delay == pytest.approx(1 / 30 + 0.1)
    assert brake.jerk == pytest.approx(45.0)
    assert BrakeParams(build_up=0.0).jerk == inf
    assert brake.max_demands(30.0) == 4 + 2
    assert BrakeParams(latency=0.0, dead_time=0.11).max_demands(10.0) == 2 + 2
    values = np.array((9.0, 3.0, 45.0, 4 / 30, 2.0, 1.0))
    assert np.array(brake.record(True).tolist()) == pytest.approx(values)
    assert brake.record(False)["throttle"] == 0.0
