"""Ways along lanes, and roads with spirals, polynomials and changing lanes, by hand."""

from math import atan, cos, hypot, pi, sin

import pytest
from support.openscenario import CORNER, QUARTER, STRAIGHT, road, road_file

from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.openscenario.curves import clothoid, fit, nurbs, round_corners
from lgmd_gym.openscenario.motion import Place, Track
from lgmd_gym.openscenario.roads import read_roads
from lgmd_gym.openscenario.ways import follow


def network(folder, text):
    path = folder / "road.xodr"
    path.write_text(text)
    return read_roads(path)


def track_of(way, left=0.0):
    start = way.spans[0].place(0.0, left)
    return Track(start, way.bends(0.0, left, start))


def test_a_clothoid_between_two_poses():
    """The clothoid from (0, 0) with heading 0.2 to its own end is found again."""
    bend = Bend(20.0, 0.01, 0.03)
    start = Place(3.0, -2.0, 0.2)
    end = Track(start, (bend,)).at(20.0)
    found = clothoid(start, end)
    assert (found.length, found.curvature, found.last_curvature) == pytest.approx(
        (20.0, 0.01, 0.03), abs=1e-6
    )
    straight = clothoid(start, start.moved(10.0))
    assert (straight.length, straight.curvature) == pytest.approx((10.0, 0.0))
    assert clothoid(start, start.moved(0.0, 5.0)) is None  # to the side
    assert clothoid(start, start.moved(0.2).turned(0.5)) is None  # tighter than 1 m


def test_fitted_curves_are_close(tmp_path):
    """A parabola: within 2 mm at all places."""
    curve = lambda x: Place(x, x * x / 100, atan(x / 50))  # noqa: E731
    path = Track(curve(-40.0), fit(curve, (-40.0, 40.0)))
    for x in range(-40, 41, 3):
        point = curve(float(x))
        near = path.at(path.nearest(point))
        assert hypot(near.x - point.x, near.y - point.y) < 3e-3
    with pytest.raises(ValueError, match="a corner or a jump to the side near x=5"):
        fit(lambda x: Place(x, 0.0 if x < 5.0 else 9.0, 0.0), (0.0, 10.0))


def test_rounded_corners():
    """A right angle with an arc of 1 m: it passes the corner at 0.41 m, a quarter of 1.57 m long."""
    found = round_corners([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)])
    assert [bend.length for bend in found.bends] == pytest.approx([9.0, pi / 2, 9.0])
    assert [bend.curvature for bend in found.bends] == pytest.approx([0.0, 1.0, 0.0])
    assert found.deviation == pytest.approx(2**0.5 - 1)
    assert found.stations == pytest.approx((0.0, 9.0 + pi / 4, 18.0 + pi / 2))
    # A slight corner has the radius that passes it at 5 cm.
    slight = round_corners([(0.0, 0.0), (50.0, 0.0), (100.0, 10.0)])
    assert slight.deviation == pytest.approx(0.05)
    with pytest.raises(ValueError, match=r"a corner of 3.14 rad at x=5, y=0 is too sharp"):
        round_corners([(0.0, 0.0), (5.0, 0.0), (0.0, 0.0)])
    with pytest.raises(ValueError, match=r"a corner of 1.57 rad at x=0.4, y=0 is too sharp"):
        round_corners([(0.0, 0.0), (0.4, 0.0), (0.4, 0.4)])


def test_corners_between_short_segments():
    """A radius below 1 m, where a segment that is straight at its other end has room in its whole length."""
    short = round_corners([(0.0, 0.0), (0.6, 0.0), (0.6, 0.6)])
    assert [bend.length for bend in short.bends] == pytest.approx([0.6 * pi / 2])
    assert short.bends[0].curvature == pytest.approx(1.0 / 0.6)
    # A straight vertex at (1, 0) leaves the whole 0.8 m after it.
    straight = round_corners([(0.0, 0.0), (1.0, 0.0), (1.8, 0.0), (1.8, 5.0)])
    assert [bend.length for bend in straight.bends] == pytest.approx([1.0, 0.8 * pi / 2, 4.2])
    # A segment between two corners is shared; it has room for 0.5 m and not for less.
    steps = [(0.0, 0.0), (5.0, 0.0), (5.0, 1.0), (10.0, 1.0)]
    assert max(bend.curvature for bend in round_corners(steps).bends) == pytest.approx(2.0)
    with pytest.raises(ValueError, match=r"a corner of 1.57 rad at x=5, y=0 .* at least 0.5 m"):
        round_corners([(0.0, 0.0), (5.0, 0.0), (5.0, 0.98), (10.0, 0.98)])


def test_nurbs_of_a_quarter_circle():
    """The standard example of a circle: weights 1, √½, 1 and order 3."""
    curve = nurbs([(1, 0, 1), (1, 1, 0.5**0.5), (0, 1, 1)], [0, 0, 0, 1, 1, 1], 3)
    for value in (0.0, 0.3, 0.5, 0.9, 1.0):
        place = curve(value)
        assert hypot(place.x, place.y) == pytest.approx(1.0)
    assert curve(0.5).heading == pytest.approx(3 * pi / 4, abs=1e-5)


def test_a_lane_along_a_spiral(tmp_path):
    """Lane 1 is 1.75 m to the left of the line at each distance; the shorter way of a left curve."""
    spiral = road(0, 0, 0, 0, 200, '<spiral curvStart="0" curvEnd="0.01"/>')
    roads = network(tmp_path, road_file(spiral))
    (bend,) = roads.road("0").line.bends
    assert bend == Bend(200.0, 0.0, 0.01)
    lane = Track(roads.road("0").at(0.0, 1.75), roads.road("0").bends(1, 1.75))
    assert lane.length == pytest.approx(200.0 - 1.75 * bend.turn, abs=2e-3)
    for s in (20.0, 100.0, 180.0):
        beside = roads.road("0").at(s, 1.75)
        assert lane.at(lane.nearest(beside)).distance(beside) < 3e-3


def test_param_poly3(tmp_path):
    """u = 100 p, v = 10 p² for p in [0, 1]: it ends at (100, 10) with the slope 0.2."""
    shape = '<paramPoly3 aU="0" bU="100" cU="0" dU="0" aV="0" bV="0" cV="10" dV="0" pRange="normalized"/>'
    length = 100.66205
    roads = network(tmp_path, road_file(road(0, 5, 1, 0, length, shape)))
    line = roads.road("0").line
    assert line.length == pytest.approx(length, abs=1e-2)
    end = line.at(line.length)
    assert (end.x, end.y, end.heading) == pytest.approx((105.0, 11.0, atan(0.2)), abs=1e-6)
    middle = line.at(line.nearest(Place(55.0, 3.5, 0.0)))
    assert (middle.x, middle.y) == pytest.approx((55.0, 3.5), abs=5e-3)
    arc_length = shape.replace("normalized", "arcLength").replace("100", "1").replace("10", "0.001")
    roads = network(tmp_path, road_file(road(0, 0, 0, 0, 100, arc_length)))
    line = roads.road("0").line
    assert line.at(line.length)[:2] == pytest.approx((100.0, 10.0), abs=1e-6)


WIDER = """<lanes><laneOffset s="0" a="0" b="0" c="0" d="0"/><laneSection s="0">
<center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>
<width sOffset="100" a="3" b="0.02" c="0" d="0"/><width sOffset="200" a="5" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes>"""


def test_a_lane_that_widens(tmp_path):
    """From 3 to 5 m between s = 100 and 200 m: its centre moves from -1.5 to -2.5 m, with the slope -0.01."""
    roads = network(tmp_path, road_file(road(0, 0, 0, 0, 300, lanes=WIDER)))
    found = roads.road("0")
    assert found.constant_centre(-1, 0.0, 100.0)
    assert not found.constant_centre(-1, 0.0, 101.0)
    way, chosen = follow(roads, found, 1, 0.0, -1)
    path = track_of(way)
    assert not chosen
    for s, y in ((50.0, -1.5), (150.0, -2.0), (250.0, -2.5)):
        assert path.at(path.nearest(Place(s, y, 0.0))).distance(Place(s, y, 0.0)) < 5e-3
    assert path.at(path.nearest(Place(150.0, -2.0, 0.0))).heading == pytest.approx(-0.01, abs=1e-4)


def test_ways_from_road_to_road(tmp_path):
    """Along x, a quarter circle to the left, and up: lane -1 is 1.75 m to the right."""
    roads = network(tmp_path, CORNER)
    way, chosen = follow(roads, roads.road("0"), 1, 40.0, -1)
    assert [(span.road.name, span.direction, span.lane) for span in way.spans] == [
        ("0", 1, -1), ("1", 1, -1), ("2", 1, -1)
    ]  # fmt: skip
    assert not chosen
    assert way.length == pytest.approx(60.0 + QUARTER + 100.0)
    path = track_of(way)
    assert path.length == pytest.approx(60.0 + 11.75 * pi / 2 + 100.0, abs=1e-6)
    assert path.at(80.0 + 11.75 * pi / 2)[:2] == pytest.approx((111.75, 30.0))
    back, _ = follow(roads, roads.road("2"), -1, 50.0, 1)
    assert [(span.road.name, span.direction, span.lane) for span in back.spans] == [
        ("2", -1, 1), ("1", -1, 1), ("0", -1, 1)
    ]  # fmt: skip
    end = track_of(back).at(50.0 + 8.25 * pi / 2 + 30.0)
    assert end[:2] == pytest.approx((70.0, 1.75))


def test_the_straightest_of_several_roads(tmp_path):
    """Road 0 is followed by an arc and by a straight."""
    fork = road_file(
        road(0, 0, 0, 0, 100),
        road(1, 100, 0, 0, QUARTER, '<arc curvature="0.1"/>', "predecessor:0:end", junction="1"),
        road(2, 100, 0, 0, 50, "<line/>", "predecessor:0:end", junction="1"),
    )
    roads = network(tmp_path, fork)
    way, chosen = follow(roads, roads.road("0"), 1, 0.0, -1)
    assert [span.road.name for span in way.spans] == ["0", "2"]
    assert chosen
    way, _ = follow(roads, roads.road("0"), 1, 0.0, -1, [(roads.road("1"), 1)])
    assert [span.road.name for span in way.spans] == ["0", "1"]


def test_connecting_roads_are_driven_with_their_traffic(tmp_path):
    """A connecting road with right lanes only is no way back."""
    one_way = road(1, 100, 0, 0, 50, "<line/>", "predecessor:0:end successor:2:start", junction="1")
    one_way = one_way.replace(one_way[one_way.index("<left>") : one_way.index("<center>")], "")
    roads = network(tmp_path, road_file(road(0, 0, 0, 0, 100), one_way, road(2, 150, 0, 0, 100)))
    assert [item.name for item, _ in roads.route("0", 1, "2")] == ["0", "1", "2"]
    with pytest.raises(ValueError, match="no way from road 2 to road 0"):
        roads.route("2", -1, "0")


def test_projection_on_a_path(tmp_path):
    roads = network(tmp_path, CORNER)
    line = Track(Place(0.0, 0.0, 0.0), (Bend(100.0), Bend(QUARTER, 0.1), Bend(50.0)))
    for distance in (0.0, 33.3, 100.0, 107.0, 140.0):
        for left in (-3.0, 0.0, 3.0):
            assert line.project(line.at(distance, left)) == pytest.approx(distance, abs=1e-3)
    assert network(tmp_path, STRAIGHT).road("0").joints == ()
    assert roads.road("0").is_open(-1)


def test_links_to_roads_that_do_not_exist(tmp_path):
    roads = network(tmp_path, road_file(road(0, 0, 0, 0, 100, link="successor:7:start")))
    way, chosen = follow(roads, roads.road("0"), 1, 20.0, -1)
    assert (way.length, chosen) == (80.0, False)


def test_ways_and_curves_of_extreme_length(tmp_path):
    """A way ends after 3 km, and a lane with a far id is missing at once."""
    roads = network(tmp_path, road_file(road(0, 0, 0, 0, 1e6)))
    assert follow(roads, roads.road("0"), 1, 0.0, -1)[0].length == 3000.0
    with pytest.raises(ValueError, match="unknown lane of road 0 '1000000000'"):
        roads.road("0").lane_centre(10**9, 0.0)
    with pytest.raises(ValueError, match="a curve needs more than 5000 pieces"):
        fit(lambda x: Place(x, sin(x / 3.0), atan(cos(x / 3.0) / 3.0)), (0.0, 9e5))
