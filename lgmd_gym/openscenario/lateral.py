"""Lateral actions: changes of lane and of the offset in a lane, as paths along the lanes."""

from collections.abc import Callable
from math import ceil, cos, hypot, pi
from typing import NamedTuple

import numpy as np

from lgmd_gym.openscenario.curves import fit
from lgmd_gym.openscenario.dynamics import Dynamics, read_dynamics, read_offset_dynamics
from lgmd_gym.openscenario.nodes import Element
from lgmd_gym.openscenario.roads import Road
from lgmd_gym.openscenario.ways import Way, follow
from lgmd_gym.openscenario.world import Mover, ScenarioMap, lane_at, shifted

_STEP = 0.02  # [s] of the integration of the position along the road
_STEPS = 400  # of a transition over a distance
_CLOSE = 1e-6  # [m]
_SETTLED = 5.0  # [m] after a transition within which the path regains the direction of the lane


class OnRoad(NamedTuple):
    """Position of an entity on a road."""

    road: Road
    direction: int  # 1 along its reference line, -1 against it
    s: float  # distance along it [m]
    t: float  # offset from it, + left [m]
    lane: int  # id of the nearest lane


def on_road(item: Element, mover: Mover, world: ScenarioMap, time: float) -> OnRoad:
    """Return where an entity is; ValueError if it does not drive along a road."""
    here = mover.path.at(mover.timeline.at(time).distance)
    road, s, t = world.road_of(mover, here)
    along = cos(here.heading - road.at(s).heading)
    if abs(along) < 0.7:
        raise item.error(f"{mover.name!r} must drive along a road at {time:.3g} s; its heading is across")
    return OnRoad(road, 1 if along > 0.0 else -1, s, t, lane_at(road, s, t))


def lane_change(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Move an entity to another lane."""
    dynamics = read_dynamics(item.child("LaneChangeActionDynamics"))
    target = item.child("LaneChangeTarget").only("AbsoluteTargetLane", "RelativeTargetLane")
    now = on_road(item, mover, world, time)
    lane = target.whole("value")
    if target.tag == "RelativeTargetLane":
        other = on_road(target, world.mover(target), world, time)
        lane = shifted(other.road, other.lane, lane * other.direction)
    if lane not in now.road.lanes(now.s):
        known = ", ".join(str(number) for number in sorted(now.road.lanes(now.s)) if number)
        raise target.error(f"road {now.road.name} has no lane {lane} at {now.s:.4g} m; its lanes are {known}")
    offset = item.number("targetLaneOffset", 0.0)
    return _move(item, mover, world, time, now._replace(lane=lane), offset, lambda _: dynamics)


def lane_offset(item: Element, mover: Mover, world: ScenarioMap, time: float) -> float:
    """Move an entity to an offset in its lane."""
    item.flag("continuous")
    target = item.child("LaneOffsetTarget").only("AbsoluteTargetLaneOffset", "RelativeTargetLaneOffset")
    now, offset = on_road(item, mover, world, time), target.number("value")
    if target.tag == "RelativeTargetLaneOffset":
        other = on_road(target, world.mover(target), world, time)
        offset = other.t + other.direction * offset - now.road.lane_centre(now.lane, now.s)
    block = item.child("LaneOffsetActionDynamics")
    return _move(item, mover, world, time, now, offset, lambda change: read_offset_dynamics(block, change))


def _move(
    item: Element,
    mover: Mover,
    world: ScenarioMap,
    time: float,
    now: OnRoad,
    offset: float,
    dynamics_of: Callable[[float], Dynamics],
) -> float:
    """Move an entity to an offset in a lane, and return the time of the end [s].

    Args:
        item: The action.
        mover: The entity.
        world: The world.
        time: Start [s].
        now: Its position, with the lane to which it moves.
        offset: Final offset from the centre of the lane, + left of the reference line [m].
        dynamics_of: Returns the transition for a change of the offset [m].
    """
    legs = mover.legs[mover.legs.index((now.road, now.direction)) + 1 :] if mover.legs else ()
    way, chosen = follow(world.network, now.road, now.direction, now.s, now.lane, legs)
    if not way.spans:
        raise item.error(
            f"{mover.name!r} is at the end of road {now.road.name} at {time:.3g} s; start earlier"
        )
    if chosen:
        world.note(item, f"{mover.name!r} takes the straightest way at junctions, because it has no route")
    distance, final = mover.timeline.at(time).distance, now.direction * offset
    here, prefix = mover.path.at(distance), mover.path
    change = here.seen_from(way.spans[0].line(0.0)).y - way.spans[0].centre(0.0) - final
    dynamics = dynamics_of(change)
    mover.way, mover.replan = way, None
    if abs(change) < _CLOSE:
        return time
    if dynamics.is_step:
        if time > 0.0:
            raise item.error(
                f"a jump of {mover.name!r} by {abs(change):.3g} m to the side at {time:.3g} s is not "
                "supported; use linear dynamics"
            )
        place = way.spans[0].place(0.0, final)
        mover.start = place.turned(pi) if mover.backwards else place
        world.settle(mover)
        return time
    extent = dynamics.extent(change)

    def plan() -> float:
        march = _over_distance if dynamics.dimension == "distance" else _over_time
        with item.locate_errors(f"{item.tag} of {mover.name!r}: "):
            along, driven = march(mover, way, time, _Transition(dynamics, extent, change, final))
            last, parts = float(along[-1]), np.linspace(0.0, 1.0, len(along))
            settled = min(last + _SETTLED, way.length)

            def left(at: float) -> float:
                return final + change * (1.0 - dynamics.share(float(np.interp(at, along, parts))))

            curve = way.curve(left)
            bends = fit(curve, sorted({*way.stops(0.0, settled), last}), here)
            rest = way.bends(settled, final, curve(settled)) if way.length - settled > _CLOSE else ()
        mover.track, mover.follows = prefix.then(distance, (*bends, *rest)), True
        return mover.timeline.time_of(distance + driven)

    end = plan()
    mover.replan, mover.replan_until = plan, end
    mover.turns.append((time, end))
    return end


class _Transition(NamedTuple):
    """A change of the offset from the centre of a lane, which fades out."""

    dynamics: Dynamics
    extent: float  # duration [s] or distance along the lane [m]
    change: float  # offset at the start minus the final one, + left [m]
    final: float  # final offset from the centre, + left [m]

    def left(self, part: float) -> float:
        """Return the offset at a part of the time or distance [m]."""
        return self.final + self.change * (1.0 - self.dynamics.share(part))


def _over_time(mover: Mover, way: Way, time: float, transition: _Transition) -> tuple[np.ndarray, float]:
    """Return distances along a way at equal steps of a transition in time, and the distance driven."""
    count = min(max(ceil(transition.extent / _STEP), 20), 4000)
    along, position, total = np.zeros(count + 1), 0.0, 0.0
    for number in range(count):
        begin, end = (time + transition.extent * (number + k) / count for k in (0, 1))
        driven = mover.timeline.at(end).distance - mover.timeline.at(begin).distance
        aside = transition.left((number + 1) / count) - transition.left(number / count)
        scale, slope = _geometry(way, position, transition.left((number + 0.5) / count))
        aside += slope * driven
        if abs(aside) > 0.999 * driven:
            raise ValueError(
                f"{abs(transition.change):.3g} m to the side in {transition.extent:.3g} s need more than its "
                f"speed of {mover.timeline.at(begin).speed:.3g} m/s; give it more time"
            )
        position += (driven**2 - aside**2) ** 0.5 / scale
        along[number + 1] = position
        total += driven
        _check_inside(way, position)
    return along, total


def _over_distance(mover: Mover, way: Way, time: float, transition: _Transition) -> tuple[np.ndarray, float]:
    """Return distances along a way at equal steps of a transition, and the distance driven."""
    along, position, total = np.zeros(_STEPS + 1), 0.0, 0.0
    for number in range(_STEPS):
        scale, slope = _geometry(way, position, transition.left((number + 0.5) / _STEPS))
        step = transition.extent / _STEPS
        aside = transition.left((number + 1) / _STEPS) - transition.left(number / _STEPS) + slope * step
        position += step / scale
        along[number + 1] = position
        total += hypot(step, aside)
        _check_inside(way, position)
    return along, total


def _geometry(way: Way, along: float, left: float) -> tuple[float, float]:
    """Return the length of the lane per length of the reference line, and the slope of the lane's centre."""
    span = way.span(along)
    centre = span.centre(along)
    curvature = span.direction * span.road.line.curvature(span.s(along))
    ahead = min(along + 0.05, span.finish)
    slope = (span.centre(ahead) - centre) / (ahead - along) if ahead > along else 0.0
    scale = 1.0 - curvature * (centre + left)
    if scale <= 0.0:
        raise ValueError("the lane is beyond the centre of the curve")
    return scale, slope


def _check_inside(way: Way, along: float) -> None:
    if along > way.length:
        raise ValueError(f"the road ends after {way.length:.4g} m, before the action does; start earlier")
