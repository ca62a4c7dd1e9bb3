"""NHTSA's manoeuvres for false activations on a test track: driving without a threat.

Seven of its eight manoeuvres are here, in `obstacles` (steel plate) and in `adjacent` (cars at the roadside).
Sizes that the report's summary leaves open are stated at each family. Driving under a bridge is left out.
"""

from math import cos, pi, sin
from typing import TYPE_CHECKING

from lgmd_gym.envs.dynamics.bend import Bend, Pose, arc
from lgmd_gym.envs.dynamics.segment import Segment
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.scenario import (
    EGO_LENGTH,
    LANE_WIDTH,
    START_TTC,
    TARGET_LENGTH,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_known, check_within

if TYPE_CHECKING:
    from lgmd_gym.envs.dynamics.path import Path

DOT, DOT_SHADE = 0.1, 230  # [m], size of a raised pavement marker; white ceramic
DOT_ROWS, DOTS_PER_ROW, DOT_SPACING, ROW_SPACING = 4, 6, 0.5, 2.0  # [m]
BRAKING_AT = 3.0  # [s]
CURVE_ANGLE = pi / 3  # [rad]
MAX_LATERAL = 4.0  # [m/s²]
PLACES = ("entrance", "exit")
AFTER_PASSING = 2.0  # [s]


@family("BottsDots")
def drive_over_dots(ego_speed: float = 72.4 * KMH) -> Scenario:
    """The ego drives over four rows of raised pavement markers (Botts' dots) in its lane; not a threat.

    The markers are 0.1 m wide and drawn as flat white squares, six to a row. Source: NHTSA.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
    """
    speed = check_speed("ego_speed", ego_speed)
    dots = tuple(
        Actor(
            gap=START_TTC * speed + row * ROW_SPACING,
            lateral_offset=(number - (DOTS_PER_ROW - 1) / 2) * DOT_SPACING,
            kind="road_marking",
            shade=DOT_SHADE,
            length=DOT,
            width=DOT,
            height=0.02,
        )
        for row in range(DOT_ROWS)
        for number in range(DOTS_PER_ROW)
    )
    return Scenario(family="BottsDots", ego_speed=speed, duration=START_TTC + 2.0, actors=dots)


@family("AdjacentBraking")
def neighbour_brakes(
    ego_speed: float = 72.4 * KMH,
    radius: float = 0.0,
    headway: float = 1.5,
    deceleration: float = 3.0,
    shade: int | None = None,
) -> Scenario:
    """A car ahead in the lane to the left brakes to a standstill, and the ego passes it; not a threat.

    In a curve, both cars turn right: the other car is on the outer lane, straight ahead of the ego's optical
    axis. Source: NHTSA, on a straight and in a curve; headway, deceleration and radius are assumptions.

    Args:
        ego_speed: Speed of both cars before the braking, in (0, 40] [m/s].
        radius: Radius of the ego's path, in [15, 500]; 0 for a straight road [m].
        headway: Time headway, in [0.3, 10] [s].
        deceleration: Deceleration of the other car, in [0.5, 10] [m/s²].
        shade: Grey level of the other car in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    gap = speed * check_within("headway", headway, 0.3, 10.0, "s")
    strength = check_within("deceleration", deceleration, 0.5, 10.0, "m/s²")
    braking = (Segment(start=BRAKING_AT, acceleration=-strength),)
    stopping = speed**2 / (2.0 * strength)
    duration = BRAKING_AT + (gap + stopping + TARGET_LENGTH + EGO_LENGTH) / speed + AFTER_PASSING
    if radius == 0.0:
        other = Actor(gap=gap, lateral_offset=LANE_WIDTH, speed=speed, profile=braking, shade=shade)
        return Scenario(family="AdjacentBraking", ego_speed=speed, duration=duration, actors=(other,))
    bend_radius = _curve_radius(speed, radius)
    # The other car reaches the curve after 1 m.
    entry = gap + (EGO_LENGTH + TARGET_LENGTH) / 2 + 1.0
    other = Actor(
        gap=gap,
        lateral_offset=LANE_WIDTH,
        speed=speed,
        profile=braking,
        path=(Bend(1.0), arc(bend_radius + LANE_WIDTH, -pi / 2)),
        shade=shade,
    )
    curve = arc(bend_radius, -pi / 2)
    return Scenario(
        family="AdjacentBraking",
        ego_speed=speed,
        duration=duration,
        actors=(other,),
        ego_path=(Bend(entry), curve),
        road=RoadPlan(kind="curve", distance=entry, bends=(curve,)),
    )


@family("CurveStandingCar")
def car_at_curve(
    ego_speed: float = 72.4 * KMH, place: str = "entrance", radius: float = 200.0, shade: int | None = None
) -> Scenario:
    """The ego drives through a right curve past a car that stands in the outer lane; not a threat.

    At the entrance the car is straight ahead of the ego before it steers. Source: NHTSA, with a stationary
    car at the entrance and at the exit of a curve; the radius is an assumption.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        place: "entrance", 10 m behind the start of the curve, or "exit", 10 m before its end.
        radius: Radius of the ego's path, in [15, 500] [m].
        shade: Grey level of the standing car in [0, 255]; None to draw it from the seed.
    """
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    speed = check_speed("ego_speed", ego_speed)
    bend_radius = _curve_radius(speed, radius)
    check_known("place", place, PLACES)
    entry, curve = 4.0 * speed, arc(bend_radius, -CURVE_ANGLE)
    path = Path(Pose(0.0, 0.0, 0.0), (Bend(entry), curve))
    station = entry + (10.0 if place == "entrance" else curve.length - 10.0)
    standing = _beside(path, station, shade)
    return Scenario(
        family="CurveStandingCar",
        ego_speed=speed,
        duration=(entry + curve.length) / speed + AFTER_PASSING,
        actors=(standing,),
        ego_path=(Bend(entry), curve),
        road=RoadPlan(kind="curve", distance=entry, bends=(curve,)),
    )


def _curve_radius(speed: float, radius: float) -> float:
    """Return the radius of the ego's path [m]; its lateral acceleration is limited to 4 m/s²."""
    value = check_within("radius", radius, 15.0, 500.0, "m")
    if speed**2 / value > MAX_LATERAL:
        raise ValueError(
            f"ego_speed {speed:g} m/s on a radius of {value:g} m has a lateral acceleration of "
            f"{speed**2 / value:.1f} m/s², beyond {MAX_LATERAL:g} m/s²; "
            f"pass at least {speed**2 / MAX_LATERAL:.0f} m"
        )
    return value


def _beside(path: "Path", station: float, shade: int | None) -> Actor:
    """Return a standing car in the lane to the left of a path at a distance along it [m]."""
    pose = path.pose(station)
    x, y = pose.x + LANE_WIDTH * sin(pose.heading), pose.y - LANE_WIDTH * cos(pose.heading)
    return Actor(
        gap=x - EGO_LENGTH / 2 - TARGET_LENGTH / 2, lateral_offset=-y, heading=-pose.heading, shade=shade
    )
