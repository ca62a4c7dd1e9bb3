"""Actions by name: what has an effect on the motion of the entities, what has none, and errors for others."""

from collections.abc import Callable
from math import cos, inf, pi

from lgmd_gym.envs.dynamics.path import rear_axle_path
from lgmd_gym.openscenario.motion import Place, Timeline, Track, synchronise
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.world import Mover, ScenarioMap, reads_front_axle

_ON_PATH = 0.1  # [m] from a trajectory within which an entity can begin to follow it


def settle(world: ScenarioMap, mover: Mover) -> None:
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


def teleport(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Place an entity at the start."""
    only_at_start(item, time)
    place = world.place(item.child("Position"))
    if mover.follows and mover.track is not None:
        distance = mover.track.nearest(place)
        if mover.track.at(distance).distance(place) <= _ON_PATH:
            mover.track = mover.track.part(distance)
            return time
        mover.follows = False
    mover.start = place
    settle(world, mover)
    return time


def follow_trajectory(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
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
    distance = mover.timeline.at(time).distance
    here = mover.path.at(distance)
    if here.distance(rest.start) > _ON_PATH or cos(here.heading - rest.start.heading) < 0.999:
        raise item.error(f"{mover.name!r} is not on its path at {time:.3g} s; begin the path where it is")
    mover.track, mover.follows = mover.path.then(distance, rest.bends), True
    return mover.timeline.time_of(distance + rest.length)


def assign_route(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Let an entity follow a route at its present distance beside the roads' reference lines."""
    return _follow_route(item, mover, world.route(item).shifted, time)


def acquire_position(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
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
    with item.locate_errors():
        track = shifted(here.seen_from(centre.at(distance)).y)
    rest = track.part(track.nearest(here))
    if time > 0.0:
        return _continue(item, mover, time, rest)
    if cos(here.heading - rest.start.heading) < 0.999:
        raise item.error(f"{mover.name!r} does not have the direction of its route; turn it around")
    mover.track, mover.start, mover.follows = rest, rest.start, True
    return inf


def assign_controller(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Set the control point of an entity."""
    assign = item.find("AssignControllerAction")
    if assign is not None:
        mover.front_axle = reads_front_axle(assign, world.catalogs)
    return time


def only_at_start(item: Element, time: float) -> None:
    """Raise ValueError for an action that would move an entity by a jump after the start."""
    if time > 0.0:
        raise item.error(f"{item.tag} is supported at the start only, got {time:.3g} s; move it to Init")


def speed(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Change an entity's speed."""
    dynamics, now = item.child("SpeedActionDynamics"), mover.timeline.at(time).speed
    target = item.child("SpeedActionTarget").only("AbsoluteTargetSpeed", "RelativeTargetSpeed")
    value = target.number("value")
    if target.tag == "RelativeTargetSpeed":
        if target.flag("continuous"):
            raise target.error("a continuous RelativeTargetSpeed is not supported; use continuous=false")
        other = world.mover(target).timeline.at(time).speed
        delta = target.choice("speedTargetValueType", ("delta", "factor")) == "delta"
        value = other + value if delta else other * value
    shape = dynamics.choice("dynamicsShape", ("step", "linear"))
    dimension = dynamics.choice("dynamicsDimension", ("time", "rate", "distance"))
    dynamics.choice("followingMode", ("position",), "position")
    amount = dynamics.number("value")
    if value < 0.0 and (time > 0.0 or shape != "step"):
        raise target.error("driving backwards is supported from the start only; use a step in Init")
    if shape == "step" or amount == 0.0:
        return _step(item, mover, world, time, value)
    change = value - now
    if amount < 0.0:
        raise dynamics.error(f"SpeedActionDynamics value must be >= 0, got {amount:g}")
    if abs(change) < 1e-9:
        return time
    acceleration = {
        "rate": amount if change > 0.0 else -amount,
        "time": change / amount,
        "distance": (value**2 - now**2) / (2.0 * amount),
    }[dimension]
    return _change(item, mover, world, time, acceleration, value)


def _step(item: Element, mover: Mover, world: ScenarioMap, time: float, value: float) -> float:
    if time == 0.0:
        mover.timeline, mover.leader = Timeline(abs(value)), None
        mover.backwards = value < 0.0
        settle(world, mover)
    elif abs(value - mover.timeline.at(time).speed) > 1e-6:
        raise item.error(
            f"a jump of the speed of {mover.name!r} at {time:.3g} s is not supported; use linear dynamics"
        )
    else:
        mover.leader = None
    return time


def _change(
    item: Element,
    mover: Mover,
    world: ScenarioMap,
    time: float,
    acceleration: float,
    final: float,
    build_up: float = 0.0,
) -> float:
    mover.leader = None
    with item.locate_errors(f"{item.tag} of {mover.name!r}: "):
        end = mover.timeline.change(time, acceleration, final, build_up)
    for other in world.movers.values():
        if other.leader is mover:
            other.timeline.copy_from(time, mover.timeline)
    return end


def speed_profile(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Change an entity's speed in steps, within limits of acceleration and jerk.

    The acceleration builds up with the given rate and ends at once.
    """
    item.choice("followingMode", ("follow", "position"))
    limits = item.find("DynamicConstraints")
    for entry in item.all("SpeedProfileEntry"):
        final, now = entry.number("speed"), mover.timeline.at(time).speed
        if entry.has("time"):
            acceleration, build_up = (final - now) / max(entry.number("time"), 1e-9), 0.0
        else:
            name = "maxAcceleration" if final > now else "maxDeceleration"
            if limits is None or not limits.has(name):
                raise entry.error(f"SpeedProfileEntry without time needs DynamicConstraints {name}")
            limit = limits.number(name)
            build_up = limit / limits.number(f"{name}Rate") if limits.has(f"{name}Rate") else 0.0
            acceleration = limit if final > now else -limit
        time = _change(item, mover, world, time, acceleration, final, build_up)
    return time


def longitudinal_distance(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Place an entity at a distance ahead of or behind another at the start."""
    other = world.mover(item)
    if item.find("DynamicConstraints") is not None:
        raise item.error("LongitudinalDistanceAction with DynamicConstraints is not supported; remove them")
    only_at_start(item, time)
    if mover.follows or mover.start is None:
        raise item.error(f"{mover.name!r} must have a position and no trajectory; add a TeleportAction")
    system = item.choice("coordinateSystem", ("entity", "road", "lane"), "entity")
    known = ("leadingReferencedEntity", "trailingReferencedEntity")
    ahead = item.choice("displacement", known, known[1]) == known[0]
    if item.has("distance"):
        distance = item.number("distance")
    else:
        distance = item.number("timeGap") * mover.timeline.at(time).speed
    base, place = other.place(time), mover.place(time)
    same = cos(place.heading - base.heading) > 0.0
    if item.flag("freespace"):
        own = (mover.rear if same else mover.front) if ahead else (mover.front if same else mover.rear)
        distance += own + (other.front if ahead else other.rear)
    distance = distance if ahead else -distance
    moved = base.moved(distance, place.seen_from(base).y)
    if system != "entity":
        _check_straight(item, world, base, distance)
    mover.start = Place(moved.x, moved.y, place.heading)
    settle(world, mover)
    if item.flag("continuous"):
        mover.timeline, mover.leader = Timeline(other.timeline.at(time).speed), other
    return time


def _check_straight(item: Element, world: ScenarioMap, base: Place, distance: float) -> None:
    """Raise ValueError if a distance along the road is not one along the axis of an entity [m]."""
    road, s, t = world.locate(base)
    along = distance if cos(base.heading - road.at(s).heading) > 0.0 else -distance
    inside = 0.0 <= s + along <= road.length
    if not inside or road.at(s + along, t).distance(base.moved(distance)) > _ON_PATH:
        system = item.text("coordinateSystem")
        raise item.error(
            f"LongitudinalDistanceAction coordinateSystem={system!r} is supported on a straight road, "
            "parallel to it; use a LanePosition"
        )


def synchronize(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Change an entity's speed so that it reaches a place when another entity reaches its own."""
    master = world.mover(item, "masterEntityRef")
    for name in ("targetTolerance", "targetToleranceMaster"):
        item.number(name, 0.0)
    if master.track is None or mover.track is None:
        raise item.error("both entities of a SynchronizeAction must have a position")
    goal = master.track.nearest(world.place(item.child("TargetPositionMaster"), time))
    arrival = master.timeline.time_of(goal)
    if arrival == inf:
        raise item.error(f"{master.name!r} never reaches its TargetPositionMaster")
    now = mover.timeline.at(time)
    place = world.place(item.child("TargetPosition"), time)
    distance = mover.track.nearest(place) - now.distance
    final, steady = _final_speed(item, master, arrival)
    with item.locate_errors(f"SynchronizeAction of {mover.name!r}: "):
        changes = synchronise(now, distance, arrival - time, final, steady)
    for start, acceleration, value in changes:
        _change(item, mover, world, start, acceleration, value)
    return arrival


def _final_speed(item: Element, master: Mover, arrival: float) -> tuple[float | None, tuple[float, float]]:
    """Return the final speed, None for any, and the distance and time at the end with it."""
    block = item.find("FinalSpeed")
    if block is None:
        return None, (0.0, 0.0)
    found = block.only("AbsoluteSpeed", "RelativeSpeedToMaster")
    value = found.number("value")
    if found.tag == "RelativeSpeedToMaster":
        speed = master.timeline.at(arrival).speed
        delta = found.choice("speedTargetValueType", ("delta", "factor")) == "delta"
        value = speed + value if delta else speed * value
    if value < 0.0:
        raise found.error(f"the final speed must be >= 0 m/s, got {value:g}")
    distance, time = found.find("TargetDistanceSteadyState"), found.find("TargetTimeSteadyState")
    return value, (
        0.0 if distance is None else distance.number("distance"),
        0.0 if time is None else time.number("time"),
    )


AT_START = 0.2  # [s] within which an entity may be deleted
ActionRun = Callable[[float], float]
"""Carries out an action at a time [s] and returns the time of its end."""
_PRIVATE: dict[str, Callable[[Element, Mover, ScenarioMap, float], float]] = {
    "TeleportAction": teleport,
    "SynchronizeAction": synchronize,
    "ControllerAction": assign_controller,
    "SpeedAction": speed,
    "SpeedProfileAction": speed_profile,
    "LongitudinalDistanceAction": longitudinal_distance,
    "FollowTrajectoryAction": follow_trajectory,
    "AssignRouteAction": assign_route,
    "AcquirePositionAction": acquire_position,
}
_GROUPS = {
    "LongitudinalAction": ("SpeedAction", "SpeedProfileAction", "LongitudinalDistanceAction"),
    "RoutingAction": ("FollowTrajectoryAction", "AssignRouteAction", "AcquirePositionAction"),
}
"""Elements that contain one action of some kinds."""
NO_EFFECT = ("AppearanceAction", "ActivateControllerAction", "VariableAction")
"""Known actions that have no effect on the motion."""


def private_action(item: Element, mover: Mover, world: ScenarioMap) -> ActionRun | None:
    """Return the function of a `PrivateAction`, or None for an action without effect."""
    found = item.only(*_GROUPS, "TeleportAction", "SynchronizeAction", "ControllerAction", *NO_EFFECT)
    if found.tag in NO_EFFECT:
        found.skip()
        return None
    if found.tag in _GROUPS:
        found = found.only(*_GROUPS[found.tag])
    function = _PRIVATE[found.tag]

    def run(time: float) -> float:
        with found.locate_errors(f"{found.tag}: "):
            return function(found, mover, world, time)

    return run


def global_action(item: Element, world: ScenarioMap) -> ActionRun | None:
    """Return the function of a `GlobalAction` in a story, or None for an action without effect."""
    found = item.only("EntityAction", *NO_EFFECT)
    if found.tag in NO_EFFECT:
        found.skip()
        return None
    mover = world.mover(found)
    found.only("DeleteEntityAction")

    def run(time: float) -> float:
        if time > AT_START:
            raise found.error(
                f"DeleteEntityAction at {time:.3g} s is supported in the first {AT_START:g} s only"
            )
        mover.deleted = True
        return time

    return run
