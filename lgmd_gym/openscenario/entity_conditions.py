"""Conditions of entities: speeds, distances and times between entities that move as compiled so far."""

from collections.abc import Callable
from math import cos

from lgmd_gym.openscenario.entities import Mover
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.parameters import RULES
from lgmd_gym.openscenario.world import World

_CLOSE = 1e-9
_NEVER = 1e9  # [s], for times that are undefined
Test = Callable[[float], bool]
"""Whether a condition holds at a time [s]."""


def entity_test(item: Element, world: World) -> Test:
    """Return the test of a `ByEntityCondition`.

    Raises:
        ValueError: If the condition is not supported.
    """
    triggering = item.child("TriggeringEntities")
    rule = triggering.choice("triggeringEntitiesRule", ("any", "all"))
    movers = [world.mover(entry) for entry in triggering.all("EntityRef")]
    if not movers:
        raise triggering.error("TriggeringEntities must contain an EntityRef")
    found = item.child("EntityCondition").only(*_ENTITY)
    tests = [_ENTITY[found.tag](found, mover, world) for mover in movers]
    if rule == "any":
        return lambda time: any(test(time) for test in tests)
    return lambda time: all(test(time) for test in tests)


def meets(value: float, rule: str, limit: float) -> bool:
    """Return whether a rule holds; a value is equal within 1e-9."""
    if rule in ("greaterOrEqual", "lessOrEqual", "equalTo") and abs(value - limit) <= _CLOSE:
        return True
    if rule == "notEqualTo":
        return abs(value - limit) > _CLOSE
    return value > limit if rule in ("greaterThan", "greaterOrEqual") else value < limit


def _limit(item: Element) -> Callable[[float], bool]:
    rule, limit = item.choice("rule", RULES[1:5]), item.number("value")
    return lambda value: meets(value, rule, limit)


def _speed(item: Element, mover: Mover, world: World) -> Test:
    met = _limit(item)
    return lambda time: met(mover.timeline.at(time).speed * (-1.0 if mover.backwards else 1.0))


def _relative_speed(item: Element, mover: Mover, world: World) -> Test:
    met, other = _limit(item), world.mover(item)
    return lambda time: met(mover.timeline.at(time).speed - other.timeline.at(time).speed)


def _acceleration(item: Element, mover: Mover, world: World) -> Test:
    met = _limit(item)
    return lambda time: met(mover.timeline.at(time).acceleration)


def _traveled_distance(item: Element, mover: Mover, world: World) -> Test:
    value = item.number("value")
    return lambda time: mover.timeline.at(time).distance >= value - _CLOSE


def _stand_still(item: Element, mover: Mover, world: World) -> Test:
    duration = item.number("duration")

    def holds(time: float) -> bool:
        before = mover.timeline.at(max(time - duration, 0.0))
        now = mover.timeline.at(time)
        return time >= duration and now.speed < _CLOSE and now.distance - before.distance < _CLOSE

    return holds


def _gap(one: Mover, other: Mover, freespace: bool, time: float) -> tuple[float, float]:
    """Return distance along and across the axis of the first entity; free space is along it, >= 0 [m]."""
    seen = other.place(time).seen_from(one.place(time))
    along = seen.x
    if freespace:
        ahead, behind = along - one.front - other.rear, -along - one.rear - other.front
        return max(ahead, behind, 0.0), seen.y
    return abs(along), seen.y


def _relative_distance(item: Element, mover: Mover, world: World) -> Test:
    met, other, freespace = _limit(item), world.mover(item), item.flag("freespace")
    kinds = ("longitudinal", "lateral", "cartesianDistance", "euclidianDistance")
    kind = item.choice("relativeDistanceType", kinds)
    item.choice("coordinateSystem", ("entity",), "entity")
    if freespace and kind != "longitudinal":
        raise item.error("freespace is supported for longitudinal distances only; use freespace=false")

    def holds(time: float) -> bool:
        along, across = _gap(mover, other, freespace, time)
        if kind == "longitudinal":
            return met(along)
        return met(abs(across) if kind == "lateral" else (along**2 + across**2) ** 0.5)

    return holds


def _reach_position(item: Element, mover: Mover, world: World) -> Test:
    place, tolerance = world.place(item.child("Position")), item.number("tolerance")

    def holds(time: float) -> bool:
        here = mover.place(time)
        return ((here.x - place.x) ** 2 + (here.y - place.y) ** 2) ** 0.5 <= tolerance

    return holds


def _distance(item: Element, mover: Mover, world: World) -> Test:
    met, place = _limit(item), world.place(item.child("Position"))
    _no_freespace(item)

    def holds(time: float) -> bool:
        here = mover.place(time)
        return met(((here.x - place.x) ** 2 + (here.y - place.y) ** 2) ** 0.5)

    return holds


def _time_to_collision(item: Element, mover: Mover, world: World) -> Test:
    met, freespace = _limit(item), item.flag("freespace")
    target = item.child("TimeToCollisionConditionTarget").only("EntityRef", "Position")
    if target.tag == "EntityRef":
        other = world.mover(target)
        return lambda time: met(_closing_time(mover, other, freespace, time))
    place = world.place(target)
    _no_freespace(item)

    def holds(time: float) -> bool:
        speed = mover.timeline.at(time).speed
        ahead = place.seen_from(mover.place(time)).x
        return met(ahead / speed if speed > 0.0 and ahead > 0.0 else _NEVER)

    return holds


def _closing_time(one: Mover, other: Mover, freespace: bool, time: float) -> float:
    """Return the present distance divided by the closing speed along the first entity's axis [s]."""
    here, there = one.place(time), other.place(time)
    along = _gap(one, other, freespace, time)[0]
    closing = one.timeline.at(time).speed
    closing -= other.timeline.at(time).speed * cos(there.heading - here.heading)
    ahead = there.seen_from(here).x > 0.0
    return along / closing if closing > 0.0 and ahead else _NEVER


def _time_headway(item: Element, mover: Mover, world: World) -> Test:
    met, other, freespace = _limit(item), world.mover(item), item.flag("freespace")

    def holds(time: float) -> bool:
        speed = mover.timeline.at(time).speed
        return met(_gap(mover, other, freespace, time)[0] / speed if speed > 0.0 else _NEVER)

    return holds


def _no_freespace(item: Element) -> None:
    if item.flag("freespace"):
        raise item.error(f"{item.tag} with freespace to a position is not supported; use freespace=false")


_ENTITY: dict[str, Callable[[Element, Mover, World], Test]] = {
    "SpeedCondition": _speed,
    "RelativeSpeedCondition": _relative_speed,
    "AccelerationCondition": _acceleration,
    "TraveledDistanceCondition": _traveled_distance,
    "StandStillCondition": _stand_still,
    "RelativeDistanceCondition": _relative_distance,
    "ReachPositionCondition": _reach_position,
    "DistanceCondition": _distance,
    "TimeToCollisionCondition": _time_to_collision,
    "TimeHeadwayCondition": _time_headway,
}
