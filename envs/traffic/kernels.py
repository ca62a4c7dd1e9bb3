"""Compiled decisions and motion of all cars of a traffic road: highway-env's IDM, MOBIL and bicycle model.

See `places` for the arithmetic.
"""

from math import asin, atan, cos, pi, pow, sin, sqrt, tan
from typing import Any

import numpy as np

from lgmd_gym.envs.traffic.places import (
    ALL_DONE,
    END_MARGIN,
    NO_ROUTE,
    heading_at,
    limited,
    neighbours,
    not_zero,
    wrapped,
)
from lgmd_gym.kernels import kernel

MAX_ACCELERATION, MAX_STEERING = 6.0, pi / 3  # [m/s²], [rad]
TAU_PURSUIT, KP_HEADING, KP_LATERAL = 0.5 * 0.2, 1 / 0.2, 1 / 0.6  # [s], [1/s], [1/s]
LANE_CHANGE_DELAY, MIN_GAIN, MAX_IMPOSED = 1.0, 0.2, 2.0  # [s], [m/s²], [m/s²]
MAX_SPEED = 40.0  # [m/s]
COMFORT_DECELERATION = 3.0  # [m/s²], limit of the ego's deceleration towards its target speed


@kernel(exact=True)
def desired_gap(driver: Any, car: Any, front: Any) -> float:
    """Return the IDM distance that a driver would keep in a car behind another one [m]."""
    closing = car.speed - front.speed * cos(front.heading - car.heading)
    comfort = 2.0 * sqrt(-driver.comfort_acceleration * driver.comfort_deceleration)
    return driver.distance + car.speed * driver.headway + car.speed * closing / comfort


@kernel(exact=True)
def free_acceleration(driver: Any, car: Any, lanes: Any) -> float:
    """Return the IDM acceleration of a driver in a car on a free road [m/s²]."""
    target = min(max(car.target_speed, 0.0), lanes[int(car.lane)].speed_limit)
    ratio = max(car.speed, 0.0) / abs(not_zero(target))
    return driver.comfort_acceleration * (1.0 - pow(ratio, driver.exponent))


@kernel(exact=True)
def idm(driver: Any, cars: Any, i: int, front: int, lanes: Any, along: Any) -> float:
    """Return the IDM acceleration of a driver in car i behind another one; -1 for none [m/s²]."""
    car = cars[i]
    result = free_acceleration(driver, car, lanes)
    if front >= 0:
        lane = int(car.lane)
        distance = not_zero(along[front, lane] - along[i, lane])
        gap = desired_gap(driver, car, cars[front])
        result -= driver.comfort_acceleration * pow(gap / distance, driver.square)
    return result


@kernel(exact=True)
def follow(cars: Any, i: int, front: int, lanes: Any, along: Any) -> float:
    """Return the acceleration of car i behind another one; -1 for none [m/s²].

    The free-road term of IDM falls with the fourth power of speed over target speed. Without a limit, an ego
    that has to give way (target speed 0) would always brake with an emergency deceleration.
    """
    total = idm(cars[i], cars, i, front, lanes, along)
    if cars[i].is_ego == 0.0:
        return total
    free = free_acceleration(cars[i], cars[i], lanes)
    return max(free, -COMFORT_DECELERATION) + (total - free)


@kernel(exact=True)
def accepts(
    cars: Any, number: int, i: int, new: int, lanes: Any, pieces: Any, offsets: Any, along: Any, across: Any
) -> bool:
    """Return whether MOBIL recommends that car i change to lane `new`.

    The first `number` records are cars; objects do not follow. highway-env's politeness is 0, so the
    accelerations of the followers do not count.
    """
    driver = cars[i]
    front, rear = neighbours(cars, i, new, lanes, pieces, offsets, along, across)
    if 0 <= rear < number and idm(driver, cars, rear, i, lanes, along) < -MAX_IMPOSED:
        return False
    predicted = idm(driver, cars, i, front, lanes, along)
    if driver.planned_lane >= 0.0:
        target = lanes[int(driver.target_lane)].number
        if np.sign(lanes[new].number - target) != np.sign(driver.planned_lane - target):
            return False
        return predicted >= -MAX_IMPOSED
    old, _ = neighbours(cars, i, int(driver.lane), lanes, pieces, offsets, along, across)
    return predicted - idm(driver, cars, i, old, lanes, along) >= MIN_GAIN


@kernel(exact=True)
def is_taken(cars: Any, number: int, i: int, along: Any) -> bool:
    """Return whether a car shortly ahead of car i also changes to its target lane."""
    car, own = cars[i], int(cars[i].lane)
    for j in range(number):
        other = cars[j]
        if j != i and other.lane != car.target_lane and other.target_lane == car.target_lane:
            distance = along[j, own] - along[i, own]
            if 0.0 < distance < desired_gap(car, car, other):
                return True
    return False


@kernel(exact=True)
def change_lane(
    cars: Any, number: int, i: int, lanes: Any, pieces: Any, offsets: Any, along: Any, across: Any
) -> None:
    """Begin or abort a lane change of car i, as `IDMVehicle.change_lane_policy` does."""
    car, own = cars[i], int(cars[i].lane)
    if car.lane != car.target_lane:
        if lanes[own].road == lanes[int(car.target_lane)].road and is_taken(cars, number, i, along):
            car.target_lane = car.lane
        return
    if not car.timer > LANE_CHANGE_DELAY:
        return
    car.timer = 0.0
    for new in (own - 1, own + 1):  # the lanes of a road are in order
        if not 0 <= lanes[own].number + new - own < lanes[own].lanes:
            continue
        lane = lanes[new]
        reachable = abs(across[i, new]) <= 2 * lane.width and 0 <= along[i, new] < lane.length + END_MARGIN
        if lane.forbidden or not reachable or abs(car.speed) < 1:
            continue
        if accepts(cars, number, i, new, lanes, pieces, offsets, along, across):
            car.target_lane = new


@kernel(exact=True)
def steer(car: Any, lane: Any, along: float, across: float, bend: float) -> float:
    """Return the steering angle of a car towards the centre of its target lane [rad].

    Args:
        car: `CAR` record.
        lane: The target lane.
        along: Place of the car along the lane [m].
        across: Place of the car across the lane [m].
        bend: Angle of a sine lane to its axis at the place that the car reaches in `TAU_PURSUIT` [rad].
    """
    speed = not_zero(car.speed)
    ahead = heading_at(lane, along + car.speed * TAU_PURSUIT, bend)
    drift = asin(limited(-KP_LATERAL * across / speed, 1.0))
    rate = KP_HEADING * wrapped(ahead + limited(drift, pi / 4) - car.heading)
    slip = asin(limited(car.length / 2 / speed * rate, 1.0))
    return limited(atan(2.0 * tan(slip)), MAX_STEERING)


@kernel(exact=True)
def decide(
    cars: Any, number: int, lanes: Any, pieces: Any, offsets: Any, along: Any, across: Any, bend: Any,
    first: int, follows: bool,
) -> int:  # fmt: skip
    """Update steering angle, acceleration and target lane of each car, in order.

    The choice of the next road at the end of a lane is highway-env's.

    Args:
        cars: `CAR` records, the cars first.
        number: Number of cars.
        lanes: `LANE` records.
        pieces: See `neighbours`.
        offsets: See `neighbours`.
        along: See `project`.
        across: See `project`.
        bend: See `steer`; shape (cars, lanes).
        first: Index of the first car to update.
        follows: Whether that car has already chosen its next lane.

    Returns:
        Index of the car that has to choose its next lane before it continues, or `ALL_DONE`.
    """
    for i in range(first, number):
        car = cars[i]
        if car.crashed:
            continue
        target = int(car.target_lane)
        at_end = along[i, target] > lanes[target].length - END_MARGIN / 2
        stays = lanes[target].ends and car.planned_lane == NO_ROUTE
        if car.continues and at_end and not stays and not (follows and i == first):
            return i
        if car.changes_lanes:
            change_lane(cars, number, i, lanes, pieces, offsets, along, across)
            target = int(car.target_lane)
        car.steering = steer(car, lanes[target], along[i, target], across[i, target], bend[i, target])
        front, _ = neighbours(cars, i, int(car.lane), lanes, pieces, offsets, along, across)
        acceleration = follow(cars, i, front, lanes, along)
        if car.lane != car.target_lane:
            front, _ = neighbours(cars, i, target, lanes, pieces, offsets, along, across)
            acceleration = min(acceleration, follow(cars, i, front, lanes, along))
        car.acceleration = limited(acceleration, MAX_ACCELERATION)
    return ALL_DONE


@kernel(exact=True)
def move(cars: Any, number: int, slip: Any, dt: float) -> None:
    """Advance the cars except the ego by `dt` [s]; they never reverse. `slip` is their slip angle [rad]."""
    for i in range(number):
        car = cars[i]
        if car.is_ego:
            continue
        car.timer += dt
        beta = slip[i]
        if car.crashed:
            car.steering = beta = 0.0
            car.acceleration = -1.0 * car.speed
        if car.speed > MAX_SPEED:
            car.acceleration = min(car.acceleration, MAX_SPEED - car.speed)
        course = car.heading + beta
        car.x += car.speed * cos(course) * dt
        car.y += car.speed * sin(course) * dt
        car.heading += car.speed * sin(beta) / (car.length / 2) * dt
        car.speed = max(car.speed + car.acceleration * dt, 0.0)  # an Euler step can overshoot zero
