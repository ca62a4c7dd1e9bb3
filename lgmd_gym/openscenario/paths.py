"""Places and paths on the plane of the map: x, y and headings + to the left."""

from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, inf, sin
from typing import NamedTuple

from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.script import Bend, Pose

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

    def seen_from(self, other: "Place") -> "Place":
        """Return this place in the axes of another: x ahead of it, y to its left."""
        dx, dy = self.x - other.x, self.y - other.y
        c, s = cos(other.heading), sin(other.heading)
        return Place(dx * c + dy * s, dy * c - dx * s, self.heading - other.heading)


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
    """A path on the map: bends from a start, straight before and after them.

    Attributes:
        start: Pose at distance 0.
        bends: Bends in driving order.
    """

    start: Place
    bends: tuple[Bend, ...] = ()

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

        candidates, before = [], 0.0
        for bend in (*self.bends, Bend(max(high - self.length, 1.0))):
            if bend.curvature == bend.last_curvature == 0.0:
                ahead = place.seen_from(self.at(before)).x
                candidates.append(min(max(ahead, 0.0), bend.length) + before)
            else:
                count = max(int(bend.length / 0.5), 1)
                step = bend.length / count
                best = min((before + k * step for k in range(count + 1)), key=apart)
                candidates.append(_refine(self, place, best - step, best + step))
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
