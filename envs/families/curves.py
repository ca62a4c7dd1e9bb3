"""Curves: a car in the ego's lane, and cars, rails and pipes beside it that are no threat.

AdjacentBraking and CurveStandingCar are two of NHTSA's eight manoeuvres for false activations on a test
track; others are in `obstacles` and `adjacent`, and driving under a bridge is left out. Sizes that the
report's summary leaves open are stated at each family.
"""

from math import atan2, cos, exp, hypot, log, pi, sin, sqrt
from typing import TYPE_CHECKING, Annotated

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.envs.dynamics.script import Bend, Pose, Segment, arc
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.arguments import (
    EITHER,
    EgoSpeed,
    Headway,
    LeftCurve,
    OtherShade,
    Shade,
    between,
    draw,
    grey,
    kmh,
    one,
    one_of,
    speed,
    within,
)
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    LANE_WIDTH,
    START_TTC,
    TARGET_LENGTH,
    TARGET_WIDTH,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_within

if TYPE_CHECKING:
    from lgmd_gym.envs.dynamics.path import Path

MAX_LATERAL = 4.0  # [m/s²]
BEYOND_TARGET = 60.0  # [m] of the curve
MEETINGS = (4.0, 5.5, 7.0)  # [s] at which the ego meets the cars of CurvePass
AFTER_PASSING = 2.0  # [s]
RAIL = 175  # grey level
RAIL_PIECE, RAIL_HEIGHT, RAIL_DEPTH = 4.0, 0.75, 0.3  # [m]
CURVE_LENGTH = 120.0  # [m], limit of the length of a curve with a guard rail
CURVE_ANGLE = pi / 3  # [rad] of CurveStandingCar
BRAKING_AT = 3.0  # [s] in AdjacentBraking
OUTER_RADIUS = 25.0  # [m] of the outer side of the road in case 3 of UN R152, the largest allowed
PIPE_PIECE, PIPE_HEIGHT, PIPE_DEPTH = 2.0, 0.8, 0.11  # [m]
PIPE_CLEARANCE, CAR_CLEARANCE = 0.25, 0.1  # [m] between lane edge and pipes, and between pipes and car
LEVEL_SPEED_KMH, LEVEL_RADIUS = (20.0, 100.0), (50.0, 1500.0)  # of random levels in wide curves; [m]
PLACES = ("entrance", "exit")

CurveSpeed = Annotated[float, speed("Ego speed; the lateral acceleration v²/radius is limited to 4 m/s²")]
WideRadius = Annotated[float, within("[15, 2000]", "m", "Radius of the ego's path")]
Radius = Annotated[float, within("[15, 500]", "m", "Radius of the ego's path")]


def _curve(rng: np.random.Generator) -> Arguments:
    """Draw a speed, and a radius that is uniform on a logarithmic scale."""
    ego_speed = kmh(*LEVEL_SPEED_KMH)(rng)
    lowest = max(LEVEL_RADIUS[0], 1.01 * ego_speed**2 / MAX_LATERAL)
    radius = exp(between(log(lowest), log(LEVEL_RADIUS[1]))(rng))
    return {"ego_speed": ego_speed, "radius": radius, "left": EITHER(rng)}


def _standing(rng: np.random.Generator) -> Arguments:
    return _curve(rng) | {
        "lateral_offset": between(-0.4, 0.4)(rng),
        "entry": between(0.0, 3.0)(rng) if rng.random() < 0.4 else 0.0,
    }


@family("CCRsCurve", Level("CCRsCurve", 3.0, _standing), threat=True, twin=True)
def approach_standing_in_curve(
    ego_speed: CurveSpeed = 50 * KMH,
    radius: WideRadius = 200.0,
    left: LeftCurve = True,
    lateral_offset: Annotated[
        float, within("[-1.5, 1.5]", "m", "Target centre minus the ego's path, + left")
    ] = 0.0,
    entry: Annotated[float, within("[0, 4]", "s", "Time to the start of the curve")] = 0.0,
    shade: Shade = None,
) -> Scenario:
    """The ego approaches a stationary car in its lane in a curve.

    The car stands parallel to the lane. It is not a case of a protocol.
    """
    curvature = _side(left) / _limited(ego_speed, radius)
    straight = ego_speed * entry
    station = (EGO_LENGTH + TARGET_LENGTH) / 2 + START_TTC * ego_speed
    curve = Bend(station - straight + BEYOND_TARGET, curvature)
    bends = (Bend(straight), curve) if straight else (curve,)
    target = _car_at(_path(bends), station, lateral_offset, shade)
    return _in_curve("CCRsCurve", ego_speed, START_TTC + AFTERMATH, straight, curve, target)


def _beside(rng: np.random.Generator) -> Arguments:
    oncoming = kmh(20.0, 100.0)(rng) if EITHER(rng) else 0.0
    to_left = oncoming > 0.0 or EITHER(rng)
    offset = between(3.2, 4.0)(rng) if to_left else -between(2.9, 4.0)(rng)
    return _curve(rng) | {"lateral_offset": offset, "oncoming_speed": oncoming}


@family("CurvePass", Level("CurvePass", 1.0, _beside))
def pass_cars_in_curve(
    ego_speed: CurveSpeed = 50 * KMH,
    radius: WideRadius = 200.0,
    left: LeftCurve = True,
    lateral_offset: Annotated[
        float,
        within("[-6, 6]", "m", "Centres of the cars minus the ego's path, + left; at least 2.8 m aside"),
    ] = LANE_WIDTH,
    oncoming_speed: Annotated[float, speed("Speed of the cars in the opposite direction", zero=True)] = 0.0,
) -> Scenario:
    """The ego drives through a curve past three cars next to its lane; not a threat.

    The cars stand, or they approach in the oncoming lane. It is not a case of a protocol.
    """
    curvature = _side(left) / _limited(ego_speed, radius)
    if abs(lateral_offset) < 2.8:
        raise ValueError(
            f"lateral_offset of CurvePass must be at least 2.8 m to either side, got {lateral_offset:g}; "
            "CCRsCurve has a car in the ego's lane"
        )
    stations = [(EGO_LENGTH + TARGET_LENGTH) / 2 + (ego_speed + oncoming_speed) * time for time in MEETINGS]
    curve = Bend(stations[-1] + BEYOND_TARGET, curvature)
    # A car on the oncoming lane drives along the curve in the opposite direction.
    way = (Bend(stations[-1] + BEYOND_TARGET, -curvature / (1.0 - curvature * lateral_offset)),)
    path = _path((curve,))
    cars = [_car_at(path, station, lateral_offset, None, oncoming_speed, way) for station in stations]
    return _in_curve("CurvePass", ego_speed, MEETINGS[-1] + AFTER_PASSING, 0.0, curve, *cars)


def _rail(rng: np.random.Generator) -> Arguments:
    radius = between(40.0, 200.0)(rng)
    top = min(80.0, (3.5 * radius) ** 0.5 / KMH)
    return {"ego_speed": kmh(20.0, top)(rng), "radius": radius, "left": EITHER(rng)}


@family("CurveGuardRail", Level("CurveGuardRail", 1.0, _rail))
def drive_along_rail(
    ego_speed: CurveSpeed = 50 * KMH, radius: Radius = 60.0, left: LeftCurve = True
) -> Scenario:
    """The ego drives through a curve with a guard rail along the outside; not a threat."""
    side, entry = _side(left), 3.0 * ego_speed
    curve = arc(_limited(ego_speed, radius), side * min(pi / 2, CURVE_LENGTH / radius))
    # The outside of a left curve is next to the ego's lane; of a right curve, beyond the oncoming lane.
    outside = LANE_WIDTH / 2 + 1.0 + (0.0 if left else LANE_WIDTH)
    path = _path((Bend(entry), curve))
    rails = _rail_along(path, entry - 15.0, entry + curve.length + 15.0, side * outside)
    duration = (entry + curve.length) / ego_speed + AFTER_PASSING
    return _in_curve("CurveGuardRail", ego_speed, duration, entry, curve, *rails)


@family("CurveObjectOutside", Level("CurveObjectOutside", 1.0, draw(left=EITHER)))
def curve_with_car_outside(
    left: LeftCurve = True, shade: Annotated[int | None, grey("the stationary car")] = None
) -> Scenario:
    """The ego drives through a tight curve with guard pipes and a stationary car behind them; not a threat.

    The ego slows from 30 to 22.5 km/h before a curve whose outer side has a radius of 25 m. Guard pipes stand
    along the outer side, and the car just behind them, on the extension of the lane's centre: within 1.6 s at
    the entry of the curve. The pipes are drawn as a closed rail. A right curve is the mirror image, for
    driving on the left; the road drawn is for driving on the right, so the pipes are on its centre line.
    Source: UN R152 Rev.2, Annex 3 Appendix 2, case 3, with a stationary vehicle.
    """
    side, steady = _side(left), 4.0  # [s] at constant speed
    approach, slow, slowing = 30 * KMH, 22.5 * KMH, 2.0
    onset = steady * approach + (approach**2 - slow**2) / (2 * slowing) + 1.0
    radius = OUTER_RADIUS - LANE_WIDTH / 2
    curve, aside = arc(radius, side * pi / 2), LANE_WIDTH / 2 + PIPE_CLEARANCE + PIPE_DEPTH / 2
    pipes = _rail_along(
        _path((Bend(onset), curve)),
        onset - 10.0,
        onset + curve.length + 10.0,
        side * aside,
        PIPE_PIECE,
        PIPE_HEIGHT,
        PIPE_DEPTH,
    )
    # The car's rear corner on the inside of the curve is the closest to the pipes.
    behind_pipes = radius + aside + PIPE_DEPTH / 2 + CAR_CLEARANCE
    ahead = sqrt(behind_pipes**2 - (radius - TARGET_WIDTH / 2) ** 2)
    standing = Actor(gap=onset - EGO_LENGTH / 2 + ahead, shade=shade)
    return Scenario(
        family="CurveObjectOutside",
        ego_speed=approach,
        duration=steady + (approach - slow) / slowing + (curve.length + 10.0) / slow,
        actors=(standing, *pipes),
        ego_profile=(Segment(start=steady, acceleration=-slowing, final_speed=slow),),
        ego_path=(Bend(onset), curve),
        road=RoadPlan(kind="curve", distance=onset, bends=(curve,)),
    )


_NEIGHBOUR = draw(
    ego_speed=kmh(30.0),
    headway=between(0.8, 2.0),
    deceleration=between(2.0, 6.0),
    radius=lambda rng: between(150.0, 400.0)(rng) if EITHER(rng) else 0.0,
)


@family("AdjacentBraking", Level("AdjacentBraking", 1.0, _NEIGHBOUR))
def neighbour_brakes(
    ego_speed: Annotated[float, speed("Speed of both cars before the braking")] = 72.4 * KMH,
    radius: Annotated[
        float, within("[0, 500]", "m", "Radius of the ego's path; 0 for a straight road, or at least 15")
    ] = 0.0,
    headway: Headway = 1.5,
    deceleration: Annotated[float, within("[0.5, 10]", "m/s²", "Deceleration of the other car")] = 3.0,
    shade: OtherShade = None,
) -> Scenario:
    """A car ahead in the lane to the left brakes to a standstill, and the ego passes it; not a threat.

    In a curve, both cars turn right: the other car is on the outer lane, straight ahead of the ego's optical
    axis. Source: NHTSA, on a straight and in a curve; headway, deceleration and radius are assumptions.
    """
    gap = ego_speed * headway
    braking = (Segment(start=BRAKING_AT, acceleration=-deceleration),)
    stopping = ego_speed**2 / (2.0 * deceleration)
    duration = BRAKING_AT + (gap + stopping + TARGET_LENGTH + EGO_LENGTH) / ego_speed + AFTER_PASSING
    if radius == 0.0:
        other = Actor(gap=gap, lateral_offset=LANE_WIDTH, speed=ego_speed, profile=braking, shade=shade)
        return Scenario(family="AdjacentBraking", ego_speed=ego_speed, duration=duration, actors=(other,))
    bend_radius = _limited(ego_speed, check_within("radius", radius, 15.0, 500.0, "m"))
    other = Actor(
        gap=gap,
        lateral_offset=LANE_WIDTH,
        speed=ego_speed,
        profile=braking,
        path=(Bend(1.0), arc(bend_radius + LANE_WIDTH, -pi / 2)),
        shade=shade,
    )
    # The other car reaches the curve after 1 m.
    entry = gap + (EGO_LENGTH + TARGET_LENGTH) / 2 + 1.0
    return _in_curve("AdjacentBraking", ego_speed, duration, entry, arc(bend_radius, -pi / 2), other)


_AT_CURVE = draw(ego_speed=kmh(30.0), place=one("entrance", "exit"), radius=between(150.0, 400.0))


@family("CurveStandingCar", Level("CurveStandingCar", 1.0, _AT_CURVE))
def car_at_curve(
    ego_speed: EgoSpeed = 72.4 * KMH,
    place: Annotated[
        str,
        one_of(PLACES, '"entrance", 10 m behind the start of the curve, or "exit", 10 m before its end'),
    ] = "entrance",
    radius: Radius = 200.0,
    shade: Annotated[int | None, grey("the standing car")] = None,
) -> Scenario:
    """The ego drives through a right curve past a car that stands in the outer lane; not a threat.

    At the entrance the car is straight ahead of the ego before it steers. Source: NHTSA, with a stationary
    car at the entrance and at the exit of a curve; the radius is an assumption.
    """
    entry, curve = 4.0 * ego_speed, arc(_limited(ego_speed, radius), -CURVE_ANGLE)
    station = entry + (10.0 if place == "entrance" else curve.length - 10.0)
    pose = _path((Bend(entry), curve)).pose(station)
    standing = Actor(
        gap=pose.x + LANE_WIDTH * sin(pose.heading) - EGO_LENGTH / 2 - TARGET_LENGTH / 2,
        lateral_offset=-(pose.y - LANE_WIDTH * cos(pose.heading)),
        heading=-pose.heading,
        shade=shade,
    )
    duration = (entry + curve.length) / ego_speed + AFTER_PASSING
    return _in_curve("CurveStandingCar", ego_speed, duration, entry, curve, standing)


def _side(left: bool) -> float:
    return 1.0 if left else -1.0


def _limited(ego_speed: float, radius: float) -> float:
    """Return the radius; raise ValueError if the lateral acceleration is beyond its limit."""
    if ego_speed**2 / radius > MAX_LATERAL:
        raise ValueError(
            f"ego_speed {ego_speed:g} m/s on a radius of {radius:g} m has a lateral acceleration of "
            f"{ego_speed**2 / radius:.1f} m/s², beyond {MAX_LATERAL:g} m/s²; "
            f"pass at least {ego_speed**2 / MAX_LATERAL:.0f} m"
        )
    return radius


def _path(bends: tuple[Bend, ...]) -> "Path":
    """Return a path from the ego's initial centre."""
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    return Path(Pose(0.0, 0.0, 0.0), bends)


def _in_curve(
    name: str, ego_speed: float, duration: float, entry: float, curve: Bend, *actors: Actor
) -> Scenario:
    """Return a scenario in which the ego drives a straight of length `entry` [m] and a curve."""
    return Scenario(
        family=name,
        ego_speed=ego_speed,
        duration=duration,
        actors=actors,
        ego_path=(Bend(entry), curve) if entry else (curve,),
        road=RoadPlan(kind="curve", distance=entry, bends=(curve,)),
    )


def _car_at(
    path: "Path",
    station: float,
    offset: float,
    shade: int | None,
    oncoming_speed: float = 0.0,
    way: tuple[Bend, ...] = (),
) -> Actor:
    """Return a car at a distance along a path and to its left [m]; it stands, or drives towards the ego."""
    pose = path.pose(station)
    x, y = pose.x + offset * sin(pose.heading), pose.y - offset * cos(pose.heading)
    return Actor(
        gap=x - (EGO_LENGTH + TARGET_LENGTH) / 2,
        lateral_offset=-y,
        heading=-pose.heading + (pi if oncoming_speed else 0.0),
        speed=oncoming_speed,
        path=way if oncoming_speed else (),
        shade=shade,
    )


def _rail_along(
    path: "Path",
    start: float,
    end: float,
    to_right: float,
    piece: float = RAIL_PIECE,
    height: float = RAIL_HEIGHT,
    depth: float = RAIL_DEPTH,
) -> list[Actor]:
    """Return boxes in a row along a path.

    Args:
        path: The path, from the ego's initial centre on.
        start: Distance along the path at which the row begins [m].
        end: Distance at which it ends [m].
        to_right: Distance of the boxes' centre line from the path, + right [m].
        piece: Length of a box along the path [m].
        height: Height [m].
        depth: Width of the boxes [m].
    """

    def shifted(distance: float) -> tuple[float, float]:
        pose = path.pose(distance)
        return pose.x - to_right * sin(pose.heading), pose.y + to_right * cos(pose.heading)

    pieces: list[Actor] = []
    for number in range(int((end - start) / piece)):
        x0, y0 = shifted(start + number * piece)
        x1, y1 = shifted(start + (number + 1) * piece)
        length = hypot(x1 - x0, y1 - y0)
        pieces.append(
            Actor(
                gap=(x0 + x1) / 2 - EGO_LENGTH / 2 - length / 2,
                lateral_offset=-(y0 + y1) / 2,
                heading=-atan2(y1 - y0, x1 - x0),
                kind="box",
                shade=RAIL,
                length=length,
                width=depth,
                height=height,
            )
        )
    return pieces
