"""The road of a braking scenario: straight lanes, and contact with the ego found inside the step."""

from typing import NamedTuple

import numpy as np
from highway_env.road.lane import LineType, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.kinematics import Vehicle

from lgmd_gym.envs.contact import first_touch
from lgmd_gym.envs.scenario import LANE_WIDTH
from lgmd_gym.envs.vehicles import EgoCar, StraightCar

ROAD_START, ROAD_END = -300.0, 6000.0  # [m], beyond what any scenario drives or sees


class Contact(NamedTuple):
    """The ego's first touch of another vehicle.

    Attributes:
        other: What was hit.
        impact_speed: The ego's speed at the touch [m/s].
        relative_impact_speed: The ego's speed less the other's along the ego's heading [m/s].
    """

    other: Vehicle
    impact_speed: float
    relative_impact_speed: float


class BrakingRoad(Road):
    """A road that sweeps the ego's rectangle through each step.

    Attributes:
        ego: The car under test.
        contact: The first contact, or None so far. From then on the road stands still: the cars stay where
            they touched, with the speeds of that moment.
    """

    def __init__(self, network: RoadNetwork, np_random: np.random.Generator) -> None:
        super().__init__(network=network, np_random=np_random)  # type: ignore[arg-type]
        self.ego: EgoCar | None = None
        self.contact: Contact | None = None

    def step(self, dt: float) -> None:
        """Advance all cars by `dt` [s], or up to the first contact of the ego within it."""
        if self.contact is not None:
            return
        ego = self.ego
        before = [(np.array(vehicle.position), vehicle.speed) for vehicle in self.vehicles]
        super().step(dt)
        hit = None if ego is None else self._first_hit(ego, before)
        if ego is None or hit is None:
            return
        fraction, other = hit
        for vehicle, (position, speed) in zip(self.vehicles, before, strict=True):
            vehicle.position = position + fraction * (np.asarray(vehicle.position) - position)
            vehicle.speed = speed + fraction * (vehicle.speed - speed)
        along = other.speed * float(np.cos(other.heading - ego.heading))
        self.contact = Contact(other, ego.speed, ego.speed - along)
        ego.crashed = other.crashed = True

    def _first_hit(
        self, ego: EgoCar, before: list[tuple[np.ndarray, float]]
    ) -> tuple[float, StraightCar] | None:
        """Return the fraction of the step at which the ego first touches a car, and the car."""
        ego_from = before[self.vehicles.index(ego)][0]
        ego_dx, ego_dy = (float(way) for way in np.asarray(ego.position) - ego_from)
        start = ego.rectangle._replace(x=float(ego_from[0]), y=float(ego_from[1]))
        found: tuple[float, StraightCar] | None = None
        for other, (position, _) in zip(self.vehicles, before, strict=True):
            if other is ego or not isinstance(other, StraightCar):
                continue
            dx, dy = (float(way) for way in np.asarray(other.position) - position)
            standing = other.rectangle._replace(x=float(position[0]), y=float(position[1]))
            fraction = first_touch(start, standing, ego_dx - dx, ego_dy - dy)
            if fraction is not None and (found is None or fraction < found[0]):
                found = fraction, other
        return found


def straight_network(lanes: int) -> RoadNetwork:
    """Return `lanes` parallel lanes along x; lane 0 is the leftmost and lies at y = 0."""
    network = RoadNetwork()
    for index in range(lanes):
        y = index * LANE_WIDTH
        lines = [
            LineType.CONTINUOUS_LINE if index == 0 else LineType.STRIPED,
            LineType.CONTINUOUS_LINE if index == lanes - 1 else LineType.NONE,
        ]
        lane = StraightLane(
            [ROAD_START, y],
            [ROAD_END, y],
            width=LANE_WIDTH,
            line_types=lines,  # type: ignore[arg-type]
            speed_limit=40,
        )
        network.add_lane("start", "end", lane)
    return network
