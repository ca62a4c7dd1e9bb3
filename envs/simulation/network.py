"""highway-env road networks for the road plans."""

from math import cos, pi, sin

from highway_env.road.lane import AbstractLane, CircularLane, LineType, StraightLane
from highway_env.road.road import RoadNetwork

from lgmd_gym.envs.dynamics.path import Path, Pose
from lgmd_gym.envs.scenarios.scenario import LANE_WIDTH, RoadPlan

ROAD_START, ROAD_END = -300.0, 6000.0  # [m], beyond what any scenario drives or sees
SIDE_ROAD = 250.0  # [m] of the road across to either side, and of a curve's way in and out
NONE, STRIPED, SOLID = LineType.NONE, LineType.STRIPED, LineType.CONTINUOUS_LINE


def build_network(plan: RoadPlan, start: Pose) -> RoadNetwork:
    """Return the lanes of a plan.

    Args:
        plan: The road.
        start: The ego's centre at the start; a curve or crossing lies relative to it.
    """
    if plan.kind == "curve":
        return _curve(plan, start)
    if plan.kind == "crossing":
        return _crossing(plan, start)
    return _straight(plan)


def _straight(plan: RoadPlan) -> RoadNetwork:
    """Parallel lanes along x; lane 0 is the leftmost and lies at y = 0."""
    network = RoadNetwork()
    if plan.kind == "two-way":
        network.add_lane("end", "start", _lane(ROAD_END, ROAD_START, 0.0, STRIPED, SOLID))
        network.add_lane("start", "end", _lane(ROAD_START, ROAD_END, LANE_WIDTH, NONE, SOLID))
        return network
    for index in range(plan.lanes):
        left = SOLID if index == 0 else STRIPED
        right = SOLID if index == plan.lanes - 1 else NONE
        network.add_lane("start", "end", _lane(ROAD_START, ROAD_END, index * LANE_WIDTH, left, right))
    return network


def _lane(start: float, end: float, y: float, left: int, right: int) -> StraightLane:
    return _between((start, y), (end, y), left, right)


def _between(start: tuple[float, float], end: tuple[float, float], left: int, right: int) -> StraightLane:
    lines = [left, right]
    return StraightLane(start, end, width=LANE_WIDTH, line_types=lines, speed_limit=40)  # type: ignore[arg-type]


def _curve(plan: RoadPlan, start: Pose) -> RoadNetwork:
    """The ego's lane and one towards it on its left, straight before and after the arcs."""
    network = RoadNetwork()
    entry = Pose(start.x + plan.at, start.y, start.heading)
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
            lane = _piece(ends, curvature, offset, left, right)
            network.add_lane(f"{number}", f"{number + 1}", lane)
    return network


def _piece(ends: tuple[Pose, Pose], curvature: float, offset: float, left: int, right: int) -> AbstractLane:
    """Return a straight or circular lane `offset` metres to the left of the path between two poses."""
    one, other = ((pose.x + offset * sin(pose.heading), pose.y - offset * cos(pose.heading)) for pose in ends)
    if curvature == 0.0:
        return _between(one, other, left, right)
    clockwise = curvature < 0.0  # as highway-env draws it, with y downwards: to the right
    radius = 1.0 / abs(curvature)
    side = 1.0 if clockwise else -1.0
    pose = ends[0]
    centre = [pose.x - side * radius * sin(pose.heading), pose.y + side * radius * cos(pose.heading)]
    phases = [end.heading - side * pi / 2 for end in ends]
    return CircularLane(
        centre,  # type: ignore[arg-type]
        radius + side * offset,
        *phases,
        clockwise=clockwise,
        width=LANE_WIDTH,
        line_types=[left, right],  # type: ignore[arg-type]
        speed_limit=40,
    )


def _crossing(plan: RoadPlan, start: Pose) -> RoadNetwork:
    """A two-way road with another one across it; no lines in the junction."""
    network = RoadNetwork()
    middle, right_lane, left_lane = start.x + plan.at, start.y, start.y - LANE_WIDTH
    before, after = middle - LANE_WIDTH, middle + LANE_WIDTH
    for number, (first, last, lines) in enumerate(
        ((ROAD_START, before, True), (before, after, False), (after, ROAD_END, True))
    ):
        solid, striped = (SOLID, STRIPED) if lines else (NONE, NONE)
        network.add_lane(f"w{number}", f"w{number + 1}", _lane(first, last, right_lane, NONE, solid))
        network.add_lane(f"e{number}", f"e{number + 1}", _lane(last, first, left_lane, striped, solid))
    top, bottom = left_lane - LANE_WIDTH / 2, right_lane + LANE_WIDTH / 2
    for number, (first, last, lines) in enumerate(
        (
            (top - SIDE_ROAD, top, True),
            (top, bottom, False),
            (bottom, bottom + SIDE_ROAD, True),
        )
    ):
        solid, striped = (SOLID, STRIPED) if lines else (NONE, NONE)
        down, up = middle - LANE_WIDTH / 2, middle + LANE_WIDTH / 2
        network.add_lane(
            f"n{number}", f"n{number + 1}", _between((down, first), (down, last), striped, solid)
        )
        network.add_lane(f"s{number}", f"s{number + 1}", _between((up, last), (up, first), NONE, solid))
    return network
