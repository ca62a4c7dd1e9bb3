"""The road of the traffic suite: contact with the ego found inside the step, wrecks, and quick look-ups."""

from math import cos, hypot
from typing import Any, NamedTuple

from highway_env.road.regulation import RegulatedRoad
from highway_env.road.road import Road
from highway_env.vehicle.objects import Landmark

from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.traffic.ego import TrafficEgo
from lgmd_gym.envs.traffic.geometry import outline, touched_side

SLOPE = 0.8  # highway-env measures past the end of a bent lane along its chord, the box is up to this nearer


class Touch(NamedTuple):
    """The ego's first touch of somebody.

    Attributes:
        other: Who or what was touched.
        side: The part of the ego that was touched: "front" (bumper with its corners), "rear" or "side".
        impact_speed: The ego's speed at the touch [m/s].
        relative_impact_speed: The ego's speed less the other's along the ego's heading [m/s].
    """

    other: Any
    side: str
    impact_speed: float
    relative_impact_speed: float


class TrafficRoad(RegulatedRoad):
    """A road taken over from a highway-env environment, with its cars.

    Cars that touch each other are wrecks and stop, as in highway-env, but are not pushed apart. At the ego's
    first touch everything stands still, with the speeds of that moment.

    Args:
        road: The road to take over; its cars move here.
        ego: The car under test.
        regulated: Whether cars give way where their ways cross (highway-env's rules).

    Attributes:
        touch: The ego's first touch, or None so far.
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
        self.touch: Touch | None = None
        self._places: dict[int, list[float | None]] | None = None
        self._boxes = [(index, lane, *_box(lane)) for index, lane in self.network.lanes_dict().items()]

    @property
    def cars(self) -> list[Any]:
        """Everybody who drives, the ego included."""
        return self.vehicles

    @property
    def others(self) -> list[Any]:
        """Everybody and everything that the ego can touch."""
        items = (*self.vehicles, *self.objects)
        return [item for item in items if item is not self.ego and not isinstance(item, Landmark)]

    def act(self) -> None:
        """Have every driver decide."""
        if self.touch is None:
            self._places = {}  # nobody moves meanwhile
            super().act()
            self._places = None

    def step(self, dt: float) -> None:
        """Advance everybody by `dt` [s], or up to the ego's first touch within it."""
        if self.touch is not None:
            return
        self.steps += 1
        if self.regulated and self.steps % int(1 / dt / self.REGULATION_FREQUENCY) == 0:
            self.enforce_road_rules()
        before = [(car, outline(car), car.speed) for car in self.vehicles]
        travelled = self.ego.travelled
        for car in self.vehicles:
            car.step(dt)
        fraction = self._find_touch(before)
        self.ego.travelled = (1 - fraction) * travelled + fraction * self.ego.travelled
        self._find_wrecks()

    def _find_touch(self, before: list[tuple[Any, Rectangle, float]]) -> float:
        """Find the ego's first touch in the step just made, go back to it, and return the share gone."""
        was = {id(car): place for car, place, _ in before}
        start, end = was[id(self.ego)], outline(self.ego)
        first: tuple[float, Any] | None = None
        for other in self.others:
            now = outline(other)
            if abs(now.x - end.x) + abs(now.y - end.y) > 30.0:
                continue
            place = was.get(id(other), now)
            dx, dy = end.x - start.x - (now.x - place.x), end.y - start.y - (now.y - place.y)
            fraction = first_touch(start, place, dx, dy)
            if fraction is not None and (first is None or fraction < first[0]):
                first = fraction, other
        if first is None:
            return 1.0
        fraction, other = first
        for car, place, speed in before:
            for axis in (0, 1):
                car.position[axis] = (1 - fraction) * place[axis] + fraction * car.position[axis]
            car.speed = (1 - fraction) * speed + fraction * car.speed
        self.ego.crashed = other.crashed = True
        along = other.speed * cos(float(other.heading) - self.ego.heading)
        side = touched_side(outline(self.ego), outline(other))
        self.touch = Touch(other, side, float(self.ego.speed), float(self.ego.speed - along))
        return fraction

    def _find_wrecks(self) -> None:
        """Mark the cars that touch each other."""
        cars = [car for car in self.vehicles if car is not self.ego]
        places = [(float(car.position[0]), float(car.position[1])) for car in cars]
        for i, (x, y) in enumerate(places):
            for j in range(i):
                if abs(places[j][0] - x) + abs(places[j][1] - y) > 8.0:
                    continue
                if first_touch(outline(cars[i]), outline(cars[j]), 0.0, 0.0) is not None:
                    cars[i].crashed = cars[j].crashed = True

    def neighbour_vehicles(self, vehicle: Any, lane_index: Any = None) -> tuple[Any, Any]:
        """Return who is ahead and who behind on a lane; as in highway-env, each place looked up once.

        Args:
            vehicle: Who asks.
            lane_index: The lane; its own if None.
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
        """Return the index of the lane closest to a place, as `RoadNetwork.get_closest_lane_index` does.

        Lanes whose bounding box is farther away than `hint` are not looked at.

        Args:
            position: Where [m].
            heading: [rad].
            hint: Index of a lane that is probably close.
        """
        x, y = float(position[0]), float(position[1])
        best = float(self.network.get_lane(hint).distance_with_heading(position, heading))
        closest = None
        for index, lane, left, top, right, bottom in self._boxes:
            away = max(left - x, x - right, top - y, y - bottom)
            if away * SLOPE > best:
                continue
            distance = float(lane.distance_with_heading(position, heading))
            # The first of equals wins, so the hint's own turn has to come.
            if distance < best or (closest is None and distance == best):
                best, closest = distance, index
        return hint if closest is None else closest

    def _pieces(self, lane_index: Any, lane: Any) -> list[tuple[Any, float]]:
        """Return a lane and those before and after it, with where they begin along it [m]."""
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
        """Return everybody's place along a lane [m], None for who is not on it."""
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
        """Return whether two cars' ways may cross soon; who is too far away to meet is not looked at."""
        apart = hypot(float(v2.position[0] - v1.position[0]), float(v2.position[1] - v1.position[1]))
        if apart > (v1.speed + v2.speed) * horizon + v1.LENGTH + v2.LENGTH:
            return False
        return bool(RegulatedRoad.is_conflict_possible(v1, v2, horizon, step))


def _box(lane: Any) -> tuple[float, float, float, float]:
    """Return left, top, right and bottom of a lane's centre line [m], a little too wide."""
    pieces = max(2, int(lane.length / 2.0) + 1)
    points = [lane.position(lane.length * number / (pieces - 1), 0.0) for number in range(pieces)]
    xs, ys = [float(point[0]) for point in points], [float(point[1]) for point in points]
    return min(xs) - 0.1, min(ys) - 0.1, max(xs) + 0.1, max(ys) + 0.1
