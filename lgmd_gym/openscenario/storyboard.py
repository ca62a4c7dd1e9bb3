"""The storyboard: initial actions, and events that start in the order of their triggers."""

from dataclasses import dataclass, field
from math import inf

from lgmd_gym.openscenario.actions import ActionRun, global_action, private_action
from lgmd_gym.openscenario.conditions import HORIZON, States, Trigger, read_trigger
from lgmd_gym.openscenario.nodes import Element, Node
from lgmd_gym.openscenario.parameters import declare
from lgmd_gym.openscenario.weather import weather_of
from lgmd_gym.openscenario.world import POSITIONS, Mover, ScenarioMap

MAX_STARTS = 2000
"""Largest number of starts of events in a scenario."""


@dataclass(eq=False)
class Event:
    """An event of the storyboard."""

    item: Element
    triggers: tuple[Element | None, Element | None]  # triggers of its act and of the event itself
    groups: list[tuple[str, str]]  # kind and name of the elements that contain it, and its own
    runs: list[tuple[str, ActionRun]]  # its actions; empty if none has an effect
    maneuver: Node  # the maneuver that contains it
    skips: bool  # whether it does not start while another event of its maneuver runs (priority "skip")
    count: int = 1  # how often it may start, in the present execution of its group
    group: "Group | None" = None  # its maneuver group, if that is carried out several times
    begin: float = 0.0  # start of the present execution of its group [s]
    act_start: float = inf  # start of its act [s]
    started: float = inf  # start [s]; inf before
    ended: float = inf  # end [s]; inf before the start

    @property
    def free_from(self) -> float:
        """Time from which it may start, after its present execution [s]."""
        return self.ended if self.ended < inf else self.begin


@dataclass(eq=False)
class Group:
    """A maneuver group with several events that is carried out more than once."""

    repeats: int  # how often it is still carried out after the present execution
    counts: list[tuple[Event, int]]  # its events, and how often each may start in an execution

    @property
    def complete(self) -> float:
        """End of the present execution [s]; inf before all its events are complete."""
        left = any(event.count for event, _ in self.counts)
        return inf if left else max(event.ended for event, _ in self.counts)


@dataclass
class Storyboard:
    """The events of a scenario, and what has happened."""

    events: list[Event]  # the events, in the order of the file
    # start and end of acts, maneuvers, events and actions by kind and name [s]
    states: States = field(default_factory=States)

    def play(self, world: ScenarioMap) -> list[str]:
        """Carry out all events that have an effect, in the order of their triggers.

        Returns:
            A note with file and line for each event with an effect that never starts, unless a
            `ParameterCondition` switches it off.
        """
        waiting = [event for event in self.events if self._matters(event)]
        for event in self.events:
            if event not in waiting:
                _skip_triggers(event)
        triggers = {
            event: (
                read_trigger(event.triggers[0], world, self.states),
                read_trigger(event.triggers[1], world, self.states),
            )
            for event in waiting
        }
        now = last = 0.0
        for _ in range(MAX_STARTS):
            times = [self._start(event, *triggers[event], now) for event in waiting]
            if min(times, default=inf) == inf:  # again, with the starts of the acts
                times = [self._start(event, *triggers[event], now) for event in waiting]
            now = min(times, default=inf)
            if now == inf:
                break
            event, last = waiting[times.index(now)], now
            if now > HORIZON:
                world.note(
                    event.item, f"events after {HORIZON:g} s are left out; this one starts at {now:.4g} s"
                )
                break
            self._carry_out(event, now)
            event.count -= 1
            waiting = self._still_waiting(event, waiting)
        else:
            raise waiting[0].item.error(
                f"events start more than {MAX_STARTS} times; lower maximumExecutionCount"
            )
        notes: list[str] = []
        for event in waiting:
            event.item.skip()
            reason = _reason(*triggers[event], last)
            if event.runs and reason and event.started == inf and event.begin == 0.0:
                notes.append(str(event.item.error(f"event {event.item.label()!r} never starts: {reason}")))
        return notes

    def _still_waiting(self, event: Event, waiting: list[Event]) -> list[Event]:
        """Return the events that wait after one has been carried out, in the order of the file."""
        if event.count == 0 or event.ended == inf:
            waiting = [item for item in waiting if item is not event]
        if event.group is not None and self._repeat(event.group):
            waiting = [item for item in self.events if item in waiting or item.group is event.group]
        return waiting

    def _start(self, event: Event, act: Trigger, own: Trigger, now: float) -> float:
        """Return the time at which an event starts, and note the start of its act [s].

        Args:
            event: The event.
            act: Trigger of its act.
            own: Its own trigger.
            now: Present time [s].
        """
        begun = act.first(0.0)
        event.act_start = begun
        for key in event.groups[:-1]:
            start, end = self.states.get(key, (inf, inf))
            self.states[key] = min(begun, start), end
        return own.first(max(begun, now, event.free_from)) if begun < inf else inf

    def _repeat(self, group: Group) -> bool:
        """Begin the next execution of a group if the present one is complete; return whether it began."""
        end = group.complete
        if end == inf or group.repeats == 0:
            return False
        group.repeats -= 1
        for event, count in group.counts:
            event.count, event.begin, event.started, event.ended = count, end, inf, inf
            for key in event.groups[3:]:  # its maneuver and itself
                self.states[key] = inf, inf
        return True

    def _matters(self, event: Event) -> bool:
        """Return whether an event changes the motion, or another event that does waits for it."""
        group = [] if event.group is None else [other for other, _ in event.group.counts]
        if event.runs or any(other.runs for other in group):
            return True
        names = {name for _, name in event.groups}
        return any(
            reference.label("storyboardElementRef") in names
            for other in self.events
            if other.runs
            for trigger in other.triggers
            if trigger is not None
            for reference in _references(trigger)
        )

    def _carry_out(self, event: Event, now: float) -> None:
        if event.skips and any(
            other.maneuver is event.maneuver and other.started <= now < other.ended for other in self.events
        ):
            raise event.item.error(
                f"Event priority='skip' while another event of its Maneuver runs, at {now:.3g} s, is not "
                "supported; use override"
            )
        event.started = event.ended = now
        for name, run in event.runs:
            end = run(now)
            self.states["action", name] = now, end
            event.ended = max(event.ended, end)
        for key in event.groups:
            members = [other for other in self.events if key in other.groups and self._matters(other)]
            start = event.started if key[0] == "event" else min(other.act_start for other in members)
            self.states[key] = start, max(other.ended for other in members)


def _skip_triggers(event: Event) -> None:
    for trigger in event.triggers:
        if trigger is not None:
            trigger.skip()


def _reason(act: Trigger, own: Trigger, now: float) -> str:
    """Return why an event never starts; empty if parameters switch it off.

    Args:
        act: Trigger of its act.
        own: Its own trigger.
        now: Last start of another event [s].
    """
    begun = act.first(0.0)
    if begun < inf:
        return own.reason(max(begun, now))
    reason = act.reason(0.0)
    return f"its act does not: {reason}" if reason else ""


def _references(trigger: Element) -> list[Element]:
    """Return the references to elements of the storyboard in a trigger."""
    found: list[Element] = []
    for group in trigger.all("ConditionGroup"):
        for condition in group.all("Condition"):
            for value in condition.all("ByValueCondition"):
                found += value.all("StoryboardElementStateCondition")
    return found


def run_init(board: Element, world: ScenarioMap) -> None:
    """Carry out the initial actions.

    Routes are assigned after the positions, and lateral actions come last, because their paths depend on the
    speeds.
    """
    actions = board.child("Init").child("Actions")
    for item in actions.all("UserDefinedAction"):
        item.skip()
        world.note(item, "UserDefinedAction has no effect")
    for item in actions.all("GlobalAction"):
        _run_global(item, world)
    pending = [
        (action, run)
        for item in actions.all("Private")
        for action in item.all("PrivateAction")
        if (run := private_action(action, world.mover(item), world)) is not None
    ]
    _run_ordered([item for item in pending if _rank(item[0]) == 0], world)
    for mover in world.movers.values():
        world.settle(mover)
    for rank in (1, 2):
        _run_ordered([item for item in pending if _rank(item[0]) == rank], world)


def _run_global(item: Element, world: ScenarioMap) -> None:
    """Carry out an initial `GlobalAction`."""
    found = item.find("EnvironmentAction")
    if found is not None:
        world.weather = weather_of(world.catalogs.resolve(found, "Environment"))
        return
    run = global_action(item, world)
    if run is not None:
        run(0.0)


def _rank(action: Element) -> int:
    """Return the place of an initial action: 1 for routes, 2 for lateral actions, 0 for others."""
    routing = action.find("RoutingAction")
    if routing is not None and routing.find("AssignRouteAction", "AcquirePositionAction"):
        return 1
    return 2 if action.find("LateralAction") is not None else 0


def _is_placed(action: Element, world: ScenarioMap) -> bool:
    """Return whether the entities that the position of a teleport refers to have positions."""
    teleport = action.find("TeleportAction")
    position = None if teleport is None else teleport.find("Position")
    if position is None:
        return True
    found = list(position.all(*POSITIONS))
    return all(not item.has("entityRef") or world.mover(item).track is not None for item in found)


def _run_ordered(pending: list[tuple[Element, ActionRun]], world: ScenarioMap) -> None:
    """Carry out initial actions in their order; one waits for the position that it refers to."""
    while pending:
        ready = next((item for item in pending if _is_placed(item[0], world)), pending[0])
        pending.remove(ready)
        ready[1](0.0)


def read_story(board: Element, world: ScenarioMap) -> Storyboard:
    """Return the events of all stories."""
    events: list[Event] = []
    for story in board.all("Story"):
        story = Element(story.node, declare(story, {}))
        for act in story.all("Act"):
            stop = act.find("StopTrigger")
            if stop is not None:
                stop.skip()
            trigger, before = act.find("StartTrigger"), len(events)
            for group in act.all("ManeuverGroup"):
                events += _group_events(story, act, trigger, group, world)
            if len(events) == before and trigger is not None:
                trigger.skip()
    return Storyboard(events)


def _group_events(
    story: Element, act: Element, trigger: Element | None, group: Element, world: ScenarioMap
) -> list[Event]:
    repeats = _execution_count(group)
    actors = group.child("Actors")
    selects = actors.flag("selectTriggeringEntities")
    movers = [world.mover(item) for item in actors.all("EntityRef")]
    maneuvers = [Element(item.node, declare(item, {})) for item in group.all("Maneuver")]
    maneuvers += [world.catalogs.entry(item, "Maneuver") for item in group.all("CatalogReference")]
    outer = [("story", story.label()), ("act", act.label()), ("maneuverGroup", group.label())]
    events: list[Event] = []
    for maneuver in maneuvers:
        for event in maneuver.all("Event"):
            count = _execution_count(event)
            if repeats * count == 0:
                event.skip()
                continue
            priority = event.choice("priority", ("override", "overwrite", "parallel", "skip"))
            names = [*outer, ("maneuver", maneuver.label()), ("event", event.label())]
            runs = [run for action in event.all("Action") for run in _runs(action, movers, world)]
            if selects and any(action.find("PrivateAction") for action in event.all("Action")):
                raise actors.error("selectTriggeringEntities=true is not supported; list the entities")
            triggers = trigger, event.find("StartTrigger")
            if world.ego is not None and any(_needs_contact(item, world.ego.name) for item in triggers):
                event.skip()
                world.note(
                    event,
                    f"event {event.label()!r} waits for a contact of the ego, which ends the episode; it is "
                    "left out",
                )
                continue
            found = Event(event, triggers, names, runs, maneuver.node, priority == "skip", count)
            events.append(found)
    if len(events) == 1:
        events[0].count *= repeats
    elif repeats > 1:
        repeated = Group(repeats - 1, [(event, event.count) for event in events])
        for event in events:
            event.group = repeated
    return events


def _needs_contact(trigger: Element | None, ego: str) -> bool:
    """Return whether a trigger waits for a contact of the ego in each group of its conditions."""
    groups = [] if trigger is None else list(trigger.all("ConditionGroup"))
    return bool(groups) and all(
        any(_is_contact(condition, ego) for condition in group.all("Condition")) for group in groups
    )


def _is_contact(condition: Element, ego: str) -> bool:
    """Return whether a condition is a contact of the ego."""
    kind = condition.find("ByEntityCondition")
    if kind is None:
        return False
    found = kind.child("EntityCondition").find("CollisionCondition")
    if found is None:
        return False
    triggering = [item.text("entityRef") for item in kind.child("TriggeringEntities").all("EntityRef")]
    return triggering == [ego] or any(item.text("entityRef") == ego for item in found.all("EntityRef"))


def _execution_count(item: Element) -> int:
    """Return how often a maneuver group or an event is carried out."""
    count = item.whole("maximumExecutionCount", 1)
    if count < 0:
        raise item.error(f"{item.tag} maximumExecutionCount must be >= 0, got {count}")
    return count


def _runs(action: Element, movers: list[Mover], world: ScenarioMap) -> list[tuple[str, ActionRun]]:
    if not action.node.children:
        world.note(action, f"Action {action.label()!r} is empty and has no effect")
        return []
    found = action.only("PrivateAction", "GlobalAction", "UserDefinedAction")
    if found.tag == "UserDefinedAction":
        found.skip()
        world.note(found, "UserDefinedAction has no effect")
        return []
    if found.tag == "GlobalAction":
        runs = [global_action(found, world)]
    else:
        runs = [private_action(found, mover, world) for mover in movers]
    return [(action.label(), run) for run in runs if run is not None]
