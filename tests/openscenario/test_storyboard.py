"""Triggers and actions: the compiled motion, by hand.

The ego starts at s = 100 m with 10 m/s; the target stands 60 m ahead of it. Both are 4 m long, with the
reference point in their centre: the ego has contact after 5.6 s.
"""

import pytest
from support.openscenario import (
    AWAY,
    START,
    at,
    compiled,
    entity_condition,
    event,
    lane_position,
    parameter,
    scenario,
    segments,
    speed,
    story,
    value_condition,
)

from lgmd_gym.openscenario.conditions import meets

ONE_GROUP = "</ConditionGroup></StartTrigger>"


def started(folder, trigger, **kwargs):
    """Return the time at which the target begins to accelerate; None if it never does."""
    found = segments(folder, story("Target", event("E", AWAY, trigger)), **kwargs)
    return found[0].start if found else None


def distance(kind, value, rule="lessThan", freespace="false", entity="Target"):
    return (
        f'<RelativeDistanceCondition entityRef="{entity}" relativeDistanceType="{kind}" value="{value}" '
        f'freespace="{freespace}" rule="{rule}"/>'
    )


def relative(tag, rule, value, more=""):
    return f'<{tag} entityRef="Target" rule="{rule}" value="{value}" {more}/>'


TTC = (
    '<TimeToCollisionCondition value="2" rule="lessThan" freespace="true"><TimeToCollisionConditionTarget>'
    '<EntityRef entityRef="Target"/></TimeToCollisionConditionTarget></TimeToCollisionCondition>'
)
TTC_PLACE = TTC.replace(
    '<EntityRef entityRef="Target"/>', f"<Position>{lane_position(180)}</Position>"
).replace("true", "false")
PLACE = f"<Position>{lane_position(130)}</Position>"
REACH = f'<ReachPositionCondition tolerance="2">{PLACE}</ReachPositionCondition>'
NEAR = f'<DistanceCondition value="15" rule="lessThan" freespace="false">{PLACE}</DistanceCondition>'


@pytest.mark.parametrize(
    ("condition", "time"),
    [
        ('<TraveledDistanceCondition value="25"/>', 2.5),
        (distance("longitudinal", 20), 4.0),
        (distance("longitudinal", 20, freespace="true"), 3.6),
        (distance("cartesianDistance", 30), 3.0),
        (distance("lateral", 1), 0.0),
        (distance("lateral", 1, "greaterThan"), None),
        (TTC, 3.6),  # 56 m less 36 m at 10 m/s
        (TTC_PLACE, 6.0),  # 80 m less 60 m
        ('<TimeHeadwayCondition entityRef="Target" value="3" rule="lessOrEqual" freespace="true"/>', 2.6),
        (REACH, 2.8),
        (NEAR, 1.5),
        ('<SpeedCondition value="9.5" rule="greaterThan"/>', 0.0),
        ('<SpeedCondition value="9.5" rule="lessThan"/>', None),
        (relative("RelativeSpeedCondition", "greaterThan", 9), 0.0),
        ('<AccelerationCondition value="-1" rule="lessThan"/>', None),
        ('<StandStillCondition duration="1"/>', None),
    ],
)
def test_conditions_of_entities(tmp_path, condition, time):
    found = started(tmp_path, entity_condition(condition))
    assert found == (None if time is None else pytest.approx(time, abs=1e-6))


def test_standstill_of_the_target(tmp_path):
    trigger = entity_condition('<StandStillCondition duration="1.5"/>', entity="Target")
    assert started(tmp_path, trigger) == pytest.approx(1.5, abs=1e-6)


@pytest.mark.parametrize(
    ("rule", "met"),
    [("greaterThan", False), ("greaterOrEqual", True), ("lessThan", True), ("lessOrEqual", True)],
)
def test_values_are_equal_within_a_billionth(rule, met):
    assert meets(0.3 - 4e-10, rule, 0.3) is met
    assert meets(0.3 - 4e-9, rule, 0.3) is rule.startswith("less")


@pytest.mark.parametrize(
    ("trigger", "time"),
    [
        ("", 0.0),
        (at(0.5), 0.5),
        (at(2, "greaterOrEqual"), 2.0),
        (at(2, "lessThan"), 0.0),
        (value_condition('<SimulationTimeCondition value="0" rule="greaterThan"/>', "rising"), 0.0),
        (value_condition('<SimulationTimeCondition value="1" rule="greaterThan"/>', "rising", 0.7), 1.7),
        (value_condition('<SimulationTimeCondition value="1" rule="lessThan"/>', "falling"), 1.0),
        (value_condition('<SimulationTimeCondition value="1" rule="lessThan"/>', "rising"), None),
        (value_condition('<SimulationTimeCondition value="1" rule="lessThan"/>', "risingOrFalling"), 1.0),
        (value_condition('<ParameterCondition parameterRef="x" rule="equalTo" value="3"/>'), 0.0),
        (value_condition('<ParameterCondition parameterRef="$x" rule="greaterThan" value="3"/>'), None),
        (entity_condition(distance("longitudinal", 20), edge="rising"), 4.0),
        (entity_condition(distance("longitudinal", 20), edge="rising", delay=0.25), 4.25),
    ],
)
def test_edges_delays_and_values(tmp_path, trigger, time):
    found = started(tmp_path, trigger, parameters=parameter("x", "3"))
    assert found == (None if time is None else pytest.approx(time, abs=1e-6))


def joined(*triggers):
    """Return one trigger whose groups are those of several."""
    inside = "".join(item.removeprefix("<StartTrigger>").removesuffix("</StartTrigger>") for item in triggers)
    return f"<StartTrigger>{inside}</StartTrigger>"


def both(one, other):
    """Return a trigger with one group of two conditions."""
    first = one.removesuffix(ONE_GROUP)
    second = other.removeprefix("<StartTrigger><ConditionGroup>")
    return first + second


def test_groups_and_conditions_of_a_trigger(tmp_path):
    early, late = at(1), entity_condition(distance("longitudinal", 20), edge="rising")
    assert started(tmp_path, joined(late, early)) == 1.0
    assert started(tmp_path, both(early, late)) == pytest.approx(4.0, abs=1e-6)
    assert started(tmp_path, both(late, early)) == pytest.approx(4.0, abs=1e-6)
    assert started(tmp_path, both(late, at(5))) is None  # the edge is over


def test_events_follow_the_end_of_others(tmp_path):
    def after(state, kind="event", name="First"):
        return value_condition(
            f'<StoryboardElementStateCondition storyboardElementType="{kind}" '
            f'storyboardElementRef="{name}" state="{state}"/>'
        )

    first = event("First", AWAY, at(1))  # from 1 to 4 s
    slower = speed(0, "rate", "linear", 3)
    for state, time in (("completeState", 4.0), ("endTransition", 4.0), ("startTransition", 1.0)):
        found = segments(tmp_path, story("Target", first, event("Then", slower, after(state))))
        assert [item.start for item in found][-1] == time
    found = segments(
        tmp_path, story("Target", first, event("Then", slower, after("completeState", "act", "Act")))
    )
    assert len(found) == 1  # the act ends with its last event


def test_an_event_without_effect_can_start_others(tmp_path):
    light = "<AppearanceAction><LightStateAction/></AppearanceAction>"
    then = value_condition(
        '<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="Light" '
        'state="completeState"/>'
    )
    found = segments(tmp_path, story("Target", event("Light", light, at(2)), event("E", AWAY, then)))
    assert found[0].start == 2.0


@pytest.mark.parametrize(
    ("trigger", "message"),
    [
        (entity_condition('<CollisionCondition><EntityRef entityRef="Target"/></CollisionCondition>'),
         "CollisionCondition in EntityCondition is not supported"),
        (value_condition('<VariableCondition variableRef="x" rule="equalTo" value="1"/>'),
         "VariableCondition in ByValueCondition is not supported"),
        (at(1, "equalTo"), "SimulationTimeCondition rule='equalTo' is not supported"),
        (value_condition('<ParameterCondition parameterRef="y" rule="equalTo" value="1"/>'),
         "unknown parameter 'y'"),
        (entity_condition(distance("lateral", 1, freespace="true")), "freespace is supported for long"),
        (entity_condition(distance("longitudinal", 1).replace("/>", ' coordinateSystem="lane"/>')),
         "coordinateSystem='lane' is not supported; use entity"),
        ("<StartTrigger/>", "StartTrigger must contain a Condition"),
    ],
)  # fmt: skip
def test_unsupported_conditions(tmp_path, trigger, message):
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: .*{message}"):
        compiled(tmp_path, scenario(START, story("Target", event("E", AWAY, trigger))))
