"""Turns at a junction: Euro NCAP's CCFtap, CMFtap and CPTA, and turns without a threat of UN R152."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, radians, sin, tan
from typing import Annotated

from lgmd_gym.envs.dynamics.script import Bend, Pose, Segment, turn
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.arguments import (
    EITHER,
    ClothesShade,
    LeadShade,
    RiderShade,
    Shade,
    draw,
    grey,
    kmh,
    one,
    one_of,
    speed,
    truth,
)
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.road_users import ADULT, MOTORCYCLE, TARGET_CAR, RoadUser, run_up
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    LANE_WIDTH,
    REAR_AXLE,
    START_TTC,
    TARGET_LENGTH,
    WHEELBASE,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_within
from lgmd_gym.fields import value

DIRECTIONS = {"same": 1.0, "opposite": -1.0}
PEDESTRIAN_LINE = 9.5  # [m] between the centre line of the ego's road and the pedestrian's path
APPROACH_TIME = 4.0  # [s] at constant speed before the ego or the lead car slows down (UN R152)
FIRST_RADIUS = 1500.0  # [m] at the start of the clothoid
BEFORE_TURN = 2.0  # [s] from the start to the turn; T0 is 1 s before it
FRONT = REAR_AXLE + EGO_LENGTH / 2  # [m] from the rear axle to the front bumper


def _turning_speed(name: str, given: object) -> float:
    return check_within(name, check_speed(name, given), 0.0, 25.02 * KMH, "m/s")


TurningSpeed = Annotated[
    float, value(None, _turning_speed, "Ego speed; the limit is 25 km/h", "(0, 6.95]", "m/s")
]


_ONCOMING = draw(ego_speed=kmh(10.0, 25.0), target_speed=kmh(30.0, 80.0))
_PEDESTRIAN = draw(ego_speed=kmh(10.0, 20.0), left=EITHER, direction=one("same", "opposite"))


@family("CCFtap", Level("CCFtap", 4.0, _ONCOMING), threat=True, twin=True)
def turn_across_car(
    ego_speed: TurningSpeed = 15 * KMH,
    target_speed: Annotated[float, speed("Target speed")] = 45 * KMH,
    shade: Shade = None,
) -> Scenario:
    """The ego turns left across the path of an oncoming car (Car-to-Car Front Turn-Across-Path).

    Without braking, the near corner of the target's front meets the middle of the ego's front. Sources: Euro
    NCAP AEB Car-to-Car v4.3.1, 8.2; Frontal Collisions v1.1, 1.2.4.
    """
    return _turn_across("CCFtap", TARGET_CAR, ego_speed, target_speed, shade)


@family("CMFtap", Level("CMFtap", 2.0, _ONCOMING), threat=True, twin=True)
def turn_across_motorcycle(
    ego_speed: TurningSpeed = 15 * KMH,
    target_speed: Annotated[float, speed("Speed of the motorcycle")] = 45 * KMH,
    shade: RiderShade = None,
) -> Scenario:
    """The ego turns left across the path of a motorcycle (Car-to-Motorcyclist Front Turn-Across-Path).

    Without braking, the near corner of the motorcycle's front meets the middle of the ego's front. Sources:
    Euro NCAP AEB VRU v4.5.1; Frontal Collisions v1.1, 1.2.4.
    """
    return _turn_across("CMFtap", MOTORCYCLE, ego_speed, target_speed, shade)


@family("CPTA", Level("CPTA", 2.0, _PEDESTRIAN), threat=True, twin=True)
def turn_towards_pedestrian(
    ego_speed: TurningSpeed = 10 * KMH,
    left: Annotated[bool, truth("Whether the ego turns left; otherwise right")] = True,
    direction: Annotated[
        str,
        one_of(
            tuple(DIRECTIONS),
            'Direction in which the pedestrian walks, relative to the ego\'s before the turn: "same" or '
            '"opposite"',
        ),
    ] = "same",
    shade: ClothesShade = None,
) -> Scenario:
    """The ego turns into a road that a pedestrian crosses (Car-to-Pedestrian Turning Adult).

    The pedestrian walks at 5 km/h on a line 9.5 m beside the centre line of the ego's road. Without braking,
    its hip is on the ego's centreline at the contact. Source: Euro NCAP AEB VRU v4.5.1: left (far side) in
    the same and the opposite direction at 10 to 20 km/h, right (near side) at 10 km/h with an arc of its own.
    """
    ahead, line = DIRECTIONS[direction], _pedestrian_line(left)
    turn = turn_of(ego_speed, left)
    ego = turning_ego(ego_speed, left, _pedestrian_contact(turn, left, ahead))
    # The pedestrian starts 6 m before the contact if it comes from the kerb beside the ego's lane of the
    # crossing road, else 9.5 m. Faster right turns are of numbered levels only, which do not change.
    beside = direction == "opposite" if left else direction == "same" and turn is RIGHT_TURNS[10]
    start = 6.0 if beside else 9.5
    run = run_up(ego.contact, 5 * KMH, start - 2.0, 2.0)
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
    return ego.scenario("CPTA", ego_speed, walker)


@family("TurnBeforeOncoming", Level("TurnBeforeOncoming", 1.0, draw(left=EITHER)))
def turn_before_oncoming(
    left: Annotated[
        bool, truth("Whether the ego turns left, across the front of the other car; otherwise right")
    ] = True,
    shade: Annotated[int | None, grey("the stationary car")] = None,
) -> Scenario:
    """The ego turns off in front of an oncoming car that has stopped at the junction; not a threat.

    The ego approaches at 30 km/h and turns at 17 km/h; at steering onset the stationary car is within 2.8 s.
    Source: UN R152 Rev.2, Annex 3 Appendix 2, case 1.
    """
    approach, slow, slowing = 30 * KMH, 17 * KMH, 2.5
    slowing_distance = (approach**2 - slow**2) / (2 * slowing)
    onset = APPROACH_TIME * approach + slowing_distance + 1.0
    radius = 9.0 if left else 6.0
    bends = turn((1.0 if left else -1.0) * pi / 2, radius, 3.0)
    turn_length = sum(bend.length for bend in bends)
    standing = Actor(gap=onset + 12.5, lateral_offset=LANE_WIDTH, heading=pi, shade=shade)
    reach = radius + 1.5  # extent of the turn along the initial heading
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2
    return Scenario(
        family="TurnBeforeOncoming",
        ego_speed=approach,
        duration=APPROACH_TIME + (approach - slow) / slowing + (turn_length + 10.0) / slow,
        actors=(standing,),
        ego_profile=(Segment(start=APPROACH_TIME, acceleration=-slowing, final_speed=slow),),
        ego_path=(Bend(onset), *bends),
        road=RoadPlan(kind="crossing", distance=onset + reach - lane),
    )


@family("LeadTurnsOff", Level("LeadTurnsOff", 1.0, draw(left=EITHER)))
def lead_turns_off(
    left: Annotated[bool, truth("Whether the lead car turns left; otherwise right")] = False,
    shade: LeadShade = None,
) -> Scenario:
    """The lead car slows down and turns off while the ego drives straight on; not a threat.

    Both cars start at 40 km/h. The lead car slows to 10 km/h and turns; the ego slows to 27 km/h by then.
    Source: UN R152 Rev.2, Annex 3 Appendix 2, case 2.
    """
    both, lead_slow, slow, slowing = 40 * KMH, 10 * KMH, 27 * KMH, 3.0
    lead_time = (both - lead_slow) / slowing
    lead_distance = APPROACH_TIME * both + (both**2 - lead_slow**2) / (2 * slowing)
    ease = (both - slow) / lead_time  # the ego reaches 27 km/h when the lead car begins to turn
    ego_distance = APPROACH_TIME * both + (both**2 - slow**2) / (2 * ease)
    gap_at_turn = 4.6 * (slow - lead_slow)
    radius = 8.0
    lead = Actor(
        gap=gap_at_turn + ego_distance - lead_distance,
        speed=both,
        profile=(Segment(start=APPROACH_TIME, acceleration=-slowing, final_speed=lead_slow),),
        path=(Bend(lead_distance), *turn((1.0 if left else -1.0) * pi / 2, radius, 2.0)),
        shade=shade,
    )
    onset = EGO_LENGTH / 2 + ego_distance + gap_at_turn + TARGET_LENGTH / 2
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2
    return Scenario(
        family="LeadTurnsOff",
        ego_speed=both,
        duration=APPROACH_TIME + lead_time + 6.0,
        actors=(lead,),
        ego_profile=(Segment(start=APPROACH_TIME, acceleration=-ease, final_speed=slow),),
        road=RoadPlan(kind="crossing", distance=onset + radius + 1.0 - lane),
    )


@dataclass(frozen=True, slots=True)
class Turn:
    """A turn of 90° of the ego's front axle: clothoid, arc and clothoid."""

    radius: float  # radius of the arc [m]
    clothoid_deg: float  # change of heading on each clothoid [degrees]
    arc_deg: float  # change of heading on the arc [degrees]

    def bends(self, left: bool) -> tuple[Bend, ...]:
        """Return the path of the front axle."""
        sign = 1.0 if left else -1.0
        low, high = sign / FIRST_RADIUS, sign / self.radius
        length = 2.0 * radians(self.clothoid_deg) / (1.0 / FIRST_RADIUS + 1.0 / self.radius)
        arc = Bend(radians(self.arc_deg) * self.radius, high)
        return Bend(length, low, high), arc, Bend(length, high, low)


# Highest ego speed [km/h] of each turn, Euro NCAP Frontal Collisions v1.1, 1.2.4.
TURNS = {10: Turn(9.0, 20.62, 48.76), 15: Turn(11.75, 20.93, 48.14), 25: Turn(14.75, 21.79, 46.42)}
# To the right there is one of 10 km/h, as in Vector's files of CPTA; faster ones mirror those to the left.
RIGHT_TURNS = {**TURNS, 10: Turn(8.0, 22.85, 44.3)}


@dataclass(frozen=True, slots=True)
class TurningEgo:
    """The ego's turn up to the contact."""

    path: tuple[Bend, ...]  # path of the rear axle
    junction: float  # distance from the ego's initial centre to the centre of the crossing road [m]
    contact: float  # time of the contact [s]
    front: Pose  # middle of the ego's front at the contact, relative to that at the start, + left; heading

    def scenario(self, name: str, speed: float, actor: Actor) -> Scenario:
        """Return the scenario with an actor."""
        return Scenario(
            family=name,
            ego_speed=speed,
            duration=self.contact + AFTERMATH,
            actors=(actor,),
            ego_path=self.path,
            road=RoadPlan(kind="crossing", distance=self.junction),
            ego_reference=REAR_AXLE,
        )


def turn_of(speed: float, left: bool = True) -> Turn:
    """Return the turn that the ego drives at a speed [m/s], to the left or right."""
    turns = TURNS if left else RIGHT_TURNS
    return next(turn for limit, turn in turns.items() if speed <= (limit + 0.02) * KMH)


def turning_ego(speed: float, left: bool, contact: tuple[float, Pose]) -> TurningEgo:
    """Return the ego's turn with a contact that is at least 5 s after the start.

    Args:
        speed: Ego speed [m/s].
        left: Whether the ego turns left.
        contact: See `contact_in_turn`.
    """
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    turn, (way, front) = turn_of(speed, left), contact
    straight = max(BEFORE_TURN * speed, START_TTC * speed - way)
    length = sum(bend.length for bend in turn.bends(left))
    # End of the front axle's turn along the initial heading, from the turn's start.
    end = Path(Pose(0.0, 0.0, 0.0), turn.bends(left)).pose(length).x
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2  # of the crossing road, into which the ego turns
    path = (Bend(straight), *_rear_path(turn, left))
    moved = Pose(straight + front.x, front.y, front.heading)
    return TurningEgo(path, REAR_AXLE + straight + end - lane, (straight + way) / speed, moved)


@lru_cache
def _rear_path(turn: Turn, left: bool) -> tuple[Bend, ...]:
    """Return the path of the rear axle from the time at which the front axle begins the turn."""
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import rear_axle_path

    return rear_axle_path(turn.bends(left), WHEELBASE)


def contact_in_turn(turn: Turn, left: bool, clearance: Callable[[Pose], float]) -> tuple[float, Pose]:
    """Return the place of a contact in a turn, by bisection.

    Args:
        turn: The turn.
        left: Whether the ego turns left.
        clearance: Returns a distance for the middle of the ego's front that decreases along the turn and is 0
            at the contact.

    Returns:
        Distance that the rear axle has covered in the turn [m]; position of the middle of the ego's front
        relative to that at the start of the turn, + left, and the heading.
    """
    from lgmd_gym.envs.dynamics.path import Path

    path = Path(Pose(-FRONT, 0.0, 0.0), _rear_path(turn, left))

    def front(way: float) -> Pose:
        pose = path.pose(way)
        x, y = pose.x + FRONT * cos(pose.heading), pose.y + FRONT * sin(pose.heading)
        return Pose(x, -y, -pose.heading)

    low, high = 1.0, float(path.table[-1, 0])  # after 1 m the ego has turned a little
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if clearance(front(middle)) > 0.0 else (low, middle)
    return low, front(low)


def _pedestrian_line(left: bool) -> float:
    """Return the lateral position of the pedestrian's path, + left of the ego's initial centreline [m]."""
    return (PEDESTRIAN_LINE if left else -PEDESTRIAN_LINE) + LANE_WIDTH / 2


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
    """Return a left turn in which the middle of the ego's front meets an oncoming road user."""
    ego = turning_ego(ego_speed, True, _crossing_contact(turn_of(ego_speed), user.width))
    target = Actor(
        gap=ego.front.x + target_speed * ego.contact,
        lateral_offset=LANE_WIDTH,
        heading=pi,
        speed=target_speed,
        shade=shade,
        **user.fields,
    )
    return ego.scenario(name, ego_speed, target)
