"""Conditions: the first time at which one holds, for entities that move as compiled so far.

The ego drives undisturbed, as on a test track without a braking system.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, inf

from lgmd_gym.openscenario.clearance import off_road, relative_clearance
from lgmd_gym.openscenario.distances import Target, read_distance, relative_velocity
from lgmd_gym.openscenario.motion import first_true
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.parameters import RULES, compare
from lgmd_gym.openscenario.world import Mover, ScenarioMap, signal_key, touching

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
    if _direction(item) is None:
        return lambda time: met(mover.timeline.at(time).speed)
    return lambda time: met(mover.signed_speed(time))


def _relative_speed(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met, other = _limit(item), world.mover(item)
    if item.has("direction"):
        item.choice("direction", ("longitudinal",))
        return lambda time: met(-relative_velocity(mover, other, other.place(time), time)[0])
    return lambda time: met(mover.timeline.at(time).speed - other.timeline.at(time).speed)


def _acceleration(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met = _limit(item)
    sign = -1.0 if mover.backwards else 1.0
    if _direction(item) is not None:
        return lambda time: met(sign * mover.timeline.at(time).acceleration)

    def holds(time: float) -> bool:
        now = mover.timeline.at(time)
        return met(hypot(now.acceleration, now.speed**2 * mover.path.curvature(now.distance)))

    return holds


def _direction(item: Element) -> str | None:
    """Return the direction of a speed or acceleration; None for the total one, which is never negative."""
    if item.has("direction"):
        return item.choice("direction", ("longitudinal",))
    if item.number("value") < 0.0:
        raise item.error(
            f"{item.tag} without direction compares the total, which is never negative, with "
            f'{item.number("value"):g}; add direction="longitudinal"'
        )
    return None


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


def _relative_distance(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met, other, distance = _limit(item), Target(world.mover(item)), read_distance(item, world, None)
    return lambda time: met(distance.between(mover, other, time))


def _reach_position(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    place, tolerance = world.place(item.child("Position")), item.number("tolerance")
    return lambda time: mover.place(time).distance(place) <= tolerance


def _distance(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met, place, distance = _limit(item), world.place(item.child("Position")), read_distance(item, world)
    return lambda time: met(distance.between(mover, Target(None, place), time))


def _time_to_collision(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met, distance = _limit(item), read_distance(item, world)
    found = item.child("TimeToCollisionConditionTarget").only("EntityRef", "Position")
    is_entity = found.tag == "EntityRef"
    target = Target(world.mover(found)) if is_entity else Target(None, world.place(found))
    return lambda time: met(min(distance.time_to_collision(mover, target, time), _NEVER))


def _time_headway(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    met, other, distance = _limit(item), Target(world.mover(item)), read_distance(item, world)

    def holds(time: float) -> bool:
        speed = mover.timeline.at(time).speed
        if other.place(time).seen_from(mover.place(time)).x < 0.0:
            return False  # undefined for an entity behind
        return met(distance.between(mover, other, time) / speed if speed > 0.0 else _NEVER)

    return holds


def _collision(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    """Return the test whether the bodies of two entities overlap."""
    found = item.only("EntityRef", "ByType", "ByObjectType")
    if found.tag == "EntityRef":
        others = [world.mover(found)]
    else:
        kind = found.choice("type", tuple(_TYPES))
        others = [other for other in world.movers.values() if other.tag == _TYPES[kind]]
    return lambda time: any(touching(mover, other, time) for other in others if other is not mover)


def _end_of_road(item: Element, mover: Mover, world: ScenarioMap) -> Test:
    """Return the test whether an entity has been at or beyond the end of its roads for a duration."""
    duration = item.number("duration")

    def beyond(time: float) -> bool:
        if mover.way is None:
            return False
        last = mover.way.spans[-1]
        return mover.place(time).seen_from(last.line(last.finish)).x >= -_CLOSE

    return lambda time: time >= duration and beyond(time - duration)


_TYPES = {"vehicle": "Vehicle", "pedestrian": "Pedestrian", "miscellaneous": "MiscObject"}
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
    "CollisionCondition": _collision,
    "EndOfRoadCondition": _end_of_road,
    "RelativeClearanceCondition": relative_clearance,
    "OffroadCondition": off_road,
}


HORIZON = 120.0  # [s] of simulated time within which a trigger must occur
_STEP = 0.02  # [s] between the samples in the search for a change
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
    name: str = ""  # name in the file
    switch: bool = False  # whether it compares a parameter, so that it is constant on purpose
    # times at which its value is set, in order; None for a condition that is no value set by actions [s]
    changes: Callable[[], list[float]] | None = None

    def first(self, start: float) -> float:
        """Return the first time at or after a start at which the condition triggers [s]; inf for never."""
        begin = max(start - self.delay, 0.0)
        if self.edge == "none":
            found = self._change(begin, True)
        elif self._jumps_at(begin):
            found = begin
        elif self.edge == "rising":
            found = self._change(self._change(begin, False), True)
        elif self.edge == "falling":
            found = self._change(self._change(begin, True), False)
        else:
            found = self._change(begin, not self.holds(begin))
        return max(found + self.delay, start)

    def _jumps_at(self, start: float) -> bool:
        """Return whether the condition has its edge just at a time, by what happens at this time [s]."""
        found = [inf if self.jump is None else self.jump()] if self.changes is None else self.changes()
        change = next((item for item in found if 0.0 < item < inf and abs(item - start) <= _CLOSE), None)
        if change is None:
            return False
        before, after = self.holds(change - _JUST), self.holds(change + _JUST)
        return before != after and (self.edge == "risingOrFalling" or (self.edge == "rising") == after)

    def reason(self, start: float) -> str:
        """Return why the condition does not trigger at or after a start [s]; empty if it does."""
        if self.first(start) < inf:
            return ""
        holds = self.holds(max(start - self.delay, 0.0))
        if self.edge == "none" or (self.edge == "rising") != holds:
            return f"condition {self.name!r} never {'ceases to hold' if holds else 'holds'}"
        state, edge = ("holds", "rising") if holds else ("does not hold", "falling")
        return (
            f"condition {self.name!r} {state} from the beginning, so that it has no {edge} edge; "
            'use conditionEdge="none"'
        )

    def _change(self, start: float, value: bool) -> float:
        """Return the first time at or after a start at which `holds` has a value [s]."""
        if start == inf:
            return inf
        if self.changes is not None:
            later = [start, *(change for change in self.changes() if change > start)]
            return next((time for time in later if self.holds(time) == value), inf)
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

    def reason(self, start: float) -> str:
        """Return why it never triggers at or after a start [s]; empty if parameters switch it off."""
        on = [
            group
            for group in self._groups
            if not any(condition.switch and condition.reason(start) for condition in group)
        ]
        reasons = [self._group_reason(group, start) for group in on]
        return "; ".join(dict.fromkeys(reasons))

    def _group_reason(self, group: list[Condition], start: float) -> str:
        names = ", ".join(repr(condition.name) for condition in group)
        together = (
            f"the conditions {names} never trigger at the same time; an edge lasts an instant, "
            'conditionEdge="none" does not'
        )
        return next(filter(None, (condition.reason(start) for condition in group)), together)

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
    if not all(groups):
        raise item.error(f"{item.tag} must contain a Condition in each ConditionGroup")
    if not groups:
        world.note(item, f"{item.tag} has no condition; it starts at once")
    return Trigger(groups)


def _condition(item: Element, world: ScenarioMap, states: States) -> Condition:
    edge, delay = item.choice("conditionEdge", EDGES), item.number("delay", 0.0)
    if delay < 0.0:
        raise item.error(f"Condition delay must be >= 0 s, got {delay:g}")
    kind = item.only("ByValueCondition", "ByEntityCondition")
    jump = changes = None
    if kind.tag == "ByEntityCondition":
        holds = entity_test(kind, world)
    elif kind.find(*SET_BY_ACTIONS) is not None:
        holds, changes = _of_value(kind, world)
    else:
        holds, jump = _by_value(kind, states)
    switch = kind.find("ParameterCondition") is not None
    return Condition(holds, jump, edge, delay, item.label() if item.has("name") else "", switch, changes)


SET_BY_ACTIONS = {
    "ParameterCondition": "parameterRef",
    "VariableCondition": "variableRef",
    "TrafficSignalCondition": "name",
}
"""Conditions on values that actions set, and their attributes with the name of the value."""
_BY_VALUE = ("SimulationTimeCondition", "StoryboardElementStateCondition", *SET_BY_ACTIONS)


def _of_value(item: Element, world: ScenarioMap) -> tuple[Test, Callable[[], list[float]]]:
    """Return the test of a value that actions set, and the times at which they set it."""
    found = item.only(*_BY_VALUE)
    name = found.name_of(SET_BY_ACTIONS[found.tag])
    if found.tag == "TrafficSignalCondition":
        name, rule, bound = signal_key(found.text("name")), "equalTo", found.text("state")
        world.values.setdefault(name, [(-inf, "")])
    else:
        rule, bound = found.choice("rule", RULES), found.text("value")
        with found.locate_errors():
            compare(found.resolve(f"${name}"), rule, bound)

    def met(time: float) -> bool:
        with found.locate_errors():
            return compare(world.value_of(found, name, time), rule, bound)

    return met, lambda: [time for time, _ in world.values.get(name, []) if time > -inf]


def _by_value(item: Element, states: States) -> tuple[Test, Callable[[], float]]:
    found = item.only(*_BY_VALUE)
    if found.tag == "SimulationTimeCondition":
        limit, rule = found.number("value"), found.choice("rule", RULES[1:5])
        return (lambda time: meets(time, rule, limit)), (lambda: limit)
    key = found.text("storyboardElementType"), found.label("storyboardElementRef")
    known = ("completeState", "endTransition", "startTransition", "runningState")
    state = found.choice("state", known)

    def changed() -> float:
        start, end = states.get(key, (inf, inf))
        return start if state in ("startTransition", "runningState") else end

    def reached(time: float) -> bool:
        start, end = states.get(key, (inf, inf))
        return changed() <= time and (state != "runningState" or time < end or end == start)

    return reached, changed
