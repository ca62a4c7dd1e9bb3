# pyright: standard
# Not strict: highway-env states few types.
"""The errors of the drivers of an episode of traffic: windows, and their effects on the cars."""

from copy import copy
from typing import NamedTuple

import numpy as np
from highway_env.road.road import Road

from lgmd_gym.envs.attention import Attention
from lgmd_gym.envs.traffic.cars import TrafficCar, TrafficEgo
from lgmd_gym.envs.traffic.kernels import MAX_ACCELERATION

LIFTED = -1.0  # [m/s²], deceleration without braking, after the throttle is lifted
FASTER = 1.2  # target speed of the car behind the ego over that of the ego
BEYOND = 60.0  # [s] by which the windows extend beyond the duration of the episode


def add_follower(road: Road, ego: TrafficEgo, rng: np.random.Generator) -> None:
    """Add a car that keeps its lane behind the ego, at the distance and speed at which its driver follows.

    There is none where the lane begins too close behind the ego, or another car is closer than twice that
    distance behind it.

    Args:
        road: The road.
        ego: The ego.
        rng: Random generator of the driver's time headway.
    """
    # The other traffic keeps its draws.
    shared, road.np_random = road.np_random, rng  # type: ignore[assignment]
    car = TrafficCar(road, ego.position, ego.heading, ego.speed, enable_lane_change=False)
    road.np_random = shared
    along = ego.lane.local_coordinates(ego.position)[0]
    distance = car.DISTANCE_WANTED + car.TIME_WANTED * ego.speed
    _, behind = road.neighbour_vehicles(ego)
    occupied = behind is not None and along - ego.lane.local_coordinates(behind.position)[0] < 2.0 * distance
    if along < distance or occupied:
        return
    car.position = ego.lane.position(along - distance, 0.0)
    car.heading = ego.lane.heading_at(along - distance)
    car.lane_index, car.lane = ego.lane_index, ego.lane
    car.target_lane_index, car.route = ego.lane_index, copy(ego.route)
    car.target_speed, car.continues_to_next_lane = FASTER * ego.target_speed, ego.continues_to_next_lane
    road.vehicles.append(car)


class Window(NamedTuple):
    """A window of time."""

    start: float  # time since the start of the episode [s]
    end: float  # [s]
    deceleration: float = 0.0  # of the car ahead [m/s²]


def draw_windows(
    rng: np.random.Generator,
    interval: float,
    durations: tuple[float, float],
    decelerations: tuple[float, float],
    end: float,
) -> tuple[Window, ...]:
    """Return windows in order; the pauses between them are exponentially distributed.

    A later end adds windows and changes none.

    Args:
        rng: Random generator.
        interval: Mean pause [s]; infinite for no windows.
        durations: Range of the durations [s].
        decelerations: Range of the decelerations [m/s²].
        end: Time before which the last window begins [s].
    """
    windows: list[Window] = []
    time = 0.0
    while interval < float("inf"):
        start = time + float(rng.exponential(interval))
        if start >= end:
            break
        time = start + float(rng.uniform(*durations))
        windows.append(Window(start, time, float(rng.uniform(*decelerations))))
    return tuple(windows)


class DriverErrors:
    """The errors of the drivers of one episode.

    Args:
        attention: Kind and frequency of the errors.
        rng: Random generator of the episode's windows.
        duration: Duration of the episode [s].
        dt: Duration of a step of the road [s].

    Attributes:
        glances: Windows in which the ego's driver looks away.
        brakings: Windows in which the car ahead brakes.
        steps: Number of steps since the start of the episode.
    """

    def __init__(self, attention: Attention, rng: np.random.Generator, duration: float, dt: float) -> None:
        self.attention, self._dt, end = attention, dt, duration + BEYOND
        glances, brakings = rng.spawn(2)
        self.glances = draw_windows(
            glances, attention.glance_interval, attention.glance_durations, (0.0, 0.0), end
        )
        self.brakings = draw_windows(
            brakings, attention.braking_interval, attention.braking_durations, attention.decelerations, end
        )
        self.steps = 0
        self._held: float | None = None  # acceleration during the present glance [m/s²]
        self._lead: tuple[Window, TrafficCar | None] | None = None  # the car that brakes in a window
        self._follower: TrafficCar | None = None
        self._waited = 0  # steps for which the follower's driver has had to brake

    @property
    def time(self) -> float:
        """Time since the start of the episode [s]."""
        return self.steps * self._dt

    @property
    def attentive(self) -> bool:
        """Whether the ego's driver observes the road."""
        return _window_at(self.glances, self.time) is None

    def hold(self, ego: TrafficEgo, speed_limit: float, given: float) -> float:
        """Return the acceleration that the ego's driver demands [m/s²].

        Args:
            ego: The ego; its `driver_acceleration` is still that of the last step.
            speed_limit: Speed limit of its lane [m/s].
            given: Acceleration that an attentive driver demands [m/s²].
        """
        if self.attentive:
            self._held = None
            return given
        if self._held is None:
            self._held = ego.driver_acceleration
        may_accelerate = 0.0 < ego.speed < speed_limit
        return self._held if may_accelerate else min(self._held, 0.0)

    def change_others(
        self, cars: np.ndarray, vehicles: list[TrafficCar], ahead: int, behind: int, full: float
    ) -> None:
        """Change the accelerations of the cars ahead of the ego and behind it.

        Args:
            cars: `CAR` records with the decisions of this step, changed in place.
            vehicles: The cars of the first records.
            ahead: Index of the first record ahead of the ego in its lane; −1 for none.
            behind: Index of the first one behind it; −1 for none.
            full: Full braking of the car behind, that of the ego [m/s²].
        """
        window = _window_at(self.brakings, self.time)
        if window is None:
            self._lead = None
        elif self._lead is None or self._lead[0] != window:
            self._lead = (window, _car(vehicles, ahead))
        if self._lead is not None and self._lead[1] in vehicles:
            index = vehicles.index(self._lead[1])
            deceleration = self._lead[0].deceleration
            cars["acceleration"][index] = min(cars["acceleration"][index], -deceleration)
        if self.attention.reaction_time > 0.0:
            self._react_late(cars, _car(vehicles, behind), behind, full)

    def _react_late(self, cars: np.ndarray, follower: TrafficCar | None, index: int, full: float) -> None:
        """Limit the deceleration of the car behind the ego until its driver has reacted."""
        if follower is not self._follower:
            self._follower, self._waited = follower, 0
        if follower is None or follower.crashed or cars["acceleration"][index] >= LIFTED:
            self._waited = 0
            return
        if self._waited * self._dt < self.attention.reaction_time - 1e-9:
            cars["acceleration"][index] = LIFTED
        elif cars["acceleration"][index] <= -MAX_ACCELERATION:  # IDM requires at least this limit
            cars["acceleration"][index] = -max(full, MAX_ACCELERATION)
        self._waited += 1


def _car(vehicles: list[TrafficCar], index: int) -> TrafficCar | None:
    """Return a car by its index; None for an object or no car."""
    return vehicles[index] if 0 <= index < len(vehicles) else None


def _window_at(windows: tuple[Window, ...], time: float) -> Window | None:
    """Return the window at a time, its end excluded; None for none."""
    return next((item for item in windows if item.start <= time < item.end), None)
