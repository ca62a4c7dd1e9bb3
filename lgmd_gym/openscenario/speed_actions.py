"""Actions that change the speed of an entity, or its distance to another."""

from math import cos, inf

from lgmd_gym.openscenario.entities import Mover
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.path_actions import only_at_start, settle
from lgmd_gym.openscenario.paths import Place
from lgmd_gym.openscenario.timelines import Timeline, synchronise
from lgmd_gym.openscenario.world import World


def speed(item: Element, mover: Mover, world: World, time: float) -> float:
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


def _step(item: Element, mover: Mover, world: World, time: float, value: float) -> float:
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
    world: World,
    time: float,
    acceleration: float,
    final: float,
    build_up: float = 0.0,
) -> float:
    try:
        mover.leader = None
        end = mover.timeline.change(time, acceleration, final, build_up)
    except ValueError as error:
        raise item.error(f"{item.tag} of {mover.name!r}: {error}") from None
    for other in world.movers.values():
        if other.leader is mover:
            other.timeline.copy_from(time, mover.timeline)
    return end


def speed_profile(item: Element, mover: Mover, world: World, time: float) -> float:
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


def longitudinal_distance(item: Element, mover: Mover, world: World, time: float) -> float:
    """Place an entity at a distance ahead of or behind another at the start."""
    other = world.mover(item)
    if item.find("DynamicConstraints") is not None:
        raise item.error("LongitudinalDistanceAction with DynamicConstraints is not supported; remove them")
    only_at_start(item, time)
    if mover.follows or mover.start is None:
        raise item.error(f"{mover.name!r} must have a position and no trajectory; add a TeleportAction")
    item.choice("coordinateSystem", ("entity", "road", "lane"), "entity")
    known = ("leadingReferencedEntity", "trailingReferencedEntity")
    ahead = item.choice("displacement", known, known[1]) == known[0]
    distance = item.number("distance") if item.has("distance") else _time_gap(item, mover, time)
    base, place = other.place(time), mover.place(time)
    same = cos(place.heading - base.heading) > 0.0
    if item.flag("freespace"):
        own = (mover.rear if same else mover.front) if ahead else (mover.front if same else mover.rear)
        distance += own + (other.front if ahead else other.rear)
    moved = base.moved(distance if ahead else -distance, place.seen_from(base).y)
    mover.start = Place(moved.x, moved.y, place.heading)
    settle(world, mover)
    if item.flag("continuous"):
        mover.timeline, mover.leader = Timeline(other.timeline.at(time).speed), other
    return time


def _time_gap(item: Element, mover: Mover, time: float) -> float:
    return item.number("timeGap") * mover.timeline.at(time).speed


def synchronize(item: Element, mover: Mover, world: World, time: float) -> float:
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
    try:
        changes = synchronise(now, distance, arrival - time, final, steady).changes
    except ValueError as error:
        raise item.error(f"SynchronizeAction of {mover.name!r}: {error}") from None
    for start, acceleration, value in changes:
        _change(item, mover, world, start, acceleration, value)
    return arrival


def _final_speed(
    item: Element, master: Mover, arrival: float
) -> tuple[float | None, tuple[float, float]]:  # fmt: skip
    """Return the final speed, None for any, and the distance and time at the end with it."""
    block = item.find("FinalSpeed")
    if block is None:
        return None, (0.0, 0.0)
    found = block.only("AbsoluteSpeed", "RelativeSpeedToMaster")
    value = found.number("value")
    if found.tag == "RelativeSpeedToMaster":
        value += master.timeline.at(arrival).speed
    if value < 0.0:
        raise found.error(f"the final speed must be >= 0 m/s, got {value:g}")
    distance, time = found.find("TargetDistanceSteadyState"), found.find("TargetTimeSteadyState")
    return value, (
        0.0 if distance is None else distance.number("distance"),
        0.0 if time is None else time.number("time"),
    )
