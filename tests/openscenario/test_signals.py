"""Values that actions set: states of traffic signals and parameters that change more than once."""

import pytest
from support.openscenario import AWAY, START, at, compiled, event, parameter, scenario, story, value_condition


def global_event(name, action, trigger):
    return (
        f'<Event name="{name}" priority="parallel"><Action name="{name}A"><GlobalAction>{action}'
        f"</GlobalAction></Action>{trigger}</Event>"
    )


def signal(state, time, name="7"):
    inside = f'<TrafficSignalStateAction name="{name}" state="{state}"/>'
    action = (
        f"<InfrastructureAction><TrafficSignalAction>{inside}</TrafficSignalAction></InfrastructureAction>"
    )
    return global_event(f"{state}{name}", action, at(time))


LIGHTS = (signal("yellow", 1), signal("red", 3), signal("green", 5), signal("red", 0.5, "8"))


def condition(state, name="7", **kwargs):
    return value_condition(f'<TrafficSignalCondition name="{name}" state="{state}"/>', **kwargs)


def started(folder, events, trigger, **kwargs):
    found = compiled(folder, scenario(START, story("Target", *events, event("E", AWAY, trigger)), **kwargs))
    segments = found.world.movers["Target"].timeline.segments
    return (segments[0].start if segments else None), [note.split(": ", 1)[1] for note in found.notes]


@pytest.mark.parametrize(
    ("trigger", "time"),
    [
        (condition("yellow"), 1.0),
        (condition("red"), 3.0),
        (condition("red", edge="rising"), 3.0),
        (condition("red", delay=0.5), 3.5),
        (condition("red", edge="rising", delay=0.5), 3.5),
        (condition("yellow", edge="falling"), 3.0),
        (condition("green", edge="risingOrFalling"), 5.0),
        (condition("red", "8"), 0.5),  # each signal has its own state
        (condition("off"), None),
    ],
)
def test_states_of_signals(tmp_path, trigger, time):
    """Signal 7 is yellow from 1 s, red from 3 s and green from 5 s; signal 8 red from 0.5 s."""
    found, notes = started(tmp_path, LIGHTS, trigger)
    assert found == (None if time is None else pytest.approx(time, abs=1e-6))
    assert ("event 'E' never starts: condition 'c' never holds" in notes) == (time is None)


def test_notes_on_signals(tmp_path):
    """A signal in a condition is not drawn; one in no condition has no effect."""
    _, notes = started(tmp_path, LIGHTS[2:], condition("green"))
    assert set(notes) == {
        "InfrastructureAction has no effect",
        "traffic signals are not drawn; their states have an effect on conditions only",
    }


def test_signals_of_a_controller(tmp_path):
    phases = (
        '<TrafficSignals><TrafficSignalController name="c"><Phase name="p" duration="3">'
        '<TrafficSignalState trafficSignalId="7" state="red"/></Phase></TrafficSignalController>'
        "</TrafficSignals></RoadNetwork>"
    )
    text = scenario(START, story("Target", event("E", AWAY, condition("red"))))
    with pytest.raises(ValueError, match=r"case\.xosc:\d+: signal '7' of a TrafficSignalController"):
        compiled(tmp_path, text.replace("</RoadNetwork>", phases))


def test_a_parameter_that_is_set_back(tmp_path):
    """p is true from 1 to 2 s: with t > 3 s, both never hold together."""
    sets = [
        global_event(
            f"S{time}",
            f'<ParameterAction parameterRef="p"><SetAction value="{value}"/></ParameterAction>',
            at(time),
        )
        for time, value in ((1, "true"), (2, "false"))
    ]
    switch = '<ParameterCondition parameterRef="p" value="true" rule="equalTo"/>'
    declared = parameter("p", "false", "boolean")
    assert started(tmp_path, sets, value_condition(switch), parameters=declared)[0] == pytest.approx(1.0)
    later = '<SimulationTimeCondition value="{}" rule="greaterThan"/>'

    def both(time):
        second = value_condition(later.format(time)).removeprefix("<StartTrigger><ConditionGroup>")
        return value_condition(switch).replace("</ConditionGroup></StartTrigger>", second)

    assert started(tmp_path, sets, both(1.5), parameters=declared)[0] == pytest.approx(1.5)
    assert started(tmp_path, sets, both(3), parameters=declared)[0] is None
    off = switch.replace('"true"', '"false"')
    found, _ = started(tmp_path, sets, value_condition(off, edge="rising"), parameters=declared)
    assert found == pytest.approx(2.0)
