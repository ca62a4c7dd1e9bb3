"""The storyboard: initial actions, and events that start in the order of their triggers."""

from dataclasses import dataclass, field
from math import inf

from lgmd_gym.openscenario.actions import ActionRun, global_action, private_action, settle
from lgmd_gym.openscenario.conditions import States, Trigger, read_trigger
from lgmd_gym.openscenario.nodes import Element, Node
from lgmd_gym.openscenario.parameters import declare
from lgmd_gym.openscenario.world import Mover, ScenarioMap


@dataclass(eq=False)
class Event:
    """An event of the storyboard."""

    item: Element
    triggers: tuple[Element | None, Element | None]  # triggers of its act and of the event itself
    groups: list[tuple[str, str]]  # kind and name of the elements that contain it, and its own
    runs: list[tuple[str, ActionRun]]  # its actions; empty if none has an effect
    maneuver: Node  # the maneuver that contains it
    skips: bool  # whether it does not start while another event of its maneuver runs (priority "skip")
    started: float = inf  # start [s]; inf before
    ended: float = inf  # end [s]; inf before the start


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
                for trigger in event.triggers:
                    if trigger is not None:
                        trigger.skip()
        triggers = [
            (read_trigger(act, world, self.states), read_trigger(own, world, self.states))
            for act, own in (event.triggers for event in waiting)
        ]
        now = last = 0.0
        while waiting:
            times = [_start(act, own, now) for act, own in triggers]
            now = min(times)
            if now == inf:
                break
            index = times.index(now)
            triggers.pop(index)
            self._carry_out(waiting.pop(index), now)
            last = now
        for event in waiting:
            event.item.skip()
        notes: list[str] = []
        for event, (act, own) in zip(waiting, triggers, strict=True):
            reason = _reason(act, own, last)
            if event.runs and reason:
                name = event.item.text("name", "")
                notes.append(str(event.item.error(f"event {name!r} never starts: {reason}")))
        return notes

    def _matters(self, event: Event) -> bool:
        """Return whether an event changes the motion, or another event that does refers to it."""
        if event.runs:
            return True
        names = {name for _, name in event.groups}
        return any(
            reference.text("storyboardElementRef") in names
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
            start = min(other.started for other in members)
            self.states[key] = start, max(other.ended for other in members)


def _start(act: Trigger, own: Trigger, now: float) -> float:
    """Return the time at which an event starts, given the triggers of its act and its own [s]."""
    begun = act.first(0.0)
    return own.first(max(begun, now)) if begun < inf else inf


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


def run_init(board: Element, world: ScenarioMap) -> Element | None:
    """Carry out the initial actions; return the environment, None without one."""
    environment, actions = None, board.child("Init").child("Actions")
    for item in actions.all("GlobalAction"):
        found = item.only("EnvironmentAction", "VariableAction")
        if found.tag == "EnvironmentAction":
            environment = world.catalogs.resolve(found, "Environment")
        else:
            found.skip()
    for item in actions.all("Private"):
        mover = world.mover(item)
        for action in item.all("PrivateAction"):
            run = private_action(action, mover, world)
            if run is not None:
                run(0.0)
    for mover in world.movers.values():
        settle(world, mover)
    return environment


def read_story(board: Element, world: ScenarioMap) -> Storyboard:
    """Return the events of all stories."""
    events: list[Event] = []
    for story in board.all("Story"):
        story = Element(story.node, declare(story, {}))
        for act in story.all("Act"):
            stop = act.find("StopTrigger")
            if stop is not None:
                stop.skip()
            trigger = act.find("StartTrigger")
            for group in act.all("ManeuverGroup"):
                events += _group_events(story, act, trigger, group, world)
    return Storyboard(events)


def _group_events(
    story: Element, act: Element, trigger: Element | None, group: Element, world: ScenarioMap
) -> list[Event]:
    _once(group)
    actors = group.child("Actors")
    if actors.flag("selectTriggeringEntities"):
        raise actors.error("selectTriggeringEntities=true is not supported; list the entities")
    movers = [world.mover(item) for item in actors.all("EntityRef")]
    maneuvers = [*group.all("Maneuver")]
    maneuvers += [world.catalogs.entry(item, "Maneuver") for item in group.all("CatalogReference")]
    outer = [("story", story.text("name")), ("act", act.text("name")), ("maneuverGroup", group.text("name"))]
    events: list[Event] = []
    for maneuver in maneuvers:
        for event in maneuver.all("Event"):
            _once(event)
            priority = event.choice("priority", ("override", "overwrite", "parallel", "skip"))
            names = [*outer, ("maneuver", maneuver.text("name")), ("event", event.text("name"))]
            runs = [run for action in event.all("Action") for run in _runs(action, movers, world)]
            triggers = trigger, event.find("StartTrigger")
            events.append(Event(event, triggers, names, runs, maneuver.node, priority == "skip"))
    return events


def _runs(action: Element, movers: list[Mover], world: ScenarioMap) -> list[tuple[str, ActionRun]]:
    found = action.only("PrivateAction", "GlobalAction")
    if found.tag == "GlobalAction":
        runs = [global_action(found, world)]
    else:
        runs = [private_action(found, mover, world) for mover in movers]
    return [(action.text("name"), run) for run in runs if run is not None]


def _once(item: Element) -> None:
    if item.number("maximumExecutionCount", 1.0) != 1.0:
        raise item.error(f"{item.tag} maximumExecutionCount must be 1")
