"""Trajectories: corners, times, NURBS, and jumps of the speed, by hand."""

from math import cos, hypot, sin

import pytest
from support.openscenario import (
    START,
    at,
    compiled,
    event,
    lane_position,
    private,
    scenario,
    speed,
    story,
    teleport,
    world_position,
)

from lgmd_gym.openscenario.motion import Place, Timeline


def follow(shape, timing="<None/>"):
    return (
        '<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name="t" closed="false"><Shape>'
        f"{shape}</Shape></Trajectory></TrajectoryRef><TimeReference>{timing}</TimeReference>"
        '<TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction></RoutingAction>'
    )


def polyline(*points):
    """Return a polyline of (x, y) or (x, y, time)."""
    vertices = ""
    for x, y, *time in points:
        stamp = f'time="{time[0]}"' if time else ""
        vertices += f'<Vertex {stamp}><Position><WorldPosition x="{x}" y="{y}"/></Position></Vertex>'
    return f"<Polyline>{vertices}</Polyline>"


TIMING = '<Timing domainAbsoluteRelative="{}" scale="{}" offset="{}"/>'


def target(folder, action, init="", time=None):
    """Return the target after an initial action, or after an event at a time."""
    events = "" if time is None else story("Target", event("E", action, at(time)))
    start = private("Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>",
                    speed(10))  # fmt: skip
    own = private("Target", action) if time is None else init
    return compiled(folder, scenario(start + own, events))


def test_a_corner_where_a_trajectory_begins(tmp_path):
    """The ego turns by 0.2 rad at s = 110 m, at 1 s: it follows the line within 0.1 m and has its heading."""
    start = private(
        "Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>", speed(10)
    )
    line = follow(polyline((110, -1.75), (110 + 50 * cos(0.2), -1.75 + 50 * sin(0.2))))
    found = compiled(
        tmp_path,
        scenario(start + teleport("Target", lane_position(900)), story("Ego", event("E", line, at(1)))),
    )
    mover = found.world.movers["Ego"]
    assert mover.place(1.0).heading == pytest.approx(0.0)
    line = Place(110.0, -1.75, 0.2)
    beside = [mover.place(1.0 + 0.05 * step).seen_from(line).y for step in range(60)]
    assert max(map(abs, beside)) < 0.1
    seen = mover.place(4.0).seen_from(line)
    assert seen == pytest.approx((30.0, 0.0, 0.0), abs=0.02)
    assert any("the path of 'Ego' has a corner of 0.2 rad, which is rounded" in note for note in found.notes)
    wide = follow(polyline((110, -1.75), (110 + 50 * cos(0.6), -1.75 + 50 * sin(0.6))))
    with pytest.raises(ValueError, match="'Ego' is not on its path at 1 s"):
        compiled(tmp_path, scenario(START, story("Ego", event("E", wide, at(1)))))


def test_a_polyline_with_a_corner(tmp_path):
    """20 m along x and up: the corner is an arc of 1 m, which is 0.43 m shorter."""
    found = target(tmp_path, follow(polyline((0, 50), (20, 50), (20, 80))) + "", None)
    mover = found.world.movers["Target"]
    assert mover.place(0.0)[:2] == (0.0, 50.0)
    assert mover.track.at(19.0)[:2] == pytest.approx((19.0, 50.0))
    assert mover.track.at(18.0 + 1.5707963 + 11.0)[:2] == pytest.approx((19.0 + 1.0, 60.5707963), abs=1.1)
    assert any("rounded; the path passes them at 0.41 m" in note for note in found.notes)


def test_times_of_vertices(tmp_path):
    """10 m in 2 s, 10 m in 4 s, 20 m in 2 s: 5, 2.5 and 10 m/s with short ramps around 2 and 6 s."""
    shape = polyline((0, 50, 0), (10, 50, 2), (20, 50, 6), (40, 50, 8))
    mover = target(tmp_path, follow(shape, TIMING.format("absolute", 1, 0))).world.movers["Target"]
    for time, x in ((0, 0), (1, 5), (4, 15), (7, 30), (8, 40)):
        assert mover.place(time).x == pytest.approx(x, abs=1e-6)
    # Halfway in a ramp with 12 m/s², the distance deviates by change² / 12 / 8.
    assert mover.place(2.0).x == pytest.approx(10.0 - 2.5**2 / 96, abs=1e-6)
    assert mover.timeline.at(1.0).speed == 5.0


def test_scale_offset_and_domain_of_times(tmp_path):
    """From 2 s on with half of the speed: 10 m in 4 s."""
    stand = teleport("Target", world_position(0, 50))
    shape = polyline((0, 50, 0), (10, 50, 2))
    relative = follow(shape, TIMING.format("relative", 2, 0))
    mover = target(tmp_path, relative, stand, 2).world.movers["Target"]
    assert mover.place(4.0).x == pytest.approx(5.0)
    assert mover.place(6.0).x == pytest.approx(10.0)
    absolute = follow(shape, TIMING.format("absolute", 1, 2))
    mover = target(tmp_path, absolute, stand, 2).world.movers["Target"]
    assert mover.place(3.0).x == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("shape", "timing", "message"),
    [
        (polyline((0, 50, 1), (9, 50, 2)), TIMING.format("absolute", 1, 0), "begins at 1 s, after its"),
        (polyline((0, 50, 0), (9, 50, 0)), TIMING.format("absolute", 1, 0), "times of the vertices"),
        (polyline((0, 50, 0), (9, 50, 2)), TIMING.format("absolute", 0, 0), "scale must be > 0, got 0"),
        (polyline((0, 50, 0), (9, 50)), "<None/>", "every Vertex of a Polyline must have a time, or none"),
        (polyline((0, 50, 0), (1, 50, 0.5), (30, 50, 1)), TIMING.format("absolute", 1, 0),
         "changes by 56 m/s at 0.5 s, which needs more than 12 m/s²"),
        (polyline((0, 50)), "<None/>", "needs at least 2 vertices"),
        (polyline((0, 50), (0, 50)), "<None/>", "must be apart"),
    ],
)  # fmt: skip
def test_invalid_times(tmp_path, shape, timing, message):
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: .*{message}"):
        target(tmp_path, follow(shape, timing))


def test_a_stated_heading_beside_the_direction_of_travel(tmp_path):
    shape = polyline((0, 50), (20, 50)).replace('y="50"', 'y="50" h="1.5"', 1)
    found = target(tmp_path, follow(shape))
    assert any("the heading of a Vertex is 1.5 rad beside the direction" in note for note in found.notes)


def test_nurbs(tmp_path):
    """A quarter of a circle of 30 m around (0, 50)."""
    points = "".join(
        f'<ControlPoint weight="{w}"><Position><WorldPosition x="{x}" y="{y}"/></Position></ControlPoint>'
        for x, y, w in ((30, 50, 1), (30, 80, 0.5**0.5), (0, 80, 1))
    )
    knots = "".join(f'<Knot value="{value}"/>' for value in (0, 0, 0, 1, 1, 1))
    mover = target(tmp_path, follow(f'<Nurbs order="3">{points}{knots}</Nurbs>')).world.movers["Target"]
    assert mover.track.length == pytest.approx(30.0 * 3.14159265 / 2, abs=5e-3)
    for distance in (10.0, 25.0, 40.0):
        place = mover.track.at(distance)
        assert hypot(place.x, place.y - 50.0) == pytest.approx(30.0, abs=3e-3)


def test_a_straight_trajectory_lasts_until_its_end(tmp_path):
    """The ego follows 30 m straight on from 1 s on, and then accelerates: at 4 s."""
    ahead = follow(
        '<Clothoid curvature="0" curvaturePrime="0" length="30"><Position><RelativeObjectPosition '
        'entityRef="Ego" dx="0" dy="0"/></Position></Clothoid>'
    )
    then = speed(12, "rate", "linear", 2)
    trigger = at(0).replace(
        '<SimulationTimeCondition value="0" rule="greaterThan"/>',
        '<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="A" '
        'state="completeState"/>',
    )
    text = scenario(START, story("Ego", event("A", ahead, at(1)), event("B", then, trigger)))
    (segment,) = compiled(tmp_path, text).world.movers["Ego"].timeline.segments
    assert segment.start == pytest.approx(4.0)


def test_a_jump_of_the_speed():
    """From 10 to 4 m/s at 5 s: 0.5 s with 12 m/s² around it; the distance afterwards is that of a jump."""
    timeline = Timeline(10.0)
    assert timeline.jump(5.0, 4.0) == pytest.approx(5.25)
    assert timeline.at(4.75).speed == 10.0
    assert timeline.at(6.0).distance == pytest.approx(54.0)
    # Not before the end of the previous change, at 6 s.
    timeline = Timeline(10.0)
    timeline.change(5.0, 2.0, 12.0)
    assert timeline.jump(6.0, 0.0) == pytest.approx(7.0)


def test_a_jump_in_a_file(tmp_path):
    found = compiled(tmp_path, scenario(START, story("Target", event("E", speed(3), at(2)))))
    assert found.world.movers["Target"].place(4.0).x == pytest.approx(166.0)
    assert any("the speed of 'Target' jumps by 3 m/s at 2 s; here it changes within 0.25 s" in note
               for note in found.notes)  # fmt: skip


@pytest.mark.parametrize(("shape", "amount", "lasts"), [("cubic", 3, 3.0), ("sinusoidal", 3, 3.14159265)])
def test_a_change_of_speed_with_a_shape(tmp_path, shape, amount, lasts):
    """6 m/s with a largest acceleration of 3 m/s²: 1.5 · 6 / 3 s, or π / 2 · 6 / 3 s; half at half time."""
    text = scenario(START, story("Target", event("E", speed(6, "rate", shape, amount), at(1))))
    timeline = compiled(tmp_path, text).world.movers["Target"].timeline
    assert timeline.at(1.0 + lasts / 2).speed == pytest.approx(3.0)
    assert timeline.at(1.0 + lasts).speed == pytest.approx(6.0)
    assert timeline.at(1.0 + lasts).distance == pytest.approx(3.0 * lasts)
