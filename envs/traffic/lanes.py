"""The lanes of a highway-env road network as arrays for the kernels."""

from typing import Self, TypeAlias, cast

import numpy as np
from highway_env.road.lane import CircularLane, SineLane, StraightLane
from highway_env.road.road import LaneIndex, RoadNetwork

from lgmd_gym.envs.traffic.kernels import CIRCLE, LANE, SINE, STRAIGHT, project

HighwayLane: TypeAlias = StraightLane | CircularLane
"""A lane of highway-env that has a table row; a `SineLane` is a `StraightLane`."""


class LaneTable:
    """The lanes of a road network; they must not change.

    Args:
        network: The road network, with straight, sine and circular lanes.

    Attributes:
        indices: highway-env's index of each lane: start, end, number.
        numbers: Row of each index.
        lanes: The lanes, in the order of `indices`.
        records: `LANE` records.
        pieces: Rows of each lane and of its next and previous lanes, −1 for none, int64, shape (lanes, n).
        offsets: Start of each of these along the lane, shape (lanes, n) [m].
    """

    def __init__(self, network: RoadNetwork) -> None:
        by_index = network.lanes_dict()
        self.indices: list[LaneIndex] = cast(list[LaneIndex], list(by_index))
        self.numbers: dict[LaneIndex, int] = {index: row for row, index in enumerate(self.indices)}
        self.lanes: list[HighwayLane] = cast(list[HighwayLane], list(by_index.values()))
        self.records = np.zeros(len(self.lanes), LANE)
        roads = {index[:2]: None for index in self.indices}
        for row, index in enumerate(self.indices):
            _fill(self.records[row], self.lanes[row])
            start, end, number = index
            values = (list(roads).index(index[:2]), number, len(network.graph[start][end]))
            self.records[["road", "number", "lanes", "ends"]][row] = (*values, end not in network.graph)
        self._circular = bool((self.records["shape"] == CIRCLE).any())
        self._sine = bool((self.records["shape"] == SINE).any())
        self._slopes = self.records["amplitude"] * self.records["pulsation"]
        self._zeros = np.zeros((0, len(self.lanes)))
        pieces = [self._connected(network, index) for index in self.indices]
        size = max(map(len, pieces))
        self.pieces = np.array([[k for k, _ in item] + [-1] * (size - len(item)) for item in pieces])
        self.offsets = np.array([[at for _, at in item] + [0.0] * (size - len(item)) for item in pieces])

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        """Return this object."""
        return self

    def coordinates(self, cars: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the coordinates along and across the lanes [m], shape (cars, lanes) each.

        Args:
            cars: `CAR` records.
        """
        polar = self._no_values(len(cars))
        if self._circular:
            # NumPy's arctan2 and arctan, because the C library's round differently.
            dy, dx = (cars[axis][:, None] - self.records[axis] for axis in ("y", "x"))
            polar = np.arctan2(dy, dx)
        along, across = np.empty_like(polar), np.empty_like(polar)
        project(cars, self.records, polar, along, across)
        return along, across

    def bends(self, cars: np.ndarray, along: np.ndarray, seconds: float = 0.0) -> np.ndarray:
        """Return the angle of each lane to its axis where cars are after a time [rad], shape (cars, lanes).

        Args:
            cars: `CAR` records.
            along: Their coordinates along the lanes [m].
            seconds: The time, in which they keep their speed along every lane [s].
        """
        if not self._sine:
            return self._no_values(len(along))
        lanes, places = self.records, along + (cars["speed"] * seconds)[:, None]
        return np.arctan(self._slopes * np.cos(lanes["pulsation"] * places + lanes["phase"]))

    def _no_values(self, count: int) -> np.ndarray:
        if len(self._zeros) < count:
            self._zeros = np.zeros((count, len(self.lanes)))
        return self._zeros[:count]

    def _connected(self, network: RoadNetwork, index: LaneIndex) -> list[tuple[int, float]]:
        """Return a lane, the next and the previous lanes, each with its start along the lane [m]."""
        start, end, number = index
        pieces = [(self.numbers[index], 0.0)]
        for after, lanes in network.graph.get(end, {}).items():
            if lanes:
                row = self.numbers[end, after, number if number < len(lanes) else 0]
                pieces.append((row, float(self.lanes[self.numbers[index]].length)))
        for before, ends in network.graph.items():
            lanes = ends.get(start)
            if lanes:
                row = self.numbers[before, start, number if number < len(lanes) else 0]
                pieces.append((row, -float(self.lanes[row].length)))
        return pieces


def _fill(record: np.void, lane: HighwayLane) -> None:
    """Write the geometry of a lane into a `LANE` record."""
    record["length"], record["width"] = lane.length, lane.width
    record["forbidden"], record["speed_limit"] = lane.forbidden, lane.speed_limit
    if isinstance(lane, CircularLane):
        record["shape"], record["radius"], record["turn"] = CIRCLE, lane.radius, lane.direction
        record["x"], record["y"] = lane.center
        record["phase"] = lane.start_phase
        return
    record["shape"], record["heading"] = STRAIGHT, lane.heading
    record["x"], record["y"] = lane.start
    record["along_x"], record["along_y"] = lane.direction
    record["across_x"], record["across_y"] = lane.direction_lateral
    if isinstance(lane, SineLane):
        record["shape"] = SINE
        record["amplitude"], record["pulsation"] = lane.amplitude, lane.pulsation
        record["phase"] = lane.phase
