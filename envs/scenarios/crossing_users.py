"""Crossing pedestrians and bicycles: Euro NCAP's CPNA, CPFA, CPNCO, CBNA, CBNAO and CBFA."""

from dataclasses import replace
from math import pi

from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.scenarios.registry import family
from lgmd_gym.envs.scenarios.road_users import (
    ADULT,
    BICYCLE,
    CHILD,
    LARGE_CAR,
    SMALL_CAR,
    RoadUser,
    parked_row,
    run_up,
)
from lgmd_gym.envs.scenarios.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    EGO_WIDTH,
    LANE_WIDTH,
    START_TTC,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_flag, check_known, check_within

SIDES = {"right": 1.0, "left": -1.0}
CAR_CLEARANCE = 1.0  # [m] between the ego's side and the parked cars of CPNCO, and between these cars
BICYCLE_RUN_UP = 7.0  # [m], distance in which a bicycle accelerates
BICYCLE_GAP = 0.2  # [m] between the two parked cars of CBNA, CBNAO and CBFA


@family("CPNA")
def pedestrian_from_right(
    ego_speed: float = 40 * KMH,
    walking_speed: float = 5 * KMH,
    impact_location: float = 0.5,
    child: bool = False,
    shade: int | None = None,
) -> Scenario:
    """A pedestrian walks into the ego's path from the right (Car-to-Pedestrian Nearside Adult).

    The pedestrian starts 4 m from the ego's centreline and reaches its speed within 1 m. Without braking, the
    ego's front meets the pedestrian's hip at the impact location. Sources: Euro NCAP AEB VRU v4.5.1 (CPNA-25,
    CPNA-75) and Frontal Collisions v1.1; 49 CFR 571.127 S8.3.1; UN R152 Rev.2, 6.6 with a child.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        walking_speed: Pedestrian speed, in (0, 5] [m/s].
        impact_location: Position of the hip across the ego's width, 0 the right side and 1 the left, in
            [0.1, 0.9].
        child: Whether the pedestrian is a child.
        shade: Grey level of the clothes in [0, 255]; None to draw it from the seed.
    """
    return _pedestrian("CPNA", ego_speed, walking_speed, impact_location, child, shade, "right", 4.0, 1.0)


@family("CPFA")
def pedestrian_from_left(
    ego_speed: float = 40 * KMH,
    walking_speed: float = 8 * KMH,
    impact_location: float = 0.5,
    child: bool = False,
    shade: int | None = None,
) -> Scenario:
    """A pedestrian runs into the ego's path from the left (Car-to-Pedestrian Farside Adult).

    The pedestrian starts 6 m from the ego's centreline and reaches its speed within 1.5 m. Sources: Euro NCAP
    AEB VRU v4.5.1 (CPFA-50) and Frontal Collisions v1.1; 49 CFR 571.127 S8.3.2.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        walking_speed: Pedestrian speed, in (0, 5] [m/s].
        impact_location: As in CPNA.
        child: Whether the pedestrian is a child.
        shade: Grey level of the clothes in [0, 255]; None to draw it from the seed.
    """
    return _pedestrian("CPFA", ego_speed, walking_speed, impact_location, child, shade, "left", 6.0, 1.5)


@family("CPNCO")
def child_between_cars(
    ego_speed: float = 40 * KMH,
    walking_speed: float = 5 * KMH,
    impact_location: float = 0.5,
    shade: int | None = None,
) -> Scenario:
    """A child walks out from behind two parked cars (Car-to-Pedestrian Nearside Child Obstructed).

    The cars stand 1 m to the right of the ego's side and 1 m apart; the child walks 1 m ahead of the first
    one. Sources: Euro NCAP AEB VRU v4.5.1 (CPNCO-50) and Frontal Collisions v1.1; 49 CFR 571.127 S8.3.3.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        walking_speed: Speed of the child, in (0, 5] [m/s].
        impact_location: As in CPNA.
        shade: Grey level of the clothes in [0, 255]; None to draw it from the seed.
    """
    made = _pedestrian("CPNCO", ego_speed, walking_speed, impact_location, True, shade, "right", 4.0, 1.0)
    front, inner = START_TTC * made.ego_speed - 1.0, -EGO_WIDTH / 2 - CAR_CLEARANCE
    parked = parked_row(front, inner, (SMALL_CAR, LARGE_CAR), CAR_CLEARANCE)
    return replace(made, actors=(*made.actors, *parked))


@family("CBNA")
def bicycle_from_right(
    ego_speed: float = 40 * KMH,
    bicycle_speed: float = 15 * KMH,
    impact_location: float = 0.5,
    obstructed: bool = True,
    shade: int | None = None,
) -> Scenario:
    """A bicycle crosses the ego's path from the right (Car-to-Bicyclist Nearside Adult).

    Without braking, the ego's front meets the crankshaft at the impact location. The bicycle appears from
    behind two parked cars 17 m beside the ego's centreline. Sources: Euro NCAP AEB VRU v4.5.1 (CBNA-50) and
    Frontal Collisions v1.1; UN R152 Rev.2, 6.7 without the cars.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        bicycle_speed: Bicycle speed, in (0, 15] [m/s].
        impact_location: Position of the crankshaft across the ego's width, 0 the right side and 1 the left,
            in [0.1, 0.9].
        obstructed: Whether the parked cars are there.
        shade: Grey level of the rider's clothes in [0, 255]; None to draw it from the seed.
    """
    cars = (17.0, 1.0) if check_flag("obstructed", obstructed) else None
    return _bicycle("CBNA", ego_speed, bicycle_speed, impact_location, shade, "right", 17.0, cars)


@family("CBNAO")
def bicycle_behind_cars(
    ego_speed: float = 40 * KMH,
    bicycle_speed: float = 10 * KMH,
    impact_location: float = 0.5,
    shade: int | None = None,
) -> Scenario:
    """A bicycle crosses the ego's path from behind parked cars (Car-to-Bicyclist Nearside Adult Obstructed).

    The cars stand 3.55 m beside the ego's centreline and 4.8 m before the bicycle's path. Sources: Euro NCAP
    AEB VRU v4.5.1 (CBNAO-50) and Frontal Collisions v1.1.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        bicycle_speed: Bicycle speed, in (0, 15] [m/s].
        impact_location: As in CBNA.
        shade: Grey level of the rider's clothes in [0, 255]; None to draw it from the seed.
    """
    return _bicycle("CBNAO", ego_speed, bicycle_speed, impact_location, shade, "right", 4.5, (3.55, 4.8))


@family("CBFA")
def bicycle_from_left(
    ego_speed: float = 40 * KMH,
    bicycle_speed: float = 20 * KMH,
    impact_location: float = 0.5,
    shade: int | None = None,
) -> Scenario:
    """A bicycle crosses the ego's path from the left (Car-to-Bicyclist Farside Adult).

    The bicycle appears from behind two parked cars 22 m beside the ego's centreline. Sources: Euro NCAP AEB
    VRU v4.5.1 (CBFA-50) and Frontal Collisions v1.1.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        bicycle_speed: Bicycle speed, in (0, 15] [m/s].
        impact_location: As in CBNA.
        shade: Grey level of the rider's clothes in [0, 255]; None to draw it from the seed.
    """
    return _bicycle("CBFA", ego_speed, bicycle_speed, impact_location, shade, "left", 22.0, (22.0, 1.0))


def crossing_actor(
    user: RoadUser, ego_speed: float, side: str, impact_location: float, run: tuple[float, float, float],
    shade: int | None,
) -> Actor:  # fmt: skip
    """Return a road user whose impact point is at the impact location 5 s after the start.

    Args:
        user: The road user.
        ego_speed: Ego speed [m/s].
        side: Side from which the road user comes, "right" or "left".
        impact_location: Position across the ego's width, 0 the right side and 1 the left.
        run: Speed [m/s], distance at that speed [m], and distance of the acceleration before it [m].
        shade: Grey level; None to draw it from the seed.
    """
    check_known("side", side, SIDES)
    to_left, motion = SIDES[side], run_up(START_TTC, *run)
    aim = (check_within("impact_location", impact_location, 0.1, 0.9) - 0.5) * EGO_WIDTH
    return Actor(
        gap=START_TTC * ego_speed + user.width / 2 - user.length / 2,
        lateral_offset=aim - to_left * (user.impact_point + motion.distance),
        heading=to_left * pi / 2,
        speed=motion.speed,
        profile=motion.profile,
        shade=shade,
        **user.fields,
    )


def _pedestrian(
    name: str, ego_speed: float, walking_speed: float, impact_location: float, child: bool, shade: int | None,
    side: str, start: float, acceleration_distance: float,
) -> Scenario:  # fmt: skip
    """Return a crossing pedestrian whose centre starts `start` [m] from the ego's centreline."""
    speed = check_speed("ego_speed", ego_speed)
    walking = check_within("walking_speed", walking_speed, 0.1, 5.0, "m/s")
    user = CHILD if check_flag("child", child) else ADULT
    location = check_within("impact_location", impact_location, 0.1, 0.9)
    # The way of the centre ends where the impact point is at the impact location.
    way = start + SIDES[side] * (location - 0.5) * EGO_WIDTH - user.impact_point
    run = (walking, way - acceleration_distance, acceleration_distance)
    walker = crossing_actor(user, speed, side, location, run, shade)
    return Scenario(
        family=name,
        ego_speed=speed,
        duration=START_TTC + AFTERMATH,
        actors=(walker,),
        road=RoadPlan(kind="two-way"),
    )


def _bicycle(
    name: str, ego_speed: float, bicycle_speed: float, impact_location: float, shade: int | None, side: str,
    steady: float, cars: tuple[float, float] | None,
) -> Scenario:  # fmt: skip
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
    speed = check_speed("ego_speed", ego_speed)
    riding = check_within("bicycle_speed", bicycle_speed, 0.1, 15.0, "m/s")
    run = (riding, steady, BICYCLE_RUN_UP)
    rider = crossing_actor(BICYCLE, speed, side, impact_location, run, shade)
    path = START_TTC * speed + BICYCLE.width / 2  # from the ego's front bumper to the bicycle's path [m]
    parked = () if cars is None else _cars_along(path, side, *cars)
    lane = SIDES[side] * LANE_WIDTH / 2
    return Scenario(
        family=name,
        ego_speed=speed,
        duration=START_TTC + AFTERMATH,
        actors=(rider, *parked),
        road=RoadPlan(kind="crossing", distance=EGO_LENGTH / 2 + path - lane),
    )


def _cars_along(path: float, side: str, beside: float, clearance: float) -> tuple[Actor, ...]:
    """Return two cars parked before the path of a bicycle, with their rears towards the ego's lane."""
    to_left, actors = SIDES[side], list[Actor]()
    near_side = path - BICYCLE.width / 2 - clearance  # of the cars, from the ego's front bumper [m]
    for car in (LARGE_CAR, SMALL_CAR):
        centre = near_side - car.width / 2
        actors.append(
            Actor(
                gap=centre - car.length / 2,
                lateral_offset=-to_left * (beside + car.length / 2),
                heading=-to_left * pi / 2,
                **car.fields,
            )
        )
        beside += car.length + BICYCLE_GAP
    return tuple(actors)
