"""Actions by name: what has an effect on the motion of the entities, what has none, and errors for others."""

from collections.abc import Callable
from math import cos, inf

from lgmd_gym.openscenario.dynamics import Dynamics, read_dynamics
from lgmd_gym.openscenario.lateral import lane_change, lane_offset
from lgmd_gym.openscenario.motion import MAX_ACCELERATION, Place, Timeline, synchronise
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.routing import ON_PATH, acquire_position, assign_route, follow_trajectory
from lgmd_gym.openscenario.weather import weather_of
from lgmd_gym.openscenario.world import Mover, ScenarioMap, carry_over, read_controllers, signal_key

_PIECES = 20  # of constant acceleration in a change of speed with a shape
_LIMITS = ("maxAcceleration", "maxDeceleration", "maxAccelerationRate", "maxDecelerationRate", "maxSpeed")
_JUMP = 0.5  # [m/s], change of the speed above which a jump gives a note


def teleport(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Place an entity at the start; later only where it is, which has no effect."""
    place = world.place(item.child("Position"), time)
    if time > 0.0 and mover.track is not None and _is_at(mover.place(time), place):
        return time
    only_at_start(item, time)
    if mover.follows and mover.track is not None:
        distance = mover.track.nearest(place)
        if mover.track.at(distance).distance(place) <= ON_PATH:
            mover.track = mover.track.part(distance)
            return time
        mover.follows = False
    mover.start = place
    world.settle(mover)
    return time


def _is_at(here: Place, there: Place) -> bool:
    """Return whether two poses are the same, up to a distance and an angle that a path bridges."""
    return here.distance(there) <= ON_PATH and cos(here.heading - there.heading) >= 0.999


def assign_controller(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Set the control point of an entity; what else controllers do has no effect."""
    for child in item.all("AssignControllerAction"):
        read_controllers(child, mover, world.catalogs)
    for child in item.all("OverrideControllerValueAction"):
        for value in child.all("Throttle", "Brake", "Clutch", "ParkingBrake", "SteeringWheel", "Gear"):
            if value.flag("active"):
                world.note(
                    value, f"{value.tag} of {mover.name!r} has no effect; it moves as the storyboard says"
                )
    item.skip()
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
        leader = world.mover(target)
        delta = target.choice("speedTargetValueType", ("delta", "factor")) == "delta"
        relation = (1.0, value) if delta else (value, 0.0)
        if target.flag("continuous") and leader is not mover:
            return _keep_speed(item, mover, world, time, leader, relation, read_dynamics(dynamics))
        value = leader.timeline.at(time).speed * relation[0] + relation[1]
    transition = read_dynamics(dynamics, zero_rate=True)
    if value < 0.0 and (time > 0.0 or not transition.is_step):
        raise target.error("driving backwards is supported from the start only; use a step in Init")
    if transition.is_step:
        return _step(item, mover, world, time, value)
    if abs(value - now) < 1e-9:  # ends a change that is under way
        return _change(item, mover, world, time, 0.0, value)
    if transition.dimension == "rate" and transition.value == 0.0:
        world.note(item, f"{mover.name!r} keeps its speed: a rate of 0 never reaches {value:g} m/s")
        _change(item, mover, world, time, 0.0, now)
        return inf
    return _transition(item, mover, world, time, transition, value)


def _keep_speed(
    item: Element,
    mover: Mover,
    world: ScenarioMap,
    time: float,
    leader: Mover,
    relation: tuple[float, float],
    transition: Dynamics,
) -> float:
    """Reach a speed relative to another entity, and keep to it.

    Args:
        item: The action.
        mover: The entity.
        world: The world.
        time: Start [s].
        leader: The other entity.
        relation: Factor, and addition [m/s].
        transition: How the speed is reached.
    """
    factor, delta = relation
    ahead: Mover | None = leader
    while ahead is not None:
        if ahead is mover:
            raise item.error(f"{mover.name!r} and {leader.name!r} cannot both keep to the speed of the other")
        ahead = ahead.leader
    value = leader.timeline.at(time).speed * factor + delta
    end = time
    if value < 0.0:
        raise item.error(f"the speed of {mover.name!r} must be >= 0 m/s, got {value:g}")
    if transition.is_step:
        _step(item, mover, world, time, value)
    elif abs(value - mover.timeline.at(time).speed) > 1e-9:
        end = _transition(item, mover, world, time, transition, value)
        if abs(leader.timeline.at(end).speed * factor + delta - value) > 1e-6:
            raise item.error(
                f"the speed of {leader.name!r} changes while {mover.name!r} approaches it, which is not "
                "supported; use continuous=false"
            )
    mover.leader, mover.relation = leader, relation
    with item.locate_errors(f"{item.tag} of {mover.name!r}: "):
        mover.timeline.copy_from(end, leader.timeline, relation)
    carry_over(world, mover, time)
    return inf


def _transition(
    item: Element, mover: Mover, world: ScenarioMap, time: float, transition: Dynamics, value: float
) -> float:
    """Change the speed along a shape, with constant accelerations between a few speeds."""
    now = mover.timeline.at(time).speed
    change, extent = value - now, transition.extent(value - now)
    if transition.dimension == "distance":
        if transition.shape != "linear":
            raise item.error(
                "a cubic or sinusoidal change of speed over a distance is not supported; use time"
            )
        return _change(item, mover, world, time, (value**2 - now**2) / (2.0 * extent), value)
    if transition.shape == "linear":
        return _change(item, mover, world, time, change / extent, value)
    for number in range(_PIECES):
        begin, end = number / _PIECES, (number + 1) / _PIECES
        part = change * (transition.share(end) - transition.share(begin))
        final = value if number == _PIECES - 1 else now + change * transition.share(end)
        _change(item, mover, world, time + begin * extent, part * _PIECES / extent, final)
    return time + extent


def _step(item: Element, mover: Mover, world: ScenarioMap, time: float, value: float) -> float:
    mover.leader = None
    if time == 0.0:
        mover.timeline = Timeline(abs(value))
        mover.backwards = value < 0.0
        if mover.replan is None:
            world.settle(mover)
        carry_over(world, mover, time)
        return time
    change = value - mover.timeline.at(time).speed
    if abs(change) > 1e-6:
        _jump(item, mover, world, time, value)
    else:
        _change(item, mover, world, time, 0.0, mover.timeline.at(time).speed)
    return time


def _jump(item: Element, mover: Mover, world: ScenarioMap, time: float, value: float) -> float:
    """Change the speed at once, as fast as a segment can."""
    change = value - mover.timeline.at(time).speed
    with item.locate_errors(f"{item.tag} of {mover.name!r}: "):
        end = mover.timeline.jump(time, value)
    if abs(change) > _JUMP:
        lasts = abs(change) / MAX_ACCELERATION
        world.note(
            item,
            f"the speed of {mover.name!r} jumps by {change:.3g} m/s at {time:.3g} s; here it changes within "
            f"{lasts:.2g} s",
        )
    carry_over(world, mover, time)
    return end


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
    change = final - mover.timeline.at(time).speed
    if abs(acceleration) > MAX_ACCELERATION:
        lasts = abs(change / acceleration)
        _jump(item, mover, world, time + lasts / 2, final)
        return time + lasts
    with item.locate_errors(f"{item.tag} of {mover.name!r}: "):
        end = mover.timeline.change(time, acceleration, final, build_up)
    carry_over(world, mover, time)
    return end


def speed_profile(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Change an entity's speed in steps, within limits of acceleration and jerk.

    The acceleration builds up with the given rate and ends at once. An entry with a time has a constant
    acceleration; one with the time 0 is a step.
    """
    exact = item.choice("followingMode", ("follow", "position")) == "position"
    limits = item.find("DynamicConstraints")
    if limits is not None:
        _check_limits(limits)
    highest = inf if limits is None or not limits.has("maxSpeed") else limits.number("maxSpeed")
    for entry in item.all("SpeedProfileEntry"):
        final, now = entry.number("speed"), mover.timeline.at(time).speed
        if final > highest:
            raise entry.error(
                f"SpeedProfileEntry speed={final:g} is above DynamicConstraints maxSpeed={highest:g}"
            )
        name = "maxAcceleration" if final > now else "maxDeceleration"
        if entry.has("time") and entry.number("time") == 0.0 and final >= 0.0:
            _step(item, mover, world, time, final)
            continue
        if entry.has("time"):
            acceleration, build_up = (final - now) / max(entry.number("time"), 1e-9), 0.0
            if not exact and limits is not None and limits.has(f"{name}Rate"):
                world.note(entry, "the speed changes evenly in the time; the limit of the jerk has no effect")
        else:
            if limits is None or not limits.has(name):
                raise entry.error(f"SpeedProfileEntry without time needs DynamicConstraints {name}")
            limit = limits.number(name)
            build_up = limit / limits.number(f"{name}Rate") if limits.has(f"{name}Rate") else 0.0
            acceleration = limit if final > now else -limit
        time = _change(item, mover, world, time, acceleration, final, build_up)
    return time


def _check_limits(limits: Element) -> None:
    """Raise ValueError for limits of `DynamicConstraints` that are not above 0."""
    for name in _LIMITS:
        if limits.has(name) and limits.number(name) <= 0.0:
            raise limits.error(f"DynamicConstraints {name} must be > 0, got {limits.number(name):g}")


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
    world.settle(mover)
    if item.flag("continuous"):
        mover.timeline, mover.leader = Timeline(other.timeline.at(time).speed), other
    return time


def _check_straight(item: Element, world: ScenarioMap, base: Place, distance: float) -> None:
    """Raise ValueError if a distance along the road is not one along the axis of an entity [m]."""
    road, s, t = world.locate(base)
    along = distance if cos(base.heading - road.at(s).heading) > 0.0 else -distance
    inside = 0.0 <= s + along <= road.length
    if not inside or road.at(s + along, t).distance(base.moved(distance)) > ON_PATH:
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
    "LaneChangeAction": lane_change,
    "LaneOffsetAction": lane_offset,
}
_GROUPS = {
    "LongitudinalAction": ("SpeedAction", "SpeedProfileAction", "LongitudinalDistanceAction"),
    "LateralAction": ("LaneChangeAction", "LaneOffsetAction"),
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
    """Return the function of a `GlobalAction`, or None for an action without effect."""
    known = ("EntityAction", "ParameterAction", "EnvironmentAction", "InfrastructureAction")
    found = item.only(*known, *NO_EFFECT)
    if found.tag == "InfrastructureAction":
        return _set_signal(found, world)
    if found.tag in ("ParameterAction", "VariableAction"):
        return _set_value(found, world)
    if found.tag in NO_EFFECT:
        found.skip()
        return None
    if found.tag == "EnvironmentAction":
        weather = weather_of(world.catalogs.resolve(found, "Environment"))
        if weather != world.weather:
            raise found.error(
                f"a change of the weather from {world.weather} to {weather} is not supported; set it in Init"
            )
        return None
    mover = world.mover(found)
    found.only("DeleteEntityAction", "AddEntityAction")
    if found.find("AddEntityAction") is not None:
        found.skip()

    def run(time: float) -> float:
        if time > AT_START:
            what = "DeleteEntityAction" if found.find("DeleteEntityAction") else "AddEntityAction"
            raise found.error(f"{what} at {time:.3g} s is supported in the first {AT_START:g} s only")
        mover.deleted = found.find("DeleteEntityAction") is not None
        return time

    return run


def _set_signal(item: Element, world: ScenarioMap) -> ActionRun | None:
    """Return the function of an `InfrastructureAction`; None if no condition refers to its signal."""
    action = item.find("TrafficSignalAction")
    found = None if action is None else action.find("TrafficSignalStateAction")
    key = None if found is None else signal_key(found.text("name"))
    if found is None or key not in world.watched:
        item.skip()
        world.note(item, f"{item.tag} has no effect")
        return None
    state = found.text("state")
    world.note(item, "traffic signals are not drawn; their states have an effect on conditions only")

    def run(time: float) -> float:
        world.values.setdefault(key, [(-inf, "")]).append((time, state))
        return time

    return run


def _set_value(item: Element, world: ScenarioMap) -> ActionRun | None:
    """Return the function of a `ParameterAction` or `VariableAction`; None if no condition refers to it."""
    name = item.name_of("parameterRef" if item.tag == "ParameterAction" else "variableRef")
    change = item.only("SetAction", "ModifyAction")
    value, factor, delta = "", 1.0, 0.0
    if change.tag == "SetAction":
        value = change.text("value")
    else:
        rule = change.child("Rule").only("AddValue", "MultiplyByValue")
        if rule.tag == "AddValue":
            delta = rule.number("value")
        else:
            factor = rule.number("value")

    def run(time: float) -> float:
        new = value
        if change.tag == "ModifyAction":
            with item.locate_errors():
                new = repr(float(world.value_of(item, name, time)) * factor + delta)
        world.values.setdefault(name, []).append((time, new))
        return time

    if name not in world.watched:
        item.skip()
        return None
    return run
