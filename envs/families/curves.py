"""Scenarios in a curve: a car that stands in the ego's lane, and cars next to the lane."""

from math import cos, pi, sin

from lgmd_gym.envs.dynamics.bend import Bend, Pose
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    LANE_WIDTH,
    START_TTC,
    TARGET_LENGTH,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_flag, check_within, shown

MAX_LATERAL = 4.0  # [m/s²]
RADIUS = (15.0, 2000.0)  # [m]
BEYOND_TARGET = 60.0  # [m] of the curve
MEETINGS = (4.0, 5.5, 7.0)  # [s] at which the ego meets the cars of CurvePass
AFTER_PASSING = 2.0  # [s]


@family("CCRsCurve")
def approach_standing_in_curve(
    ego_speed: float = 50 * KMH,
    radius: float = 200.0,
    left: bool = True,
    lateral_offset: float = 0.0,
    entry: float = 0.0,
    shade: int | None = None,
) -> Scenario:
    """The ego approaches a stationary car in its lane in a curve.

    The car stands parallel to the lane. It is not a case of a protocol.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s]; the lateral acceleration v²/radius is limited to 4 m/s².
        radius: Radius of the ego's path, in [15, 2000] [m].
        left: Whether the curve turns left; otherwise right.
        lateral_offset: Target centre minus the ego's path, + left, in [-1.5, 1.5] [m].
        entry: Time to the start of the curve, in [0, 4] [s].
        shade: Grey level of the target in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    curvature = _curvature(speed, radius, left)
    offset = check_within("lateral_offset", lateral_offset, -1.5, 1.5, "m")
    straight = speed * check_within("entry", entry, 0.0, 4.0, "s")
    station = (EGO_LENGTH + TARGET_LENGTH) / 2 + START_TTC * speed
    curve = Bend(station - straight + BEYOND_TARGET, curvature)
    bends = (Bend(straight), curve) if straight else (curve,)
    return Scenario(
        family="CCRsCurve",
        ego_speed=speed,
        duration=START_TTC + AFTERMATH,
        actors=(_car_at(bends, station, offset, shade),),
        ego_path=bends,
        road=RoadPlan(kind="curve", distance=straight, bends=(curve,)),
    )


@family("CurvePass")
def pass_cars_in_curve(
    ego_speed: float = 50 * KMH,
    radius: float = 200.0,
    left: bool = True,
    lateral_offset: float = LANE_WIDTH,
    oncoming_speed: float = 0.0,
) -> Scenario:
    """The ego drives through a curve past three cars next to its lane; not a threat.

    The cars stand, or they approach in the oncoming lane. It is not a case of a protocol.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s]; the lateral acceleration v²/radius is limited to 4 m/s².
        radius: Radius of the ego's path, in [15, 2000] [m].
        left: Whether the curve turns left; otherwise right.
        lateral_offset: Centres of the cars minus the ego's path, + left, in [-6, -2.8] or [2.8, 6] [m].
        oncoming_speed: Speed of the cars in the opposite direction, in [0, 40] [m/s].
    """
    speed = check_speed("ego_speed", ego_speed)
    curvature = _curvature(speed, radius, left)
    offset = check_within("lateral_offset", lateral_offset, -6.0, 6.0, "m")
    if abs(offset) < 2.8:
        raise ValueError(
            f"lateral_offset of CurvePass must be at least 2.8 m to either side, got {offset:g}; "
            "CCRsCurve has a car in the ego's lane"
        )
    oncoming = check_speed("oncoming_speed", oncoming_speed, zero=True)
    stations = [(EGO_LENGTH + TARGET_LENGTH) / 2 + (speed + oncoming) * time for time in MEETINGS]
    curve = Bend(stations[-1] + BEYOND_TARGET, curvature)
    # A car on the oncoming lane drives along the curve in the opposite direction.
    path = (Bend(stations[-1] + BEYOND_TARGET, -curvature / (1.0 - curvature * offset)),)
    actors = (_car_at((curve,), station, offset, None, oncoming, path) for station in stations)
    return Scenario(
        family="CurvePass",
        ego_speed=speed,
        duration=MEETINGS[-1] + AFTER_PASSING,
        actors=tuple(actors),
        ego_path=(curve,),
        road=RoadPlan(kind="curve", bends=(curve,)),
    )


def _curvature(speed: float, radius: float, left: bool) -> float:
    """Return the curvature of the ego's path, + left [1/m]; its lateral acceleration is limited."""
    value = check_within("radius", radius, *RADIUS, "m")
    if speed**2 / value > MAX_LATERAL:
        raise ValueError(
            f"ego_speed {speed:g} m/s on a radius of {shown(radius)} m has a lateral acceleration of "
            f"{speed**2 / value:.1f} m/s², beyond {MAX_LATERAL:g} m/s²; "
            f"pass at least {speed**2 / MAX_LATERAL:.0f} m"
        )
    return (1.0 if check_flag("left", left) else -1.0) / value


def _car_at(
    bends: tuple[Bend, ...],
    station: float,
    offset: float,
    shade: int | None,
    oncoming_speed: float = 0.0,
    path: tuple[Bend, ...] = (),
) -> Actor:
    """Return a car at a distance along a path and to its left [m]; it stands, or drives towards the ego."""
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    pose = Path(Pose(0.0, 0.0, 0.0), bends).pose(station)
    x, y = pose.x + offset * sin(pose.heading), pose.y - offset * cos(pose.heading)
    return Actor(
        gap=x - (EGO_LENGTH + TARGET_LENGTH) / 2,
        lateral_offset=-y,
        heading=-pose.heading + (pi if oncoming_speed else 0.0),
        speed=oncoming_speed,
        path=path if oncoming_speed else (),
        shade=shade,
    )
