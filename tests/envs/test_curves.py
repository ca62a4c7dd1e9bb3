"""Scenarios in a curve and with a box: places computed by hand, and invalid arguments."""

from math import cos, pi, sin

import pytest

from lgmd_gym.envs.families import make_scenario


@pytest.mark.parametrize(("left", "side"), [(True, 1), (False, -1)])
def test_a_standing_car_is_on_the_arc_of_the_lane(left, side):
    scenario = make_scenario("CCRsCurve", ego_speed=10.0, radius=100.0, left=left)
    (car,) = scenario.actors
    station = (4.3 + 4.023) / 2 + 50.0  # half of both lengths, and 5 s
    angle = station / 100.0
    assert car.gap == pytest.approx(100 * sin(angle) - (4.3 + 4.023) / 2)
    assert car.lateral_offset == pytest.approx(side * 100 * (1 - cos(angle)))
    assert car.heading == pytest.approx(side * angle)
    assert scenario.road.bends == scenario.ego_path


def test_the_curve_begins_after_the_entry():
    scenario = make_scenario("CCRsCurve", ego_speed=10.0, radius=100.0, entry=3.0, lateral_offset=0.5)
    (car,) = scenario.actors
    angle = ((4.3 + 4.023) / 2 + 20.0) / 100.0
    assert scenario.road.distance == scenario.ego_path[0].length == 30.0
    assert car.gap == pytest.approx(30 + (100 - 0.5) * sin(angle) - (4.3 + 4.023) / 2)
    assert car.lateral_offset == pytest.approx(100 - (100 - 0.5) * cos(angle))


def test_oncoming_cars_drive_along_the_oncoming_lane():
    options = {"ego_speed": 10.0, "radius": 200.0, "lateral_offset": 3.5, "oncoming_speed": 20.0}
    for left, radius in ((True, 196.5), (False, 203.5)):
        scenario = make_scenario("CurvePass", left=left, **options)
        stations = [(4.3 + 4.023) / 2 + 30.0 * time for time in (4.0, 5.5, 7.0)]
        for car, station in zip(scenario.actors, stations, strict=True):
            side = 1 if left else -1
            assert car.heading == pytest.approx(side * station / 200 + pi)
            assert car.path[0].curvature == pytest.approx(-side / radius)
            assert car.speed == 20.0


def test_cars_next_to_the_lane_stand_without_an_oncoming_speed():
    scenario = make_scenario("CurvePass", lateral_offset=-3.0)
    assert [(car.speed, car.path) for car in scenario.actors] == [(0.0, ())] * 3


def test_the_box_is_in_the_way_of_the_ego():
    (box,) = make_scenario("StandingBox", ego_speed=10.0, width=0.5, height=0.4, length=1.0).actors
    assert (box.kind, box.gap, box.width, box.height, box.length) == ("box", 50.0, 0.5, 0.4, 1.0)
    make_scenario("StandingBox", width=0.5, lateral_offset=1.09)


@pytest.mark.parametrize(
    ("family", "arguments", "message"),
    [
        ("CCRsCurve", {"ego_speed": 30.0, "radius": 100.0}, "acceleration of 9.0 m/s².*at least 225 m"),
        ("CCRsCurve", {"radius": 3000.0}, r"radius must be in \[15, 2000\] m"),
        ("CCRsCurve", {"lateral_offset": 2.0}, "lateral_offset"),
        ("CCRsCurve", {"entry": 5.0}, r"entry must be in \[0, 4\] s"),
        ("CurvePass", {"lateral_offset": 1.0}, "at least 2.8 m to either side, got 1; CCRsCurve has a car"),
        ("CurvePass", {"oncoming_speed": -1.0}, "oncoming_speed"),
        ("StandingBox", {"width": 0.5, "lateral_offset": 1.2}, "lateral_offset"),
        ("StandingBox", {"height": 0.1}, r"height must be in \[0.2, 4\] m"),
    ],
)
def test_invalid_arguments(family, arguments, message):
    with pytest.raises(ValueError, match=message):
        make_scenario(family, **arguments)
