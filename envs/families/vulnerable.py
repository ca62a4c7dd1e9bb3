"""Pedestrians and bicycles that cross, walk along or are passed: Euro NCAP's CPNA to CBLA."""

from dataclasses import replace
from math import pi
from typing import Annotated

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.arguments import (
    EITHER,
    ClothesShade,
    DrawArguments,
    EgoSpeed,
    RiderShade,
    Sampler,
    always,
    between,
    draw,
    kmh,
    slower,
    speed,
    still,
    truth,
    within,
)
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.road_users import (
    ADULT,
    BICYCLE,
    CHILD,
    LARGE_CAR,
    SIDES,
    SMALL_CAR,
    RoadUser,
    RunUp,
    crossing_actor,
    parked_row,
    run_up,
    yielding,
)
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    EGO_WIDTH,
    LANE_WIDTH,
    START_TTC,
    Actor,
    RoadPlan,
    Scenario,
)

CAR_CLEARANCE = 1.0  # [m] between the ego's side and the parked cars of CPNCO, and between these cars
RUN_UP = 7.0  # [m], distance in which a bicycle accelerates
CAR_GAP = 0.2  # [m] between the two parked cars of crossing bicycles
LYING_HEIGHTS = {False: 0.3, True: 0.2}  # [m], by whether the person is a child
SLOW_KMH = (1.8, 18.0)  # speeds of those who move towards the ego, 0.5 to 5 m/s

Walking = Annotated[float, within("[0.1, 5]", "m/s", "Pedestrian speed")]
Riding = Annotated[float, within("[0.1, 15]", "m/s", "Bicycle speed")]
Location = Annotated[
    float,
    within(
        "[0.1, 0.9]",
        "",
        "Position across the ego's width of a crossing pedestrian's hip, a crossing bicycle's crankshaft, or "
        "another road user's centre; 0 is the right side and 1 the left",
    ),
]
Child = Annotated[bool, truth("Whether the pedestrian is a child")]
Towards = Annotated[
    bool,
    truth("Whether the motion is towards the ego, from 1 s before the contact on with an even deceleration"),
]
Clearance = Annotated[float, within("[0.2, 10]", "m", "Distance between the sides of ego and road user")]


def _walker(low: float = 3.0, high: float = 8.0, **more: Sampler) -> DrawArguments:
    location = between(0.1, 0.9)
    return draw(ego_speed=kmh(10.0, 60.0), walking_speed=kmh(low, high), impact_location=location, **more)


def _rider(low: float, high: float, **more: Sampler) -> DrawArguments:
    location = between(0.1, 0.9)
    return draw(ego_speed=kmh(10.0, 60.0), bicycle_speed=kmh(low, high), impact_location=location, **more)


def _from(lowest: float, drawn: DrawArguments) -> DrawArguments:
    """Return a function that draws the same arguments with an ego speed above a limit in km/h."""
    return lambda rng: drawn(rng) | {"ego_speed": kmh(lowest)(rng)}


_PASSED = {"ego_speed": kmh(20.0, 50.0), "clearance": between(1.0, 1.5)}


@family("CPNA", Level("CPNA", 5.0, _walker(child=EITHER)), threat=True, twin=True)
def pedestrian_from_right(
    ego_speed: EgoSpeed = 40 * KMH,
    walking_speed: Walking = 5 * KMH,
    impact_location: Location = 0.5,
    child: Child = False,
    shade: ClothesShade = None,
) -> Scenario:
    """A pedestrian walks into the ego's path from the right (Car-to-Pedestrian Nearside Adult).

    The pedestrian starts 4 m from the ego's centreline and reaches its speed within 1 m. Without braking, the
    ego's front meets the pedestrian's hip at the impact location. Sources: Euro NCAP AEB VRU v4.5.1 (CPNA-25,
    CPNA-75) and Frontal Collisions v1.1; 49 CFR 571.127 S8.3.1; UN R152 Rev.2, 6.6 with a child.
    """
    return _crossing_pedestrian("CPNA", ego_speed, walking_speed, impact_location, child, shade)


@family("CPFA", Level("CPFA", 4.0, _walker(5.0, 10.0)), threat=True, twin=True)
def pedestrian_from_left(
    ego_speed: EgoSpeed = 40 * KMH,
    walking_speed: Walking = 8 * KMH,
    impact_location: Location = 0.5,
    child: Child = False,
    shade: ClothesShade = None,
) -> Scenario:
    """A pedestrian runs into the ego's path from the left (Car-to-Pedestrian Farside Adult).

    The pedestrian starts 6 m from the ego's centreline and reaches its speed within 1.5 m. Sources: Euro NCAP
    AEB VRU v4.5.1 (CPFA-50) and Frontal Collisions v1.1; 49 CFR 571.127 S8.3.2.
    """
    return _crossing_pedestrian(
        "CPFA", ego_speed, walking_speed, impact_location, child, shade, "left", 6.0, 1.5
    )


@family("CPNCO", Level("CPNCO", 3.0, _walker()), threat=True, twin=True)
def child_between_cars(
    ego_speed: EgoSpeed = 40 * KMH,
    walking_speed: Walking = 5 * KMH,
    impact_location: Location = 0.5,
    shade: ClothesShade = None,
) -> Scenario:
    """A child walks out from behind two parked cars (Car-to-Pedestrian Nearside Child Obstructed).

    The cars stand 1 m to the right of the ego's side and 1 m apart; the child walks 1 m ahead of the first
    one. Sources: Euro NCAP AEB VRU v4.5.1 (CPNCO-50) and Frontal Collisions v1.1; 49 CFR 571.127 S8.3.3.
    """
    made = _crossing_pedestrian("CPNCO", ego_speed, walking_speed, impact_location, True, shade)
    front, inner = START_TTC * made.ego_speed - 1.0, -EGO_WIDTH / 2 - CAR_CLEARANCE
    parked = parked_row(front, inner, (SMALL_CAR, LARGE_CAR), CAR_CLEARANCE)
    return replace(made, actors=(*made.actors, *parked))


@family("CBNA", Level("CBNA", 3.0, _rider(10.0, 20.0, obstructed=EITHER)), threat=True, twin=True)
def bicycle_from_right(
    ego_speed: EgoSpeed = 40 * KMH,
    bicycle_speed: Riding = 15 * KMH,
    impact_location: Location = 0.5,
    obstructed: Annotated[bool, truth("Whether the parked cars are there")] = True,
    shade: RiderShade = None,
) -> Scenario:
    """A bicycle crosses the ego's path from the right (Car-to-Bicyclist Nearside Adult).

    Without braking, the ego's front meets the crankshaft at the impact location. The bicycle appears from
    behind two parked cars 17 m beside the ego's centreline. Sources: Euro NCAP AEB VRU v4.5.1 (CBNA-50) and
    Frontal Collisions v1.1; UN R152 Rev.2, 6.7 without the cars.
    """
    cars = (17.0, 1.0) if obstructed else None
    return _crossing_bicycle("CBNA", ego_speed, bicycle_speed, impact_location, shade, "right", 17.0, cars)


@family("CBNAO", Level("CBNAO", 2.0, _rider(8.0, 15.0)), threat=True, twin=True)
def bicycle_behind_cars(
    ego_speed: EgoSpeed = 40 * KMH,
    bicycle_speed: Riding = 10 * KMH,
    impact_location: Location = 0.5,
    shade: RiderShade = None,
) -> Scenario:
    """A bicycle crosses the ego's path from behind parked cars (Car-to-Bicyclist Nearside Adult Obstructed).

    The cars stand 3.55 m beside the ego's centreline and 4.8 m before the bicycle's path. Sources: Euro NCAP
    AEB VRU v4.5.1 (CBNAO-50) and Frontal Collisions v1.1.
    """
    cars = (3.55, 4.8)
    return _crossing_bicycle("CBNAO", ego_speed, bicycle_speed, impact_location, shade, "right", 4.5, cars)


@family("CBFA", Level("CBFA", 2.0, _rider(15.0, 25.0)), threat=True, twin=True)
def bicycle_from_left(
    ego_speed: EgoSpeed = 40 * KMH,
    bicycle_speed: Riding = 20 * KMH,
    impact_location: Location = 0.5,
    shade: RiderShade = None,
) -> Scenario:
    """A bicycle crosses the ego's path from the left (Car-to-Bicyclist Farside Adult).

    The bicycle appears from behind two parked cars 22 m beside the ego's centreline. Sources: Euro NCAP AEB
    VRU v4.5.1 (CBFA-50) and Frontal Collisions v1.1.
    """
    cars = (22.0, 1.0)
    return _crossing_bicycle("CBFA", ego_speed, bicycle_speed, impact_location, shade, "left", 22.0, cars)


def _standing(**more: Sampler) -> DrawArguments:
    """Return a function that draws a person who does not walk."""
    return draw(ego_speed=kmh(20.0), walking_speed=still, impact_location=between(0.1, 0.9), **more)


@family(
    "CPLA",
    Level("CPLA", 4.0, _from(20.0, _walker())),
    Level("StandingPerson", 2.0, _standing(), twin=True),
    Level("StandingChild", 2.0, _standing(child=always), twin=True),
    Level("LyingPerson", 2.0, _standing(lying=always, child=EITHER), twin=True),
    Level("PedestrianTowards", 2.0, _walker(*SLOW_KMH, towards=always, child=EITHER), twin=True),
    threat=True,
    twin=True,
)
def pedestrian_ahead(
    ego_speed: EgoSpeed = 40 * KMH,
    walking_speed: Annotated[float, slower("Pedestrian speed", zero=True)] = 5 * KMH,
    impact_location: Location = 0.5,
    child: Child = False,
    lying: Annotated[
        bool, truth("Whether the pedestrian lies across the lane; requires a walking speed of 0")
    ] = False,
    towards: Towards = False,
    shade: ClothesShade = None,
) -> Scenario:
    """A pedestrian walks ahead of the ego in the same direction (Car-to-Pedestrian Longitudinal Adult).

    With a walking speed of 0 the pedestrian stands or lies; one who lies is drawn as a box of the person's
    height by 0.5 m (a child by 0.3 m), 0.3 m high (a child 0.2 m). Sources: Euro NCAP AEB VRU v4.5.1
    (CPLA-25, CPLA-50) and Frontal Collisions v1.1; 49 CFR 571.127 S8.5, and S8.4 with a walking speed of 0.
    Children, lying persons and those who walk towards the ego are not cases of a protocol.
    """
    user = CHILD if child else ADULT
    if lying:
        if walking_speed > 0.0:
            raise ValueError(
                f"lying requires walking_speed=0, got {walking_speed:g} m/s; set it to 0 or remove lying"
            )
        user = RoadUser("box", user.width, user.height, LYING_HEIGHTS[child])
    return _ahead("CPLA", user, ego_speed, "walking_speed", walking_speed, impact_location, shade, towards)


@family(
    "CBLA",
    Level("CBLA", 3.0, _from(25.0, _rider(10.0, 20.0))),
    Level("BicycleTowards", 2.0, _rider(*SLOW_KMH, towards=always), twin=True),
    threat=True,
    twin=True,
)
def bicycle_ahead(
    ego_speed: EgoSpeed = 50 * KMH,
    bicycle_speed: Annotated[float, slower("Bicycle speed", zero=True)] = 15 * KMH,
    impact_location: Location = 0.5,
    towards: Towards = False,
    shade: RiderShade = None,
) -> Scenario:
    """A bicycle rides ahead of the ego in the same direction (Car-to-Bicyclist Longitudinal Adult).

    Sources: Euro NCAP AEB VRU v4.5.1 (CBLA-25 at 20 km/h, CBLA-50 at 15 km/h) and Frontal Collisions v1.1;
    `towards` is not a case of a protocol.
    """
    speed_name = "bicycle_speed"
    return _ahead("CBLA", BICYCLE, ego_speed, speed_name, bicycle_speed, impact_location, shade, towards)


@family(
    "CPRA",
    Level("CPRA", 1.0, draw(ego_speed=kmh(4.0, 8.0), moving=EITHER, child=EITHER)),
    threat=True,
    twin=True,
)
def pedestrian_behind(
    ego_speed: Annotated[float, speed("Speed of the reversing ego")] = 4 * KMH,
    moving: Annotated[bool, truth("Whether the pedestrian crosses; otherwise it stands")] = True,
    child: Child = False,
    impact_location: Location = 0.5,
    shade: ClothesShade = None,
) -> Scenario:
    """The ego reverses towards a pedestrian (Car-to-Pedestrian Reverse Adult or Child).

    The reversing car is driven with its leading end first: "front" is its rear bumper, left and right are
    those of the direction of motion, and the cameras are those of its leading end. The pedestrian crosses
    from the right at 5 km/h after 4 m, 1.5 m of them accelerating, or stands with the back to the car.
    Source: Euro NCAP AEB VRU v4.5.1 (CPRA/Cm-50, CPRA/Cs).
    """
    user = CHILD if child else ADULT
    if not moving:
        return _ahead("CPRA", user, ego_speed, "walking_speed", 0.0, impact_location, shade)
    motion = run_up(START_TTC, 5 * KMH, 2.5, 1.5)
    walker = crossing_actor(user, ego_speed, "right", impact_location, motion, shade)
    return _on_two_way_road("CPRA", ego_speed, walker)


@family(
    "PedestrianPass",
    Level("PedestrianPass", 1.0, draw(**_PASSED)),
    Level(
        "RoadsidePerson",
        1.0,
        draw(ego_speed=kmh(20.0), clearance=between(0.5, 2.5), walking_speed=still, child=EITHER),
    ),
)
def pass_pedestrian(
    ego_speed: EgoSpeed = 30 * KMH,
    clearance: Clearance = 1.0,
    walking_speed: Annotated[float, slower("Pedestrian speed", zero=True)] = 5 * KMH,
    child: Child = False,
    shade: ClothesShade = None,
) -> Scenario:
    """The ego passes a pedestrian on its right who walks in the same direction or stands; not a threat.

    Source: GB 39901-2025, with a clearance of 1.0 m at 30 km/h.
    """
    user = CHILD if child else ADULT
    if walking_speed >= ego_speed:
        raise ValueError(f"walking_speed must be below ego_speed {ego_speed:g} m/s, got {walking_speed:g}")
    walker = Actor(
        gap=START_TTC * (ego_speed - walking_speed),
        lateral_offset=-(EGO_WIDTH / 2 + clearance + user.width / 2),
        speed=walking_speed,
        shade=shade,
        **user.fields,
    )
    duration = START_TTC + (user.length + EGO_LENGTH) / (ego_speed - walking_speed) + 2.0
    return Scenario(family="PedestrianPass", ego_speed=ego_speed, duration=duration, actors=(walker,))


@family("BicyclePass", Level("BicyclePass", 1.0, draw(**_PASSED, bicycle_speed=kmh(5.0, 20.0))))
def pass_oncoming_bicycle(
    ego_speed: EgoSpeed = 30 * KMH,
    clearance: Clearance = 1.0,
    bicycle_speed: Annotated[float, within("[0, 15]", "m/s", "Bicycle speed")] = 0.0,
    shade: RiderShade = None,
) -> Scenario:
    """The ego passes an oncoming bicycle on its left; not a threat.

    Source: GB 39901-2025, with a stationary bicycle at a clearance of 1.0 m and 30 km/h.
    """
    rider = Actor(
        gap=START_TTC * (ego_speed + bicycle_speed),
        lateral_offset=EGO_WIDTH / 2 + clearance + BICYCLE.width / 2,
        heading=pi,
        speed=bicycle_speed,
        shade=shade,
        **BICYCLE.fields,
    )
    return _on_two_way_road("BicyclePass", ego_speed, rider, after=2.0)


def _on_two_way_road(name: str, ego_speed: float, actor: Actor, after: float = AFTERMATH) -> Scenario:
    """Return a scenario with one actor that ends some time [s] after the scripted contact."""
    road = RoadPlan(kind="two-way")
    return Scenario(family=name, ego_speed=ego_speed, duration=START_TTC + after, actors=(actor,), road=road)


def _crossing_pedestrian(
    name: str,
    ego_speed: float,
    walking_speed: float,
    impact_location: float,
    child: bool,
    shade: int | None,
    side: str = "right",
    start: float = 4.0,
    acceleration_distance: float = 1.0,
) -> Scenario:
    """Return a crossing pedestrian whose centre starts `start` [m] from the ego's centreline."""
    user = CHILD if child else ADULT
    # The way of the centre ends where the impact point is at the impact location.
    way = start + SIDES[side] * (impact_location - 0.5) * EGO_WIDTH - user.impact_point
    motion = run_up(START_TTC, walking_speed, way - acceleration_distance, acceleration_distance)
    walker = crossing_actor(user, ego_speed, side, impact_location, motion, shade)
    return _on_two_way_road(name, ego_speed, walker)


def _crossing_bicycle(
    name: str,
    ego_speed: float,
    bicycle_speed: float,
    impact_location: float,
    shade: int | None,
    side: str,
    steady: float,
    cars: tuple[float, float] | None,
) -> Scenario:
    """Return a crossing bicycle with two parked cars on the crossing road.

    Args:
        name: Name of the family.
        ego_speed: Ego speed [m/s].
        bicycle_speed: Bicycle speed [m/s].
        impact_location: Position of the crankshaft across the ego's width.
        shade: Grey level of the rider's clothes.
        side: Side from which the bicycle comes.
        steady: Distance covered at constant speed [m].
        cars: Distance of the parked cars beside the ego's centreline, and between their sides and the
            bicycle [m]; None for no cars.
    """
    motion = run_up(START_TTC, bicycle_speed, steady, RUN_UP)
    rider = crossing_actor(BICYCLE, ego_speed, side, impact_location, motion, shade)
    path = START_TTC * ego_speed + BICYCLE.width / 2  # from the ego's front bumper to the bicycle's path [m]
    parked = () if cars is None else _cars_along(path, side, *cars)
    lane = SIDES[side] * LANE_WIDTH / 2
    return Scenario(
        family=name,
        ego_speed=ego_speed,
        duration=START_TTC + AFTERMATH,
        actors=(rider, *parked),
        road=RoadPlan(kind="crossing", distance=EGO_LENGTH / 2 + path - lane),
    )


def _cars_along(path: float, side: str, beside: float, clearance: float) -> tuple[Actor, ...]:
    """Return two cars parked before the path of a bicycle, with their rears towards the ego's lane."""
    to_left, actors = SIDES[side], list[Actor]()
    near_side = path - BICYCLE.width / 2 - clearance  # of the cars, from the ego's front bumper [m]
    for car in (LARGE_CAR, SMALL_CAR):
        actors.append(
            Actor(
                gap=near_side - car.width / 2 - car.length / 2,
                lateral_offset=-to_left * (beside + car.length / 2),
                heading=-to_left * pi / 2,
                **car.fields,
            )
        )
        beside += car.length + CAR_GAP
    return tuple(actors)


def _ahead(
    name: str,
    user: RoadUser,
    ego_speed: float,
    speed_name: str,
    user_speed: float,
    impact_location: float,
    shade: int | None,
    towards: bool = False,
) -> Scenario:
    """Return a road user ahead, slower than the ego or towards it; its contact is 5 s after the start."""
    if user_speed >= ego_speed and not towards:
        raise ValueError(
            f"{speed_name} must be below ego_speed {ego_speed:g} m/s in {name}, got {user_speed:g}"
        )
    motion = yielding(user_speed) if towards else RunUp(user_speed, (), -START_TTC * user_speed)
    target = Actor(
        gap=START_TTC * ego_speed + motion.distance,
        lateral_offset=(impact_location - 0.5) * EGO_WIDTH,
        heading=pi if towards else 0.0,
        speed=user_speed,
        profile=motion.profile,
        shade=shade,
        **user.fields,
    )
    return _on_two_way_road(name, ego_speed, target)
