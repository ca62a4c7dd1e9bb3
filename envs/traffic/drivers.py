"""The other cars of the traffic suite: highway-env's IDM drivers."""

from math import asin, atan, cos, pi, sqrt, tan
from typing import Any

from highway_env.utils import not_zero, wrap_to_pi
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle


def _within(value: float, limit: float) -> float:
    """Return a value bounded to ± limit."""
    return min(max(float(value), -limit), limit)


class TrafficCar(IDMVehicle):
    """highway-env's IDM and MOBIL driver, except that it never reverses and that nobody is teleported.

    Every parameter is pinned here: making an `IntersectionEnv` writes new values into the class of its cars
    for the rest of the process, and traffic must not depend on who was made before.

    Attributes:
        follows: Whether it goes on to a next lane at the end of its own; otherwise straight on.
    """

    ACC_MAX = 6.0
    COMFORT_ACC_MAX = 3.0
    COMFORT_ACC_MIN = -5.0
    DISTANCE_WANTED = 10.0
    TIME_WANTED = 1.5
    DELTA = 4.0
    HEIGHT = 1.5

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.collidable = False  # the road finds contacts; highway-env's check would move the cars
        self.impact = None  # highway-env's initial zero vector counts as a contact
        self.follows = True

    # The next three are highway-env's formulas on plain floats, in half the time; a test holds them together.

    def acceleration(self, ego_vehicle: Any, front_vehicle: Any = None, rear_vehicle: Any = None) -> float:
        """Return the acceleration that IDM asks of a car behind another [m/s²]."""
        car = ego_vehicle
        if car is None or not isinstance(car, Vehicle):
            return 0.0
        wanted = getattr(car, "target_speed", 0.0)
        limit = getattr(car.lane, "speed_limit", None)
        if limit is not None:
            wanted = min(max(wanted, 0.0), limit)
        share = max(car.speed, 0.0) / abs(not_zero(wanted))
        result = self.COMFORT_ACC_MAX * (1.0 - share**self.DELTA)
        if front_vehicle is not None:
            apart = not_zero(float(car.lane_distance_to(front_vehicle)))
            result -= self.COMFORT_ACC_MAX * (self.desired_gap(car, front_vehicle) / apart) ** 2
        return float(result)

    def desired_gap(self, ego_vehicle: Any, front_vehicle: Any = None, projected: bool = True) -> float:
        """Return the distance that IDM wants between two cars [m]."""
        car, front = ego_vehicle, front_vehicle
        closing = car.speed - front.speed * (cos(front.heading - car.heading) if projected else 1.0)
        comfort = 2.0 * sqrt(-self.COMFORT_ACC_MAX * self.COMFORT_ACC_MIN)
        return float(self.DISTANCE_WANTED + car.speed * self.TIME_WANTED + car.speed * closing / comfort)

    def steering_control(self, target_lane_index: Any) -> float:
        """Return the steering angle towards the middle of a lane [rad]."""
        lane = self.road.network.get_lane(target_lane_index)
        along, across = lane.local_coordinates(self.position)
        speed = not_zero(self.speed)
        ahead = float(lane.heading_at(along + self.speed * self.TAU_PURSUIT))
        drift = asin(_within(-self.KP_LATERAL * across / speed, 1.0))
        missing = ahead + _within(drift, pi / 4) - self.heading
        rate = self.KP_HEADING * wrap_to_pi(missing)
        slip = asin(_within(self.LENGTH / 2 / speed * rate, 1.0))
        return _within(atan(2.0 * tan(slip)), self.MAX_STEERING_ANGLE)

    def follow_road(self) -> None:
        """Go on to the next lane at the end of a lane."""
        if self.follows:
            super().follow_road()

    def on_state_update(self) -> None:
        """Find the lane the car is on; a `TrafficRoad` knows where to look."""
        find = getattr(self.road, "closest_lane", None)
        if find is None:  # while highway-env is still building the scene
            super().on_state_update()
            return
        self.lane_index = find(self.position, self.heading, self.lane_index)
        self.lane = self.road.network.get_lane(self.lane_index)
        if self.road.record_history:
            self.history.appendleft(self.create_from(self))

    def predict_trajectory_constant_speed(self, times: Any) -> Any:
        """Return positions and headings along the route at the present speed, one each per time.

        highway-env's own looks the numbers of lanes up on the wrong road, and fails where a road has fewer.

        Args:
            times: From now on [s].
        """
        network, (start, end, number), lane = self.road.network, self.lane_index, self.lane
        along, gone = lane.local_coordinates(self.position)[0], 0.0
        ways = [piece for piece in self.route or [] if piece[:2] != (start, end)]
        found = []
        for time in times:
            place = along + self.speed * time - gone
            while place > lane.length and ways:
                gone, place = gone + lane.length, place - lane.length
                start, end, wanted = ways.pop(0)
                lanes = network.graph[start][end]
                lane = lanes[min(number if wanted is None else wanted, len(lanes) - 1)]
            found.append((lane.position(place, 0.0), lane.heading_at(place)))
        return tuple(zip(*found, strict=True))

    def step(self, dt: float) -> None:
        """Advance by `dt` [s]; a car that has come to a stop stays there."""
        super().step(dt)
        if self.speed < 0.0:  # Euler steps overshoot zero; the position used the old speed
            self.speed = 0.0


class CrossingCar(TrafficCar):
    """The same with the values that `IntersectionEnv` writes into the class of its cars."""

    COMFORT_ACC_MAX = 6.0
    COMFORT_ACC_MIN = -3.0
    DISTANCE_WANTED = 7.0
