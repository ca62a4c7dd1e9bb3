"""Routes: ways along the reference lines of several roads."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import pi
from typing import NamedTuple

from lgmd_gym.openscenario.paths import Place, Track
from lgmd_gym.openscenario.roads import Road, RoadNetwork

Stop = tuple[Road, int | None, float]  # road, lane, distance along the road [m]


class Leg(NamedTuple):
    """A road of a route."""

    road: Road
    direction: int  # 1 along the reference line, -1 against it
    start: float  # [m], distance along the route at its beginning


@dataclass(frozen=True)
class Route:
    """A way along roads; lanes and offsets refer to the direction of travel.

    Attributes:
        legs: The roads.
        origin: Distance from the beginning of the first road to the first waypoint [m].
    """

    legs: tuple[Leg, ...]
    origin: float

    @classmethod
    def through(cls, network: RoadNetwork, stops: list[Stop]) -> "Route":
        """Return the shortest route through waypoints.

        Raises:
            ValueError: If there is none.
        """
        steps: list[tuple[Road, int]] = []
        for (road, lane, s), (other, _, after) in pairwise(stops):
            direction = None if lane is None or lane == 0 else road.direction(lane)
            if road is other and after != s:
                direction = 1 if after > s else -1
            way = network.route(road.name, direction, other.name)
            steps += way if not steps or steps[-1] != way[0] else way[1:]
        legs, length = [], 0.0
        for road, direction in steps:
            legs.append(Leg(road, direction, length))
            length += road.length
        first, direction = steps[0]
        return cls(tuple(legs), stops[0][2] if direction > 0 else first.length - stops[0][2])

    @cached_property
    def track(self) -> Track:
        """Path along the reference lines, from the beginning of the first road on."""
        return self.shifted(0.0)

    def shifted(self, left: float) -> Track:
        """Return the path at a distance to the left of the reference lines [m]."""
        first = self.legs[0]
        start = first.road.at(0.0 if first.direction > 0 else first.road.length, first.direction * left)
        bends = [leg.road.bends(leg.direction, leg.direction * left) for leg in self.legs]
        heading = start if first.direction > 0 else start.turned(pi)
        return Track(heading, tuple(bend for part in bends for bend in part))

    def at(self, distance: float, left: float = 0.0) -> Place:
        """Return the pose at a distance along the route, shifted to the left [m]."""
        return self.track.at(self.origin + distance, left)

    def lane_centre(self, lane: int, distance: float) -> float:
        """Return the offset of a lane's centre, + left of the direction of travel [m]."""
        along = self.origin + distance
        leg = next(leg for leg in reversed(self.legs) if leg.start <= along or leg.start == 0.0)
        s = along - leg.start
        s = s if leg.direction > 0 else leg.road.length - s
        return leg.direction * leg.road.lane_centre(leg.direction * lane, s)
