"""A car crosses our way: Euro NCAP's CCCscp, and one that clears in time."""

from math import pi

from lgmd_gym.envs.dynamics.speed_profile import Segment, SpeedProfile
from lgmd_gym.envs.dynamics.units import KMH, check_speed, check_within
from lgmd_gym.envs.scenarios.registry import AFTERMATH, START_TTC, family
from lgmd_gym.envs.scenarios.scenario import (
    EGO_LENGTH,
    LANE_WIDTH,
    TARGET_LENGTH,
    TARGET_WIDTH,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import unknown_name

SIDES = {"right": 1.0, "left": -1.0}
START_GAP = 2.9  # [m] to the target's path when starting from a stop (N1 8.2.5)
WAITING, PULL_AWAY = 4.5, 1.5  # [s] at the line, [m/s²]; both our choice, the protocol names neither


@family("CCCscp")
def cross_straight(
    ego_speed: float = 30 * KMH,
    target_speed: float = 30 * KMH,
    side: str = "right",
    from_stop: bool = False,
    shade: int | None = None,
) -> Scenario:
    """A car crosses straight, timed so that the ego's front would strike its side.

    The ego's centreline meets the target's side a quarter of its length behind its front (Car-to-Car
    Crossing straight crossing path, N1 8.2.5).

    Args:
        ego_speed: Scripted speed, in (0, 40] [m/s].
        target_speed: In (0, 40] [m/s].
        side: Where the target comes from, "right" or "left".
        from_stop: Whether the ego waits 2.9 m before the target's path and pulls away to `ego_speed`.
        shade: Body grey of the target in [0, 255]; None draws it from the seed.
    """
    speed, across = check_speed("ego_speed", ego_speed), check_speed("target_speed", target_speed)
    if from_stop:
        distance, profile = START_GAP, (Segment(start=WAITING, acceleration=PULL_AWAY, final_speed=speed),)
        contact = _time_over(distance, profile)
    else:
        distance, profile = START_TTC * speed, ()
        contact = START_TTC
    return Scenario(
        family="CCCscp",
        ego_speed=0.0 if from_stop else speed,
        duration=contact + AFTERMATH,
        actors=(_crossing_car(distance, contact * across + TARGET_LENGTH / 4, across, side, shade),),
        ego_profile=profile,
        road=_road(distance, side),
    )


@family("CrossingClears")
def cross_and_clear(
    ego_speed: float = 40 * KMH,
    target_speed: float = 40 * KMH,
    clear_by: float = 1.5,
    side: str = "right",
    shade: int | None = None,
) -> Scenario:
    """A car crosses and has left the ego's lane before the ego gets there; nothing calls for braking.

    Args:
        ego_speed: In (0, 40] [m/s].
        target_speed: In (0, 40] [m/s].
        clear_by: From the target's rear leaving the ego's lane to the ego's arrival, in [0.5, 4] [s].
        side: Where the target comes from, "right" or "left".
        shade: Body grey of the target in [0, 255]; None draws it from the seed.
    """
    speed, across = check_speed("ego_speed", ego_speed), check_speed("target_speed", target_speed)
    distance = START_TTC * speed
    gone = START_TTC - check_within("clear_by", clear_by, 0.5, 4.0, "s")
    # At `gone` the rear is a lane's half beyond the ego's centreline.
    before = gone * across - LANE_WIDTH / 2 - TARGET_LENGTH / 2
    return Scenario(
        family="CrossingClears",
        ego_speed=speed,
        duration=START_TTC + 2.0,
        actors=(_crossing_car(distance, before, across, side, shade),),
        road=_road(distance, side),
    )


def _crossing_car(distance: float, before: float, speed: float, side: str, shade: int | None) -> Actor:
    """Return a car that drives across.

    Args:
        distance: From the ego's front to the car's nearer flank, along the road [m].
        before: From the car's centre to the ego's centreline, along its way [m].
        speed: [m/s].
        side: Where it comes from.
        shade: Body grey.
    """
    if side not in SIDES:
        raise unknown_name("side", side, SIDES)
    to_left = SIDES[side]
    return Actor(
        gap=distance + TARGET_WIDTH / 2 - TARGET_LENGTH / 2,
        lateral_offset=-to_left * before,
        heading=to_left * pi / 2,
        speed=speed,
        shade=shade,
    )


def _road(distance: float, side: str) -> RoadPlan:
    """Return a crossing whose lane for that side is where the car drives."""
    lane = LANE_WIDTH / 2 * SIDES.get(side, 1.0)
    return RoadPlan(kind="crossing", at=EGO_LENGTH / 2 + distance + TARGET_WIDTH / 2 - lane)


def _time_over(distance: float, profile: tuple[Segment, ...]) -> float:
    """Return when a car that stands at first has covered a distance [s]."""
    script, covered, step = SpeedProfile(0.0, profile), 0.0, 1e-3
    while covered < distance:
        covered += script.step(step)
    return script.time
