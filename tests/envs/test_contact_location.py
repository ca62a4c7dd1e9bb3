"""Where and when the ego meets the target without braking, in every family of the protocols with a contact.

The points are those of the protocols, written down here anew: no function of the scenario families is used.
"""

from math import cos, sin

import numpy as np
import pytest
from support.contacts import ADULT_HIP, CHILD_HIP, CRANK, Contact
from support.contacts import EGO_LENGTH as LENGTH
from support.contacts import EGO_WIDTH as WIDTH

from lgmd_gym.envs import BrakingEnv, make_scenario

KMH = 1 / 3.6


def contact_of(family, arguments):
    return Contact(make_scenario(family, **arguments))


def kmh(**speeds):
    return {name: value * KMH for name, value in speeds.items()}


CROSSING = [
    *(
        ("CPNA", {"impact_location": at} | kmh(ego_speed=v), ADULT_HIP)
        for at in (0.25, 0.75)
        for v in (10, 60)
    ),
    ("CPNA", {"child": True} | kmh(ego_speed=42), CHILD_HIP),
    *(("CPFA", {"impact_location": at} | kmh(ego_speed=35), ADULT_HIP) for at in (0.1, 0.5, 0.9)),
    *(("CPNCO", {"impact_location": at} | kmh(ego_speed=20), CHILD_HIP) for at in (0.25, 0.5)),
    *(("CBNA", {"impact_location": at} | kmh(ego_speed=50), CRANK) for at in (0.1, 0.5)),
    ("CBNA", {"obstructed": False} | kmh(ego_speed=40), CRANK),
    ("CBNAO", {"impact_location": 0.75} | kmh(ego_speed=10), CRANK),
    *(("CBFA", {"impact_location": at} | kmh(ego_speed=60), CRANK) for at in (0.25, 0.5)),
    ("CPRA", kmh(ego_speed=4), ADULT_HIP),
    ("CPRA", {"child": True} | kmh(ego_speed=8), CHILD_HIP),
]


@pytest.mark.parametrize(("family", "arguments", "point"), CROSSING)
def test_crossing_road_users(family, arguments, point):
    """The target's side is at the ego's front, and its impact point at the impact location, after 5 s."""
    contact = contact_of(family, arguments)
    _, across = contact.from_front(point, 0.0)
    assert contact.touched
    assert across == pytest.approx((arguments.get("impact_location", 0.5) - 0.5) * WIDTH, abs=0.001)
    from_left = contact.target.heading > 0.0
    side = contact.target.WIDTH / 2
    near, _ = contact.from_front(0.0, -side if from_left else side)
    assert near == pytest.approx(0.0, abs=0.001)
    assert contact.travelled / contact.ego.speed == pytest.approx(5.0, abs=0.001)
    assert contact.info["impact_speed"] == pytest.approx(arguments["ego_speed"])


@pytest.mark.parametrize(
    ("family", "arguments", "slower"),
    [
        ("CPLA", {"impact_location": 0.25} | kmh(ego_speed=65), 5),
        ("CPLA", {"impact_location": 0.9, "walking_speed": 0.0} | kmh(ego_speed=10), 0),
        ("CBLA", {"impact_location": 0.5} | kmh(ego_speed=25), 15),
        ("CMRs", {"impact_location": 0.1} | kmh(ego_speed=80), 0),
        ("CPRA", {"moving": False, "impact_location": 0.75} | kmh(ego_speed=8), 0),
    ],
)
def test_road_users_along_the_path(family, arguments, slower):
    contact = contact_of(family, arguments)
    rear, across = contact.from_front(-contact.target.LENGTH / 2, 0.0)
    assert rear == pytest.approx(0.0, abs=0.001)
    assert across == pytest.approx((arguments["impact_location"] - 0.5) * WIDTH, abs=0.001)
    assert contact.info["relative_impact_speed"] / KMH == pytest.approx(arguments["ego_speed"] / KMH - slower)


def test_motorcycle_brakes_ahead():
    """At 1 s and 4 m/s² within 1 s from 50 km/h, contact is 13.9 m + v·t after s(t) of the motorcycle."""
    contact = contact_of("CMRb", {"headway": 1.0, "impact_location": 0.75} | kmh(ego_speed=50))
    rear, across = contact.from_front(-2.08 / 2, 0.0)
    assert (rear, across) == (pytest.approx(0.0, abs=0.001), pytest.approx(0.45, abs=0.001))
    # After 0.5 s the braking equals one of 4 m/s² at once, apart from 1/24·4 m that are lost in the ramp.
    speed, time = 50 * KMH, contact.travelled / (50 * KMH) - 3.0
    lost = 4.0 / 2 * (time - 0.5) ** 2 + 4.0 / 24
    assert lost == pytest.approx(speed * 1.0, abs=0.01)


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
@pytest.mark.parametrize("speeds", [(20, 60), (60, 20), (40, 40)])
def test_motorcycle_strikes_the_side(side, sign, speeds):
    contact = contact_of("CMCscp", {"side": side} | kmh(ego_speed=speeds[0], target_speed=speeds[1]))
    ahead, across = contact.from_front(2.08 / 2, 0.0)
    assert ahead == pytest.approx(-0.1 * LENGTH, abs=0.001)
    assert across == pytest.approx(sign * WIDTH / 2, abs=0.001)
    assert contact.info["collision"]


@pytest.mark.parametrize("location", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("speeds", [(30, 50), (100, 100)])
def test_head_on_in_the_lane(location, speeds):
    contact = contact_of(
        "CCFhos", {"impact_location": location} | kmh(ego_speed=speeds[0], target_speed=speeds[1])
    )
    ahead, across = contact.from_front(4.023 / 2, 0.0)
    assert ahead == pytest.approx(0.0, abs=0.001)
    assert across == pytest.approx((location - 0.5) * WIDTH, abs=0.001)
    assert contact.info["relative_impact_speed"] / KMH == pytest.approx(sum(speeds))


@pytest.mark.parametrize(("speed", "length", "gap"), [(50, 44.0, 13.9), (70, 60.0, 19.4)])
def test_head_on_after_a_lane_change(speed, length, gap):
    arguments = {"change_length": length, "following_distance": gap} | kmh(ego_speed=speed)
    contact = contact_of("CCFhol", arguments)
    ahead, across = contact.from_front(4.023 / 2, 0.0)
    assert (ahead, across) == (pytest.approx(0.0, abs=0.001), pytest.approx(0.0, abs=0.001))
    made = make_scenario("CCFhol", **arguments)
    target, overtaken = made.actors
    # The overtaken car drives ahead of the target, whose front is at `gap`.
    assert target.gap - (overtaken.gap + overtaken.length) == pytest.approx(gap)
    straight, *shift = target.path
    end = (straight.length + sum(bend.length for bend in shift)) / (speed * KMH)
    assert contact.travelled / (speed * KMH) - end == pytest.approx(1.5, abs=0.001)
    assert sum(bend.length for bend in shift) == pytest.approx(length)


@pytest.mark.parametrize("speed", [10, 15, 20, 25])
@pytest.mark.parametrize(("family", "width"), [("CCFtap", 1.712), ("CMFtap", 0.79)])
@pytest.mark.parametrize("target_speed", [30, 80])
def test_turns_across_the_path(family, width, speed, target_speed):
    """The near corner of the target's front, on its left, meets the middle of the ego's front."""
    contact = contact_of(family, kmh(ego_speed=speed, target_speed=target_speed))
    corner = contact.from_front(contact.target.LENGTH / 2, width / 2)
    assert corner == (pytest.approx(0.0, abs=0.002), pytest.approx(0.0, abs=0.005))
    assert contact.info["impact_speed"] / KMH == pytest.approx(speed)
    assert contact.target.position[1] == pytest.approx(
        -3.5 + 3.5, abs=1e-9
    )  # lane 0, the ego starts in lane 1


@pytest.mark.parametrize("direction", ["same", "opposite"])
@pytest.mark.parametrize(("speed", "left"), [(10, True), (15, True), (20, True), (10, False)])
def test_turns_towards_a_pedestrian(speed, left, direction):
    """The hip is on the ego's centreline, and the nearest corner of the pedestrian at the ego's front."""
    contact = contact_of("CPTA", {"left": left, "direction": direction} | kmh(ego_speed=speed))
    _, across = contact.from_front(ADULT_HIP, 0.0)
    assert across == pytest.approx(0.0, abs=0.005)
    corners = [contact.from_front(x * 0.3, y * 0.25) for x in (-1, 1) for y in (-1, 1)]
    assert min(ahead for ahead, _ in corners) == pytest.approx(0.0, abs=0.002)
    # 9.5 m beside the centre line of the ego's road, which is half a lane to the left of the ego.
    line = 9.5 + 1.75 if left else -9.5 + 1.75
    assert 3.5 - contact.target.position[1] == pytest.approx(line)


def test_turning_ego_follows_the_clothoids_with_its_front_axle():
    """Radius and angles of the turn at 10 km/h: 9 m, 20.62° and 48.76° (Euro NCAP)."""
    env = BrakingEnv(make_scenario("CCFtap", **kmh(ego_speed=10, target_speed=30)))
    env.reset(seed=0)
    places, ended = [], False
    while not ended:
        places.append(env.ego.position + 2.67 / 2 * np.array([cos(env.ego.heading), sin(env.ego.heading)]))
        _, _, ended, _, _ = env.step([0.0])
    x, y = np.array(places).T
    heading = np.arctan2(np.diff(y), np.diff(x))
    curvature = -np.diff(heading) / np.hypot(np.diff(x), np.diff(y))[1:]
    assert curvature.max() == pytest.approx(1 / 9, rel=0.01)
    assert curvature[:50] == pytest.approx(np.zeros(50), abs=1e-6)
