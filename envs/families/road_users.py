"""Pedestrians, two-wheelers and parked cars of the tests, and their motion before a contact."""

from math import pi
from typing import NamedTuple

from lgmd_gym.aliases import Values
from lgmd_gym.envs.dynamics.script import Segment
from lgmd_gym.envs.dynamics.units import MIN_SPEED
from lgmd_gym.envs.families.scenario import (
    ADULT_SIZE,
    BICYCLE_SIZE,
    CHILD_SIZE,
    EGO_WIDTH,
    MOTORCYCLE_SIZE,
    START_TTC,
    TARGET_HEIGHT,
    TARGET_LENGTH,
    TARGET_WIDTH,
    Actor,
)

YIELDING = 1.0  # [s] before the contact, at which a road user that moves towards the ego begins to brake
SIDES = {"right": 1.0, "left": -1.0}
"""Sides from which road users cross, with the sign of their direction, + to the left."""


class RoadUser(NamedTuple):
    """A target of the tests."""

    kind: str  # kind of actor
    length: float  # length [m]
    width: float  # width [m]
    height: float  # height [m]
    # distance of the point that defines the impact location ahead of the centre [m]: the hip of a pedestrian,
    # 0.36 m (adult) or 0.396 m (child) behind the front of the box, and the crankshaft of a bicycle
    impact_point: float = 0.0

    @property
    def fields(self) -> Values:
        """Fields of an `Actor` of this kind and size."""
        return {"kind": self.kind, "length": self.length, "width": self.width, "height": self.height}


# Boxes and impact points of Euro NCAP's OpenSCENARIO catalogues (2023 and 2026).
ADULT = RoadUser("pedestrian", *ADULT_SIZE, impact_point=ADULT_SIZE[0] / 2 - 0.36)
CHILD = RoadUser("pedestrian", *CHILD_SIZE, impact_point=CHILD_SIZE[0] / 2 - 0.396)
BICYCLE = RoadUser("bicycle", *BICYCLE_SIZE, impact_point=0.62 - 0.605)
MOTORCYCLE = RoadUser("motorcycle", *MOTORCYCLE_SIZE)
TARGET_CAR = RoadUser("car", TARGET_LENGTH, TARGET_WIDTH, TARGET_HEIGHT)
LARGE_CAR = RoadUser("car", 4.418, 1.82, 1.533)  # parked cars that hide a target
SMALL_CAR = RoadUser("car", 4.316, 1.79, 1.48)


class RunUp(NamedTuple):
    """Motion of a road user up to a contact."""

    speed: float  # speed at the start [m/s]
    profile: tuple[Segment, ...]  # change of the speed
    distance: float  # distance covered up to the contact [m]


def run_up(contact: float, speed: float, steady: float, acceleration_distance: float) -> RunUp:
    """Return the motion of a road user that accelerates from rest and then keeps its speed.

    Args:
        contact: Time of the contact [s].
        speed: Final speed, > 0 [m/s].
        steady: Distance covered at the final speed before the contact [m].
        acceleration_distance: Distance of the acceleration, > 0 [m].
    """
    ramp = 2.0 * acceleration_distance / speed
    strength, wait = speed / ramp, contact - steady / speed - ramp
    if wait >= 0.0:
        segment = Segment(start=wait, acceleration=strength, final_speed=speed)
        return RunUp(0.0, (segment,), steady + acceleration_distance)
    reached = -wait * strength
    if reached < MIN_SPEED:  # a start from rest; the road user is placed so that it is in time
        segment = Segment(start=0.0, acceleration=strength, final_speed=speed)
        return RunUp(0.0, (segment,), steady + acceleration_distance + wait * speed)
    if contact > steady / speed:  # the episode begins during the acceleration
        segment = Segment(start=0.0, acceleration=strength, final_speed=speed)
        return RunUp(reached, (segment,), steady + acceleration_distance - reached**2 / (2.0 * strength))
    return RunUp(speed, (), speed * contact)


def yielding(speed: float) -> RunUp:
    """Return the motion of a road user towards the ego that brakes evenly from 1 s before the contact on.

    The contact is 5 s after the start; without it, the road user comes to rest 1 s later.

    Args:
        speed: Speed before, > 0 [m/s].
    """
    deceleration = speed / (2.0 * YIELDING)
    segment = Segment(start=START_TTC - YIELDING, acceleration=-deceleration)
    return RunUp(speed, (segment,), START_TTC * speed - deceleration * YIELDING**2 / 2)


def parked_row(front: float, inner: float, cars: tuple[RoadUser, ...], spacing: float) -> tuple[Actor, ...]:
    """Return parked cars behind one another, parallel to the ego's lane.

    Args:
        front: Distance from the ego's front bumper to the front of the first car [m].
        inner: Lateral position of the cars' sides that face the ego's path, + left [m].
        cars: The cars, the one farthest ahead first.
        spacing: Distance between the cars [m].
    """
    row: list[Actor] = []
    for car in cars:
        aside = inner + (0.5 if inner > 0.0 else -0.5) * car.width
        row.append(Actor(gap=front - car.length, lateral_offset=aside, **car.fields))
        front -= car.length + spacing
    return tuple(row)


def crossing_actor(
    user: RoadUser, ego_speed: float, side: str, impact_location: float, motion: RunUp, shade: int | None
) -> Actor:
    """Return a road user whose impact point is at the impact location 5 s after the start.

    Args:
        user: The road user.
        ego_speed: Ego speed [m/s].
        side: Side from which the road user comes, "right" or "left".
        impact_location: Position across the ego's width, 0 the right side and 1 the left.
        motion: Its motion up to that time, see `run_up`.
        shade: Grey level; None to draw it from the seed.
    """
    to_left, aim = SIDES[side], (impact_location - 0.5) * EGO_WIDTH
    return Actor(
        gap=START_TTC * ego_speed + user.width / 2 - user.length / 2,
        lateral_offset=aim - to_left * (user.impact_point + motion.distance),
        heading=to_left * pi / 2,
        speed=motion.speed,
        profile=motion.profile,
        shade=shade,
        **user.fields,
    )
