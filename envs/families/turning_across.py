"""Turns across the path of another road user: Euro NCAP's CCFtap, CMFtap and CPTA."""

from functools import lru_cache
from math import cos, pi, sin, tan

from lgmd_gym.envs.dynamics.bend import Pose
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.road_users import ADULT, MOTORCYCLE, TARGET_CAR, RoadUser, run_up
from lgmd_gym.envs.families.scenario import LANE_WIDTH, Actor, Scenario
from lgmd_gym.envs.families.turn_geometry import Turn, contact_in_turn, turn_of, turning_ego
from lgmd_gym.errors import check_flag, check_known, check_within

DIRECTIONS = {"same": 1.0, "opposite": -1.0}
PEDESTRIAN_LINE = 9.5  # [m] between the centre line of the ego's road and the pedestrian's path


@family("CCFtap")
def turn_across_car(
    ego_speed: float = 15 * KMH, target_speed: float = 45 * KMH, shade: int | None = None
) -> Scenario:
    """The ego turns left across the path of an oncoming car (Car-to-Car Front Turn-Across-Path).

    Without braking, the near corner of the target's front meets the middle of the ego's front. Sources: Euro
    NCAP AEB Car-to-Car v4.3.1, 8.2; Frontal Collisions v1.1, 1.2.4.

    Args:
        ego_speed: Ego speed, in (0, 6.95] [m/s], which is up to 25 km/h.
        target_speed: Target speed, in (0, 40] [m/s].
        shade: Grey level of the target in [0, 255]; None to draw it from the seed.
    """
    return _turn_across("CCFtap", TARGET_CAR, ego_speed, target_speed, shade)


@family("CMFtap")
def turn_across_motorcycle(
    ego_speed: float = 15 * KMH, target_speed: float = 45 * KMH, shade: int | None = None
) -> Scenario:
    """The ego turns left across the path of a motorcycle (Car-to-Motorcyclist Front Turn-Across-Path).

    Without braking, the near corner of the motorcycle's front meets the middle of the ego's front. Sources:
    Euro NCAP AEB VRU v4.5.1; Frontal Collisions v1.1, 1.2.4.

    Args:
        ego_speed: Ego speed, in (0, 6.95] [m/s], which is up to 25 km/h.
        target_speed: Speed of the motorcycle, in (0, 40] [m/s].
        shade: Grey level of the rider's clothes in [0, 255]; None to draw it from the seed.
    """
    return _turn_across("CMFtap", MOTORCYCLE, ego_speed, target_speed, shade)


@family("CPTA")
def turn_towards_pedestrian(
    ego_speed: float = 10 * KMH, left: bool = True, direction: str = "same", shade: int | None = None
) -> Scenario:
    """The ego turns into a road that a pedestrian crosses (Car-to-Pedestrian Turning Adult).

    The pedestrian walks at 5 km/h on a line 9.5 m beside the centre line of the ego's road. Without braking,
    its hip is on the ego's centreline at the contact. Source: Euro NCAP AEB VRU v4.5.1: left (far side) in
    the same and the opposite direction at 10 to 20 km/h, right (near side) at 10 km/h.

    Args:
        ego_speed: Ego speed, in (0, 6.95] [m/s], which is up to 25 km/h.
        left: Whether the ego turns left; otherwise right.
        direction: Direction in which the pedestrian walks, relative to the ego's before the turn: "same" or
            "opposite".
        shade: Grey level of the clothes in [0, 255]; None to draw it from the seed.
    """
    check_known("direction", direction, DIRECTIONS)
    ahead, line = DIRECTIONS[direction], _pedestrian_line(left)
    speed, walking = _turning_speed(ego_speed), 5 * KMH
    ego = turning_ego(speed, left, _pedestrian_contact(turn_of(speed), left, ahead))
    # The pedestrian starts 6 m before the contact if it comes from the far kerb, else 9.5 m.
    start = 6.0 if left and direction == "opposite" else 9.5
    run = run_up(ego.contact, walking, start - 2.0, 2.0)
    hip = ego.front.x + _hip(ego.front, line)[0]
    centre = hip - ahead * (ADULT.impact_point + run.distance)
    walker = Actor(
        gap=centre - ADULT.length / 2,
        lateral_offset=line,
        heading=0.0 if ahead > 0.0 else pi,
        speed=run.speed,
        profile=run.profile,
        shade=shade,
        **ADULT.fields,
    )
    return ego.scenario("CPTA", speed, walker)


def _pedestrian_line(left: bool) -> float:
    """Return the lateral position of the pedestrian's path, + left of the ego's initial centreline [m]."""
    return (PEDESTRIAN_LINE if check_flag("left", left) else -PEDESTRIAN_LINE) + LANE_WIDTH / 2


def _hip(front: Pose, line: float) -> tuple[float, float]:
    """Return where the ego's centreline meets the pedestrian's path, x and y from the ego's front [m]."""
    return (line - front.y) / tan(front.heading), line - front.y


@lru_cache
def _pedestrian_contact(turn: Turn, left: bool, ahead: float) -> tuple[float, Pose]:
    """Return the contact with the pedestrian, see `contact_in_turn`."""
    line = _pedestrian_line(left)

    def clearance(front: Pose) -> float:
        """Return the distance of the pedestrian's nearest corner ahead of the ego's front [m]."""
        x, y = _hip(front, line)
        x -= ahead * ADULT.impact_point
        forward, aside = cos(front.heading), sin(front.heading)
        reach = (abs(forward) * ADULT.length + abs(aside) * ADULT.width) / 2
        return x * forward + y * aside - reach

    return contact_in_turn(turn, left, clearance)


@lru_cache
def _crossing_contact(turn: Turn, width: float) -> tuple[float, Pose]:
    """Return the contact with an oncoming road user of a width [m], see `contact_in_turn`."""
    return contact_in_turn(turn, True, lambda front: LANE_WIDTH - width / 2 - front.y)


def _turn_across(
    name: str, user: RoadUser, ego_speed: float, target_speed: float, shade: int | None
) -> Scenario:
    speed, oncoming = _turning_speed(ego_speed), check_speed("target_speed", target_speed)
    ego = turning_ego(speed, True, _crossing_contact(turn_of(speed), user.width))
    target = Actor(
        gap=ego.front.x + oncoming * ego.contact,
        lateral_offset=LANE_WIDTH,
        heading=pi,
        speed=oncoming,
        shade=shade,
        **user.fields,
    )
    return ego.scenario(name, speed, target)


def _turning_speed(ego_speed: float) -> float:
    return check_within("ego_speed", check_speed("ego_speed", ego_speed), 0.0, 25.02 * KMH, "m/s")
