"""Conditions on the lanes around an entity, by hand.

The ego starts at s = 100 m in lane -1 with 10 m/s. Bodies are 4 m long and 2 m wide, with the reference point
in their centre, and the lanes are 3.5 m wide.
"""

from math import sin

import pytest
from support.openscenario import (
    AWAY,
    LANES,
    START,
    STRAIGHT,
    compiled,
    entity_condition,
    event,
    lane_position,
    road,
    road_file,
    scenario,
    story,
)


def clearance(ranges=((0, 0),), ahead=70, behind=20, freespace="false", opposite="false", entities=""):
    inside = "".join(f'<RelativeLaneRange from="{low}" to="{high}"/>' for low, high in ranges)
    return (
        f'<RelativeClearanceCondition distanceForward="{ahead}" distanceBackward="{behind}" '
        f'freeSpace="{freespace}" oppositeLanes="{opposite}">{inside}{entities}</RelativeClearanceCondition>'
    )


def started(folder, condition, init=START, roads=STRAIGHT):
    """Return the time at which the target begins to accelerate; None if it never does."""
    text = scenario(init, story("Target", event("E", AWAY, entity_condition(condition))))
    found = compiled(folder, text, roads).world.movers["Target"].timeline.segments
    return found[0].start if found else None


AHEAD = START  # the target stands 60 m ahead, in the lane of the ego
LEFT = START.replace(lane_position(160), lane_position(160, 1))
BEHIND = START.replace(lane_position(160), lane_position(60))


@pytest.mark.parametrize(
    ("condition", "init", "time"),
    [
        (clearance(ahead=50), AHEAD, 0.0),
        (clearance(), AHEAD, 8.0),  # until it is 20 m behind
        (clearance(freespace="true"), AHEAD, 8.4),  # 20 m between the bodies
        (clearance(((0, 1),)), LEFT, 0.0),  # the opposite lane does not count
        (clearance(((0, 1),), opposite="true"), LEFT, 8.0),
        (clearance(((0, 0),), opposite="true"), LEFT, 0.0),
        (clearance(((1, 1),)), AHEAD, None),  # no such lane without the opposite one
        (clearance(((1, 1),), opposite="true"), AHEAD, 0.0),
        (clearance(((-1, -1),), opposite="true"), AHEAD, None),
        (clearance(behind=50), BEHIND, 1.0),  # behind the start of the ego
        (clearance((), opposite="true"), LEFT, 8.0),  # all lanes
        (clearance(entities='<EntityRef entityRef="Ego"/>'), AHEAD, 0.0),  # the target is not asked for
        (clearance(entities='<EntityRef entityRef="Target"/>'), AHEAD, 8.0),
    ],
)
def test_relative_clearance(tmp_path, condition, init, time):
    found = started(tmp_path, condition, init)
    assert found == (None if time is None else pytest.approx(time, abs=1e-6))


def test_an_entity_against_the_reference_line(tmp_path):
    """The ego drives in lane 1, against the line: the target 60 m ahead of it is at s = 240 m."""
    init = START.replace(lane_position(100), lane_position(300, 1)).replace(
        lane_position(160), lane_position(240, 1)
    )
    assert started(tmp_path, clearance(), init) == pytest.approx(8.0, abs=1e-6)
    left = init.replace(lane_position(240, 1), lane_position(240, -1))
    assert started(tmp_path, clearance(((1, 1),), opposite="true"), left) == pytest.approx(8.0, abs=1e-6)


def test_a_body_between_two_lanes(tmp_path):
    """The centre of the target is in the left lane, and 0.25 m of its body are in the lane of the ego."""
    init = START.replace(lane_position(160), lane_position(160, 1, extra='offset="-1"'))
    assert started(tmp_path, clearance(), init) == pytest.approx(0.0)
    found = started(tmp_path, clearance(freespace="true"), init)
    assert found == pytest.approx(8.4, abs=1e-6)


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        (clearance(((2, 1),)), "RelativeLaneRange from=2 must be <= to=1"),
        (clearance(((0.5, 1),)), "RelativeLaneRange from must be a whole number, got '0.5'"),
        (clearance(ahead=-1), "RelativeClearanceCondition distanceForward must be >= 0 m, got -1"),
    ],
)
def test_invalid_clearances(tmp_path, condition, message):
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: {message}"):
        started(tmp_path, condition)


def turned(angle):
    """Return initial actions with the ego at an angle to the road [rad]."""
    place = f'<LanePosition roadId="0" laneId="-1" s="100"><Orientation type="relative" h="{angle}"/>'
    return START.replace(lane_position(100), f"{place}</LanePosition>")


def test_clearance_needs_a_lane(tmp_path):
    with pytest.raises(ValueError, match=r"case\.xosc:\d+: 'Ego' must drive along a lane at 0 s"):
        started(tmp_path, clearance(), turned(0.5))


def test_off_road(tmp_path):
    """The left edge is 5.25 m to the left of the start: beyond it after 5.25 / (10 sin 0.5) s."""
    leaves = 5.25 / (10.0 * sin(0.5))
    assert started(tmp_path, '<OffroadCondition duration="2"/>', turned(0.5)) == pytest.approx(leaves + 2.0)
    assert started(tmp_path, '<OffroadCondition duration="0"/>', turned(0.5)) == pytest.approx(leaves)
    assert started(tmp_path, '<OffroadCondition duration="2"/>') == pytest.approx(92.0)  # 900 m of road


def test_lanes_without_a_surface_are_off_road(tmp_path):
    """The road ends 1.75 m to the right of the start; the lane of the type none beyond it does not count."""
    outer = '<lane id="-2" type="{}"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>'
    for kind, edge in (("none", 1.75), ("shoulder", 4.75)):
        lanes = LANES.replace("</right>", outer.format(kind))
        roads = road_file(road(0, 0, 0, 0, 1000, lanes=lanes))
        found = started(tmp_path, '<OffroadCondition duration="1"/>', turned(-0.5), roads)
        assert found == pytest.approx(1.0 + edge / (10.0 * sin(0.5)))
