"""Conditions: the first time at which one holds, for entities that move as compiled so far.

The ego drives undisturbed, as on a test track without a braking system.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from lgmd_gym.openscenario.entity_conditions import Test, entity_test, meets
from lgmd_gym.openscenario.nodes import Element, LocatedError
from lgmd_gym.openscenario.parameters import RULES, compare
from lgmd_gym.openscenario.world import World

HORIZON = 120.0  # [s] of simulated time within which a trigger must occur
_STEP = 0.05  # [s] between the samples in the search for a change
_JUST = 1e-6  # [s]
EDGES = ("none", "rising", "falling", "risingOrFalling")
States = dict[tuple[str, str], tuple[float, float]]
"""Start and end of the elements of the storyboard by kind and name [s]."""


@dataclass(frozen=True)
class Condition:
    """A condition.

    Attributes:
        holds: Whether it holds at a time [s].
        jump: Time at which it changes, if that is known: -inf for a constant; None to search for it [s].
        edge: Edge at which it triggers.
        delay: Delay of the trigger [s].
    """

    holds: Callable[[float], bool]
    jump: Callable[[], float] | None
    edge: str
    delay: float

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
                return self._bisect(time, time + _STEP, value)
            time += _STEP
        return inf

    def _bisect(self, low: float, high: float, value: bool) -> float:
        while high - low > 1e-12 * max(high, 1.0):
            middle = (low + high) / 2
            if self.holds(middle) == value:
                high = middle
            else:
                low = middle
        return high


class Trigger:
    """Groups of conditions; all conditions of one group must hold.

    Args:
        groups: The groups; no groups for a trigger at once.
    """

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


def read_trigger(item: Element | None, world: World, states: States) -> Trigger:
    """Return a `StartTrigger`; None is one at once.

    Args:
        item: The trigger.
        world: Entities.
        states: Start and end of the elements of the storyboard, filled while they run.
    """
    if item is None:
        return Trigger([])
    groups = [
        [_condition(entry, world, states) for entry in group.all("Condition")]
        for group in item.all("ConditionGroup")
    ]
    if not groups or not all(groups):
        raise item.error(f"{item.tag} must contain a Condition")
    return Trigger(groups)


def _condition(item: Element, world: World, states: States) -> Condition:
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
        try:
            met = compare(found.resolve(f"${name}"), rule, bound)
        except LocatedError:
            raise
        except ValueError as error:
            raise found.error(str(error)) from None
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
