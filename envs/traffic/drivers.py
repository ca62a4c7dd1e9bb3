"""Cars of the traffic environments: highway-env's IDM and MOBIL drivers with fixed parameters."""

from math import asin, atan, cos, pi, sqrt, tan
from typing import Any

from highway_env.utils import not_zero, wrap_to_pi
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle


def _clip(value: float, limit: float) -> float:
    """Return a value clipped to ± limit."""
    return min(max(float(value), -limit), limit)


class TrafficCar(IDMVehicle):
    """highway-env's IDM and MOBIL driver that never reverses and is not displaced by collisions.

    All parameters are set in this class: `IntersectionEnv` changes the parameters of highway-env's classes
    for the rest of the process, and the traffic must not depend on previously created environments.

    Attributes:
        continues_to_next_lane: Whether the car continues on the next lane at the end of its lane; otherwise
            it drives straight on.
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
        self.collidable = False  # `TrafficRoad` finds contacts; highway-env's check would displace the cars
        self.impact = None  # highway-env's initial zero vector would count as a contact
        self.continues_to_next_lane = True

    # The next three methods are highway-env's formulas on plain floats; a test compares both.

    def acceleration(self, ego_vehicle: Any, front_vehicle: Any = None, rear_vehicle: Any = None) -> float:
        """Return the IDM acceleration of a car behind another one [m/s²]."""
        car = ego_vehicle
        if car is None or not isinstance(car, Vehicle):
            return 0.0
        target_speed = getattr(car, "target_speed", 0.0)
        limit = getattr(car.lane, "speed_limit", None)
        if limit is not None:
            target_speed = min(max(target_speed, 0.0), limit)
        ratio = max(car.speed, 0.0) / abs(not_zero(target_speed))
        result = self.COMFORT_ACC_MAX * (1.0 - ratio**self.DELTA)
        if front_vehicle is not None:
            distance = not_zero(float(car.lane_distance_to(front_vehicle)))
            result -= self.COMFORT_ACC_MAX * (self.desired_gap(car, front_vehicle) / distance) ** 2
        return float(result)

    def desired_gap(self, ego_vehicle: Any, front_vehicle: Any = None, projected: bool = True) -> float:
        """Return the IDM target distance between two cars [m]."""
        car, front = ego_vehicle, front_vehicle
        closing = car.speed - front.speed * (cos(front.heading - car.heading) if projected else 1.0)
        comfort = 2.0 * sqrt(-self.COMFORT_ACC_MAX * self.COMFORT_ACC_MIN)
        return float(self.DISTANCE_WANTED + car.speed * self.TIME_WANTED + car.speed * closing / comfort)

    def steering_control(self, target_lane_index: Any) -> float:
        """Return the steering angle towards the centre of a lane [rad]."""
        lane = self.road.network.get_lane(target_lane_index)
        along, across = lane.local_coordinates(self.position)
        speed = not_zero(self.speed)
        ahead = float(lane.heading_at(along + self.speed * self.TAU_PURSUIT))
        drift = asin(_clip(-self.KP_LATERAL * across / speed, 1.0))
        heading_error = ahead + _clip(drift, pi / 4) - self.heading
        rate = self.KP_HEADING * wrap_to_pi(heading_error)
        slip = asin(_clip(self.LENGTH / 2 / speed * rate, 1.0))
        return _clip(atan(2.0 * tan(slip)), self.MAX_STEERING_ANGLE)

    def follow_road(self) -> None:
        """Continue on the next lane at the end of a lane."""
        if self.continues_to_next_lane:
            super().follow_road()

    def on_state_update(self) -> None:
        """Update the current lane, with the faster search of `TrafficRoad`."""
        closest_lane = getattr(self.road, "closest_lane", None)
        if closest_lane is None:  # while highway-env builds the scene
            super().on_state_update()
            return
        self.lane_index = closest_lane(self.position, self.heading, self.lane_index)
        self.lane = self.road.network.get_lane(self.lane_index)
        if self.road.record_history:
            self.history.appendleft(self.create_from(self))

    def predict_trajectory_constant_speed(self, times: Any) -> Any:
        """Return predicted positions and headings along the route at constant speed.

        highway-env's version uses the lane count of the wrong road and fails where a road has fewer lanes.

        Args:
            times: Prediction times from now on [s].
        """
        network, (start, end, number), lane = self.road.network, self.lane_index, self.lane
        along, covered = lane.local_coordinates(self.position)[0], 0.0
        route = [piece for piece in self.route or [] if piece[:2] != (start, end)]
        poses = []
        for time in times:
            place = along + self.speed * time - covered
            while place > lane.length and route:
                covered, place = covered + lane.length, place - lane.length
                start, end, next_number = route.pop(0)
                lanes = network.graph[start][end]
                lane = lanes[min(number if next_number is None else next_number, len(lanes) - 1)]
            poses.append((lane.position(place, 0.0), lane.heading_at(place)))
        return tuple(zip(*poses, strict=True))

    def step(self, dt: float) -> None:
        """Advance by `dt` [s] without reversing."""
        super().step(dt)
        if self.speed < 0.0:  # an Euler step can overshoot zero
            self.speed = 0.0


class IntersectionCar(TrafficCar):
    """A `TrafficCar` with the driver parameters of `IntersectionEnv`."""

    COMFORT_ACC_MAX = 6.0
    COMFORT_ACC_MIN = -3.0
    DISTANCE_WANTED = 7.0
