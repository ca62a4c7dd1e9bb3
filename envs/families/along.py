"""Pedestrians and bicycles along the ego's path, and behind a reversing car: CPLA, CBLA and CPRA."""

from math import pi

from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.road_users import ADULT, BICYCLE, CHILD, RoadUser, crossing_actor
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_WIDTH,
    START_TTC,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_flag, check_within


@family("CPLA")
def pedestrian_ahead(
    ego_speed: float = 40 * KMH,
    walking_speed: float = 5 * KMH,
    impact_location: float = 0.5,
    shade: int | None = None,
) -> Scenario:
    """A pedestrian walks ahead of the ego in the same direction (Car-to-Pedestrian Longitudinal Adult).

    Sources: Euro NCAP AEB VRU v4.5.1 (CPLA-25, CPLA-50) and Frontal Collisions v1.1; 49 CFR 571.127 S8.5, and
    S8.4 with a walking speed of 0.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        walking_speed: Pedestrian speed, in [0, ego_speed) [m/s].
        impact_location: Position of the pedestrian's centre across the ego's width, 0 the right side and 1
            the left, in [0.1, 0.9].
        shade: Grey level of the clothes in [0, 255]; None to draw it from the seed.
    """
    return _ahead("CPLA", ADULT, ego_speed, "walking_speed", walking_speed, impact_location, shade)


@family("CBLA")
def bicycle_ahead(
    ego_speed: float = 50 * KMH,
    bicycle_speed: float = 15 * KMH,
    impact_location: float = 0.5,
    shade: int | None = None,
) -> Scenario:
    """A bicycle rides ahead of the ego in the same direction (Car-to-Bicyclist Longitudinal Adult).

    Sources: Euro NCAP AEB VRU v4.5.1 (CBLA-25 at 20 km/h, CBLA-50 at 15 km/h) and Frontal Collisions v1.1.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        bicycle_speed: Bicycle speed, in [0, ego_speed) [m/s].
        impact_location: Position of the bicycle's centre, as in CPLA.
        shade: Grey level of the rider's clothes in [0, 255]; None to draw it from the seed.
    """
    return _ahead("CBLA", BICYCLE, ego_speed, "bicycle_speed", bicycle_speed, impact_location, shade)


@family("CPRA")
def pedestrian_behind(
    ego_speed: float = 4 * KMH,
    moving: bool = True,
    child: bool = False,
    impact_location: float = 0.5,
    shade: int | None = None,
) -> Scenario:
    """The ego reverses towards a pedestrian (Car-to-Pedestrian Reverse Adult or Child).

    The reversing car is driven with its leading end first: "front" is its rear bumper, left and right are
    those of the direction of motion, and the cameras are those of its leading end. The pedestrian crosses
    from the right at 5 km/h after 4 m, 1.5 m of them accelerating, or stands with the back to the car.
    Source: Euro NCAP AEB VRU v4.5.1 (CPRA/Cm-50, CPRA/Cs).

    Args:
        ego_speed: Speed of the reversing ego, in (0, 40] [m/s].
        moving: Whether the pedestrian crosses; otherwise it stands.
        child: Whether the pedestrian is a child.
        impact_location: Position of the pedestrian across the ego's width, 0 the right side and 1 the left,
            in [0.1, 0.9]: of its hip if it crosses, otherwise of its centre.
        shade: Grey level of the clothes in [0, 255]; None to draw it from the seed.
    """
    user = CHILD if check_flag("child", child) else ADULT
    if not check_flag("moving", moving):
        return _ahead("CPRA", user, ego_speed, "walking_speed", 0.0, impact_location, shade)
    speed = check_speed("ego_speed", ego_speed)
    walker = crossing_actor(user, speed, "right", impact_location, (5 * KMH, 2.5, 1.5), shade)
    return Scenario(
        family="CPRA",
        ego_speed=speed,
        duration=START_TTC + AFTERMATH,
        actors=(walker,),
        road=RoadPlan(kind="two-way"),
    )


@family("BicyclePass")
def pass_oncoming_bicycle(
    ego_speed: float = 30 * KMH,
    clearance: float = 1.0,
    bicycle_speed: float = 0.0,
    shade: int | None = None,
) -> Scenario:
    """The ego passes an oncoming bicycle on its left; not a threat.

    Source: GB 39901-2025, with a stationary bicycle at a clearance of 1.0 m and 30 km/h.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        clearance: Distance between the sides of ego and bicycle, in [0.2, 10] [m].
        bicycle_speed: Bicycle speed, in [0, 15] [m/s].
        shade: Grey level of the rider's clothes in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    riding = check_within("bicycle_speed", bicycle_speed, 0.0, 15.0, "m/s")
    aside = EGO_WIDTH / 2 + check_within("clearance", clearance, 0.2, 10.0, "m") + BICYCLE.width / 2
    rider = Actor(
        gap=START_TTC * (speed + riding),
        lateral_offset=aside,
        heading=pi,
        speed=riding,
        shade=shade,
        **BICYCLE.fields,
    )
    return Scenario(
        family="BicyclePass",
        ego_speed=speed,
        duration=START_TTC + 2.0,
        actors=(rider,),
        road=RoadPlan(kind="two-way"),
    )


def _ahead(
    name: str, user: RoadUser, ego_speed: float, speed_name: str, user_speed: float, impact_location: float,
    shade: int | None,
) -> Scenario:  # fmt: skip
    """Return a slower road user ahead of the ego; its contact is 5 s after the start."""
    speed, slower = check_speed("ego_speed", ego_speed), check_speed(speed_name, user_speed, zero=True)
    if slower >= speed:
        raise ValueError(f"{speed_name} must be below ego_speed {speed:g} m/s in {name}, got {slower:g}")
    location = check_within("impact_location", impact_location, 0.1, 0.9)
    target = Actor(
        gap=START_TTC * (speed - slower),
        lateral_offset=(location - 0.5) * EGO_WIDTH,
        speed=slower,
        shade=shade,
        **user.fields,
    )
    return Scenario(
        family=name,
        ego_speed=speed,
        duration=START_TTC + AFTERMATH,
        actors=(target,),
        road=RoadPlan(kind="two-way"),
    )
