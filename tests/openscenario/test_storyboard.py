"""Triggers and actions: the compiled motion, by hand.

The ego starts at s = 100 m with 10 m/s; the target stands 60 m ahead of it. Both are 4 m long, with the
reference point in their centre: the ego has contact after 5.6 s.
"""

import re
from math import inf

import pytest
from support.openscenario import (
    AWAY,
    CORNER,
    START,
    at,
    compiled,
    entity_condition,
    event,
    lane_position,
    parameter,
    private,
    scenario,
    segments,
    speed,
    story,
    teleport,
    value_condition,
    vehicle,
    world_position,
)

from lgmd_gym.openscenario.conditions import Condition, meets

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
# The target 10 m to the left; between the boxes, 56 m and 8 m.
BESIDE = START.replace(lane_position(160), '<RelativeObjectPosition entityRef="Ego" dx="60" dy="10"/>')
HEADWAY = '<TimeHeadwayCondition entityRef="Target" value="4" rule="lessOrEqual" freespace="false"/>'
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
        (HEADWAY, 2.0),
        (REACH, 2.8),
        (NEAR, 1.5),
        ('<SpeedCondition value="9.5" rule="greaterThan"/>', 0.0),
        ('<SpeedCondition value="9.5" rule="lessThan"/>', None),
        (relative("RelativeSpeedCondition", "greaterThan", 9), 0.0),
        ('<AccelerationCondition value="-1" rule="lessThan" direction="longitudinal"/>', None),
        ('<AccelerationCondition value="1" rule="lessThan"/>', 0.0),
        ('<SpeedCondition value="9.5" rule="greaterThan" direction="longitudinal"/>', 0.0),
        (relative("RelativeSpeedCondition", "greaterThan", 9, 'direction="longitudinal"'), 0.0),
        ('<StandStillCondition duration="1"/>', None),
    ],
)
def test_conditions_of_entities(tmp_path, condition, time):
    found = started(tmp_path, entity_condition(condition))
    assert found == (None if time is None else pytest.approx(time, abs=1e-6))


@pytest.mark.parametrize(
    ("more", "time"),
    [
        ("", 6.0 - (40.0**2 - 10.0**2) ** 0.5 / 10.0),  # Euclidean without a type
        ('relativeDistanceType="euclidianDistance"', 6.0 - (40.0**2 - 10.0**2) ** 0.5 / 10.0),
        ('relativeDistanceType="cartesianDistance"', 6.0 - (40.0**2 - 10.0**2) ** 0.5 / 10.0),
        ('relativeDistanceType="longitudinal" coordinateSystem="entity"', 2.0),
        ('relativeDistanceType="lateral"', 0.0),
        ('alongRoute="false" routingAlgorithm="undefined"', 6.0 - (40.0**2 - 10.0**2) ** 0.5 / 10.0),
    ],
)
def test_distance_types_of_a_headway(tmp_path, more, time):
    found = started(tmp_path, entity_condition(HEADWAY.replace("/>", f" {more}/>")), init=BESIDE)
    assert found == pytest.approx(time, abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "value", "time"),
    [
        ("longitudinal", 20, 3.6),
        ("lateral", 8.5, 0.0),
        ("euclidianDistance", 10, 5.0),  # 6 m along and 8 m across
    ],
)
def test_free_space_between_boxes(tmp_path, kind, value, time):
    condition = distance(kind, value, rule="lessOrEqual", freespace="true")
    assert started(tmp_path, entity_condition(condition), init=BESIDE) == pytest.approx(time, abs=1e-6)


def test_free_space_to_a_body_that_faces_the_other_way(tmp_path):
    """The reference points are rear axles, 1 m behind the centres: 60 - 3 - 3 m between the fronts."""
    oncoming = START.replace(lane_position(160), world_position(160, -1.75, 3.141592653589793))
    found = segments(
        tmp_path,
        story("Target", event("E", AWAY, entity_condition(distance("longitudinal", 20, freespace="true")))),
        oncoming,
        entities=vehicle("Ego", x=1.0) + vehicle("Target", x=1.0),
    )
    assert found[0].start == pytest.approx(3.4, abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "value", "time"), [("", 2.5, 4.0), ("longitudinal", 2, 4.0), ("longitudinal", 2.5, 3.5)]
)
def test_time_to_collision_uses_its_distance(tmp_path, kind, value, time):
    """The Euclidean time is (x² + 10²) / (10 x) s at x = 60 - 10 t: 2.5 s at 20 m."""
    more = f'relativeDistanceType="{kind}"' if kind else ""
    condition = TTC.replace('freespace="true"', f'freespace="false" {more}').replace(
        'value="2"', f'value="{value}"'
    )
    assert started(tmp_path, entity_condition(condition), init=BESIDE) == pytest.approx(time, abs=1e-6)


CORNER_ROUTE = (
    '<RoutingAction><AcquirePositionAction><Position><RoadPosition roadId="2" s="90" t="0"/></Position>'
    "</AcquirePositionAction></RoutingAction>"
)


def test_total_acceleration_in_a_curve(tmp_path):
    """10 m/s on the arc with a radius of 11.75 m, 30 m ahead: 8.5 m/s² across, none along."""
    init = private(
        "Ego", f"<TeleportAction><Position>{lane_position(70)}</Position></TeleportAction>", speed(10)
    ) + teleport("Target", world_position(111.75, 60))
    init = init.replace("</Private>", f"<PrivateAction>{CORNER_ROUTE}</PrivateAction></Private>", 1)
    for more, expected in (("", [3.0]), ('direction="longitudinal"', [])):
        trigger = entity_condition(f'<AccelerationCondition value="8" rule="greaterThan" {more}/>')
        found = compiled(tmp_path, scenario(init, story("Target", event("E", AWAY, trigger))), roads=CORNER)
        starts = [item.start for item in found.world.movers["Target"].timeline.segments]
        assert starts == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("trigger", "reason"),
    [
        (value_condition('<SimulationTimeCondition value="1" rule="lessThan"/>', "rising"),
         "condition 'c' holds from the beginning, so that it has no rising edge"),
        (value_condition('<SimulationTimeCondition value="0" rule="lessThan"/>', "falling"),
         "condition 'c' does not hold from the beginning, so that it has no falling edge"),
        (entity_condition('<SpeedCondition value="9.5" rule="lessThan"/>'), "condition 'c' never holds"),
        (entity_condition('<SpeedCondition value="9.5" rule="greaterThan"/>', edge="falling"),
         "condition 'c' never ceases to hold"),
    ],
)  # fmt: skip
def test_events_that_never_start_are_noted(tmp_path, trigger, reason):
    found = compiled(tmp_path, scenario(START, story("Target", event("E", AWAY, trigger))))
    (note,) = found.notes
    assert re.search(rf"case\.xosc:\d+: event 'E' never starts: {reason}", note)


def test_reasons_for_events_that_never_start(tmp_path):
    never = value_condition('<SimulationTimeCondition value="1" rule="lessThan"/>', "rising")
    apart = both(at(1).replace('"none" delay="0"', '"rising" delay="2"'),
                 at(1.5).replace('"none" delay="0"', '"rising" delay="2"'))  # fmt: skip
    texts = [
        story("Target", event("E", AWAY, apart)),
        story("Target", event("E", AWAY, at(1)), trigger=never),
        story("Target", event("E", AWAY, at(1))),
        story("Target", event("Light", "<AppearanceAction><LightStateAction/></AppearanceAction>", never)),
    ]
    notes = [compiled(tmp_path, scenario(START, text)).notes for text in texts]
    assert "the conditions 'c', 'c' never trigger at the same time" in notes[0][0]
    assert "its act does not: condition 'c' holds from the beginning" in notes[1][0]
    assert notes[2:] == [(), ()]  # it starts; and it has no effect
    off = value_condition('<ParameterCondition parameterRef="x" rule="equalTo" value="1"/>')
    for text in (event("E", AWAY, off), event("E", AWAY, both(off, at(1)))):
        found = compiled(tmp_path, scenario(START, story("Target", text), parameters=parameter("x", "3")))
        assert found.notes == ()  # switched off by a parameter


def test_an_event_that_would_be_skipped_is_refused(tmp_path):
    first, second = event("First", AWAY, at(1)), event("Second", speed(0, "rate", "linear", 3), at(2))
    text = scenario(START, story("Target", first, second.replace("override", "skip")))
    with pytest.raises(ValueError, match=r"case\.xosc:\d+: Event priority='skip' while another .* at 2 s"):
        compiled(tmp_path, text)
    late = scenario(START, story("Target", first, second.replace("override", "skip").replace('"2"', '"5"')))
    assert len(compiled(tmp_path, late).world.movers["Target"].timeline.segments) == 2


@pytest.mark.parametrize(
    "action",
    [
        speed("1e308", "distance", "linear", "1e-300"),
        speed("1e200", "rate", "linear", 2),
        "<RoutingAction><FollowTrajectoryAction><TimeReference><None/></TimeReference><TrajectoryRef>"
        '<Trajectory name="t" closed="false"><Shape><Clothoid curvature="1" curvaturePrime="0" '
        'length="1e15"><Position><WorldPosition x="160" y="-1"/></Position></Clothoid></Shape></Trajectory>'
        "</TrajectoryRef>"
        '<TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction></RoutingAction>',
    ],
)
def test_huge_numbers_are_refused_in_one_line(tmp_path, action):
    with pytest.raises(ValueError, match=r"case\.xosc:\d+: ") as caught:
        compiled(tmp_path, scenario(START, story("Target", event("E", action, at(1)))))
    assert "\n" not in str(caught.value)


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


@pytest.mark.parametrize(
    ("edge", "delay", "start", "time"),
    [
        # The condition holds from 1 s on. A delay counts from then, whether or not the event can start yet.
        *(("none", 2.0, 0.0, 3.0), ("none", 2.0, 2.0, 3.0), ("none", 2.0, 2.9, 3.0), ("none", 2.0, 4.0, 4.0)),
        *(("none", 0.0, 0.0, 1.0), ("none", 0.0, 0.5, 1.0), ("none", 0.0, 2.0, 2.0)),
        *(("rising", 2.0, 0.0, 3.0), ("rising", 2.0, 2.9, 3.0), ("rising", 2.0, 3.1, inf)),
        *(("rising", 0.0, 0.9, 1.0), ("rising", 0.0, 1.1, inf), ("falling", 2.0, 0.0, inf)),
        *(("risingOrFalling", 2.0, 2.5, 3.0), ("risingOrFalling", 0.5, 0.0, 1.5)),
    ],
)
@pytest.mark.parametrize("known", [True, False])
def test_delay_counts_from_the_condition(edge, delay, start, time, known):
    """The change is known, or searched for; the result is the same."""
    condition = Condition(lambda now: now >= 1.0, (lambda: 1.0) if known else None, edge, delay)
    assert condition.first(start) == pytest.approx(time, abs=1e-6)
    assert bool(condition.reason(start)) is (time == inf)


def test_end_of_a_condition_is_delayed_too():
    falling = Condition(lambda now: now < 2.0, lambda: 2.0, "falling", 0.75)
    assert [falling.first(start) for start in (0.0, 2.0, 2.5)] == [2.75] * 3
    assert falling.first(2.76) == inf


@pytest.mark.parametrize(("rule", "time"), [("any", 2.5), ("all", None)])
def test_rules_of_several_entities(tmp_path, rule, time):
    """The ego has covered 25 m after 2.5 s; the target stands."""
    trigger = entity_condition('<TraveledDistanceCondition value="25"/>', rule=rule)
    trigger = trigger.replace(
        '<EntityRef entityRef="Ego"/>', '<EntityRef entityRef="Target"/><EntityRef entityRef="Ego"/>'
    )
    assert started(tmp_path, trigger) == (None if time is None else pytest.approx(time, abs=1e-6))


def test_headway_of_a_standing_entity_is_infinite(tmp_path):
    """From the time at which the ego has passed the target, 6 s; an entity behind has none."""
    headway = HEADWAY.replace('"Target"', '"Ego"')
    assert started(tmp_path, entity_condition(headway, "Target")) is None
    more = headway.replace("lessOrEqual", "greaterThan")
    assert started(tmp_path, entity_condition(more, "Target")) == pytest.approx(6.0, abs=1e-6)


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
    states = {"completeState": 4.5, "endTransition": 4.5, "startTransition": 1.5, "runningState": 1.5}
    for state, time in states.items():
        later = after(state).replace('delay="0"', 'delay="0.5"')
        found = segments(tmp_path, story("Target", first, event("Then", slower, later)))
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
        (value_condition('<VariableCondition variableRef="x" rule="equalTo" value="1"/>'),
         "unknown parameter 'x'"),
        (at(1, "equalTo"), "SimulationTimeCondition rule='equalTo' is not supported"),
        (value_condition('<ParameterCondition parameterRef="y" rule="equalTo" value="1"/>'),
         "unknown parameter 'y'"),
        (entity_condition('<AccelerationCondition value="-1" rule="lessThan"/>'),
         "without direction compares"),
        (entity_condition('<SpeedCondition value="-1" rule="lessThan"/>'), "without direction compares"),
        (entity_condition('<SpeedCondition value="1" rule="lessThan" direction="vertical"/>'),
         "direction='vertical' is not supported; use longitudinal"),
        (entity_condition(HEADWAY.replace("/>", ' routingAlgorithm="fastest"/>')),
         "routingAlgorithm='fastest' is not"),
        (entity_condition(NEAR.replace('freespace="false"', 'coordinateSystem="trajectory"')),
         "coordinateSystem='trajectory' is not supported; use entity or road or lane"),
        ("<StartTrigger><ConditionGroup/></StartTrigger>", "StartTrigger must contain a Condition in each"),
        (entity_condition(REACH, delay=-1), "Condition delay must be >= 0 s, got -1"),
    ],
)  # fmt: skip
def test_unsupported_conditions(tmp_path, trigger, message):
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: .*{message}"):
        compiled(tmp_path, scenario(START, story("Target", event("E", AWAY, trigger))))
