"""Turns across the path of another road user: Euro NCAP's CCFtap, CMFtap and CPTA."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, radians, sin, tan

from lgmd_gym.envs.dynamics.bend import Bend, Pose
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.scenarios.registry import family
from lgmd_gym.envs.scenarios.road_users import ADULT, MOTORCYCLE, TARGET_CAR, RoadUser, run_up
from lgmd_gym.envs.scenarios.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    LANE_WIDTH,
    REAR_AXLE,
    START_TTC,
    WHEELBASE,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_flag, check_known, check_within

FIRST_RADIUS = 1500.0  # [m] at the start of the clothoid
BEFORE_TURN = 2.0  # [s] from the start to the turn; T0 is 1 s before it
DIRECTIONS = {"same": 1.0, "opposite": -1.0}
PEDESTRIAN_LINE = 9.5  # [m] between the centre line of the ego's road and the pedestrian's path
FRONT = REAR_AXLE + EGO_LENGTH / 2  # [m] from the rear axle to the front bumper


@dataclass(frozen=True, slots=True)
class _Turn:
    """A turn of 90° of the ego's front axle: clothoid, arc and clothoid.

    Attributes:
        radius: Radius of the arc [m].
        clothoid_deg: Change of heading on each clothoid [degrees].
        arc_deg: Change of heading on the arc [degrees].
    """

    radius: float
    clothoid_deg: float
    arc_deg: float

    def bends(self, left: bool) -> tuple[Bend, ...]:
        """Return the path of the front axle."""
        sign = 1.0 if left else -1.0
        low, high = sign / FIRST_RADIUS, sign / self.radius
        length = 2.0 * radians(self.clothoid_deg) / (1.0 / FIRST_RADIUS + 1.0 / self.radius)
        arc = Bend(radians(self.arc_deg) * self.radius, high)
        return Bend(length, low, high), arc, Bend(length, high, low)


# Highest ego speed [km/h] of each turn, Euro NCAP Frontal Collisions v1.1, 1.2.4.
TURNS = {10: _Turn(9.0, 20.62, 48.76), 15: _Turn(11.75, 20.93, 48.14), 25: _Turn(14.75, 21.79, 46.42)}


@family("CCFtap")
def turn_across_car(
    ego_speed: float = 15 * KMH, target_speed: float = 45 * KMH, shade: int | None = None
) -> Scenario:
    """The ego turns left across the path of an oncoming car (Car-to-Car Front Turn-Across-Path).

    Without braking, the near corner of the target's front meets the middle of the ego's front. Sources: Euro
    NCAP AEB Car-to-Car v4.3.1, 8.2.3; Frontal Collisions v1.1, 1.2.4.

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
    ego = _turning_ego(speed, left, _pedestrian_contact(_turn_of(speed), left, ahead))
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
def _pedestrian_contact(turn: _Turn, left: bool, ahead: float) -> tuple[float, Pose]:
    """Return the contact with the pedestrian, see `_contact`."""
    line = _pedestrian_line(left)

    def clearance(front: Pose) -> float:
        """Return the distance of the pedestrian's nearest corner ahead of the ego's front [m]."""
        x, y = _hip(front, line)
        x -= ahead * ADULT.impact_point
        forward, aside = cos(front.heading), sin(front.heading)
        reach = (abs(forward) * ADULT.length + abs(aside) * ADULT.width) / 2
        return x * forward + y * aside - reach

    return _contact(turn, left, clearance)


@lru_cache
def _crossing_contact(turn: _Turn, width: float) -> tuple[float, Pose]:
    """Return the contact with an oncoming road user of a width [m], see `_contact`."""
    return _contact(turn, True, lambda front: LANE_WIDTH - width / 2 - front.y)


@dataclass(frozen=True, slots=True)
class _TurningEgo:
    """The ego's turn up to the contact.

    Attributes:
        path: Path of the rear axle.
        junction: Distance from the ego's initial centre to the centre of the crossing road [m].
        contact: Time of the contact [s].
        front: Middle of the ego's front at the contact, relative to that at the start, + left; heading.
    """

    path: tuple[Bend, ...]
    junction: float
    contact: float
    front: Pose

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


def _turn_across(
    name: str, user: RoadUser, ego_speed: float, target_speed: float, shade: int | None
) -> Scenario:
    speed, oncoming = _turning_speed(ego_speed), check_speed("target_speed", target_speed)
    ego = _turning_ego(speed, True, _crossing_contact(_turn_of(speed), user.width))
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


def _turn_of(speed: float) -> _Turn:
    """Return the turn that the ego drives at a speed [m/s]."""
    return next(turn for limit, turn in TURNS.items() if speed <= (limit + 0.02) * KMH)


def _turning_ego(speed: float, left: bool, contact: tuple[float, Pose]) -> _TurningEgo:
    """Return the ego's turn with a contact that is at least 5 s after the start.

    Args:
        speed: Ego speed [m/s].
        left: Whether the ego turns left.
        contact: See `_contact`.
    """
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    turn, (way, front) = _turn_of(speed), contact
    straight = max(BEFORE_TURN * speed, START_TTC * speed - way)
    length = sum(bend.length for bend in turn.bends(left))
    end = (
        Path(Pose(0.0, 0.0, 0.0), turn.bends(left)).pose(length).x
    )  # of the front axle, from the turn's start
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2  # of the crossing road, into which the ego turns
    path = (Bend(straight), *_rear_path(turn, left))
    moved = Pose(straight + front.x, front.y, front.heading)
    return _TurningEgo(path, REAR_AXLE + straight + end - lane, (straight + way) / speed, moved)


@lru_cache
def _rear_path(turn: _Turn, left: bool) -> tuple[Bend, ...]:
    """Return the path of the rear axle from the time at which the front axle begins the turn."""
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.steered_path import rear_axle_path

    return rear_axle_path(turn.bends(left), WHEELBASE)


def _contact(turn: _Turn, left: bool, clearance: Callable[[Pose], float]) -> tuple[float, Pose]:
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
