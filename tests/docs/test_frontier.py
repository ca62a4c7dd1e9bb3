"""The last decision at which full braking avoids a contact, against values computed by hand."""

from math import atan, degrees

import pytest
from support.examples import load

from lgmd_gym.benchmark.case import make_case
from lgmd_gym.camera import Camera

frontier = load("frontier").frontier

KMH = 1 / 3.6


@pytest.mark.parametrize("kmh", [20, 50, 80])
def test_stationary_car(kmh):
    """Stopping takes latency 1/30 s, dead time 0.1 s, a ramp of 0.2 s to 9 m/s², and full braking."""
    speed = kmh * KMH
    item = frontier(_case("CCRs", speed))
    ramp = speed * 0.2 - 9.0 * 0.2**2 / 6  # distance in the ramp [m]
    left = speed - 9.0 * 0.1
    distance = speed * (1 / 30 + 0.1) + ramp + left**2 / 18.0
    # The decision is the last one in steps of 1/30 s.
    assert distance <= item.time_left * speed + 1e-6
    assert item.time_left * speed < distance + 2.0 * speed / 30
    assert item.avoidable
    assert item.view.bearing_deg == pytest.approx(0.0, abs=1e-9)
    lens = item.view.distance - 4.023 / 2  # to the rear of the target, 1.7 m behind the bumper
    assert lens == pytest.approx(distance + 1.7, abs=2.0 * speed / 30)
    assert item.view.width_deg == pytest.approx(2 * degrees(atan(0.856 / lens)))
    grown = 2 * degrees(atan(0.856 / lens) - atan(0.856 / (lens + speed / 30)))
    assert item.growth_deg_s == pytest.approx(30 * grown)
    wide = Camera.make("wide")
    assert item.growth_px(wide) == pytest.approx(grown * wide.pixels_per_degree)
    assert item.drift_deg_s == pytest.approx(0.0, abs=1e-9)
    assert item.view.pixels > 20
    assert item.seen_s > 3.0


def _case(family, speed, **arguments):
    return make_case("test", family, "a", ego_speed=speed, **arguments)


def test_oncoming_cars_cannot_be_avoided():
    item = frontier(_case("CCFhos", 50 * KMH))
    assert not item.avoidable
    # The ego stops just before the contact: it needs 1.77 s and 13.4 m, in which the target covers 24.6 m.
    speed = 50 * KMH
    stop = 1 / 30 + 0.1 + 0.2 + (speed - 0.9) / 9.0
    way = speed * (1 / 30 + 0.1 + 0.2) - 9.0 * 0.2**2 / 6 + (speed - 0.9) ** 2 / 18.0
    assert item.time_left == pytest.approx((way + speed * stop) / (2 * speed), abs=2 / 30)


def test_no_contact_no_frontier():
    assert frontier(_case("EmptyRoad", 20.0)) is None


def test_a_crossing_motorcycle_is_beside_the_image():
    item = frontier(_case("CMCscp", 30 * KMH, target_speed=60 * KMH, side="left"))
    assert item.view.bearing_deg < -45.0
    assert (item.view.pixels, item.view.contrast, item.seen_s) == (0, 0.0, 0.0)


def test_a_child_behind_parked_cars_is_seen_late():
    hidden, plain = (frontier(_case(family, 30 * KMH)) for family in ("CPNCO", "CPFA"))
    assert hidden.seen_s < 1.5 < 3.0 < plain.seen_s
    assert hidden.view.bearing_deg > 0.0 > plain.view.bearing_deg
