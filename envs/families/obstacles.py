"""Scenarios without a threat: objects on or next to the road that are not cars."""

from math import atan2, cos, hypot, pi, sin
from typing import TYPE_CHECKING

from lgmd_gym.envs.dynamics.bend import Bend, Pose, arc
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.road_users import ADULT
from lgmd_gym.envs.families.scenario import (
    BRIDGE_SHADOW,
    EGO_LENGTH,
    EGO_WIDTH,
    LANE_WIDTH,
    START_TTC,
    Actor,
    RoadPlan,
    Scenario,
    bridge_shadow,
)
from lgmd_gym.errors import check_flag, check_whole, check_within

if TYPE_CHECKING:
    from lgmd_gym.envs.dynamics.path import Path

STEEL, RAIL = 150, 175  # grey levels
RAIL_PIECE, RAIL_HEIGHT, RAIL_DEPTH = 4.0, 0.75, 0.3  # [m]
CURVE_LENGTH = 120.0  # [m], limit of the length of a curve with a guard rail


@family("EmptyRoad")
def drive_alone(ego_speed: float = 50 * KMH) -> Scenario:
    """The ego drives on an empty road; only lane lines and road texture move; not a threat.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
    """
    return Scenario(family="EmptyRoad", ego_speed=check_speed("ego_speed", ego_speed), duration=10.0)


@family("SteelPlate")
def drive_over_plate(ego_speed: float = 80 * KMH, shade: int = STEEL) -> Scenario:
    """The ego drives over a steel plate of 2.4 × 3.7 m; not a threat.

    Source: 49 CFR 571.127 S9.2 at 80 km/h, GB 39901-2025 at 60 km/h.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        shade: Grey level of the plate in [0, 255].
    """
    speed = check_speed("ego_speed", ego_speed)
    plate = Actor(
        gap=START_TTC * speed,
        kind="road_marking",
        shade=check_whole("shade", shade, 0, 255),
        length=3.7,
        width=2.4,
        height=0.025,
    )
    return Scenario(family="SteelPlate", ego_speed=speed, duration=START_TTC + 2.0, actors=(plate,))


@family("BridgeShadow")
def drive_through_shadow(
    ego_speed: float = 80 * KMH, length: float = 12.0, shade: int = BRIDGE_SHADOW
) -> Scenario:
    """The ego drives through the shadow of a bridge; not a threat.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        length: Length of the shadow along the road, in [1, 100] [m].
        shade: Grey level of the shadow in [0, 255].
    """
    speed = check_speed("ego_speed", ego_speed)
    shadow_length = check_within("length", length, 1.0, 100.0, "m")
    shadow = bridge_shadow(START_TTC * speed, shadow_length, check_whole("shade", shade, 0, 255))
    duration = START_TTC + shadow_length / speed + 2.0
    return Scenario(family="BridgeShadow", ego_speed=speed, duration=duration, actors=(shadow,))


@family("PedestrianPass")
def pass_pedestrian(
    ego_speed: float = 30 * KMH,
    clearance: float = 1.0,
    walking_speed: float = 5 * KMH,
    shade: int | None = None,
) -> Scenario:
    """The ego passes a pedestrian on its right who walks in the same direction; not a threat.

    Source: GB 39901-2025, with a clearance of 1.0 m at 30 km/h.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        clearance: Distance between the sides of ego and pedestrian, in [0.2, 10] [m].
        walking_speed: Pedestrian speed, in [0, ego_speed) [m/s].
        shade: Grey level of the clothes in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    walking = check_speed("walking_speed", walking_speed, zero=True)
    if walking >= speed:
        raise ValueError(f"walking_speed must be below ego_speed {speed:g} m/s, got {walking:g}")
    aside = EGO_WIDTH / 2 + check_within("clearance", clearance, 0.2, 10.0, "m") + ADULT.width / 2
    walker = Actor(
        gap=START_TTC * (speed - walking),
        lateral_offset=-aside,
        speed=walking,
        shade=shade,
        **ADULT.fields,
    )
    duration = START_TTC + (ADULT.length + EGO_LENGTH) / (speed - walking) + 2.0
    return Scenario(family="PedestrianPass", ego_speed=speed, duration=duration, actors=(walker,))


@family("CurveGuardRail")
def drive_along_rail(ego_speed: float = 50 * KMH, radius: float = 60.0, left: bool = True) -> Scenario:
    """The ego drives through a curve with a guard rail along the outside; not a threat.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s]; the lateral acceleration v²/radius is limited to 4 m/s².
        radius: Radius of the ego's path, in [15, 500] [m].
        left: Whether the curve turns left; otherwise right.
    """
    speed = check_speed("ego_speed", ego_speed)
    bend_radius = check_within("radius", radius, 15.0, 500.0, "m")
    if speed**2 / bend_radius > 4.0:
        raise ValueError(
            f"ego_speed {speed:g} m/s on a radius of {bend_radius:g} m has a lateral acceleration of "
            f"{speed**2 / bend_radius:.1f} m/s², beyond 4 m/s²; "
            f"pass at most {(4.0 * bend_radius) ** 0.5:.1f} m/s"
        )
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    side = 1.0 if check_flag("left", left) else -1.0
    entry = 3.0 * speed
    curve = arc(bend_radius, side * min(pi / 2, CURVE_LENGTH / bend_radius))
    # The outside of a left curve is next to the ego's lane; of a right curve, beyond the oncoming lane.
    outside = LANE_WIDTH / 2 + 1.0 + (0.0 if left else LANE_WIDTH)
    path = Path(Pose(0.0, 0.0, 0.0), (Bend(entry), curve))
    rails = rail_along(path, entry - 15.0, entry + curve.length + 15.0, side * outside)
    return Scenario(
        family="CurveGuardRail",
        ego_speed=speed,
        duration=(entry + curve.length) / speed + 2.0,
        actors=rails,
        ego_path=(Bend(entry), curve),
        road=RoadPlan(kind="curve", distance=entry, bends=(curve,)),
    )


def rail_along(
    path: "Path",
    start: float,
    end: float,
    to_right: float,
    piece: float = RAIL_PIECE,
    height: float = RAIL_HEIGHT,
    depth: float = RAIL_DEPTH,
) -> tuple[Actor, ...]:
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
    count = int((end - start) / piece)
    for number in range(count):
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
    return tuple(pieces)
