"""highway-env road networks built from road plans."""

from functools import lru_cache
from math import cos, pi, sin

from highway_env.road.lane import AbstractLane, CircularLane, LineType, StraightLane
from highway_env.road.road import RoadNetwork

from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.script import Pose
from lgmd_gym.envs.families.scenario import LANE_WIDTH, RoadPlan

ROAD_START, ROAD_END = -300.0, 6000.0  # [m], beyond the extent of every scenario
SIDE_ROAD = 250.0  # [m], length of each arm of a side road, and of the straights before and after a curve
Point = tuple[float, float]
NONE, STRIPED, SOLID = LineType.NONE, LineType.STRIPED, LineType.CONTINUOUS_LINE


def road_network(plan: RoadPlan, start: Pose, lane_width: float = LANE_WIDTH) -> RoadNetwork:
    """Return the road network of a plan; straight roads are built once per process.

    Args:
        plan: The road plan.
        start: Initial pose of the ego; curves and crossings are placed relative to it.
        lane_width: Width of the lanes of straight roads [m]; the ego's lane stays where it is.
    """
    if plan.kind == "curve":
        return _curve(plan, start)
    if plan.kind == "crossing":
        return _crossing(plan, start)
    return _straight(plan, lane_width)


@lru_cache(maxsize=48)
def _straight(plan: RoadPlan, width: float) -> RoadNetwork:
    """Return parallel lanes along x; lane 0 is the leftmost, and that of the ego at a fixed y."""
    network, ego_y = RoadNetwork(), plan.ego_lane * LANE_WIDTH

    def add(first: str, last: str, lane: int, x: Point, lines: tuple[int, int]) -> None:
        y = ego_y + (lane - plan.ego_lane) * width
        network.add_lane(first, last, _straight_lane((x[0], y), (x[1], y), *lines, width))

    if plan.kind == "two-way":
        add("end", "start", 0, (ROAD_END, ROAD_START), (STRIPED, SOLID))
        add("start", "end", 1, (ROAD_START, ROAD_END), (NONE, SOLID))
        return network
    for index in range(plan.lanes):
        left = SOLID if index == 0 else STRIPED
        right = SOLID if index == plan.lanes - 1 else NONE
        add("start", "end", index, (ROAD_START, ROAD_END), (left, right))
    return network


def _straight_lane(
    start: Point, end: Point, left: int, right: int, width: float = LANE_WIDTH
) -> StraightLane:
    lines = [left, right]
    return StraightLane(start, end, width=width, line_types=lines, speed_limit=40)  # type: ignore[arg-type]


def _curve(plan: RoadPlan, start: Pose) -> RoadNetwork:
    """Return the ego's lane and an oncoming lane on its left, with straights before and after the arcs."""
    network = RoadNetwork()
    entry = Pose(start.x + plan.distance, start.y, start.heading)
    path = Path(entry, plan.bends)
    stations = [-SIDE_ROAD, 0.0]
    for bend in plan.bends:
        stations.append(stations[-1] + bend.length)
    stations.append(stations[-1] + SIDE_ROAD)
    curvatures = [0.0, *(bend.curvature for bend in plan.bends), 0.0]
    for number, (first, last, curvature) in enumerate(
        zip(stations[:-1], stations[1:], curvatures, strict=True)
    ):
        for offset, left, right in ((0.0, STRIPED, SOLID), (LANE_WIDTH, SOLID, NONE)):
            ends = path.pose(first), path.pose(last)
            lane = _curve_lane(ends, curvature, offset, left, right)
            network.add_lane(f"{number}", f"{number + 1}", lane)
    return network


def _curve_lane(
    ends: tuple[Pose, Pose], curvature: float, offset: float, left: int, right: int
) -> AbstractLane:
    """Return a straight or circular lane between two poses, shifted to the left by `offset` [m]."""
    one, other = ((pose.x + offset * sin(pose.heading), pose.y - offset * cos(pose.heading)) for pose in ends)
    if curvature == 0.0:
        return _straight_lane(one, other, left, right)
    clockwise = curvature < 0.0  # a right turn, in highway-env's axes
    radius = 1.0 / abs(curvature)
    side = 1.0 if clockwise else -1.0
    pose = ends[0]
    centre = [pose.x - side * radius * sin(pose.heading), pose.y + side * radius * cos(pose.heading)]
    angles = [end.heading - side * pi / 2 for end in ends]
    return CircularLane(
        centre,  # type: ignore[arg-type]
        radius + side * offset,
        *angles,
        clockwise=clockwise,
        width=LANE_WIDTH,
        line_types=[left, right],  # type: ignore[arg-type]
        speed_limit=40,
    )


def _crossing(plan: RoadPlan, start: Pose) -> RoadNetwork:
    """Return a two-way road crossed by another one, without lines in the junction."""
    network = RoadNetwork()
    x, right_y, left_y = start.x + plan.distance, start.y, start.y - LANE_WIDTH
    left_x, right_x = x - LANE_WIDTH / 2, x + LANE_WIDTH / 2
    entry, exit_ = x - LANE_WIDTH, x + LANE_WIDTH
    top, bottom = left_y - LANE_WIDTH / 2, right_y + LANE_WIDTH / 2

    def add(name: str, number: int, first: Point, last: Point, left: int, right: int) -> None:
        lines = (NONE, NONE) if number == 1 else (left, right)
        network.add_lane(f"{name}{number}", f"{name}{number + 1}", _straight_lane(first, last, *lines))

    for number, (x0, x1) in enumerate(((ROAD_START, entry), (entry, exit_), (exit_, ROAD_END))):
        add("w", number, (x0, right_y), (x1, right_y), NONE, SOLID)
        add("e", number, (x1, left_y), (x0, left_y), STRIPED, SOLID)
    for number, (y0, y1) in enumerate(((top - SIDE_ROAD, top), (top, bottom), (bottom, bottom + SIDE_ROAD))):
        add("n", number, (left_x, y0), (left_x, y1), STRIPED, SOLID)
        add("s", number, (right_x, y1), (right_x, y0), NONE, SOLID)
    return network
