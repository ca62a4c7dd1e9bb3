"""The road of the traffic environments: contact detection inside each step, and fast neighbour searches."""

from math import hypot
from typing import Any

from highway_env.road.regulation import RegulatedRoad
from highway_env.road.road import Road
from highway_env.vehicle.objects import Landmark

from lgmd_gym.envs.dynamics.contact import Contact, first_contact, first_touch, outline
from lgmd_gym.envs.traffic.ego import TrafficEgo

# Lower bound of highway-env's distance past the end of a curved lane, relative to that of its bounding box.
BOX_FACTOR = 0.8


class TrafficRoad(RegulatedRoad):
    """A highway-env road that finds the ego's first contact within each step.

    Other cars that touch each other stop, as in highway-env, but are not pushed apart. After the ego's first
    contact the road does not advance: all cars keep the positions and speeds of that moment.

    Args:
        road: The original road; its cars and objects are assigned to the new road.
        ego: The car under test.
        regulated: Whether cars give way at intersections of their routes (highway-env's rules).

    Attributes:
        contact: First contact of the ego, or None.
    """

    def __init__(self, road: Road, ego: TrafficEgo, regulated: bool) -> None:
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
        self.ego, self.regulated = ego, regulated
        self.contact: Contact | None = None
        self._places: dict[int, list[float | None]] | None = None
        self._boxes = [(index, lane, *_box(lane)) for index, lane in self.network.lanes_dict().items()]

    @property
    def cars(self) -> list[Any]:
        """All cars, including the ego."""
        return self.vehicles

    @property
    def obstacles(self) -> list[Any]:
        """Cars and solid objects that the ego can touch."""
        items = (*self.vehicles, *self.objects)
        return [item for item in items if item is not self.ego and not isinstance(item, Landmark)]

    def act(self) -> None:
        """Update the decisions of all drivers."""
        if self.contact is None:
            self._places = {}  # valid while no car moves
            super().act()
            self._places = None

    def step(self, dt: float) -> None:
        """Advance all cars by `dt` [s], or up to the ego's first contact."""
        if self.contact is not None:
            return
        self.steps += 1
        if self.regulated and self.steps % int(1 / dt / self.REGULATION_FREQUENCY) == 0:
            self.enforce_road_rules()
        items = [self.ego, *self.obstacles]
        before = [outline(item) for item in items]
        speeds = [item.speed for item in items]
        travelled = self.ego.travelled
        for car in self.vehicles:
            car.step(dt)
        fraction, index = first_contact(before, [outline(item) for item in items])
        if index:
            for car, place, speed in zip(items[: len(self.vehicles)], before, speeds, strict=False):
                for axis in (0, 1):
                    car.position[axis] = (1 - fraction) * place[axis] + fraction * car.position[axis]
                car.speed = (1 - fraction) * speed + fraction * car.speed
            self.ego.travelled = (1 - fraction) * travelled + fraction * self.ego.travelled
            self.contact = Contact.between(self.ego, items[index])
            self.ego.crashed = items[index].crashed = True
        self._mark_collisions()

    def _mark_collisions(self) -> None:
        """Mark the other cars that touch each other as crashed."""
        cars = [car for car in self.vehicles if car is not self.ego]
        places = [(float(car.position[0]), float(car.position[1])) for car in cars]
        for i, (x, y) in enumerate(places):
            for j in range(i):
                if abs(places[j][0] - x) + abs(places[j][1] - y) > 8.0:
                    continue
                if first_touch(outline(cars[i]), outline(cars[j]), 0.0, 0.0) == 0.0:
                    cars[i].crashed = cars[j].crashed = True

    def neighbour_vehicles(self, vehicle: Any, lane_index: Any = None) -> tuple[Any, Any]:
        """Return the preceding and the following vehicle on a lane, as `Road.neighbour_vehicles` does.

        Args:
            vehicle: The reference vehicle.
            lane_index: The lane; None for the lane of the vehicle.
        """
        lane_index = lane_index or vehicle.lane_index
        if not lane_index:
            return None, None
        lane = self.network.get_lane(lane_index)
        here = float(lane.local_coordinates(vehicle.position)[0])
        front = rear = None
        ahead = behind = 0.0
        lanes = [(self._along(piece), offset) for piece, offset in self._pieces(lane_index, lane)]
        for number, item in enumerate((*self.vehicles, *self.objects)):
            if item is vehicle or isinstance(item, Landmark):
                continue
            for places, offset in lanes:
                place = places[number]
                if place is None:
                    continue
                place += offset
                if place >= here and (front is None or place <= ahead):
                    front, ahead = item, place
                if place < here and (rear is None or place > behind):
                    rear, behind = item, place
                break
        return front, rear

    def closest_lane(self, position: Any, heading: float, hint: Any) -> Any:
        """Return the index of the closest lane, as `RoadNetwork.get_closest_lane_index` does.

        Lanes whose bounding box is farther away than the hint are skipped.

        Args:
            position: Position [m].
            heading: Heading [rad].
            hint: Index of a lane that is probably close.
        """
        x, y = float(position[0]), float(position[1])
        best = float(self.network.get_lane(hint).distance_with_heading(position, heading))
        closest = None
        for index, lane, left, top, right, bottom in self._boxes:
            away = max(left - x, x - right, top - y, y - bottom)
            if away * BOX_FACTOR > best:
                continue
            distance = float(lane.distance_with_heading(position, heading))
            # Among lanes at equal distance, the first one in the network is returned.
            if distance < best or (closest is None and distance == best):
                best, closest = distance, index
        return hint if closest is None else closest

    def _pieces(self, lane_index: Any, lane: Any) -> list[tuple[Any, float]]:
        """Return a lane, the previous and the next lanes, each with its start along the lane [m]."""
        start, end, number = lane_index
        pieces = [(lane, 0.0)]
        if not self.neighbour_vehicles_connected_lanes:
            return pieces
        for lanes in self.network.graph.get(end, {}).values():
            if lanes:
                pieces.append((lanes[number if number < len(lanes) else 0], float(lane.length)))
        for ends in self.network.graph.values():
            lanes = ends.get(start)
            if lanes:
                before = lanes[number if number < len(lanes) else 0]
                pieces.append((before, -float(before.length)))
        return pieces

    def _along(self, lane: Any) -> list[float | None]:
        """Return the position of every vehicle and object along a lane [m]; None if it is not on the lane."""
        if self._places is not None and id(lane) in self._places:
            return self._places[id(lane)]
        places: list[float | None] = []
        for item in (*self.vehicles, *self.objects):
            along, across = lane.local_coordinates(item.position)
            on = -lane.VEHICLE_LENGTH <= along < lane.length + lane.VEHICLE_LENGTH
            on = on and abs(across) <= lane.width_at(along) / 2 + 1.0
            places.append(float(along) if on else None)
        if self._places is not None:
            self._places[id(lane)] = places
        return places

    @staticmethod
    def is_conflict_possible(v1: Any, v2: Any, horizon: int = 3, step: float = 0.25) -> bool:
        """Return whether the routes of two cars may conflict; skips cars that are too far apart to meet."""
        apart = hypot(float(v2.position[0] - v1.position[0]), float(v2.position[1] - v1.position[1]))
        if apart > (v1.speed + v2.speed) * horizon + v1.LENGTH + v2.LENGTH:
            return False
        return bool(RegulatedRoad.is_conflict_possible(v1, v2, horizon, step))


def _box(lane: Any) -> tuple[float, float, float, float]:
    """Return left, top, right and bottom of a lane's centreline with a small margin [m]."""
    pieces = max(2, int(lane.length / 2.0) + 1)
    points = [lane.position(lane.length * number / (pieces - 1), 0.0) for number in range(pieces)]
    xs, ys = [float(point[0]) for point in points], [float(point[1]) for point in points]
    return min(xs) - 0.1, min(ys) - 0.1, max(xs) + 0.1, max(ys) + 0.1
