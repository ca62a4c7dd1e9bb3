"""Routing actions: trajectories, with and without times, routes and positions to reach."""

from itertools import accumulate
from math import cos, remainder, tau

from lgmd_gym.envs.dynamics.path import rear_axle_path
from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.openscenario.curves import fit
from lgmd_gym.openscenario.motion import Place, Track
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.roads import Road
from lgmd_gym.openscenario.trajectories import action_times
from lgmd_gym.openscenario.ways import follow
from lgmd_gym.openscenario.world import Mover, ScenarioMap, carry_over, lane_at

ON_PATH = 0.1  # [m] from a path within which an entity can begin to follow it
CORNER = 0.5  # [rad] beside the heading of a path up to which an entity can begin to follow it
_SMOOTH = 0.045  # [rad], corner above which the path is rounded
_ROOM = 5.0  # [m] of a path for the rounding of a corner at its start


def follow_trajectory(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Let an entity follow a trajectory from its start, or from where it is."""
    item.child("TrajectoryFollowingMode").choice("followingMode", ("follow", "position"))
    reference = item if item.find("Trajectory", "CatalogReference") else item.child("TrajectoryRef")
    current = None if mover.track is None else mover.place(time)
    trajectory = world.trajectory(reference, current, time)
    world.notes.extend(note for note in trajectory.notes if note not in world.notes)
    track, times = trajectory.track, action_times(item, trajectory, time)
    offset = item.number("initialDistanceOffset", 0.0)
    if mover.front_axle:
        base = mover.body.wheelbase
        if base == 0.0:
            raise item.error(f"the front axle of {mover.name!r} cannot be its control point without Axles")
        if times:
            raise item.error(
                "a trajectory with times is not supported for the front axle; use TimeReference None"
            )
        track = Track(track.start.moved(-base), rear_axle_path(track.bends, base))
    if times:
        return _follow_times(item, mover, world, time, track, times)
    if time == 0.0:
        mover.track, mover.start, mover.follows = track.part(offset), track.at(offset), True
        mover.replan = mover.way = None
        _continue_lane(mover, world, track.length - offset)
        return mover.timeline.time_of(track.length - offset) if track.bends else time
    begin = track.nearest(mover.place(time)) if offset == 0.0 else offset
    _continue(item, mover, world, time, track.part(begin))
    end = mover.timeline.at(time).distance + track.length - begin
    _continue_lane(mover, world, end)
    return mover.timeline.time_of(end)


def _follow_times(
    item: Element,
    mover: Mover,
    world: ScenarioMap,
    time: float,
    track: Track,
    times: tuple[tuple[float, float], ...],
) -> float:
    """Let an entity follow a trajectory with times, from its start or from where it should be."""
    if times[0][0] > time + 1e-6:
        raise item.error(
            f"the trajectory of {mover.name!r} begins at {times[0][0]:.4g} s, after its action at "
            f"{time:.4g} s; start the action at its first time"
        )
    if times[-1][0] <= time:
        raise item.error(f"the trajectory of {mover.name!r} ends before its action begins, at {time:.4g} s")
    rest = [entry for entry in times if entry[0] > time + 1e-9]
    before = times[len(times) - len(rest) - 1]
    share = (time - before[0]) / (rest[0][0] - before[0])
    begin = before[1] + share * (rest[0][1] - before[1])
    mover.leader, mover.replan = None, None
    driven = mover.timeline.at(time).distance
    if time == 0.0:
        mover.track, mover.start, mover.follows = track.part(begin), track.at(begin), True
        mover.way = None
    else:
        _continue(item, mover, world, time, track.part(begin))
    _continue_lane(mover, world, driven + track.length - begin)
    with item.locate_errors(f"{item.tag} of {mover.name!r}: "):
        planned = [(time, driven), *((when, driven + where - begin) for when, where in rest)]
        end = mover.timeline.follow_times(planned)
    carry_over(world, mover, time)
    return end


def _continue_lane(mover: Mover, world: ScenarioMap, distance: float) -> None:
    """Continue a path along the lane at its end, if it has the direction of a lane there."""
    end = mover.path.at(distance)
    if not world.network.roads:
        return
    road, s, t = world.locate(end)
    along = cos(end.heading - road.at(s).heading)
    beside = end.distance(road.at(s, t))
    if abs(along) < 0.999 or beside > ON_PATH or not world.inside(road, s, t):
        return
    direction = 1 if along > 0.0 else -1
    way, mover.chosen = follow(world.network, road, direction, s, lane_at(road, s, t))
    if not way.spans:
        return
    left = end.seen_from(way.spans[0].line(0.0)).y - way.spans[0].centre(0.0)
    rest = way.bends(0.0, left, end)
    mover.way = way
    if any(bend.curvature or bend.last_curvature for bend in rest):
        mover.track = mover.path.then(distance, rest)


def _continue(item: Element, mover: Mover, world: ScenarioMap, time: float, rest: Track) -> None:
    """Continue the path of an entity with another from where it is."""
    distance = mover.timeline.at(time).distance
    here = mover.path.at(distance)
    turn = abs(remainder(here.heading - rest.start.heading, tau))
    if here.distance(rest.start) > ON_PATH or turn > CORNER:
        raise item.error(f"{mover.name!r} is not on its path at {time:.3g} s; begin the path where it is")
    bends = rest.bends
    if turn > _SMOOTH:
        world.note(item, f"the path of {mover.name!r} has a corner of {turn:.2g} rad, which is rounded")
        with item.locate_errors():
            bends = _rounded(here, rest)
    mover.track, mover.follows = mover.path.then(distance, bends), True
    mover.replan = mover.way = None


def _rounded(here: Place, rest: Track) -> tuple[Bend, ...]:
    """Return the bends of a path from a pose beside its heading on, which meets it within a few metres."""
    joints = [*accumulate(bend.length for bend in rest.bends)]
    end = next((joint for joint in joints if joint >= _ROOM), max(rest.length, _ROOM))
    stops = [0.0, *(joint for joint in joints if joint < end), end]
    return (*fit(rest.at, stops, here), *rest.part(end).bends)


def assign_route(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Let an entity follow a route at its present distance from the centre of its lane."""
    _follow_legs(item, mover, world, time, [(leg.road, leg.direction) for leg in world.route(item).legs])
    return time


def acquire_position(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Let an entity drive to a position on the shortest way; return the time at which it is there [s]."""
    here, goal = mover.place(time), world.place(item.child("Position"), time)
    road, s, _ = world.road_of(mover, here)
    other, end, _ = world.locate(goal)
    lane = -1 if (cos(here.heading - road.at(s).heading) > 0.0) != road.left_hand else 1
    route = world.route_through(item, [(road, lane, s), (other, None, end)])
    _follow_legs(item, mover, world, time, [(leg.road, leg.direction) for leg in route.legs])
    return mover.timeline.time_of(mover.path.nearest(goal, mover.timeline.at(time).distance))


def _follow_legs(
    item: Element, mover: Mover, world: ScenarioMap, time: float, legs: list[tuple[Road, int]]
) -> None:
    """Let an entity follow roads, from where it is on them."""
    distance = mover.timeline.at(time).distance
    here = mover.path.at(distance)
    road, s, t = min(
        ((leg, *leg.nearest(here)) for leg, _ in legs),
        key=lambda found: here.distance(found[0].at(*found[1:])),
    )
    if here.distance(road.at(s, t)) > ON_PATH or not world.inside(road, s, t):
        road, s, t = world.locate(here)
        direction = 1 if cos(here.heading - road.at(s).heading) > 0.0 else -1
        with item.locate_errors():
            legs = [*world.network.route(road.name, direction, legs[0][0].name), *legs[1:]]
    index = next(number for number, (leg, _) in enumerate(legs) if leg is road)
    direction = legs[index][1]
    if direction * cos(here.heading - road.at(s).heading) < 0.999:
        raise item.error(f"{mover.name!r} does not have the direction of its route; turn it around")
    with item.locate_errors():
        way, _ = follow(world.network, road, direction, s, lane_at(road, s, t), legs[index + 1 :])
        if not way.spans:
            raise ValueError(f"{mover.name!r} is at the end of road {road.name}; start earlier")
        left = here.seen_from(way.spans[0].line(0.0)).y - way.spans[0].centre(0.0)
        rest = way.bends(0.0, left, here)
    mover.track, mover.follows = mover.path.then(distance, rest), True
    mover.way, mover.legs, mover.chosen, mover.replan = way, tuple(legs), False, None
