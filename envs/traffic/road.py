# pyright: standard
# Not strict: highway-env states few types.
"""The road of the traffic environments: compiled drivers and motion, contact detection inside each step."""

import struct
from math import hypot
from typing import TypeAlias, cast

import numpy as np
from highway_env.road.regulation import RegulatedRoad
from highway_env.road.road import Road
from highway_env.utils import rotated_rectangles_intersect
from highway_env.vehicle.objects import Landmark, RoadObject

from lgmd_gym.envs.dynamics.bodies import BODY
from lgmd_gym.envs.dynamics.contact import Contact
from lgmd_gym.envs.dynamics.episode import PARTS
from lgmd_gym.envs.traffic.cars import TrafficCar, TrafficEgo
from lgmd_gym.envs.traffic.driver_errors import DriverErrors
from lgmd_gym.envs.traffic.kernels import (
    ALL_DONE,
    CAR,
    CAR_STATE,
    TAU_PURSUIT,
    contact_time,
    decide,
    fill_bodies,
    find_contact,
    locate,
    mark_collisions,
    move,
    neighbours,
)
from lgmd_gym.envs.traffic.lanes import LaneTable

TrafficItem: TypeAlias = TrafficCar | RoadObject
"""A car, or a solid object."""
_STATE = struct.Struct(f"{len(CAR_STATE)}d")  # packing takes a third of the time of assigning a row


class TrafficRoad(RegulatedRoad):
    """A highway-env road that moves all cars in compiled kernels and finds the ego's first contact.

    Other cars that touch each other stop, as in highway-env, but are not pushed apart. After the ego's first
    contact the road does not advance: all cars keep the positions and speeds of that moment.

    Args:
        road: The original road; its cars and objects are assigned to the new road.
        ego: The car under test; None while highway-env builds the scene, without collisions.
        regulated: Whether cars give way at intersections of their routes (highway-env's rules).

    Attributes:
        contact: First contact of the ego, or None.
        errors: Errors of the drivers; None for attentive drivers.
    """

    def __init__(self, road: Road, ego: TrafficEgo | None, regulated: bool) -> None:
        super().__init__(
            road.network,
            road.vehicles,
            road.objects,  # type: ignore[arg-type]
            road.np_random,
            neighbour_vehicles_connected_lanes=road.neighbour_vehicles_connected_lanes,
        )
        self.vehicles, self.objects = road.vehicles, road.objects  # also if empty
        for item in (*self.vehicles, *self.objects):
            item.road = self
        self._ego, self.regulated = ego, regulated
        self.contact: Contact | None = None
        self.errors: DriverErrors | None = None
        self._lanes = LaneTable(self.network)
        self._records = np.zeros(0, CAR)
        self._constants = _numbers(self._records)
        self._known: list[TrafficCar] = []  # the cars of `_constants`
        self._predictions: dict[int, list[tuple[float, float, float]]] = {}

    @property
    def ego(self) -> TrafficEgo:
        """The car under test."""
        assert self._ego is not None
        return self._ego

    @property
    def cars(self) -> list[TrafficCar]:
        """All cars, including the ego."""
        return cast(list[TrafficCar], self.vehicles)

    @property
    def obstacles(self) -> list[TrafficItem]:
        """Cars and solid objects that the ego can touch."""
        return [item for item in self.items if item is not self._ego]

    @property
    def items(self) -> list[TrafficItem]:
        """All cars, then the solid objects."""
        return [*self.cars, *(item for item in self.objects if not isinstance(item, Landmark))]

    def act(self) -> None:
        """Update the decisions of all drivers."""
        if self.contact is not None:
            return
        cars = self._records = self.read()
        table, number = self._lanes, len(self.vehicles)
        along, across = table.coordinates(cars)
        bends = table.bends(cars, along, TAU_PURSUIT)
        pieces = table.pieces if self.neighbour_vehicles_connected_lanes else table.pieces[:, :1].copy()
        arguments = (cars, number, table.records, pieces, table.offsets, along, across, bends)
        waiting = decide(*arguments, 0, False)
        while waiting != ALL_DONE:
            car = self.cars[waiting]
            car.follow_road()
            cars["target_lane"][waiting] = table.numbers[car.target_lane_index]
            cars["planned_lane"][waiting] = car.planned_lane
            waiting = decide(*arguments, waiting, True)
        ego = self._ego
        if ego is None:
            return
        own = self.cars.index(ego)
        record = cars[own]
        if self.errors is not None:
            lane = int(record["lane"])
            limit, given = float(table.records["speed_limit"][lane]), float(record["acceleration"])
            record["acceleration"] = self.errors.hold(ego, limit, given)
            ahead, behind = neighbours(cars, own, lane, table.records, pieces, table.offsets, along, across)
            full = ego.brake.max_deceleration
            self.errors.change_others(cars, self.cars, ahead, behind, full)
        ego.action = {"steering": float(record["steering"]), "acceleration": float(record["acceleration"])}
        ego.driver_acceleration = max(ego.action["acceleration"], -ego.brake.max_deceleration)

    def step(self, dt: float) -> None:
        """Advance all cars by `dt` [s], or up to the ego's first contact; call `act` before."""
        if self.contact is not None:
            return
        self.steps += 1
        if self.errors is not None:
            self.errors.steps += 1
        if self.regulated and self.steps % int(1 / dt / self.REGULATION_FREQUENCY) == 0:
            self.enforce_road_rules()
        cars, number = self._records, len(self.vehicles)
        # NumPy copies structured records field by field, which takes ten times as long.
        before, ego = _records(_numbers(cars).copy()), self._ego
        move(cars, number, np.arctan(1 / 2 * np.tan(cars["steering"])), dt)
        travelled = 0.0
        if ego is not None:
            travelled = ego.travelled
            ego.move(dt)
            cars[self.vehicles.index(ego)] = (*ego.state(self._lanes), *ego.constants)
        along, across = self._lanes.coordinates(cars)
        locate(cars, number, self._lanes.records, along, across, self._lanes.bends(cars, along))
        self._write(cars)
        if ego is None:
            return
        if self._stop_at_contact(before, cars, dt, travelled):
            cars = self.read()
        if mark_collisions(cars, number):
            for i in np.flatnonzero(cars["crashed"][:number]):
                self.vehicles[i].crashed = True

    def _stop_at_contact(self, before: np.ndarray, after: np.ndarray, dt: float, travelled: float) -> bool:
        """Move all cars back to the ego's first contact in a step of `dt` [s], if any; return if there is."""
        ego, own = self.ego, self.vehicles.index(self.ego)
        index = find_contact(before, after, own)
        if index == own:
            return False
        whole = ego.travelled - travelled
        covered = np.array([ego.progress(dt * part / PARTS)[0] for part in range(PARTS + 1)])
        shares = covered / whole if whole > 0.0 else covered
        part = contact_time(before, after, own, index, shares)
        if part > 1.0:
            return False
        way, speed = ego.progress(part * dt)
        own_share = way / whole if whole > 0.0 else 0.0
        for car, record in zip(self.vehicles, before, strict=False):
            share = own_share if car is ego else part
            for axis, place in enumerate((record["x"], record["y"])):
                car.position[axis] = (1 - share) * place + share * car.position[axis]
            car.heading = float((1 - share) * record["heading"] + share * car.heading)
            car.speed = float((1 - part) * record["speed"] + part * car.speed)
        ego.speed, ego.travelled = speed, travelled + way
        self.contact = Contact.between(ego, self.items[index])
        ego.crashed = self.items[index].crashed = True
        return True

    def read(self) -> np.ndarray:
        """Return all cars, then the solid objects, as `CAR` records."""
        vehicles = self.cars
        if self._known != vehicles:
            self._known, self._constants = list(vehicles), self._read_constants()
        numbers = self._constants.copy()
        for number, car in enumerate(vehicles):
            _STATE.pack_into(numbers, number * CAR.itemsize, *car.state(self._lanes))  # type: ignore[arg-type]
        return _records(numbers)

    def _read_constants(self) -> np.ndarray:
        """Return the numbers of the records of all cars without their state, and of the solid objects."""
        items = self.items
        cars = np.zeros(len(items), CAR)
        for number, item in enumerate(items):
            if isinstance(item, TrafficCar):
                _numbers(cars)[number, len(CAR_STATE) :] = item.constants
                continue
            assert item.lane_index is not None
            cars["x"][number], cars["y"][number] = item.position
            cars["heading"][number], cars["lane"][number] = item.heading, self._lanes.numbers[item.lane_index]
            cars["length"][number], cars["width"][number] = item.LENGTH, item.WIDTH
        return _numbers(cars)

    def bodies(self) -> np.ndarray:
        """Return the ego, the other cars and the solid objects as `BODY` records on straight paths."""
        vehicles = self.cars
        current = self._known == vehicles and self.contact is None and len(self._records) > 0
        cars = self._records if current else self.read()
        bodies = np.zeros(len(cars), BODY)
        fill_bodies(cars, vehicles.index(self.ego), bodies)
        return bodies

    def _write(self, cars: np.ndarray) -> None:
        """Assign the state of `CAR` records to the cars."""
        table, ego = self._lanes, self._ego
        vehicles = self.cars
        for car, row in zip(vehicles, _numbers(cars)[:, :9].tolist(), strict=False):
            x, y, heading, speed, lane, target, timer, steering, acceleration = row
            number = int(lane)
            car.lane_index, car.lane = table.indices[number], table.lanes[number]
            car.target_lane_index, car.timer = table.indices[int(target)], timer
            if car is not ego:
                position = car.position
                position[0], position[1] = x, y
                car.heading, car.speed = heading, speed
                car.action = {"steering": steering, "acceleration": acceleration}

    def enforce_road_rules(self) -> None:
        """Let cars give way to others whose routes they may cross, as highway-env does."""
        self._predictions = {}
        super().enforce_road_rules()

    def is_conflict_possible(  # type: ignore[override]
        self, v1: TrafficCar, v2: TrafficCar, horizon: float = 3.0, step: float = 0.25
    ) -> bool:
        """Return whether the routes of two cars may conflict within `horizon` [s].

        In contrast to highway-env, cars that are too far apart to meet are skipped, and the positions of a
        car are predicted once for all pairs.
        """
        (x1, y1), (x2, y2) = v1.position.tolist(), v2.position.tolist()
        if hypot(x2 - x1, y2 - y1) > (v1.speed + v2.speed) * horizon + v1.LENGTH + v2.LENGTH:
            return False
        times = np.arange(step, horizon, step)
        for one, other in zip(self._predict(v1, times), self._predict(v2, times), strict=True):
            if hypot(other[0] - one[0], other[1] - one[1]) <= v1.LENGTH and rotated_rectangles_intersect(
                ((one[0], one[1]), 1.5 * v1.LENGTH, 0.9 * v1.WIDTH, one[2]),  # type: ignore[arg-type]
                ((other[0], other[1]), 1.5 * v2.LENGTH, 0.9 * v2.WIDTH, other[2]),  # type: ignore[arg-type]
            ):
                return True
        return False

    def _predict(self, car: TrafficCar, times: np.ndarray) -> list[tuple[float, float, float]]:
        """Return the predicted poses of a car: x [m], y [m] and heading [rad] at each time."""
        if id(car) not in self._predictions:
            positions, headings = car.predict_trajectory_constant_speed(times)
            self._predictions[id(car)] = [
                (*position.tolist(), float(heading))
                for position, heading in zip(positions, headings, strict=True)
            ]
        return self._predictions[id(car)]


def _numbers(cars: np.ndarray) -> np.ndarray:
    """Return a view of `CAR` records as float64, shape (cars, fields)."""
    return cars.view(np.float64).reshape(len(cars), cars.itemsize // 8)


def _records(numbers: np.ndarray) -> np.ndarray:
    """Return a view of float64 of shape (cars, fields) as `CAR` records."""
    return numbers.view(CAR)[:, 0]
