# pyright: standard
# Not strict: highway-env states few types.
"""Cars of the traffic environments: highway-env's drivers with fixed parameters, and the car under test."""

from math import atan, cos, sin, tan
from typing import Any, cast

import numpy as np
from highway_env.road.road import Road
from highway_env.vehicle.behavior import IDMVehicle

from lgmd_gym.envs.dynamics.brake import BrakeParams, DelayLine
from lgmd_gym.envs.dynamics.longitudinal import advance
from lgmd_gym.envs.families.scenario import EGO_LENGTH, EGO_WIDTH
from lgmd_gym.envs.traffic.kernels import NO_ROUTE, UNPLANNED
from lgmd_gym.envs.traffic.lanes import HighwayLane, LaneTable

HEADWAYS = (0.4, 1.5)  # [s], IDM's time headway T; each driver draws one


class TrafficCar(IDMVehicle):
    """highway-env's IDM and MOBIL driver that never reverses and is not displaced by collisions.

    `TrafficRoad` computes the decisions and the motion of all cars.

    Each driver draws its time headway from the road's random generator: with highway-env's 1.5 s and 10 m for
    all, 95 % of the headways in following exceed 2 s, and traffic contains no close following.

    All other parameters are set in this class: `IntersectionEnv` changes the parameters of highway-env's
    classes for the rest of the process, and the traffic must not depend on previously created environments.

    Attributes:
        continues_to_next_lane: Whether the car continues on the next lane at the end of its lane; otherwise
            it drives straight on.
    """

    ACC_MAX = 6.0
    COMFORT_ACC_MAX = 3.0
    COMFORT_ACC_MIN = -5.0
    DISTANCE_WANTED = 7.0
    DELTA = 4.0
    HEIGHT = 1.5
    IS_EGO = False
    position: np.ndarray
    speed: float
    lane: HighwayLane
    action: dict[str, float]

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.TIME_WANTED = float(self.road.np_random.uniform(*HEADWAYS))
        self.collidable = False  # `TrafficRoad` finds contacts; highway-env's check would displace the cars
        self.impact = None  # highway-env's initial zero vector would count as a contact
        self.continues_to_next_lane = True

    @property
    def planned_lane(self) -> float:
        """Lane number at the head of the route, `UNPLANNED` or `NO_ROUTE`."""
        if not self.route:
            return NO_ROUTE
        number = self.route[0][2]
        return UNPLANNED if number is None else number

    def state(self, lanes: LaneTable) -> tuple[float, ...]:
        """Return the values of `CAR_STATE`."""
        x, y = self.position.tolist()
        action = self.action
        return (
            *(x, y, self.heading, self.speed, lanes.numbers[self.lane_index]),
            *(lanes.numbers[self.target_lane_index], self.timer, action["steering"], action["acceleration"]),
            *(self.crashed, self.target_speed, self.enable_lane_change, self.continues_to_next_lane),
            self.planned_lane,
        )

    @property
    def constants(self) -> tuple[float, ...]:
        """The values of `CAR_CONSTANTS`."""
        return (
            *(self.IS_EGO, self.LENGTH, self.WIDTH, self.COMFORT_ACC_MAX, self.COMFORT_ACC_MIN),
            *(self.DISTANCE_WANTED, self.TIME_WANTED, self.DELTA, 2.0),
        )

    def predict_trajectory_constant_speed(self, times: np.ndarray) -> Any:
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


class IntersectionCar(TrafficCar):
    """A `TrafficCar` with the driver parameters of `IntersectionEnv`."""

    COMFORT_ACC_MAX = 6.0
    COMFORT_ACC_MIN = -3.0


class TrafficEgo(TrafficCar):
    """The car under test: driven by IDM without lane changes; an agent can add braking.

    Without lane changes, episodes with and without braking differ by the braking alone. MOBIL would also
    overtake on a two-way road regardless of oncoming cars. The steering is highway-env's. The speed follows
    the brake model of `BrakingEnv`, exactly within each step.

    Args:
        road: The road.
        position: Centre [m].
        heading: Heading [rad].
        speed: Speed [m/s].
        brake: Response to demands; None for the default.

    Attributes:
        driver_acceleration: Acceleration demanded by the IDM driver, >= −6 and within the brake [m/s²].
        current_acceleration: Acceleration of the car [m/s²].
        yaw_rate: Mean yaw rate over the last step, + to the right [rad/s].
        travelled: Distance travelled since the reset [m].
    """

    IS_EGO = True
    color = (50, 200, 0)  # in highway-env's top view

    def __init__(
        self,
        road: Road,
        position: np.ndarray,
        heading: float = 0.0,
        speed: float = 0.0,
        brake: BrakeParams | None = None,
    ) -> None:
        self.LENGTH, self.WIDTH = EGO_LENGTH, EGO_WIDTH
        super().__init__(road, position, heading, speed, enable_lane_change=False)
        self.brake = brake or BrakeParams()
        self.driver_acceleration = self.current_acceleration = 0.0
        self.yaw_rate = self.travelled = 0.0
        self._delay_line = DelayLine(self.brake.delay)
        self._by_driver = True
        self._start = (0.0, 0.0)  # speed and acceleration before the last step
        self._parts: list[tuple[float, float]] = []  # of that step: duration [s], target acceleration [m/s²]

    def demand(self, value: float) -> None:
        """Set the longitudinal demand: −1 full brake, 0 and above no braking beyond the driver's."""
        self._delay_line.put(min(value, 0.0))

    @property
    def braking(self) -> float:
        """Deceleration beyond the driver's, >= 0 [m/s²]; 0 at standstill."""
        if self._by_driver:
            return 0.0
        return max(0.0, min(self.driver_acceleration, 0.0) - self.current_acceleration)

    def move(self, dt: float) -> None:
        """Advance by `dt` [s] with the driver's steering angle, under the delayed demands."""
        self.timer += dt
        action = cast(dict[str, float], self.action)
        slip = atan(tan(action["steering"]) / 2)
        self._start, self._parts = (self.speed, self.current_acceleration), []
        distance = sum(self._advance(duration, demand) for duration, demand in self._delay_line.advance(dt))
        course = self.heading + slip
        x, y = self.position.tolist()
        self.position = np.array([x + distance * cos(course), y + distance * sin(course)])
        turned = distance * sin(slip) / (self.LENGTH / 2)
        self.heading += turned
        self.yaw_rate = turned / dt
        self.travelled += distance
        action["acceleration"] = self.current_acceleration

    def _advance(self, duration: float, demand: float) -> float:
        """Advance the speed under one demand and return the distance travelled [m]."""
        before, target = self.current_acceleration, self.driver_acceleration
        self._by_driver = demand == 0.0 and (self._by_driver or before >= target)
        if demand < 0.0:
            target = min(demand * self.brake.max_deceleration, target)
        self._parts.append((duration, target))
        distance, self.speed, self.current_acceleration = advance(
            self.speed, before, target, self.brake.jerk, duration
        )
        return distance

    def progress(self, time: float) -> tuple[float, float]:
        """Return the distance covered [m] and the speed [m/s] at a time of the last step [s]."""
        covered, (speed, acceleration) = 0.0, self._start
        for duration, target in self._parts:
            duration = min(duration, time)
            time -= duration
            moved, speed, acceleration = advance(speed, acceleration, target, self.brake.jerk, duration)
            covered += moved
        return covered, speed
