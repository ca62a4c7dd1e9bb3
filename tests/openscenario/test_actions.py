"""Actions: the compiled motion, by hand; the situation of test_storyboard.py."""

import pytest
from support.openscenario import (
    AWAY,
    CORNER,
    START,
    at,
    compiled,
    event,
    lane_position,
    pedestrian,
    private,
    scenario,
    segments,
    speed,
    story,
    teleport,
    vehicle,
    world_position,
)

from lgmd_gym.envs.dynamics.script import Bend, Segment


@pytest.mark.parametrize(
    ("action", "expected"),
    [
        (speed(6, "rate", "linear", 2), (2.0, 6.0)),
        (speed(6, "time", "linear", 4), (1.5, 6.0)),
        (speed(6, "distance", "linear", 9), (2.0, 6.0)),
        (AWAY.replace('AbsoluteTargetSpeed value="6"', 'RelativeTargetSpeed entityRef="Ego" value="-4" '
         'speedTargetValueType="delta" continuous="false"'), (2.0, 6.0)),
        (AWAY.replace('AbsoluteTargetSpeed value="6"', 'RelativeTargetSpeed entityRef="Ego" value="0.6" '
         'speedTargetValueType="factor" continuous="false"'), (2.0, 6.0)),
    ],
)  # fmt: skip
def test_changes_of_speed(tmp_path, action, expected):
    (found,) = segments(tmp_path, story("Target", event("E", action, at(1))))
    assert (found.acceleration, found.final_speed) == pytest.approx(expected)
    assert found.start == 1.0


PROFILE = """<LongitudinalAction><SpeedProfileAction followingMode="follow"><DynamicConstraints
maxAcceleration="2" maxAccelerationRate="4" maxDeceleration="3"/><SpeedProfileEntry speed="6"/>
<SpeedProfileEntry speed="3"/><SpeedProfileEntry speed="5" time="2"/></SpeedProfileAction>
</LongitudinalAction>"""


def test_speed_profiles_have_a_limit_of_jerk(tmp_path):
    """The acceleration reaches 2 m/s² after 0.5 s, at 0.5 m/s, and 6 m/s 2.75 s later."""
    first, second, third = segments(tmp_path, story("Target", event("E", PROFILE, at(1))))
    assert first == Segment(start=1.0, acceleration=2.0, build_up=0.5, final_speed=6.0)
    assert second == Segment(start=4.25, acceleration=-3.0, final_speed=3.0)
    assert third == Segment(start=5.25, acceleration=1.0, final_speed=5.0)


def test_speed_profiles_with_times(tmp_path):
    """An entry at the time 0 is a step, also in Init; the others have constant accelerations."""
    entries = '<SpeedProfileEntry speed="5" time="0"/><SpeedProfileEntry speed="8" time="2"/>'
    text = (
        '<LongitudinalAction><SpeedProfileAction followingMode="position"><DynamicConstraints maxSpeed="8"/>'
        f"{entries}</SpeedProfileAction></LongitudinalAction>"
    )
    init = START + private("Target", text)
    found = compiled(tmp_path, scenario(init)).world.movers["Target"].timeline
    assert found.at(0.0).speed == 5.0
    assert found.segments == [Segment(start=0.0, acceleration=1.5, final_speed=8.0)]
    notes = compiled(tmp_path, scenario(START, story("Target", event("E", PROFILE, at(1))))).notes
    assert [note.split(": ", 1)[1] for note in notes] == [
        "the speed changes evenly in the time; the limit of the jerk has no effect"
    ] * ("maxDecelerationRate" in PROFILE or "maxAccelerationRate" in PROFILE)


@pytest.mark.parametrize("shape", ["linear", "step"])
def test_a_change_to_the_present_speed_ends_a_change(tmp_path, shape):
    """The target has 4 m/s after 2 of 5 s; the second action keeps it."""
    events = event("E", speed(10, "rate", "linear", 2), at(1)), event("F", speed(4, "rate", shape, 2), at(3))
    found = compiled(tmp_path, scenario(START, story("Target", *events))).world.movers["Target"].timeline
    assert found.at(2.0).speed == pytest.approx(2.0)
    assert found.at(10.0).speed == pytest.approx(4.0)
    assert found.at(10.0).distance == pytest.approx(4.0 + 7.0 * 4.0)


def test_a_teleport_to_the_same_place(tmp_path):
    """It has no effect after the start, but for one to another place or heading."""
    same = '<RelativeObjectPosition entityRef="Target" dx="0" dy="0"/>'
    teleports = f"<TeleportAction><Position>{same}</Position></TeleportAction>"
    events = event("E", AWAY, at(1)), event("F", teleports, at(2))
    found = compiled(tmp_path, scenario(START, story("Target", *events)))
    assert found.scenario == compiled(tmp_path, scenario(START, story("Target", events[0]))).scenario
    turned = same.replace("/>", '><Orientation type="relative" h="0.1"/></RelativeObjectPosition>')
    with pytest.raises(ValueError, match="TeleportAction is supported at the start only, got 2 s"):
        compiled(tmp_path, scenario(START, story("Target", events[0], events[1].replace(same, turned))))


SYNC = f"""<SynchronizeAction masterEntityRef="Ego"><TargetPositionMaster>{lane_position(160)}
</TargetPositionMaster><TargetPosition>{lane_position(172)}</TargetPosition><FinalSpeed>
<AbsoluteSpeed value="4"><TargetDistanceSteadyState distance="8"/></AbsoluteSpeed></FinalSpeed>
</SynchronizeAction>"""


def test_synchronisation(tmp_path):
    """The ego is at 160 m after 6 s. The target drives 12 m until then, the last 8 m at 4 m/s: it needs 2 s
    for the first 4 m, and begins 4 s before the end."""
    (found,) = segments(tmp_path, story("Target", event("E", SYNC, at(0.5))))
    assert (found.start, found.acceleration, found.final_speed) == pytest.approx((2.0, 2.0, 4.0))
    master = SYNC.replace(
        '<AbsoluteSpeed value="4">', '<RelativeSpeedToMaster value="-6" speedTargetValueType="delta">'
    ).replace("/AbsoluteSpeed", "/RelativeSpeedToMaster")
    factor = master.replace(
        'value="-6" speedTargetValueType="delta"', 'value="0.4" speedTargetValueType="factor"'
    )
    for action in (master, factor):
        assert segments(tmp_path, story("Target", event("E", action, at(0.5)))) == [found]


def test_distances_are_set_at_the_start(tmp_path):
    """30 m of free space: the centres are 34 m apart."""
    action = (
        '<LongitudinalAction><LongitudinalDistanceAction entityRef="Ego" distance="30" freespace="true" '
        'continuous="true" displacement="leadingReferencedEntity"/></LongitudinalAction>'
    )
    text = scenario(START + private("Target", action))
    found = compiled(tmp_path, text)
    assert found.scenario.actors[0].gap == pytest.approx(30.0)
    assert found.scenario.actors[0].speed == 10.0  # it keeps its distance
    behind = compiled(tmp_path, text.replace('displacement="leadingReferencedEntity"', ""))
    assert behind.world.movers["Target"].place().x == pytest.approx(100.0 - 34.0)


def test_a_continuous_distance_copies_the_speed(tmp_path):
    keep = private(
        "Third",
        '<LongitudinalAction><LongitudinalDistanceAction entityRef="Target" timeGap="0" freespace="false" '
        'continuous="true"/></LongitudinalAction>',
    )
    entities = vehicle("Ego") + vehicle("Target") + vehicle("Third")
    init = START + teleport("Third", lane_position(170, 1)) + keep
    found = segments(tmp_path, story("Target", event("E", AWAY, at(1))), init, "Third", entities=entities)
    assert found == [Segment(start=1.0, acceleration=2.0, final_speed=6.0)]


def test_a_distance_along_a_bend_is_refused(tmp_path):
    """On a straight road along the entity, coordinates of road and entity agree; round the corner not."""
    action = (
        '<LongitudinalAction><LongitudinalDistanceAction entityRef="Ego" distance="30" freespace="false" '
        'continuous="false" displacement="leadingReferencedEntity" coordinateSystem="road"/>'
        "</LongitudinalAction>"
    )
    init = (
        teleport("Ego", lane_position(40))
        + private("Ego", speed(5))
        + teleport("Target", lane_position(45))
        + private("Target", action)
    )
    found = compiled(tmp_path, scenario(init), roads=CORNER)
    assert found.world.movers["Target"].place().x == pytest.approx(70.0)
    with pytest.raises(
        ValueError, match=r"case\.xosc:\d+: .*coordinateSystem='road' is supported on a straight"
    ):
        compiled(tmp_path, scenario(init.replace('"30"', '"80"')), roads=CORNER)


@pytest.mark.parametrize(
    ("mode", "message"), [("position", ""), ("follow", "followingMode='follow' is not supp")]
)
def test_following_mode_of_a_change_of_speed(tmp_path, mode, message):
    action = AWAY.replace("dynamicsShape", f'followingMode="{mode}" dynamicsShape')
    text = scenario(START, story("Target", event("E", action, at(1))))
    if not message:
        assert compiled(tmp_path, text).world.movers["Target"].timeline.segments[0].start == 1.0
        return
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: .*{message}"):
        compiled(tmp_path, text)


def delete(time):
    remove = '<EntityAction entityRef="Third"><DeleteEntityAction/></EntityAction>'
    text = event("E", "", at(time))
    text = text.replace("<PrivateAction></PrivateAction>", f"<GlobalAction>{remove}</GlobalAction>")
    return story("Target", text)


def test_deleted_entities_are_no_actors(tmp_path):
    entities = vehicle("Ego") + vehicle("Target") + vehicle("Third")
    init = START + teleport("Third", lane_position(140))
    found = compiled(tmp_path, scenario(init, delete(0.1), entities=entities))
    assert len(found.scenario.actors) == 1
    with pytest.raises(ValueError, match=r"DeleteEntityAction at 3 s is supported in the first 0\.2 s only"):
        compiled(tmp_path, scenario(init, delete(3), entities=entities))


ROUTE = """<RoutingAction><AssignRouteAction><Route name="r" closed="false">
<Waypoint routeStrategy="shortest"><Position><LanePosition roadId="0" laneId="-1" s="0"/></Position>
</Waypoint><Waypoint routeStrategy="shortest"><Position><LanePosition roadId="2" laneId="-1" s="90"/>
</Position></Waypoint></Route></AssignRouteAction></RoutingAction>"""
ACQUIRE = (
    '<RoutingAction><AcquirePositionAction><Position><RoadPosition roadId="2" s="90" t="0"/></Position>'
    "</AcquirePositionAction></RoutingAction>"
)


@pytest.mark.parametrize("action", [ROUTE, ACQUIRE])
def test_routes_are_paths_beside_the_reference_lines(tmp_path, action):
    """The ego drives in the right lane, round the corner with a radius of 11.75 m, 30 m after its start."""
    init = private(
        "Ego", f"<TeleportAction><Position>{lane_position(70)}</Position></TeleportAction>", speed(10), action
    ) + teleport("Target", world_position(111.75, 60))
    found = compiled(tmp_path, scenario(init), roads=CORNER)
    assert found.contact < 10.0
    straight, arc, *_ = found.world.movers["Ego"].track.bends
    assert straight.length == pytest.approx(30.0)
    assert (arc.length, arc.curvature) == pytest.approx((11.75 * 1.5707963267948966, 1 / 11.75))


def test_an_entity_follows_its_road(tmp_path):
    init = private(
        "Ego",
        f"<TeleportAction><Position>{lane_position(2, 1, 1)}</Position></TeleportAction>",
        speed(10),
    )
    found = compiled(tmp_path, scenario(init, entities=vehicle("Ego")), roads=CORNER)
    (bend,) = found.scenario.ego_path[-1:]
    assert bend.curvature == pytest.approx(-1 / 8.25)  # lane 1 against the reference line
    # 10 s before it begins at the given speed, straight on: 2 m of the line are left.
    assert bend.length == pytest.approx(2.0 * 8.25 / 10, abs=1e-6)


TURN = """<RoutingAction><FollowTrajectoryAction initialDistanceOffset="{offset}"><TimeReference><None/>
</TimeReference><TrajectoryFollowingMode followingMode="position"/><TrajectoryRef>
<Trajectory name="t" closed="false"><Shape><ClothoidSpline>
<ClothoidSplineSegment curvatureStart="0" curvatureEnd="0" length="30">{start}
</ClothoidSplineSegment><ClothoidSplineSegment curvatureStart="0" curvatureEnd="0.1" length="8"/>
</ClothoidSpline></Shape></Trajectory></TrajectoryRef></FollowTrajectoryAction></RoutingAction>"""
START_AT = f"<PositionStart>{world_position(100, -1.75)}</PositionStart>"


def test_trajectories_from_the_start(tmp_path):
    init = private("Ego", speed(10), TURN.format(offset=10, start=START_AT)) + teleport(
        "Target", lane_position(160)
    )
    found = compiled(tmp_path, scenario(init))
    assert found.world.movers["Ego"].track.bends == (Bend(20.0), Bend(8.0, 0.0, 0.1))
    assert found.world.movers["Ego"].place(0.0)[:2] == pytest.approx((110.0, -1.75))


def test_trajectories_from_where_an_entity_is(tmp_path):
    """After 2 s the ego has driven 20 m; the trajectory has 30 m before its clothoid."""
    follow = event("E", TURN.format(offset=0, start=""), at(2))
    found = compiled(tmp_path, scenario(START, story("Ego", follow)))
    assert found.world.movers["Ego"].track.bends == (Bend(50.0), Bend(8.0, 0.0, 0.1))
    beside = TURN.format(offset=0, start=f"<PositionStart>{world_position(100, 3)}</PositionStart>")
    with pytest.raises(ValueError, match="'Ego' is not on its path at 2 s; begin the path where it is"):
        compiled(tmp_path, scenario(START, story("Ego", event("E", beside, at(2)))))


def test_the_front_axle_as_control_point(tmp_path):
    """The rear axle starts one wheelbase behind the trajectory, and turns less than the front axle."""
    control = (
        '<ObjectController><Controller name="c"><Properties><Property name="Driver.ControlPoint.Mode" '
        'value="FrontAxle"/></Properties></Controller></ObjectController>'
    )
    entities = vehicle("Ego", x=1.25, extra=control) + vehicle("Target")
    init = private("Ego", speed(10), TURN.format(offset=0, start=START_AT)) + teleport(
        "Target", lane_position(160)
    )
    ego = compiled(tmp_path, scenario(init, entities=entities)).world.movers["Ego"]
    assert ego.place(0.0).x == pytest.approx(97.5)
    assert ego.place(6.0).heading == pytest.approx(0.4, abs=1e-3)  # half of 8 m times 0.1 1/m
    assert 0.1 < ego.place(3.8).heading < 0.3  # the front axle is at the end of the clothoid
    with pytest.raises(
        ValueError, match=r"Driver\.ControlPoint\.Mode must be FrontAxle or RearAxle, got 'Roof'"
    ):
        compiled(tmp_path, scenario(init, entities=entities.replace('"FrontAxle"', '"Roof"')))
    with pytest.raises(ValueError, match="the front axle of 'Ego' cannot be its control point without Axles"):
        compiled(tmp_path, scenario(init, entities=entities.replace("<FrontAxle", "<OtherAxle", 1)))


def test_driving_backwards_is_turned_around(tmp_path):
    """The ego drives 2 m/s backwards; its centre is 1.4 m ahead of its reference point, and its rear bumper
    0.6 m behind it. A pedestrian stands 10 m behind the reference point: 9.1 m of free space."""
    entities = vehicle("Ego", x=1.4) + pedestrian("Target")
    behind = '<RelativeObjectPosition entityRef="Ego" dx="-10" dy="0.5"/>'
    init = private(
        "Ego", f"<TeleportAction><Position>{lane_position(100)}</Position></TeleportAction>", speed(-2)
    ) + teleport("Target", behind)
    found = compiled(tmp_path, scenario(init, entities=entities))
    (actor,) = found.scenario.actors
    assert found.world.movers["Target"].place().x == pytest.approx(90.0)
    assert found.world.movers["Ego"].place(1.0).x == pytest.approx(98.0)
    assert found.contact == pytest.approx((10 - 0.6 - 0.3) / 2)
    assert found.start == pytest.approx(found.contact - 5.0)
    assert actor.gap == pytest.approx(10.0)  # at 2 m/s, 5 s before the contact
    assert actor.lateral_offset == pytest.approx(-0.5)  # + left of the direction of travel
    assert found.scenario.ego_speed == 2.0


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (speed(6, "time", "linear", -2), "SpeedActionDynamics value must be >= 0, got -2"),
        (speed(6, "distance", "cubic", 20), "a cubic or sinusoidal change of speed over a distance is not"),
        (speed(60, "rate", "linear", 2), "SpeedAction of 'Target': final_speed: 60 m/s"),
        (PROFILE.replace("/><", ' maxSpeed="5"/><', 1), "speed=6 is above DynamicConstraints maxSpeed=5"),
        (PROFILE.replace('"4"', '"0"'), "DynamicConstraints maxAccelerationRate must be > 0, got 0"),
        (speed(-1, "rate", "linear", 2), "driving backwards is supported from the start only"),
        (
            f"<TeleportAction><Position>{lane_position(160.2)}</Position></TeleportAction>",
            "TeleportAction is supported at the start only, got 1 s",
        ),
        (
            "<LateralAction><LateralDistanceAction/></LateralAction>",
            "LateralDistanceAction in LateralAction is not supported; use LaneChangeAction or LaneOff",
        ),
        (
            "<LongitudinalAction><LateralAction/></LongitudinalAction>",
            "LateralAction in LongitudinalAction is not supported; use SpeedAction",
        ),
        (SYNC.replace('s="172"', 's="162"'), "SynchronizeAction of 'Target': no room before the 2 s"),
        (SYNC.replace('masterEntityRef="Ego"', 'masterEntityRef="Egon"'), "unknown entity 'Egon'"),
        (PROFILE.replace('maxDeceleration="3"', ""), "needs DynamicConstraints maxDeceleration"),
        (
            TURN.replace("<None/>", "<Timing/>").format(offset=0, start=""),
            "a TimeReference with Timing needs a Polyline with a time at every Vertex",
        ),
    ],
)
def test_unsupported_actions(tmp_path, action, message):
    with pytest.raises(ValueError, match=rf"case\.xosc:\d+: .*{message}"):
        compiled(tmp_path, scenario(START, story("Target", event("E", action, at(1)))))


def test_a_rate_of_zero(tmp_path):
    """The speed stays that of the start of the action, which never ends."""
    events = (
        event("E", speed(10, "rate", "linear", 2), at(1)),
        event("F", speed(6, "rate", "linear", 0), at(3)),
    )
    found = compiled(tmp_path, scenario(START, story("Target", *events)))
    assert found.world.movers["Target"].timeline.at(20.0).speed == pytest.approx(4.0)
    assert any("'Target' keeps its speed: a rate of 0 never reaches 6 m/s" in note for note in found.notes)
    assert found.world.movers["Target"].timeline.at(3.0).speed == pytest.approx(4.0)
