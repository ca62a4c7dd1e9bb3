"""Trajectories: polylines, clothoids, splines and NURBS as paths, and the times of their vertices."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import pi, remainder

from lgmd_gym.envs.dynamics.script import Bend
from lgmd_gym.openscenario.curves import fit, nurbs, round_corners
from lgmd_gym.openscenario.motion import Place, Track
from lgmd_gym.openscenario.nodes import Element

SIDEWAYS = 0.35
"""Angle between a stated heading and the direction of travel above which there is a note [rad]."""
_NOTED = 0.1  # [m], distance from a vertex above which a rounded corner gives a note
_SAME = 1e-6  # [m] between vertices at the same place
Locate = Callable[[Element], Place]
"""Returns the place of the `Position` in an element."""


@dataclass(frozen=True)
class Trajectory:
    """A path, and the times of its vertices."""

    track: Track
    # time [s], without offset and scale, and distance along the path of each vertex [m]; empty without times
    times: tuple[tuple[float, float], ...] = ()
    notes: tuple[str, ...] = ()  # deviations from the file


def read_trajectory(item: Element, locate: Locate, current: Place | None) -> Trajectory:
    """Return a `Trajectory`.

    Args:
        item: The element.
        locate: Returns the place of a position.
        current: Present pose of the entity, at which a spline without a start begins.
    """
    if item.flag("closed"):
        raise item.error("a closed Trajectory is not supported; use closed=false")
    shape = item.child("Shape").only("Polyline", "Clothoid", "ClothoidSpline", "Nurbs")
    if shape.tag == "Polyline":
        return _polyline(shape, locate)
    if shape.tag == "Nurbs":
        return _nurbs(shape, locate)
    if shape.tag == "ClothoidSpline":
        return Trajectory(_spline(shape, locate, current))
    length, first = shape.number("length"), shape.number("curvature")
    slope = shape.number("curvatureDot" if shape.has("curvatureDot") else "curvaturePrime")
    bend = Bend(length, first, first + slope * length if slope else None)
    return Trajectory(Track(locate(shape.child("Position")), (bend,)))


def _polyline(shape: Element, locate: Locate) -> Trajectory:
    """Return a polyline; its corners are rounded, because a body cannot turn on the spot."""
    vertices = list(shape.all("Vertex"))
    if len(vertices) < 2:
        raise shape.error("a Polyline needs at least 2 vertices")
    places = [locate(vertex.child("Position")) for vertex in vertices]
    index, points = list[int](), list[tuple[float, float]]()  # point of each vertex, and the points
    for place in places:
        if not points or abs(place.x - points[-1][0]) + abs(place.y - points[-1][1]) > _SAME:
            points.append((place.x, place.y))
        index.append(len(points) - 1)
    if len(points) < 2:
        raise shape.error("the first and the last vertex of a Polyline must be apart")
    with shape.locate_errors():
        rounded = round_corners(points)
        track = Track(rounded.start, tuple(bend for bend in rounded.bends))
    apart = (
        _sideways(vertex, place, track.at(rounded.stations[point]))
        for vertex, place, point in zip(vertices, places, index, strict=True)
    )
    notes = tuple(filter(None, [next(filter(None, apart), "")]))
    if rounded.deviation > _NOTED:
        text = f"the corners of the Polyline are rounded; the path passes them at {rounded.deviation:.2g} m"
        notes = (*notes, str(shape.error(text)))
    timed = [vertex.has("time") for vertex in vertices]
    times = ()
    if all(timed):
        stations = [rounded.stations[point] for point in index]
        times = tuple(zip((vertex.number("time") for vertex in vertices), stations, strict=True))
    elif any(timed):
        raise vertices[timed.index(False)].error("every Vertex of a Polyline must have a time, or none")
    return Trajectory(track, times, notes)


def _sideways(vertex: Element, place: Place, path: Place) -> str:
    """Return a note if a vertex states a heading that is not the direction of travel, else ""."""
    position = next(iter(vertex.child("Position").all(*_HEADED)), None)
    if position is None or (position.find("Orientation") is None and not position.has("h")):
        return ""
    apart = abs(remainder(place.heading - path.heading, 2.0 * pi))
    if apart <= SIDEWAYS:
        return ""
    return str(
        position.error(
            f"the heading of a Vertex is {apart:.3g} rad beside the direction of travel and has no effect: a "
            "body drives forwards"
        )
    )


_HEADED = ("WorldPosition", "LanePosition", "RoadPosition", "RelativeLanePosition", "RelativeRoadPosition")


def _nurbs(shape: Element, locate: Locate) -> Trajectory:
    """Return a NURBS curve."""
    controls, order = list(shape.all("ControlPoint")), shape.whole("order")
    knots = [knot.number("value") for knot in shape.all("Knot")]
    if order < 2 or len(controls) < order or len(knots) != len(controls) + order:
        raise shape.error(
            f"a Nurbs of order {order} needs at least {max(order, 2)} ControlPoints and order more Knots, "
            f"got {len(controls)} and {len(knots)}"
        )
    if knots != sorted(knots) or knots[order - 1] >= knots[len(controls)]:
        raise shape.error("the Knots of a Nurbs must increase")
    places = [locate(point.child("Position")) for point in controls]
    points = [
        (place.x, place.y, point.number("weight", 1.0)) for place, point in zip(places, controls, strict=True)
    ]
    if min(weight for _, _, weight in points) <= 0.0:
        raise shape.error("the weights of a Nurbs must be > 0")
    curve = nurbs(points, knots, order)
    stops = sorted({knot for knot in knots if knots[order - 1] <= knot <= knots[len(controls)]})
    with shape.locate_errors("Nurbs: "):
        track = Track(curve(stops[0]), fit(curve, stops))
    return Trajectory(track)


def _spline(shape: Element, locate: Locate, current: Place | None) -> Track:
    start, bends = current, list[Bend]()
    for number, part in enumerate(shape.all("ClothoidSplineSegment")):
        position = part.find("PositionStart")
        if position is not None and number > 0:
            raise position.error("PositionStart is supported in the first segment only; remove it")
        if position is not None:
            start = locate(position)
        if part.number("hOffset", 0.0) != 0.0:
            raise part.error("hOffset must be 0: a path has no corners")
        first, last = part.number("curvatureStart"), part.number("curvatureEnd")
        length = part.number("length")
        if length < 0.0:
            raise part.error(f"ClothoidSplineSegment length must be >= 0 m, got {length:g}")
        if length > 0.0:
            bends.append(Bend(length, first, None if first == last else last))
    if start is None:
        raise shape.error("a position on a trajectory without PositionStart is not supported")
    return Track(start, tuple(bends))


def action_times(item: Element, trajectory: Trajectory, now: float) -> tuple[tuple[float, float], ...]:
    """Return time and distance of the vertices of a trajectory that is followed in time; empty without times.

    Args:
        item: The `FollowTrajectoryAction`.
        trajectory: The trajectory.
        now: Start of the action [s].
    """
    timing = item.child("TimeReference").only("None", "Timing")
    if timing.tag == "None":
        return ()
    if not trajectory.times:
        raise timing.error("a TimeReference with Timing needs a Polyline with a time at every Vertex")
    relative = timing.choice("domainAbsoluteRelative", ("absolute", "relative")) == "relative"
    scale, offset = timing.number("scale"), timing.number("offset") + (now if relative else 0.0)
    if scale <= 0.0:
        raise timing.error(f"Timing scale must be > 0, got {scale:g}")
    times = [(time * scale + offset, distance) for time, distance in trajectory.times]
    steps = [after[0] - before[0] for before, after in pairwise(times)]
    if min(steps) <= 0.0:
        raise timing.error("the times of the vertices of a Polyline must increase")
    return tuple(times)
