"""Crossing bicycles: Euro NCAP's CBNA, CBNAO and CBFA."""

from math import pi

from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.road_users import BICYCLE, LARGE_CAR, SIDES, SMALL_CAR, crossing_actor
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    LANE_WIDTH,
    START_TTC,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_flag, check_within

RUN_UP = 7.0  # [m], distance in which a bicycle accelerates
CAR_GAP = 0.2  # [m] between the two parked cars


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
    run = (riding, steady, RUN_UP)
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
        beside += car.length + CAR_GAP
    return tuple(actors)
