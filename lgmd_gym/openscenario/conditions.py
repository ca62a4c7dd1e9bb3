"""Conditions: the first time at which one holds, for entities that move as compiled so far.

The ego drives undisturbed, as on a test track without a braking system.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, inf

from lgmd_gym.openscenario.motion import first_true
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.parameters import RULES, compare
from lgmd_gym.openscenario.world import Mover, ScenarioMap

_CLOSE = 1e-9
_NEVER = 1e9  # [s], for times that are undefined
Test = Callable[[float], bool]
"""Whether a condition holds at a time [s]."""


def entity_test(item: Element, world: ScenarioMap) -> Test:
    """Return the test of a `ByEntityCondition`."""
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
    if rule in ("greaterOrEqual", "lessOrEqual") and abs(value - limit) <= _CLOSE:
        return True
    return value > limit if rule in ("greaterThan", "greaterOrEqual") else value < limit


def _limit(item: Element) -> Callable[[float], bool]:
    rule, limit = item.choice("rule", RULES[1:5]), item.number("value")
    return lambda value: meets(value, rule, limit)


def _speed(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met = _limit(item)
    return lambda time: met(mover.timeline.at(time).speed * (-1.0 if mover.backwards else 1.0))


def _relative_speed(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met, other = _limit(item), world.mover(item)
    return lambda time: met(mover.timeline.at(time).speed - other.timeline.at(time).speed)


def _acceleration(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met = _limit(item)
    return lambda time: met(mover.timeline.at(time).acceleration)


def _traveled_distance(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    value = item.number("value")
    return lambda time: mover.timeline.at(time).distance >= value - _CLOSE


def _stand_still(item: Element, mover: Mover, world: ScenarioMap) -> Test:
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


def _relative_distance(item: Element, mover: Mover, world: ScenarioMap) -> Test:
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


def _reach_position(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    place, tolerance = world.place(item.child("Position")), item.number("tolerance")
    return lambda time: mover.place(time).distance(place) <= tolerance


def _distance(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met, place = _limit(item), world.place(item.child("Position"))
    _no_freespace(item)
    return lambda time: met(mover.place(time).distance(place))


def _time_to_collision(item: Element, mover: Mover, world: ScenarioMap) -> Test:
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


def _time_headway(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met, other, freespace = _limit(item), world.mover(item), item.flag("freespace")

    def holds(time: float) -> bool:
        speed = mover.timeline.at(time).speed
        return met(_gap(mover, other, freespace, time)[0] / speed if speed > 0.0 else _NEVER)

    return holds


def _no_freespace(item: Element) -> None:
    if item.flag("freespace"):
        raise item.error(f"{item.tag} with freespace to a position is not supported; use freespace=false")


_ENTITY: dict[str, Callable[[Element, Mover, ScenarioMap], Test]] = {
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


HORIZON = 120.0  # [s] of simulated time within which a trigger must occur
_STEP = 0.05  # [s] between the samples in the search for a change
_JUST = 1e-6  # [s]
EDGES = ("none", "rising", "falling", "risingOrFalling")
States = dict[tuple[str, str], tuple[float, float]]
"""Start and end of the elements of the storyboard by kind and name [s]."""


@dataclass(frozen=True)
class Condition:
    """A condition."""

    holds: Callable[[float], bool]  # whether it holds at a time [s]
    # time at which it changes, if that is known: -inf for a constant; None to search for it [s]
    jump: Callable[[], float] | None
    edge: str  # edge at which it triggers
    delay: float  # delay of the trigger [s]

    def first(self, start: float) -> float:
        """Return the first time at or after a start at which the condition triggers [s]; inf for never."""
        begin = max(start - self.delay, 0.0)
        if self.edge == "none":
            found = self._change(begin, True)
        elif self.edge == "rising":
            found = self._change(self._change(begin, False), True)
        elif self.edge == "falling":
            found = self._change(self._change(begin, True), False)
        else:
            found = self._change(begin, not self.holds(begin))
        return max(found + self.delay, start)

    def _change(self, start: float, value: bool) -> float:
        """Return the first time at or after a start at which `holds` has a value [s]."""
        if start == inf:
            return inf
        if self.jump is not None:
            change = self.jump()
            after = self.holds(max(change, 0.0) + _JUST) if change < inf else self.holds(start)
            if change == inf or change < start or (change == start and self.holds(start) == after):
                return start if after == value else inf
            return change if after == value else start
        if self.holds(start) == value:
            return start
        time = start
        while time < start + HORIZON:
            if self.holds(time + _STEP) == value:
                return first_true(lambda at: self.holds(at) == value, time, time + _STEP)
            time += _STEP
        return inf


class Trigger:
    """Groups of conditions; all conditions of one group must hold. Without groups, it triggers at once."""

    def __init__(self, groups: list[list[Condition]]) -> None:
        self._groups = groups

    def first(self, start: float) -> float:
        """Return the first time at or after a start [s]; inf for never."""
        if not self._groups:
            return start
        return min((self._of_group(group, start) for group in self._groups), default=inf)

    def _of_group(self, group: list[Condition], start: float) -> float:
        time = max(condition.first(start) for condition in group)
        for _ in range(1000):
            if time == inf or len(group) == 1:
                return time
            # From just before, so that an edge at this time counts.
            latest = max(condition.first(max(time - _JUST, start)) for condition in group)
            if latest <= time:
                return time
            time = latest
        return inf


def read_trigger(item: Element | None, world: ScenarioMap, states: States) -> Trigger:
    """Return a `StartTrigger`; None is one at once. `states` is filled while the storyboard runs."""
    if item is None:
        return Trigger([])
    groups = [
        [_condition(entry, world, states) for entry in group.all("Condition")]
        for group in item.all("ConditionGroup")
    ]
    if not groups or not all(groups):
        raise item.error(f"{item.tag} must contain a Condition")
    return Trigger(groups)


def _condition(item: Element, world: ScenarioMap, states: States) -> Condition:
    edge, delay = item.choice("conditionEdge", EDGES), item.number("delay", 0.0)
    kind = item.only("ByValueCondition", "ByEntityCondition")
    if kind.tag == "ByValueCondition":
        holds, jump = _by_value(kind, states)
    else:
        holds, jump = entity_test(kind, world), None
    return Condition(holds, jump, edge, delay)


def _by_value(item: Element, states: States) -> tuple[Test, Callable[[], float] | None]:
    found = item.only("SimulationTimeCondition", "ParameterCondition", "StoryboardElementStateCondition")
    if found.tag == "SimulationTimeCondition":
        limit, rule = found.number("value"), found.choice("rule", RULES[1:5])
        return (lambda time: meets(time, rule, limit)), (lambda: limit)
    if found.tag == "ParameterCondition":
        name, rule, bound = found.name_of("parameterRef"), found.choice("rule", RULES), found.text("value")
        with found.locate_errors():
            met = compare(found.resolve(f"${name}"), rule, bound)
        return (lambda time: met), (lambda: inf)
    key = found.text("storyboardElementType"), found.text("storyboardElementRef")
    known = ("completeState", "endTransition", "startTransition", "runningState")
    state = found.choice("state", known)

    def change() -> float:
        start, end = states.get(key, (inf, inf))
        return start if state in ("startTransition", "runningState") else end

    def reached(time: float) -> bool:
        start, end = states.get(key, (inf, inf))
        return change() <= time and (state != "runningState" or time < end or end == start)

    return reached, change
