"""Required deceleration in traffic, by hand, and emergencies."""

from math import atan, hypot, inf, pi, sin, tan

import numpy as np
import pytest
from support.traffic import BlockedHighway, run_for

from lgmd_gym.envs.dynamics.bodies import BODY
from lgmd_gym.envs.registration import make_traffic
from lgmd_gym.envs.surrogate_safety import outline_after, required_deceleration
from lgmd_gym.envs.traffic.emergencies import simulate_driver

EGO = {"speed": 20.0, "length": 4.0, "width": 2.0}


def bodies(*records):
    """Return `BODY` records; fields that are not given are 0, sizes 4 m by 2 m."""
    made = np.zeros(len(records), BODY)
    for body, values in zip(made, records, strict=True):
        for name, value in ({"length": 4.0, "width": 2.0} | values).items():
            body[name] = value
    return made


@pytest.mark.parametrize(
    ("gap", "speed", "expected"),
    [
        (20.0, 10.0, 10.0**2 / 40.0),  # DRAC of a slower lead
        (20.0, 0.0, 20.0**2 / 40.0),
        (20.0, 20.0, 0.0),  # does not close
        (20.0, 25.0, 0.0),
        (79.0, 0.0, 20.0**2 / 158.0),  # contact in 3.95 s
        (81.0, 0.0, 0.0),  # in 4.05 s
    ],
)
def test_required_deceleration_of_a_lead_is_drac(gap, speed, expected):
    lead = {"x": gap + 4.0, "speed": speed}
    assert required_deceleration(bodies(EGO, lead)) == pytest.approx(expected)


def test_crossing_car_requires_a_stop_before_the_contact():
    """The car reaches the ego's path after 1 s, 20 m ahead of the ego's front."""
    crossing = {"x": 2.0 + 20.0 + 1.0, "y": 1.0 + 10.0 + 2.0, "heading": -pi / 2, "speed": 10.0}
    assert required_deceleration(bodies(EGO, crossing)) == pytest.approx(20.0 / 2.0)
    early = crossing | {"y": 1.0 + 2.0}  # has cleared the path 0.6 s later
    assert required_deceleration(bodies(EGO, early)) == 0.0
    aside = crossing | {"speed": 0.0}
    assert required_deceleration(bodies(EGO, aside)) == 0.0


def test_highest_requirement_counts_and_contact_is_infinite():
    near, far = {"x": 24.0}, {"x": 44.0}
    alone = required_deceleration(bodies(EGO, near))
    assert required_deceleration(bodies(EGO, far, near)) == alone == pytest.approx(10.0)
    assert required_deceleration(bodies(EGO)) == 0.0
    assert required_deceleration(bodies(EGO, {"x": 3.0})) == inf
    assert required_deceleration(bodies(EGO | {"speed": 0.0}, {"x": 5.0, "heading": pi, "speed": 0.0})) == 0.0


def test_prediction_follows_the_steering_angle():
    """A steered body moves on a circle with a radius of half its length over the sine of its slip."""
    (body,) = bodies(EGO | {"steering": 0.2})
    slip = atan(tan(0.2) / 2)
    radius = 2.0 / sin(slip)
    centre = -radius * sin(slip), radius * np.cos(slip)
    for time in (0.5, 2.0, 4.0):
        place = outline_after(body, time)
        assert hypot(place.x - centre[0], place.y - centre[1]) == pytest.approx(radius)
        assert place.heading == pytest.approx(20.0 * time / radius)
    stationary = {"x": 24.0}
    assert required_deceleration(bodies(EGO | {"steering": 0.2}, stationary)) == 0.0


def test_prediction_equals_the_motion_of_the_road():
    env = make_traffic("roundabout", camera=None)
    env.reset(seed=0)
    for _ in range(300):
        record = env.road.bodies()[0]
        if record["speed"] > 5.0 and abs(record["steering"]) > 0.05:
            break
        env.advance()
    place = outline_after(record, 1 / 30)
    env.road.step(1 / 30)
    assert env.ego.position == pytest.approx([place.x, place.y], abs=0.01)
    assert env.ego.heading == pytest.approx(place.heading, abs=1e-3)


def test_emergency_begins_when_5_m_per_s2_are_required():
    """The driver brakes late for a stationary car 45 m ahead at 25 m/s."""
    env = BlockedHighway()
    env.reset(seed=0)
    (info, *_) = run_for(env, 1 / 30)
    gap, speed = info["gap"], info["ego_speed"]
    assert info["required_deceleration"] == pytest.approx(speed**2 / (2 * gap), rel=1e-6)
    assert info["required_deceleration"] == env.required_deceleration
    found = simulate_driver(env, 1.0)
    assert found.demanding[0] == 1.0
    assert found.contact is not None
    assert found.contact < 4.0
