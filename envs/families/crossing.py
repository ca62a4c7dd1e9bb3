"""Crossing vehicles and animals: Euro NCAP's CCCscp and CMCscp, a car that clears in time, and animals."""

from math import pi
from typing import Annotated

import numpy as np

from lgmd_gym.envs.dynamics.script import Segment
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.arguments import (
    EITHER,
    EgoSpeed,
    RiderShade,
    Shade,
    between,
    draw,
    grey,
    kmh,
    maybe,
    one,
    one_of,
    speed,
    truth,
    within,
)
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.road_users import (
    LARGE_CAR,
    MOTORCYCLE,
    SIDES,
    SMALL_CAR,
    RoadUser,
    RunUp,
    crossing_actor,
    parked_row,
)
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    EGO_WIDTH,
    LANE_WIDTH,
    START_TTC,
    TARGET_LENGTH,
    TARGET_WIDTH,
    Actor,
    RoadPlan,
    Scenario,
)

START_GAP = 2.9  # [m] from a stopped ego to the target's path (AEB C2C v4.3.1, 8.2.5)
SIDE_IMPACT = 0.1  # of the ego's length behind its front, where a motorcycle strikes it
WAITING, PULL_AWAY = 4.5, 1.5  # [s], [m/s²], not specified by the protocol

ANIMALS = {
    "dog": RoadUser("box", 0.9, 0.3, 0.6),
    "boar": RoadUser("box", 1.5, 0.5, 0.8),
    "deer": RoadUser("box", 1.2, 0.4, 1.1),
    "moose": RoadUser("box", 2.6, 0.8, 2.0),
}
"""Boxes of the size of animals, from the ground to the back; rough sizes of adults, the deer a roe deer."""

TargetSpeed = Annotated[float, speed("Target speed")]
Side = Annotated[str, one_of(tuple(SIDES), 'Side from which the target comes, "right" or "left"')]


_CROSSING = {"ego_speed": kmh(20.0, 60.0), "target_speed": kmh(20.0, 60.0), "side": one("left", "right")}


@family("CCCscp", Level("CCCscp", 8.0, draw(**_CROSSING, obstructed=EITHER)), threat=True, twin=True)
def cross_straight(
    ego_speed: Annotated[float, speed("Scripted ego speed")] = 30 * KMH,
    target_speed: TargetSpeed = 30 * KMH,
    side: Side = "right",
    from_stop: Annotated[
        bool,
        truth("Whether the ego waits 2.9 m before the target's path and then accelerates to `ego_speed`"),
    ] = False,
    obstructed: Annotated[
        bool,
        truth(
            "Whether three cars are parked before the junction, on the side from which the target comes: 2 m "
            "beside the ego's centreline on the right, 5.5 m on the left"
        ),
    ] = False,
    shade: Shade = None,
) -> Scenario:
    """A car crosses the ego's path and is struck in the side (Car-to-Car Crossing straight crossing path).

    Without braking, the ego's centreline meets the target's side a quarter of its length behind its front.
    Sources: Euro NCAP AEB Car-to-Car v4.3.1, 8.2.5; Frontal Collisions v1.1, with parked cars.
    """
    if from_stop:
        distance = START_GAP
        profile = (Segment(start=WAITING, acceleration=PULL_AWAY, final_speed=ego_speed),)
        contact = _time_to_cover(distance, profile)
    else:
        distance, profile = START_TTC * ego_speed, ()
        contact = START_TTC
    target = _crossing_car(distance, contact * target_speed + TARGET_LENGTH / 4, target_speed, side, shade)
    parked = _occluders(distance + TARGET_WIDTH / 2, side) if obstructed else ()
    return Scenario(
        family="CCCscp",
        ego_speed=0.0 if from_stop else ego_speed,
        duration=contact + AFTERMATH,
        actors=(target, *parked),
        ego_profile=profile,
        road=_road(distance, side),
    )


@family("CMCscp", Level("CMCscp", 3.0, draw(**_CROSSING, obstructed=EITHER)), threat=True, twin=True)
def motorcycle_crosses(
    ego_speed: EgoSpeed = 30 * KMH,
    target_speed: Annotated[float, speed("Speed of the motorcycle")] = 30 * KMH,
    side: Side = "right",
    obstructed: Annotated[
        bool, truth("Whether three cars are parked before the junction, as in CCCscp")
    ] = False,
    shade: RiderShade = None,
) -> Scenario:
    """A motorcycle crosses the ego's path and strikes the ego (Car-to-Motorcyclist Crossing straight path).

    Without braking, the middle of the motorcycle's front meets the ego's side 10 % of the ego's length behind
    its front. Source: Euro NCAP Frontal Collisions v1.1.
    """
    to_left = SIDES[side]
    path = START_TTC * ego_speed - SIDE_IMPACT * EGO_LENGTH  # of the motorcycle, from the ego's front [m]
    before = EGO_WIDTH / 2 + MOTORCYCLE.length / 2 + START_TTC * target_speed
    target = Actor(
        gap=path - MOTORCYCLE.length / 2,
        lateral_offset=-to_left * before,
        heading=to_left * pi / 2,
        speed=target_speed,
        shade=shade,
        **MOTORCYCLE.fields,
    )
    parked = _occluders(path, side) if obstructed else ()
    return Scenario(
        family="CMCscp",
        ego_speed=ego_speed,
        duration=START_TTC + AFTERMATH,
        actors=(target, *parked),
        road=_road(path - TARGET_WIDTH / 2, side),
    )


@family("CrossingClears", Level("CrossingClears", 1.0, draw(**_CROSSING, clear_by=between(1.2, 2.5))))
def cross_and_clear(
    ego_speed: EgoSpeed = 40 * KMH,
    target_speed: TargetSpeed = 40 * KMH,
    clear_by: Annotated[
        float,
        within("[0.5, 4]", "s", "Time from the target's rear leaving the ego's lane to the ego's arrival"),
    ] = 1.5,
    side: Side = "right",
    shade: Shade = None,
) -> Scenario:
    """A car crosses the ego's path and clears it before the ego arrives; not a threat."""
    distance = START_TTC * ego_speed
    # At that time the target's rear is half a lane beyond the ego's centreline.
    before = (START_TTC - clear_by) * target_speed - LANE_WIDTH / 2 - TARGET_LENGTH / 2
    return Scenario(
        family="CrossingClears",
        ego_speed=ego_speed,
        duration=START_TTC + 2.0,
        actors=(_crossing_car(distance, before, target_speed, side, shade),),
        road=_road(distance, side),
    )


def _some_animal(rng: np.random.Generator) -> str:
    return [*ANIMALS][int(rng.integers(len(ANIMALS)))]


_ANIMAL = {
    "ego_speed": kmh(30.0, 120.0),
    "animal": _some_animal,
    "animal_speed": between(1.0, 8.0),
    "side": one("left", "right"),
}


@family(
    "AnimalCrossing",
    Level("AnimalCrossing", 3.0, draw(**_ANIMAL, impact_location=between(0.1, 0.9)), twin=True),
    Level("AnimalClears", 1.0, draw(**_ANIMAL, clear_by=between(0.8, 2.0)), threat=False),
    threat=True,
)
def animal_crosses(
    ego_speed: EgoSpeed = 80 * KMH,
    animal: Annotated[str, one_of(tuple(ANIMALS), "Animal")] = "deer",
    animal_speed: Annotated[float, within("[0.5, 15]", "m/s", "Speed of the animal")] = 4.0,
    side: Side = "right",
    impact_location: Annotated[
        float,
        within("[0.1, 0.9]", "", "Position across the ego's width; 0 is the right side, 1 the left"),
    ] = 0.5,
    clear_by: Annotated[
        float | None,
        maybe(
            "[0.3, 4]",
            "s",
            "Time from the animal's rear leaving the ego's way to the ego's arrival; None for a threat",
        ),
    ] = None,
    shade: Annotated[int | None, grey("the animal")] = None,
) -> Scenario:
    """An animal runs across the road at constant speed, drawn as a box of its size.

    Without braking, the ego's front meets the animal's side at the impact location. It is not a case of a
    protocol. Length, width and height [m]: dog 0.9, 0.3, 0.6; boar 1.5, 0.5, 0.8; (roe) deer 1.2, 0.4, 1.1;
    moose 2.6, 0.8, 2.0.
    """
    user = ANIMALS[animal]
    if clear_by is not None:
        if impact_location != 0.5:
            text = f"impact_location={impact_location:g} and clear_by={clear_by:g}"
            raise ValueError(f"{text} both set the position of the animal; pass one")
        beyond = EGO_WIDTH / 2 + user.length / 2 + clear_by * animal_speed  # of its centre as the ego arrives
        impact_location = 0.5 + SIDES[side] * beyond / EGO_WIDTH
    motion = RunUp(animal_speed, (), START_TTC * animal_speed)
    runner = crossing_actor(user, ego_speed, side, impact_location, motion, shade)
    duration = START_TTC + (AFTERMATH if clear_by is None else 2.0)
    road = RoadPlan(kind="two-way")
    return Scenario(
        family="AnimalCrossing", ego_speed=ego_speed, duration=duration, actors=(runner,), road=road
    )


def _crossing_car(distance: float, before: float, speed: float, side: str, shade: int | None) -> Actor:
    """Return a car that crosses the ego's path.

    Args:
        distance: Distance from the ego's front to the nearer side of the car, along the road [m].
        before: Distance from the car's centre to the ego's centreline, along the car's path [m].
        speed: Speed [m/s].
        side: Side from which the car comes.
        shade: Grey level; None to draw it from the seed.
    """
    to_left = SIDES[side]
    return Actor(
        gap=distance + TARGET_WIDTH / 2 - TARGET_LENGTH / 2,
        lateral_offset=-to_left * before,
        heading=to_left * pi / 2,
        speed=speed,
        shade=shade,
    )


def _occluders(path: float, side: str) -> tuple[Actor, ...]:
    """Return the cars parked before the junction, `path` [m] from the ego's front to the target's path."""
    from_right = side == "right"
    front, inner = (path - 24.0, -2.0) if from_right else (path - 21.0, LANE_WIDTH + 2.0)
    return parked_row(front, inner, (LARGE_CAR, SMALL_CAR, SMALL_CAR), 1.0)


def _road(distance: float, side: str) -> RoadPlan:
    """Return a crossing whose lane for traffic from that side contains the crossing car."""
    lane = LANE_WIDTH / 2 * SIDES[side]
    return RoadPlan(kind="crossing", distance=EGO_LENGTH / 2 + distance + TARGET_WIDTH / 2 - lane)


def _time_to_cover(distance: float, profile: tuple[Segment, ...]) -> float:
    """Return the time that a car needs for a distance from a standstill [s]."""
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.longitudinal import SpeedProfile

    script, covered, step = SpeedProfile(0.0, profile), 0.0, 1e-3
    while covered < distance:
        covered += script.step(step)
    return script.time
