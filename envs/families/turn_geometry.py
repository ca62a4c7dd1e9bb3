"""The ego's turn at a junction up to a contact: the paths of its axles, and where its front is."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import cos, radians, sin

from lgmd_gym.envs.dynamics.bend import Bend, Pose
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.scenario import (
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

FIRST_RADIUS = 1500.0  # [m] at the start of the clothoid
BEFORE_TURN = 2.0  # [s] from the start to the turn; T0 is 1 s before it
FRONT = REAR_AXLE + EGO_LENGTH / 2  # [m] from the rear axle to the front bumper


@dataclass(frozen=True, slots=True)
class Turn:
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
TURNS = {10: Turn(9.0, 20.62, 48.76), 15: Turn(11.75, 20.93, 48.14), 25: Turn(14.75, 21.79, 46.42)}


@dataclass(frozen=True, slots=True)
class TurningEgo:
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


def turn_of(speed: float) -> Turn:
    """Return the turn that the ego drives at a speed [m/s]."""
    return next(turn for limit, turn in TURNS.items() if speed <= (limit + 0.02) * KMH)


def turning_ego(speed: float, left: bool, contact: tuple[float, Pose]) -> TurningEgo:
    """Return the ego's turn with a contact that is at least 5 s after the start.

    Args:
        speed: Ego speed [m/s].
        left: Whether the ego turns left.
        contact: See `contact_in_turn`.
    """
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    turn, (way, front) = turn_of(speed), contact
    straight = max(BEFORE_TURN * speed, START_TTC * speed - way)
    length = sum(bend.length for bend in turn.bends(left))
    end = (
        Path(Pose(0.0, 0.0, 0.0), turn.bends(left)).pose(length).x
    )  # of the front axle, from the turn's start
    lane = LANE_WIDTH / 2 if left else -LANE_WIDTH / 2  # of the crossing road, into which the ego turns
    path = (Bend(straight), *_rear_path(turn, left))
    moved = Pose(straight + front.x, front.y, front.heading)
    return TurningEgo(path, REAR_AXLE + straight + end - lane, (straight + way) / speed, moved)


@lru_cache
def _rear_path(turn: Turn, left: bool) -> tuple[Bend, ...]:
    """Return the path of the rear axle from the time at which the front axle begins the turn."""
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.steered_path import rear_axle_path

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
