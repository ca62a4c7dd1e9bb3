"""Crossing pedestrians: Euro NCAP's CPNA, CPFA and CPNCO."""

from dataclasses import replace

from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.road_users import (
    ADULT,
    CHILD,
    LARGE_CAR,
    SIDES,
    SMALL_CAR,
    crossing_actor,
    parked_row,
)
from lgmd_gym.envs.families.scenario import AFTERMATH, EGO_WIDTH, START_TTC, RoadPlan, Scenario
from lgmd_gym.errors import check_flag, check_within

CAR_CLEARANCE = 1.0  # [m] between the ego's side and the parked cars of CPNCO, and between these cars


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
