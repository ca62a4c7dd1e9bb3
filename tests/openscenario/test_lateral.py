"""Changes of lane and of the offset in a lane: positions over time, by hand.

The ego drives 10 m/s along x from s = 100 m; the target stands 60 m ahead. The lanes are 3.5 m wide, so that
lane -1 has its centre at y = -1.75 m and lane 1 at 1.75 m.
"""

from itertools import pairwise
from math import asin, atan, cos, hypot, pi, sin

import pytest
from support.openscenario import (
    START,
    at,
    compiled,
    event,
    lane_position,
    private,
    road,
    road_file,
    scenario,
    speed,
    story,
    teleport,
    vehicle,
)

from lgmd_gym.openscenario.dynamics import read_dynamics
from lgmd_gym.openscenario.nodes import Element, Node


def change(target, shape="linear", dimension="time", value=4.0, offset=""):
    """Return a lane change; `target` is the id of a lane, or a number of lanes to the left as "+1"."""
    kind = "RelativeTargetLane" if isinstance(target, str) else "AbsoluteTargetLane"
    other = 'entityRef="Ego" ' if isinstance(target, str) else ""
    return (
        f"<LateralAction><LaneChangeAction {offset}><LaneChangeActionDynamics dynamicsShape='{shape}' "
        f"dynamicsDimension='{dimension}' value='{value}'/><LaneChangeTarget><{kind} {other}"
        f"value='{target}'/></LaneChangeTarget></LaneChangeAction></LateralAction>"
    )


def lane_offset(
    value, shape="sinusoidal", limit='maxLateralAcc="2"', kind="AbsoluteTargetLaneOffset", more=""
):
    return (
        f"<LateralAction><LaneOffsetAction continuous='false'><LaneOffsetActionDynamics "
        f"dynamicsShape='{shape}' {limit}/><LaneOffsetTarget><{kind} {more} value='{value}'/>"
        "</LaneOffsetTarget></LaneOffsetAction></LateralAction>"
    )


def ego(folder, *actions, roads=None, init=START, time=1):
    events = [event(f"E{number}", action, at(time)) for number, action in enumerate(actions)]
    text = scenario(init, story("Ego", *events))
    found = compiled(folder, text) if roads is None else compiled(folder, text, roads)
    return found.world.movers["Ego"]


@pytest.mark.parametrize(
    ("shape", "quarter", "slope"),
    [
        ("linear", 0.25, 1.0),
        ("cubic", 0.15625, 1.125),
        ("sinusoidal", (1 - cos(pi / 4)) / 2, sin(pi / 4) * pi / 2),
    ],
)
def test_a_lane_change_over_time(tmp_path, shape, quarter, slope):
    """3.5 m within 4 s from 1 s on. The speed of 10 m/s is that along the path, not along the road."""
    mover = ego(tmp_path, change(1, shape))
    assert mover.turns == [(1.0, pytest.approx(5.0))]
    place = mover.place(2.0)
    assert place.y == pytest.approx(-1.75 + 3.5 * quarter, abs=3e-3)
    assert place.heading == pytest.approx(asin(slope * 3.5 / 4.0 / 10.0), abs=2e-3)
    assert mover.place(3.0).y == pytest.approx(0.0, abs=3e-3)
    assert mover.place(9.0).y == pytest.approx(1.75, abs=3e-3)
    assert mover.place(9.0).heading == pytest.approx(0.0, abs=1e-6)
    driven = [mover.place(k / 10) for k in range(91)]
    length = sum(hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(driven))
    assert length == pytest.approx(90.0, abs=1e-2)


def test_a_linear_change_has_the_speed_along_the_path(tmp_path):
    """Along the road, (10² - 0.875²)^0.5 = 9.9616 m/s for 4 s."""
    mover = ego(tmp_path, change(1))
    assert mover.place(5.0).x == pytest.approx(110.0 + 4 * (100 - 0.875**2) ** 0.5, abs=1e-2)


def test_a_lane_change_over_a_distance(tmp_path):
    """3.5 m over 40 m of the lane; halfway, 20 m after x = 110 m, the slope of a cubic is 1.5 · 3.5 / 40."""
    mover = ego(tmp_path, change("+1", "cubic", "distance", 40))
    path = mover.track.at(mover.track.nearest(mover.place(3.0)))
    found = min((mover.place(k / 100) for k in range(200, 500)), key=lambda place: abs(place.x - 130.0))
    assert found.y == pytest.approx(0.0, abs=2e-2)
    assert found.heading == pytest.approx(atan(1.5 * 3.5 / 40), abs=2e-3)
    assert path.x == pytest.approx(mover.place(3.0).x)


@pytest.mark.parametrize(("shape", "peak"), [("linear", 1.0), ("cubic", 1.5), ("sinusoidal", pi / 2)])
def test_a_lane_change_with_a_rate(tmp_path, shape, peak):
    """The rate is the largest lateral speed: 3.5 m with 1 m/s last 3.5 s times the peak of the shape."""
    mover = ego(tmp_path, change(1, shape, "rate", 1.0))
    assert mover.turns == [(1.0, pytest.approx(1.0 + 3.5 * peak))]


def test_offsets_in_the_target_lane(tmp_path):
    mover = ego(tmp_path, change(1, offset='targetLaneOffset="-0.5"'))
    assert mover.place(8.0).y == pytest.approx(1.25, abs=3e-3)


@pytest.mark.parametrize(
    ("action", "end", "y"),
    [
        # π (1 / (2 · 2))^0.5 = 1.5708 s for 1 m with 2 m/s²; (6 / 2)^0.5 = 1.7321 s for a cubic.
        (lane_offset(1), 1 + pi / 2, -0.75),
        (lane_offset(-1, "cubic"), 1 + 3**0.5, -2.75),
        # 2 m to the left of the target in the direction of travel, which stands in the same lane.
        (lane_offset(2, kind="RelativeTargetLaneOffset", more='entityRef="Target"'), 1 + pi / 2**0.5, 0.25),
    ],
)
def test_lane_offsets(tmp_path, action, end, y):
    mover = ego(tmp_path, action)
    assert mover.turns == [(1.0, pytest.approx(end))]
    assert mover.place(8.0).y == pytest.approx(y, abs=3e-3)


def test_a_change_of_speed_during_a_lane_change(tmp_path):
    """From 2 s on the ego brakes with 2 m/s²: at 4 s it has 6 m/s, and still three quarters of the way."""
    events = event("L", change(1), at(1)) + event("B", speed(0, "rate", "linear", 2), at(2))
    mover = compiled(tmp_path, scenario(START, story("Ego", events))).world.movers["Ego"]
    assert mover.place(4.0).y == pytest.approx(-1.75 + 3.5 * 0.75, abs=3e-3)
    assert mover.place(4.0).heading == pytest.approx(asin(0.875 / 6.0), abs=2e-3)


def test_a_lane_change_on_a_curve(tmp_path):
    """A left curve with a radius of 200 m: the lanes have radii of 201.75 and 198.25 m."""
    roads = road_file(road(0, 0, 0, 0, 1000, '<arc curvature="0.005"/>'))
    mover = ego(tmp_path, change(1, "sinusoidal"), roads=roads)
    for time, radius in ((0.5, 201.75), (3.0, 200.0), (8.0, 198.25), (20.0, 198.25)):
        place = mover.place(time)
        assert hypot(place.x, place.y - 200.0) == pytest.approx(radius, abs=6e-3)


def test_initial_offsets_are_positions(tmp_path):
    jump = lane_offset(0.5, "step", "")
    init = private("Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>",
                   jump, speed(10)) + teleport("Target", lane_position(160))  # fmt: skip
    mover = compiled(tmp_path, scenario(init)).world.movers["Ego"]
    assert mover.place(0.0) == pytest.approx((100.0, -1.25, 0.0))
    assert mover.turns == []


def test_relative_lanes_of_oncoming_traffic(tmp_path):
    """One lane to the left of an entity in lane 1, which drives towards -x, is lane -1."""
    entities = vehicle("Ego") + vehicle("Other")
    init = private("Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>",
                   speed(10)) + private("Other", f"<TeleportAction><Position>{lane_position(300, 1)}"
                   "</Position></TeleportAction>", speed(10))  # fmt: skip
    move = event("E", change("+1").replace('"Ego"', '"Other"'), at(1))
    mover = compiled(tmp_path, scenario(init, story("Other", move), entities=entities)).world.movers["Other"]
    assert mover.place(8.0).y == pytest.approx(-1.75, abs=3e-3)
    assert mover.place(8.0).heading % (2 * pi) == pytest.approx(pi)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (change(4), "road 0 has no lane 4 at 110 m; its lanes are -1, 1"),
        (change(1.5), "AbsoluteTargetLane value must be a whole number, got '1.5'"),
        (change(1, value=0.3), "need more than its speed of 10 m/s; give it more time"),
        (change(1, "step"), "a jump of 'Ego' by 3.5 m to the side at 1 s is not supported"),
        (change(1, dimension="distance", value=2000), "the road ends after 890 m, before the action does"),
        (
            change(1, dimension="rate", value=0),
            "LaneChangeActionDynamics value must be > 0 for a rate, got 0",
        ),
        (change(1, value=-1), "LaneChangeActionDynamics value must be >= 0, got -1"),
        (lane_offset(1, limit='maxLateralAcc="0"'), "maxLateralAcc must be > 0 m/s², got 0"),
        (lane_offset(1, limit=""), "a jump of 'Ego' by 1 m to the side"),
    ],
)
def test_invalid_lateral_actions(tmp_path, action, message):
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: .*{message}"):
        ego(tmp_path, action)


def test_an_entity_beyond_the_road(tmp_path):
    with pytest.raises(ValueError, match="'Ego' is at the end of road 0 at 95 s; start earlier"):
        ego(tmp_path, change(1), time=95)


def test_an_entity_across_the_road(tmp_path):
    init = START.replace(
        lane_position(100), lane_position(100).replace("/>", "><Orientation h='1.5'/></LanePosition>")
    )
    with pytest.raises(ValueError, match="'Ego' must drive along a road at 1 s; its heading is across"):
        ego(tmp_path, change(1), init=init)


@pytest.mark.parametrize(
    ("shape", "shares"),
    [("linear", (0.25, 0.5)), ("cubic", (0.15625, 0.5)), ("sinusoidal", ((1 - cos(pi / 4)) / 2, 0.5))],
)
def test_shapes(tmp_path, shape, shares):
    attributes = {"dynamicsShape": shape, "dynamicsDimension": "time", "value": "2"}
    dynamics = read_dynamics(Element(Node("D", attributes, tmp_path, 1), {}))
    assert [dynamics.share(part) for part in (-1, 0, 0.25, 0.5, 1, 2)] == pytest.approx([0, 0, *shares, 1, 1])
