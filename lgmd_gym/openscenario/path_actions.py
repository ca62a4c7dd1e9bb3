"""Actions that set where an entity is and which way it drives."""

from collections.abc import Callable
from math import cos, inf, pi

from lgmd_gym.envs.dynamics.path import rear_axle_path
from lgmd_gym.openscenario.entities import Mover, reads_front_axle
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.paths import Place, Track
from lgmd_gym.openscenario.world import World

_ON_PATH = 0.1  # [m] from a trajectory within which an entity can begin to follow it


def settle(world: World, mover: Mover) -> None:
    """Set the path of an entity that follows no trajectory: along its road, or straight on."""
    start = mover.start
    if mover.follows or start is None:
        return
    ahead = start.turned(pi) if mover.backwards else start
    road, _, t = world.locate(start)
    s = road.nearest(start)[0]
    along = cos(ahead.heading - road.at(s).heading)
    mover.track = Track(ahead)
    if abs(abs(along) - 1.0) < 1e-9 and 0.0 < s < road.length:
        direction = 1 if along > 0.0 else -1
        begin = road.at(0.0, t) if direction > 0 else road.at(road.length, t).turned(pi)
        whole = Track(begin, road.bends(direction, t))
        mover.track = Track(ahead, whole.part(whole.nearest(start)).bends)


def teleport(item: Element, mover: Mover, world: World, time: float) -> float:
    """Place an entity at the start."""
    only_at_start(item, time)
    place = world.place(item.child("Position"))
    if mover.follows and mover.track is not None:
        distance = mover.track.nearest(place)
        if _apart(mover.track.at(distance), place) <= _ON_PATH:
            mover.track = mover.track.part(distance)
            return time
        mover.follows = False
    mover.start = place
    settle(world, mover)
    return time


def follow_trajectory(item: Element, mover: Mover, world: World, time: float) -> float:
    """Let an entity follow a trajectory from its start, or from where it is."""
    if item.child("TimeReference").find("None") is None:
        raise item.error("a TimeReference with Timing is not supported; use None")
    item.child("TrajectoryFollowingMode").choice("followingMode", ("follow", "position"))
    reference = item if item.find("Trajectory", "CatalogReference") else item.child("TrajectoryRef")
    current = None if mover.track is None else mover.place(time)
    track = world.trajectory(reference, current)
    offset = item.number("initialDistanceOffset", 0.0)
    if mover.front_axle:
        base = mover.body.wheelbase
        if base == 0.0:
            raise item.error(f"the front axle of {mover.name!r} cannot be its control point without Axles")
        track = Track(track.start.moved(-base), rear_axle_path(track.bends, base))
    if time == 0.0:
        mover.track, mover.start, mover.follows = track.part(offset), track.at(offset), True
        return mover.timeline.time_of(track.length - offset) if track.bends else time
    begin = track.nearest(mover.place(time)) if offset == 0.0 else offset
    return _continue(item, mover, time, track.part(begin))


def _continue(item: Element, mover: Mover, time: float, rest: Track) -> float:
    """Continue the path of an entity with another from where it is."""
    assert mover.track is not None
    here, distance = mover.track.at(mover.timeline.at(time).distance), mover.timeline.at(time).distance
    if _apart(here, rest.start) > _ON_PATH or cos(here.heading - rest.start.heading) < 0.999:
        raise item.error(f"{mover.name!r} is not on its path at {time:.3g} s; begin the path where it is")
    mover.track, mover.follows = mover.track.then(distance, rest.bends), True
    return mover.timeline.time_of(distance + rest.length)


def assign_route(item: Element, mover: Mover, world: World, time: float) -> float:
    """Let an entity follow a route at its present distance beside the roads' reference lines."""
    return _follow_route(item, mover, world.route(item).shifted, time)


def acquire_position(item: Element, mover: Mover, world: World, time: float) -> float:
    """Let an entity drive to a position on the shortest way."""
    here = mover.place(time)
    road, s, _ = world.locate(here)
    other, end, _ = world.locate(world.place(item.child("Position")))
    lane = -1 if (cos(here.heading - road.at(s).heading) > 0.0) != road.left_hand else 1
    route = world.route_through(item, [(road, lane, s), (other, None, end)])
    return _follow_route(item, mover, route.shifted, time)


def _follow_route(item: Element, mover: Mover, shifted: Callable[[float], Track], time: float) -> float:
    here = mover.place(time)
    centre = shifted(0.0)
    distance = centre.nearest(here)
    try:
        track = shifted(here.seen_from(centre.at(distance)).y)
    except ValueError as error:
        raise item.error(str(error)) from None
    rest = track.part(track.nearest(here))
    if time > 0.0:
        return _continue(item, mover, time, rest)
    if cos(here.heading - rest.start.heading) < 0.999:
        raise item.error(f"{mover.name!r} does not have the direction of its route; turn it around")
    mover.track, mover.start, mover.follows = rest, rest.start, True
    return inf


def assign_controller(item: Element, mover: Mover, world: World, time: float) -> float:
    """Set the control point of an entity."""
    assign = item.find("AssignControllerAction")
    if assign is not None:
        mover.front_axle = reads_front_axle(assign, world.catalogs)
    return time


def only_at_start(item: Element, time: float) -> None:
    """Raise ValueError for an action that would move an entity by a jump after the start."""
    if time > 0.0:
        raise item.error(f"{item.tag} is supported at the start only, got {time:.3g} s; move it to Init")


def _apart(one: Place, other: Place) -> float:
    return ((one.x - other.x) ** 2 + (one.y - other.y) ** 2) ** 0.5
