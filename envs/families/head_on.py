"""Oncoming cars in the ego's lane: Euro NCAP's CCFhos and CCFhol."""

from math import pi

from lgmd_gym.envs.dynamics.bend import Bend, Pose, lane_change
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.road_users import LARGE_CAR
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_WIDTH,
    LANE_WIDTH,
    START_TTC,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_within

LAST_STRAIGHT = 1.5  # [s] before the contact, at which the lane change of CCFhol ends


@family("CCFhos")
def meet_in_lane(
    ego_speed: float = 50 * KMH,
    target_speed: float = 50 * KMH,
    impact_location: float = 0.5,
    shade: int | None = None,
) -> Scenario:
    """An oncoming car drives in the ego's lane (Car-to-Car Front Head-on straight).

    Braking lowers the ego's speed at the contact but does not avoid it: the target does not stop. The
    episode continues at the ego's standstill. Sources: Euro NCAP AEB Car-to-Car v4.3.1; Frontal Collisions
    v1.1.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        target_speed: Target speed, in (0, 40] [m/s].
        impact_location: Position of the target's centre across the ego's width, 0 the right side and 1 the
            left, in [-0.25, 1.25].
        shade: Grey level of the target in [0, 255]; None to draw it from the seed.
    """
    speed, oncoming = check_speed("ego_speed", ego_speed), check_speed("target_speed", target_speed)
    location = check_within("impact_location", impact_location, -0.25, 1.25)
    target = Actor(
        gap=START_TTC * (speed + oncoming),
        lateral_offset=(location - 0.5) * EGO_WIDTH,
        heading=pi,
        speed=oncoming,
        shade=shade,
    )
    return _scenario("CCFhos", speed, (target,))


@family("CCFhol")
def meet_overtaking(
    ego_speed: float = 50 * KMH,
    target_speed: float | None = None,
    change_length: float = 44.0,
    following_distance: float = 13.9,
    shade: int | None = None,
) -> Scenario:
    """An oncoming car overtakes another one into the ego's lane (Car-to-Car Front Head-on lane change).

    The lane change ends 1.5 s before the contact. As in CCFhos, braking does not avoid it. Source: Euro NCAP
    AEB Car-to-Car v4.3.1: 44 m and 13.9 m at 50 km/h, 60 m and 19.4 m at 70 km/h.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        target_speed: Target speed, in (0, 40] [m/s]; None for that of the ego.
        change_length: Length of the lane change along the road, in [10, 200] [m].
        following_distance: Distance between the target and the car ahead of it, in [1, 100] [m].
        shade: Grey level of the target in [0, 255]; None to draw it from the seed.
    """
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    speed = check_speed("ego_speed", ego_speed)
    oncoming = speed if target_speed is None else check_speed("target_speed", target_speed)
    shift = lane_change(check_within("change_length", change_length, 10.0, 200.0, "m"), LANE_WIDTH)
    following = check_within("following_distance", following_distance, 1.0, 100.0, "m")
    way = sum(bend.length for bend in shift)
    contact = max(START_TTC, way / oncoming + LAST_STRAIGHT + 0.5)
    bends = (Bend((contact - LAST_STRAIGHT) * oncoming - way), *shift)
    reached = Path(Pose(0.0, 0.0, 0.0), bends).pose(contact * oncoming).x
    gap = contact * speed + reached
    target = Actor(gap=gap, lateral_offset=LANE_WIDTH, heading=pi, speed=oncoming, path=bends, shade=shade)
    overtaken = Actor(
        gap=gap - following - LARGE_CAR.length,
        lateral_offset=LANE_WIDTH,
        heading=pi,
        speed=oncoming,
        **LARGE_CAR.fields,
    )
    return _scenario("CCFhol", speed, (target, overtaken), contact)


def _scenario(name: str, speed: float, actors: tuple[Actor, ...], contact: float = START_TTC) -> Scenario:
    return Scenario(
        family=name,
        ego_speed=speed,
        duration=contact + AFTERMATH,
        actors=actors,
        road=RoadPlan(kind="two-way"),
    )
