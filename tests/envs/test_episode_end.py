"""End of an episode: every expected value is computed by hand."""

from math import pi

import numpy as np
import pytest
from support.records import bodies, record

from lgmd_gym.envs.dynamics.bodies import ROAD_MARKING
from lgmd_gym.envs.dynamics.episode import EPISODE, is_terminated, is_truncated
from lgmd_gym.envs.dynamics.script import Pose

NO_SEGMENTS = np.zeros((0, 4))
ORIGIN = Pose(0.0, 0.0, 0.0)


def ends(ego, *rows, closed_in=0, touched=0, approached=False):
    table, _ = bodies(ego, *rows)
    episode = record(EPISODE, bodies=len(rows) + 1, closed_in=closed_in, touched=touched)
    return bool(is_terminated(table, episode, approached, 0.1, 0.0)), int(episode.closed_in)


RUNNING = {"speed": 10.0, "script_speed": 10.0}
AHEAD = {"x": 30.0, "speed": 4.0}


def test_contact_and_standstill_end_an_episode():
    assert ends(RUNNING, AHEAD) == (False, 1)
    assert ends(RUNNING, AHEAD, touched=1)[0]
    assert ends({"speed": 0.0, "script_speed": 10.0}, AHEAD)[0]
    assert not ends({"speed": 0.0, "script_speed": 0.0}, AHEAD)[0]  # waits as scripted
    assert not ends({"speed": 0.0, "script_speed": 10.0}, AHEAD, approached=True)[0]
    assert not ends({"speed": 0.001, "script_speed": 10.0}, AHEAD)[0]


@pytest.mark.parametrize(
    ("body", "over"),
    [
        # Passed: more than 2 m between the ego's rear and the actor, 4 m from centre to centre and 2 m.
        ({"x": -6.0}, False),
        ({"x": -6.001}, True),
        ({"x": 6.001}, False),
        ({"x": -6.001, "y": 5.0}, True),
        ({"x": -9.0, "speed": 9.999}, True),
        ({"x": -9.0, "speed": 10.0}, True),
        ({"x": -9.0, "speed": 10.001}, False),  # a faster follower is not passed
    ],
)
def test_actors_that_are_passed(body, over):
    assert ends(RUNNING, body)[0] is over
    assert ends(RUNNING | {"x": 70.0}, body | {"x": 70.0 + body["x"]})[0] is over
    heading = pi / 2
    turned = {"x": 70.0 - body.get("y", 0.0), "y": body["x"] - 30.0, "heading": heading}
    turned["speed"] = body.get("speed", 0.0)
    assert ends(RUNNING | {"x": 70.0, "y": -30.0, "heading": heading}, turned)[0] is over


def test_episode_ends_when_all_actors_are_passed():
    assert not ends(RUNNING, {"x": -9.0}, AHEAD)[0]
    assert ends(RUNNING, {"x": -9.0}, {"x": -19.0})[0]
    assert ends(RUNNING, {"x": -9.0}, AHEAD | {"kind": ROAD_MARKING})[0]
    assert not ends(RUNNING, AHEAD | {"kind": ROAD_MARKING})[0]
    assert not ends(RUNNING)[0]


def test_closing_in_is_remembered():
    """The ego was faster, now the actor is: the threat is over, but only if the ego had closed in."""
    faster = {"x": 30.0, "speed": 10.5}
    assert ends(RUNNING, faster, closed_in=0) == (False, 0)
    assert ends(RUNNING, faster, closed_in=1) == (True, 1)
    assert ends(RUNNING, AHEAD, closed_in=0) == (False, 1)
    assert ends(RUNNING, {"x": 30.0, "speed": 10.0}, closed_in=0) == (False, 0)
    assert ends(RUNNING, {"x": 30.0, "speed": 10.0}, closed_in=1) == (False, 1)
    assert ends(RUNNING, faster | {"segment_end": 1}, closed_in=1)[0] is False  # its script continues
    assert ends(RUNNING, faster | {"path_end": 3}, closed_in=1)[0] is False  # in a bend
    assert ends(RUNNING, faster, AHEAD, closed_in=1)[0] is False
    assert ends(RUNNING, faster, {"x": -9.0}, closed_in=1)[0] is True


def test_crossing_actors_neither_lead_nor_follow():
    """Only the speed along the ego's heading counts: that of a crossing actor is 0."""
    crossing = {"x": 30.0, "y": -20.0, "speed": 15.0, "heading": pi / 2}
    assert ends(RUNNING, crossing) == (False, 1)
    assert not ends(RUNNING, crossing, closed_in=1)[0]
    assert ends(RUNNING, crossing | {"x": -6.001})[0]
    assert not ends(RUNNING, crossing | {"x": -5.9})[0]
    assert not ends(RUNNING, crossing | {"heading": pi / 3}, closed_in=1)[
        0
    ]  # 7.5 m/s along the ego's heading
    assert ends(RUNNING, crossing | {"heading": 0.5}, closed_in=1)[0]  # 13.2 m/s


def test_a_resolved_conflict_ends_an_episode_after_the_follow_up_time():
    standing, _ = bodies({"speed": 0.0, "script_speed": 10.0}, AHEAD)
    creeping, _ = bodies({"speed": 0.1, "script_speed": 10.0}, {"x": 30.0})
    episode = record(EPISODE, bodies=2)

    def decisions(table, count):
        return [bool(is_terminated(table, episode, False, 0.5, 2.0)) for _ in range(count)]

    assert decisions(standing, 3) == [False, False, False]  # 1.5 s
    assert decisions(creeping, 1) == [False]  # the brake was released
    assert decisions(standing, 4) == [False, False, False, True]  # 2 s without a break


def test_duration():
    assert not is_truncated(record(EPISODE, time=9.99, duration=10.0))
    assert is_truncated(record(EPISODE, time=10.0, duration=10.0))
    assert is_truncated(record(EPISODE, time=10.0 - 1e-12, duration=10.0))
