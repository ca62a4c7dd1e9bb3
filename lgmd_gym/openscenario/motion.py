"""Places, paths and speed over time on the plane of the map: x, y and headings + to the left."""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise
from math import ceil, cos, hypot, inf, sin, sqrt
from typing import NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.script import Bend, Pose, Segment

MAX_CURVED = 100_000.0  # [m] of bends in a path
MAX_ACCELERATION = 12.0
"""Largest acceleration of a `Segment` [m/s²]; a jump of the speed becomes a ramp with it."""
_RAMP = 0.4  # [m], so that a ramp deviates by at most 5 cm from a jump of the speed
_SHORTEST = 1e-9  # [m], below which a section of a path is dropped


class Place(NamedTuple):
    """A position on the map."""

    x: float  # [m]
    y: float  # [m]
    heading: float  # [rad], + to the left

    def moved(self, forward: float, left: float = 0.0) -> "Place":
        """Return the place with the same heading at a distance ahead and to the left [m]."""
        c, s = cos(self.heading), sin(self.heading)
        return Place(self.x + forward * c - left * s, self.y + forward * s + left * c, self.heading)

    def turned(self, angle: float) -> "Place":
        """Return the same position with the heading changed by an angle [rad]."""
        return self._replace(heading=self.heading + angle)

    def distance(self, other: "Place") -> float:
        """Return the distance of two positions [m]."""
        return ((self.x - other.x) ** 2 + (self.y - other.y) ** 2) ** 0.5

    def seen_from(self, other: "Place") -> "Place":
        """Return this place in the axes of another: x ahead of it, y to its left."""
        dx, dy = self.x - other.x, self.y - other.y
        c, s = cos(other.heading), sin(other.heading)
        return Place(dx * c + dy * s, dy * c - dx * s, self.heading - other.heading)


def first_true(test: Callable[[float], bool], low: float, high: float) -> float:
    """Return the number in (low, high] from which on a test is true, within 1e-12."""
    while high - low > 1e-12 * max(high, 1.0):
        middle = (low + high) / 2
        if test(middle):
            high = middle
        else:
            low = middle
    return high


def section(bend: Bend, start: float, end: float) -> Bend | None:
    """Return the part of a bend between two distances along it; None if it is empty."""
    start, end = max(start, 0.0), min(end, bend.length)
    if end - start <= _SHORTEST:
        return None
    if start == 0.0 and end == bend.length:
        return bend
    slope = (bend.last_curvature - bend.curvature) / bend.length
    first, last = bend.curvature + slope * start, bend.curvature + slope * end
    return Bend(end - start, first, None if bend.end_curvature is None else last)


@dataclass(frozen=True)
class Track:
    """A path on the map: bends from a start, straight before and after them."""

    start: Place  # pose at distance 0
    bends: tuple[Bend, ...] = ()  # bends in driving order

    def __post_init__(self) -> None:
        """Raise ValueError for bends that would need too many cells."""
        curved = sum(bend.length for bend in self.bends if not _is_straight(bend))
        if not curved <= MAX_CURVED:
            raise ValueError(f"the bends of a path must be at most {MAX_CURVED:g} m long, got {curved:g} m")

    @cached_property
    def _path(self) -> Path:
        return Path(Pose(self.start.x, -self.start.y, -self.start.heading), self.bends)

    @cached_property
    def length(self) -> float:
        """Length of the bends [m]."""
        return sum(bend.length for bend in self.bends)

    def at(self, distance: float, left: float = 0.0) -> Place:
        """Return the pose at a distance along the path, and a distance to the left of it [m]."""
        pose = self._path.pose(distance)
        return Place(pose.x, -pose.y, -pose.heading).moved(0.0, left)

    def curvature(self, distance: float) -> float:
        """Return the curvature at a distance along the path [1/m]."""
        for bend in self.bends:
            if 0.0 <= distance < bend.length:
                return bend.curvature + (bend.last_curvature - bend.curvature) * distance / bend.length
            distance -= bend.length
        return 0.0

    def part(self, start: float, end: float = inf) -> "Track":
        """Return the path from a distance on, without its bends beyond another."""
        bends: list[Bend] = [Bend(-start)] if start < -_SHORTEST and self.bends else []
        before = 0.0
        for bend in self.bends:
            piece = section(bend, start - before, end - before)
            bends += [] if piece is None else [piece]
            before += bend.length
        return Track(self.at(start), _trimmed(bends))

    def then(self, distance: float, bends: tuple[Bend, ...]) -> "Track":
        """Return the path up to a distance, continued with other bends from there."""
        kept = self.part(0.0, distance).bends
        missing = distance - sum(bend.length for bend in kept)
        straight = (Bend(missing),) if missing > _SHORTEST else ()
        return Track(self.start, _trimmed([*kept, *straight, *bends]))

    @cached_property
    def _samples(self) -> np.ndarray:
        """Distance, x and y at most 2 m apart along the bends, shape (3, samples) [m]."""
        ends = [0.0, *accumulate(bend.length for bend in self.bends)]
        parts = [np.linspace(a, b, max(ceil((b - a) / 2.0), 1), endpoint=False) for a, b in pairwise(ends)]
        distances = np.concatenate([*parts, ends[-1:]])
        places = [self.at(distance) for distance in distances.tolist()]
        return np.array([distances, [place.x for place in places], [place.y for place in places]])

    def project(self, place: Place) -> float:
        """Return the distance along the path of the point nearest to a place, quickly and within 1 mm [m]."""
        distances, x, y = self._samples
        distance = float(distances[np.argmin((x - place.x) ** 2 + (y - place.y) ** 2)])
        for _ in range(3):
            seen = place.seen_from(self.at(distance))
            distance += seen.x / max(1.0 - self.curvature(distance) * seen.y, 0.2)
        return distance

    def nearest(self, place: Place, low: float = 0.0, high: float = 5000.0) -> float:
        """Return the distance along the path of the point nearest to a place.

        Args:
            place: The place; its heading has no effect.
            low: First distance to search [m].
            high: Last distance to search [m].
        """

        def apart(distance: float) -> float:
            point = self.at(distance)
            return hypot(point.x - place.x, point.y - place.y)

        # Samples at the cells of the path, by which most of its bends are left out.
        table = self._path.table
        squares = (table[:, 1] - place.x) ** 2 + (table[:, 2] + place.y) ** 2
        limit = (sqrt(squares.min()) + 1.0) ** 2
        candidates, before, row = list[float](), 0.0, 0
        for bend in (*self.bends, Bend(max(high - self.length, 1.0))):
            if bend.curvature == bend.last_curvature == 0.0:
                ahead = place.seen_from(self.at(before)).x
                candidates.append(min(max(ahead, 0.0), bend.length) + before)
                row += 1
            else:
                count = max(int(bend.length / 0.5), 1)
                step = bend.length / count
                samples = squares[row : row + count + 1]
                if samples.min() <= limit:
                    best = before + int(samples.argmin()) * step
                    candidates.append(_refine(self, place, best - step, best + step))
                row += count
            before += bend.length
        before_start = place.seen_from(self.start).x
        if before_start < 0.0:
            candidates.append(before_start)
        within = [min(max(item, low), high) for item in candidates if low - 1e-3 <= item <= high + 1e-3]
        return min(within, key=apart, default=low)


def _refine(track: Track, place: Place, low: float, high: float) -> float:
    """Return the distance in an interval at which a place is neither ahead nor behind."""
    for _ in range(80):
        middle = (low + high) / 2
        if middle in (low, high):
            break
        if place.seen_from(track.at(middle)).x > 0.0:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def _trimmed(bends: list[Bend]) -> tuple[Bend, ...]:
    """Return bends with adjacent straights joined, and without a straight at the end."""
    joined: list[Bend] = []
    for bend in bends:
        if joined and _is_straight(bend) and _is_straight(joined[-1]):
            joined[-1] = Bend(joined[-1].length + bend.length)
        else:
            joined.append(bend)
    if joined and _is_straight(joined[-1]):
        joined.pop()
    return tuple(joined)


def _is_straight(bend: Bend) -> bool:
    return bend.curvature == bend.last_curvature == 0.0


_CLOSE = 1e-9  # [m/s], [m] or [s]


class Piece(NamedTuple):
    """Motion from a time on: distance, speed, acceleration and its slope at that time."""

    time: float
    distance: float
    speed: float
    acceleration: float = 0.0
    jerk: float = 0.0

    def after(self, dt: float) -> "Piece":
        """Return the motion `dt` [s] later."""
        a, j = self.acceleration, self.jerk
        distance = self.distance + dt * (self.speed + dt * (a / 2 + dt * j / 6))
        return Piece(self.time + dt, distance, self.speed + dt * (a + dt * j / 2), a + dt * j, j)


class Timeline:
    """Distance and speed over time.

    Args:
        speed: Initial speed [m/s].

    Attributes:
        initial_speed: Initial speed [m/s].
        segments: Changes of speed, in order.
    """

    def __init__(self, speed: float = 0.0) -> None:
        self.initial_speed, self.segments = speed, list[Segment]()
        self._pieces = [Piece(0.0, 0.0, speed)]

    def at(self, time: float) -> Piece:
        """Return the motion at a time [s]."""
        index = max(bisect_right(self._pieces, time, key=lambda piece: piece.time) - 1, 0)
        piece = self._pieces[index]
        return piece.after(time - piece.time)

    def change(self, time: float, acceleration: float, final_speed: float, build_up: float = 0.0) -> float:
        """Change the speed from a time on; the changes after that time are dropped.

        Args:
            time: Start [s].
            acceleration: Full acceleration [m/s²].
            final_speed: Speed at the end [m/s].
            build_up: Time to the full acceleration [s].

        Returns:
            The time of the end [s].
        """
        self._cut(time)
        now = self._pieces[-1]
        if abs(final_speed - now.speed) < _CLOSE:
            return time
        self.segments.append(
            Segment(start=time, acceleration=acceleration, build_up=build_up, final_speed=final_speed)
        )
        self._pieces += _ramp(now, acceleration, final_speed, build_up)
        return self._pieces[-1].time

    def jump(self, time: float, final_speed: float) -> float:
        """Change the speed within the shortest time; the distance afterwards is that of a jump.

        The change is around the time, if no other change ends later.

        Args:
            time: Time of the jump [s].
            final_speed: Speed after it [m/s].

        Returns:
            The time of the end [s].
        """
        change = final_speed - self.at(time).speed
        lasts = abs(change) / MAX_ACCELERATION
        start = min(max(time - lasts / 2, self._pieces[-1].time, 0.0), time)
        change = final_speed - self.at(start).speed
        return self.change(start, MAX_ACCELERATION if change > 0.0 else -MAX_ACCELERATION, final_speed)

    def follow_times(self, times: Sequence[tuple[float, float]]) -> float:
        """Reach distances at given times, with a constant speed between them.

        The changes of speed are short ramps around the times, so that no distance is lost. The first one
        follows on the present speed.

        Args:
            times: Times [s], and distances along the path, which do not decrease [m].

        Returns:
            The last time [s].

        Raises:
            ValueError: If a change of speed needs more than `MAX_ACCELERATION`.
        """
        steps = list(pairwise(times))
        speeds = [(after[1] - before[1]) / (after[0] - before[0]) for before, after in steps]
        if times[0][0] > 0.0:
            self.jump(times[0][0], speeds[0])
        else:
            self.initial_speed, self.segments = speeds[0], []
            self._pieces = [Piece(0.0, 0.0, speeds[0])]
        for number in range(1, len(speeds)):
            time, change = times[number][0], speeds[number] - speeds[number - 1]
            if abs(change) < _CLOSE:
                continue
            room = min(time - times[number - 1][0], times[number + 1][0] - time)
            lasts = min(room, _RAMP / abs(change))
            if abs(change) > MAX_ACCELERATION * lasts:
                lasts = abs(change) / MAX_ACCELERATION
                if lasts > room:
                    raise ValueError(
                        f"the speed changes by {change:.3g} m/s at {time:.4g} s, which needs more than "
                        f"{MAX_ACCELERATION:g} m/s²; give it more time"
                    )
            self.change(time - lasts / 2, change / lasts, speeds[number])
        return times[-1][0]

    def copy_from(self, time: float, other: "Timeline", relation: tuple[float, float] = (1.0, 0.0)) -> None:
        """Follow the speed of another timeline from a time on.

        Args:
            time: The time [s].
            other: The other timeline.
            relation: Factor of the other speed, and addition to it [m/s].
        """
        factor, delta = relation
        self._cut(time)
        for segment in other.segments:
            if segment.start >= time:
                final = segment.final_speed * factor + delta
                self.change(segment.start, segment.acceleration * factor, final, segment.build_up)

    def time_of(self, distance: float) -> float:
        """Return the first time at which a distance is reached [s]; inf if it never is."""
        for piece, end in zip(self._pieces, [*(item.time for item in self._pieces[1:]), inf], strict=True):
            if piece.distance >= distance - _CLOSE:
                return piece.time
            if end < inf and piece.after(end - piece.time).distance < distance:
                continue
            return _reach(piece, distance, end)
        return inf

    def _cut(self, time: float) -> None:
        """Drop what comes after a time; a change that is under way ends with its present speed."""
        now = self.at(time)
        kept = [item for item in self.segments if item.start < time - _CLOSE]
        if kept and abs(now.acceleration) > 0.0:
            kept[-1] = replace(kept[-1], final_speed=now.speed)
        self.segments = kept
        self._pieces = [piece for piece in self._pieces if piece.time < time - _CLOSE]
        self._pieces.append(Piece(time, now.distance, now.speed))


def _ramp(now: Piece, acceleration: float, final_speed: float, build_up: float) -> list[Piece]:
    """Return the pieces of a change of speed, and the constant speed after it."""
    change, pieces = final_speed - now.speed, []
    if build_up > 0.0:
        jerk = acceleration / build_up
        lasts = sqrt(2.0 * change / jerk)
        first = now._replace(acceleration=0.0, jerk=jerk)
        if lasts <= build_up:
            end = first.after(lasts)
            return [first, Piece(end.time, end.distance, final_speed)]
        pieces, now = [first], first.after(build_up)
    steady = Piece(now.time, now.distance, now.speed, acceleration)
    end = steady.after((final_speed - now.speed) / acceleration)
    return [*pieces, steady, Piece(end.time, end.distance, final_speed)]


def _reach(piece: Piece, distance: float, end: float) -> float:
    """Return the time at which a piece reaches a distance; inf if it stops before."""
    missing = distance - piece.distance
    if piece.acceleration == 0.0 and piece.jerk == 0.0:
        return piece.time + missing / piece.speed if piece.speed > 0.0 else inf
    low, high = 0.0, end - piece.time
    for _ in range(200):
        middle = (low + high) / 2
        if piece.after(middle).distance < distance:
            low = middle
        else:
            high = middle
    return piece.time + high


SpeedChange = tuple[float, float, float]
"""Start [s], acceleration [m/s²] and final speed [m/s]."""


def synchronise(
    now: Piece, distance: float, duration: float, final_speed: float | None, steady: tuple[float, float]
) -> tuple[SpeedChange, ...]:
    """Return the changes of speed with which an entity covers a distance in a given time.

    The entity has the final speed for the steady distance or time at the end. Before, it waits and then
    accelerates evenly, or accelerates at once and then keeps the final speed, whichever covers the distance;
    if neither does, it reaches an intermediate speed in half of the time.

    Args:
        now: Motion at present.
        distance: Distance to the place [m].
        duration: Time until the place has to be reached [s].
        final_speed: Speed at the place [m/s]; None for the one that results from a constant acceleration.
        steady: Distance [m] and time [s] at the end with the final speed; the larger one counts.

    Raises:
        ValueError: If no forward motion fits.
    """
    start, speed = now.time, now.speed
    if duration <= 0.0 or distance <= 0.0:
        raise ValueError(f"{distance:.3g} m in {duration:.3g} s cannot be reached; start further away")
    if final_speed is None:
        final_speed = 2.0 * distance / duration - speed
        if final_speed < 0.0:
            raise ValueError(f"{distance:.3g} m in {duration:.3g} s from {speed:.3g} m/s needs a reversal")
        return _checked(((start, (final_speed - speed) / duration, final_speed),), start, speed)
    rest = max(steady[1], steady[0] / final_speed) if final_speed > 0.0 else steady[1]
    time, length = duration - rest, distance - rest * final_speed
    if time <= 0.0 or length < -_CLOSE:
        raise ValueError(f"no room before the {rest:.3g} s at constant speed; start further away")
    mean, change = length / time, final_speed - speed
    if abs(change) > _CLOSE and 0.0 < (mean - speed) / change < 1.0:
        share = (mean - speed) / change  # of the final speed in the mean speed
        ramp = 2.0 * share * time if share <= 0.5 else 2.0 * (1.0 - share) * time
        begin = start + time - ramp if share <= 0.5 else start
        return _checked(((begin, change / ramp, final_speed),), start, speed)
    if abs(change) <= _CLOSE and abs(mean - speed) * time < 1e-6:
        return ()
    middle = 2.0 * mean - (speed + final_speed) / 2
    half = time / 2
    return _checked(
        (
            (start, (middle - speed) / half, middle),
            (start + half, (final_speed - middle) / half, final_speed),
        ),
        start,
        speed,
    )


def _checked(changes: tuple[SpeedChange, ...], start: float, speed: float) -> tuple[SpeedChange, ...]:
    for begin, acceleration, final_speed in changes:
        if final_speed < 0.0:
            raise ValueError(f"a speed of {final_speed:.3g} m/s would be needed; start later or further away")
        if abs(acceleration) > 12.0:
            raise ValueError(f"an acceleration of {acceleration:.3g} m/s² would be needed; start earlier")
        assert begin >= start - _CLOSE, (begin, start, speed)
    return changes
