"""OpenDRIVE roads, routes and positions, by hand."""

from math import pi

import pytest
from support.openscenario import (
    CORNER,
    QUARTER,
    START,
    STRAIGHT,
    element,
    road,
    road_file,
    scenario,
    write,
)

from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.openscenario.bodies import EntityBody
from lgmd_gym.openscenario.motion import Place, Track, section
from lgmd_gym.openscenario.parameters import Catalogs
from lgmd_gym.openscenario.roads import read_roads
from lgmd_gym.openscenario.world import Mover, ScenarioMap

CAR = EntityBody(kind="car", length=4.0, width=2.0, height=1.5, reference=0.0)


def close(place, x, y, heading):
    assert place[:2] == pytest.approx((x, y), abs=1e-9)
    assert place.heading == pytest.approx(heading, abs=1e-12)


def network(folder, text):
    path = folder / "road.xodr"
    path.write_text(text)
    return read_roads(path)


def test_lanes_of_an_arc(tmp_path):
    corner = network(tmp_path, CORNER).road("1")
    close(corner.at(QUARTER / 2), 100 + 10 * 0.5**0.5, 10 - 10 * 0.5**0.5, pi / 4)
    close(corner.at(QUARTER, corner.lane_centre(-1, QUARTER)), 111.75, 10.0, pi / 2)
    assert corner.lane_centre(1, 3.0) == 1.75
    assert (corner.direction(-1), corner.direction(1)) == (1, -1)
    # The right lane has a radius of 11.75 m, driven against the line it turns to the right.
    (bend,) = corner.bends(1, -1.75)
    assert (bend.length, bend.curvature) == pytest.approx((11.75 * pi / 2, 1 / 11.75))
    (bend,) = corner.bends(-1, 1.75)
    assert (bend.length, bend.curvature) == pytest.approx((8.25 * pi / 2, -1 / 8.25))


def test_lane_widths_and_offsets(tmp_path):
    lanes = """<lanes><laneOffset s="0" a="1" b="0" c="0" d="0"/><laneSection s="0">
<right><lane id="-1" type="driving"><width sOffset="0" a="3" b="0.1" c="0" d="0"/></lane>
<lane id="-2" type="driving"><width sOffset="0" a="2" b="0" c="0" d="0"/>
<width sOffset="20" a="4" b="0" c="0" d="0"/></lane></right></laneSection></lanes>"""
    found = network(tmp_path, road_file(road(0, 0, 0, 0, 100, lanes=lanes))).road("0")
    assert found.lane_centre(-1, 10.0) == pytest.approx(1 - 2.0)  # 3 + 0.1 · 10 = 4 m wide
    assert found.lane_centre(-2, 10.0) == pytest.approx(1 - 4 - 1)
    assert found.lane_centre(-2, 20.0) == pytest.approx(1 - 5 - 2)
    with pytest.raises(ValueError, match="unknown lane of road 0 '-3'; did you mean '-2'"):
        found.lane_centre(-3, 0.0)


def test_left_hand_traffic(tmp_path):
    text = STRAIGHT.replace('<road id="0"', '<road rule="LHT" id="0"')
    assert network(tmp_path, text).road("0").direction(-1) == -1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<OpenDRIVE><header/></OpenDRIVE>", "the file has no road"),
        ("<Roads/>", "must begin with OpenDRIVE, got Roads"),
        (road_file(road(0, 0, 0, 0, 9, lanes="<lanes/>")), "a road must have a laneSection"),
        (road_file(road(0, 0, 0, 0, 9), road(0, 0, 9, 0, 9)), "road id '0' is used twice"),
        (road_file(road(0, 0, 0, 0, 9, link="successor:1:middle")), "contactPoint='middle' is not supported"),
        (
            STRAIGHT.replace("\n", "").replace('lane id="-1"', 'lane id="-1.5"'),
            "lane id must be a whole number, got '-1.5'",
        ),
        (road_file(road(0, 0, 0, 0, 9, "<poly3 a='0'/>")), "poly3 in geometry is not supported; use line"),
        (
            STRAIGHT.replace("</planView>", '<geometry s="1000" x="9" y="0" hdg="0" length="1"><line/>')
            .replace("<line/><lanes>", "<line/></geometry></planView><lanes>"),
            "must be continuous",
        ),
    ],
)  # fmt: skip
def test_invalid_roads(tmp_path, text, message):
    with pytest.raises(ValueError, match=rf"road\.xodr:\d+: .*{message}"):
        network(tmp_path, text)


def test_routes_turn_through_junctions(tmp_path):
    roads = network(tmp_path, CORNER)
    assert [(item.name, side) for item, side in roads.route("0", 1, "2")] == [("0", 1), ("1", 1), ("2", 1)]
    assert [(item.name, side) for item, side in roads.route("2", -1, "0")] == [
        ("2", -1), ("1", -1), ("0", -1)
    ]  # fmt: skip
    with pytest.raises(ValueError, match="no way from road 0 to road 2"):
        roads.route("0", -1, "2")


def direct(linked="2"):
    """Return roads 1 and 2 that follow road 0 at a direct junction, without connecting roads."""
    text = road_file(road(0, 0, 0, 0, 100), road(1, 100, 0, 0, 50), road(2, 100, 0, 0, 60))
    end = '<link><successor elementType="junction" elementId="9"/></link>'
    connections = "".join(
        f'<connection id="{other}" incomingRoad="0" linkedRoad="{other}" contactPoint="start"/>'
        for other in ("1", linked)
    )
    junction = f'<junction id="9" type="direct">{connections}</junction></OpenDRIVE>'
    return text.replace("<link></link>", end, 1).replace("</OpenDRIVE>", junction)


def test_direct_junctions(tmp_path):
    roads = network(tmp_path, direct())
    assert [(item.name, side) for item, side in roads.route("0", 1, "2")] == [("0", 1), ("2", 1)]
    assert [(item.name, side) for item, side in roads.route("2", -1, "0")] == [("2", -1), ("0", -1)]
    assert sorted(roads.after("0", "end")) == [("1", "start"), ("2", "start")]
    assert list(roads.after("1", "start")) == [("0", "end")]
    with pytest.raises(ValueError, match=r"road\.xodr:\d+: road 0 or 3 is not at junction 9"):
        network(tmp_path, direct("3"))


# An entity 3 m to the right of road 0 at s = 20 m, 0.1 rad to the left of the road's direction.
HERE = Place(20.0, -3.0, 0.1)


@pytest.fixture
def world(tmp_path):
    path = write(tmp_path, scenario(START), roads=CORNER)
    roads = read_roads(path.with_name("road.xodr"))
    root = element(tmp_path, "<OpenSCENARIO><CatalogLocations/></OpenSCENARIO>")
    mover = Mover("Ego", CAR, track=Track(HERE))
    return ScenarioMap(roads, Catalogs(root), {"Ego": mover})


ROUTE = """<RouteRef><Route name="r" closed="false">
<Waypoint routeStrategy="shortest"><Position><LanePosition roadId="0" laneId="-1" s="40"/></Position>
</Waypoint><Waypoint routeStrategy="shortest"><Position><RoadPosition roadId="2" s="50" t="0"/></Position>
</Waypoint></Route></RouteRef>"""
BACK = ROUTE.replace('roadId="0" laneId="-1" s="40"', 'roadId="2" laneId="1" s="100"').replace(
    'RoadPosition roadId="2" s="50"', 'RoadPosition roadId="0" s="0"'
)
LINE = """<TrajectoryRef><Trajectory name="t" closed="false"><Shape><Polyline>
<Vertex><Position><WorldPosition x="1" y="2"/></Position></Vertex>
<Vertex><Position><WorldPosition x="1" y="7"/></Position></Vertex>
</Polyline></Shape></Trajectory></TrajectoryRef>"""
TURNED = '<Orientation type="relative" h="0.5"/>'
FIXED = '<Orientation h="0.5"/>'
LANE, RIGHT = "FromLaneCoordinates", "FromRoadCoordinates"


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        ('<WorldPosition x="1" y="2" z="9" h="3"/>', (1, 2, 3)),
        ('<RoadPosition roadId="0" s="30" t="2"/>', (30, 2, 0)),
        (f'<RoadPosition roadId="2" s="5" t="2">{TURNED}</RoadPosition>', (108, 15, pi / 2 + 0.5)),
        (f'<RoadPosition roadId="2" s="5" t="2">{FIXED}</RoadPosition>', (108, 15, 0.5)),
        ('<LanePosition roadId="0" laneId="-1" s="30" offset="0.5"/>', (30, -1.25, 0)),
        ('<LanePosition roadId="0" laneId="1" s="30" offset="0.5"/>', (30, 2.25, pi)),
        ('<RelativeLanePosition entityRef="Ego" dLane="0" ds="5"/>', (25, -1.75, 0)),
        ('<RelativeLanePosition entityRef="Ego" dLane="1" ds="5" offset="1"/>', (25, 2.75, pi)),
        ('<RelativeRoadPosition entityRef="Ego" ds="-5" dt="1"/>', (15, -2, 0)),
        ('<RelativeWorldPosition entityRef="Ego" dx="1" dy="2"/>', (21, -1, 0.1)),
        ('<RelativeObjectPosition entityRef="Ego" dx="10" dy="0"/>', (29.95004165278, -2.00166583353, 0.1)),
        (f'<TrajectoryPosition s="2" t="1">{LINE}</TrajectoryPosition>', (0, 4, pi / 2)),
        # The route begins at s = 40 m: 60 m to the corner, a quarter of 15.7 m, then up.
        (
            f'<RoutePosition>{ROUTE}<InRoutePosition><{RIGHT} pathS="{60 + QUARTER + 4}" t="1"/>'
            "</InRoutePosition></RoutePosition>",
            (109, 14, pi / 2),
        ),
        (
            f'<RoutePosition>{ROUTE}<InRoutePosition><{LANE} pathS="10" laneId="-1" laneOffset="0.5"/>'
            "</InRoutePosition></RoutePosition>",
            (50, -1.25, 0),
        ),
        # Back from the end of road 2: its lane 1 is the right lane in the direction of travel.
        (
            f'<RoutePosition>{BACK}<InRoutePosition><{LANE} pathS="30" laneId="-1"/>'
            "</InRoutePosition></RoutePosition>",
            (108.25, 80, -pi / 2),
        ),
    ],
)
def test_positions(tmp_path, world, position, expected):
    found = world.place(element(tmp_path, f"<Position>{position}</Position>"))
    assert found[:2] == pytest.approx(expected[:2], abs=1e-9)
    assert (found.heading - expected[2] + pi) % (2 * pi) == pytest.approx(pi, abs=1e-9)


@pytest.mark.parametrize(
    ("position", "message"),
    [
        ('<RoadPosition roadId="7" s="0" t="0"/>', "unknown road '7'; known: 0, 1, 2"),
        ('<RoadPosition roadId="0" s="0"/>', "RoadPosition needs the attribute 't'"),
        ('<LanePosition roadId="0" laneId="-4" s="0"/>', "unknown lane of road 0 '-4'"),
        ('<WorldPosition x="near" y="0"/>', "WorldPosition x must be a number, got 'near'"),
        ('<RelativeRoadPosition entityRef="Eco" ds="0" dt="0"/>', "unknown entity 'Eco'; did you mean 'Ego'"),
        ('<GeoPosition latitude="0" longitude="0"/>', "GeoPosition in Position is not supported; use Lane"),
    ],
)
def test_invalid_positions(tmp_path, world, position, message):
    with pytest.raises(ValueError, match=rf"part\.xml:\d+: .*({message})"):
        world.place(element(tmp_path, f"<Position>{position}</Position>"))


def shape(text):
    return f'<T><Trajectory name="t" closed="false"><Shape>{text}</Shape></Trajectory></T>'


START_AT = '<PositionStart><WorldPosition x="0" y="0" h="0"/></PositionStart>'


def spline(*parts, start=START_AT):
    inside = ""
    for number, (first, last, length) in enumerate(parts):
        inside += (
            f'<ClothoidSplineSegment curvatureStart="{first}" curvatureEnd="{last}" length="{length}">'
            f"{start if number == 0 else ''}</ClothoidSplineSegment>"
        )
    return shape(f"<ClothoidSpline>{inside}</ClothoidSpline>")


def test_trajectories(tmp_path, world):
    track = world.trajectory(element(tmp_path, spline((0, 0, 5), (0, 0.2, 4), (0.2, 0.2, 3))), None).track
    assert track.bends == (Bend(5.0), Bend(4.0, 0.0, 0.2), Bend(3.0, 0.2))
    close(track.at(5.0), 5, 0, 0)
    assert track.at(12.0).heading == pytest.approx(0.4 + 0.6)  # to the left, straight on afterwards
    assert track.at(20.0).heading == pytest.approx(1.0)
    text = '<Clothoid curvature="0.1" curvaturePrime="-0.01" length="10"><Position>'
    text += '<WorldPosition x="0" y="0"/></Position></Clothoid>'
    assert world.trajectory(element(tmp_path, shape(text)), None).track.bends == (Bend(10.0, 0.1, 0.0),)
    free = world.trajectory(element(tmp_path, spline((0.1, 0.1, 5), start="")), HERE).track
    assert free.start == HERE


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (shape("<Nurbs order='2'/>"), "a Nurbs of order 2 needs at least 2 ControlPoints"),
        (
            spline((0, 0, 5), start="<Other/>").replace("false", "true"),
            "a closed Trajectory is not supported",
        ),
        (spline((0, 0, 5), start=""), "without PositionStart is not supported"),
        (spline((0, 0, -5)), "length must be >= 0 m, got -5"),
        (spline((0, 0, 5)).replace("length=", 'hOffset="1" length='), "hOffset must be 0"),
    ],
)
def test_invalid_trajectories(tmp_path, world, text, message):
    with pytest.raises(ValueError, match=message):
        world.trajectory(element(tmp_path, text), None)


def test_parts_of_bends():
    bend = Bend(10.0, 0.0, 0.2)
    part = section(bend, 2.0, 7.0)
    assert (part.length, part.curvature, part.end_curvature) == pytest.approx((5.0, 0.04, 0.14))
    assert section(bend, -1.0, 99.0) is bend
    assert section(bend, 10.0, 20.0) is None
    track = Track(Place(0.0, 0.0, 0.0), (Bend(5.0), Bend(3.0, 0.1)))
    assert track.part(2.0).bends == (Bend(3.0), Bend(3.0, 0.1))
    assert track.part(-2.0).bends == (Bend(7.0), Bend(3.0, 0.1))
    close(track.part(-2.0).start, -2, 0, 0)
    assert track.part(6.0).bends == (Bend(2.0, 0.1),)
    assert track.part(9.0).bends == ()
    assert track.then(4.0, (Bend(1.0, 0.2),)).bends == (Bend(4.0), Bend(1.0, 0.2))


@pytest.mark.parametrize("distance", [-3.0, 0.0, 2.5, 5.0, 6.5, 8.0, 30.0])
def test_nearest_point_of_a_path(distance):
    track = Track(Place(1.0, 2.0, 0.3), (Bend(5.0), Bend(3.0, 0.1, 0.3)))
    for left in (-1.0, 0.0, 1.0):
        found = track.nearest(track.at(distance, left), low=-10.0)
        assert found == pytest.approx(distance, abs=1e-9)
