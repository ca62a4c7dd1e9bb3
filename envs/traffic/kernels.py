# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Compiled places, decisions, motion and contacts of all cars of a traffic road.

The drivers are highway-env's IDM, MOBIL and bicycle model. Every result is equal to the bit to that of
highway-env's formulas on plain floats: sums and products are in the same order, `dot` rounds as `numpy.dot`
does, and the caller computes the functions that NumPy and the C library round differently.
"""

from math import asin, atan, cos, inf, pi, pow, sin, sqrt, tan
from typing import Any

import numpy as np
from numba import extending, types

from lgmd_gym.envs.dynamics.bodies import BOX, outline_of
from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.episode import touch_between, uniform_touch
from lgmd_gym.kernels import kernel

CAR_STATE = (
    *("x", "y", "heading", "speed", "lane", "target_lane", "timer", "steering", "acceleration", "crashed"),
    *("target_speed", "changes_lanes", "continues", "planned_lane"),
)
CAR_CONSTANTS = (
    *("is_ego", "length", "width", "comfort_acceleration", "comfort_deceleration", "distance", "headway"),
    *("exponent", "square"),
)
CAR = np.dtype([(name, np.float64) for name in (*CAR_STATE, *CAR_CONSTANTS)])
"""A car or solid object of the road. `lane` and `target_lane` are rows of the lanes. `planned_lane` is the
lane number at the head of the route, `UNPLANNED` for a route without one and `NO_ROUTE` without a route.
`exponent` and `square` (2) are exponents: `x**2` of Python is `pow`, which may differ from `x * x`."""
LANE = np.dtype(
    [
        *(
            (name, np.float64)
            for name in (
                *("x", "y", "along_x", "along_y", "across_x", "across_y", "heading", "length", "width"),
                *("amplitude", "pulsation", "phase", "radius", "turn", "speed_limit"),
            )
        ),
        *((name, np.int64) for name in ("shape", "forbidden", "road", "number", "lanes", "ends")),
    ]
)
"""A lane: its start or centre [m], its directions, and the fields of highway-env's class; `road` is the index
of its road, `lanes` the number of that road's lanes, and `ends` whether no road follows."""
STRAIGHT, SINE, CIRCLE = 0, 1, 2
NO_ROUTE, UNPLANNED = -2.0, -1.0
ALL_DONE = -1

END_MARGIN = 5.0  # [m] by which a lane extends beyond its ends, `AbstractLane.VEHICLE_LENGTH`

intrinsic: Any = extending.intrinsic  # a decorated function is called without its typing context


@intrinsic
def _fma(typingctx, a, b, c):
    """Return a·b + c with one rounding."""

    def generate(context, builder, signature, args):
        return builder.fma(*args)

    return types.float64(types.float64, types.float64, types.float64), generate


@kernel(exact=True)
def dot(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the dot product of two vectors, rounded as `numpy.dot` does with fused multiply-add."""
    return _fma(ay, by, ax * bx)


@kernel(exact=True)
def wrapped(angle: float) -> float:
    """Return an angle in [-pi, pi) [rad]."""
    return (angle + pi) % (2 * pi) - pi


@kernel(exact=True)
def limited(value: float, limit: float) -> float:
    """Return a value clipped to ± limit."""
    return min(max(value, -limit), limit)


@kernel(exact=True)
def not_zero(value: float) -> float:
    """Return a value whose magnitude is at least 0.01."""
    if abs(value) > 1e-2:
        return value
    return 1e-2 if value >= 0 else -1e-2


@kernel(exact=True)
def project(
    cars: np.ndarray, lanes: np.ndarray, polar: np.ndarray, along: np.ndarray, across: np.ndarray
) -> None:
    """Write the coordinates of every car along and across every lane, shape (cars, lanes) [m].

    Args:
        cars: `CAR` records.
        lanes: `LANE` records.
        polar: Angle of each car about each lane's centre, shape (cars, lanes) [rad].
        along: Output.
        across: Output.
    """
    for i in range(len(cars)):
        for k in range(len(lanes)):
            lane = lanes[k]
            dx, dy = cars[i].x - lane.x, cars[i].y - lane.y
            if lane.shape == CIRCLE:
                phase = lane.phase + wrapped(polar[i, k] - lane.phase)
                along[i, k] = lane.turn * (phase - lane.phase) * lane.radius
                across[i, k] = lane.turn * (lane.radius - sqrt(dot(dx, dy, dx, dy)))
                continue
            along[i, k] = dot(dx, dy, lane.along_x, lane.along_y)
            across[i, k] = dot(dx, dy, lane.across_x, lane.across_y)
            if lane.shape == SINE:
                across[i, k] -= lane.amplitude * sin(lane.pulsation * along[i, k] + lane.phase)


@kernel(exact=True)
def heading_at(lane: np.record, along: float, bend: float) -> float:
    """Return the heading of a lane [rad]; `bend` is the angle of a sine lane to its axis."""
    if lane.shape == CIRCLE:
        return lane.turn * along / lane.radius + lane.phase + pi / 2 * lane.turn
    return lane.heading + bend if lane.shape == SINE else lane.heading


@kernel(exact=True)
def locate(
    cars: np.ndarray, number: int, lanes: np.ndarray, along: np.ndarray, across: np.ndarray, bend: np.ndarray
) -> None:
    """Assign the first `number` cars to their closest lanes, by distance [m] plus angle [rad]."""
    for i in range(number):
        best = inf
        for k in range(len(lanes)):
            lane = lanes[k]
            place = along[i, k]
            angle = abs(wrapped(cars[i].heading - heading_at(lane, place, bend[i, k])))
            apart = abs(across[i, k]) + max(place - lane.length, 0.0) + max(0.0 - place, 0.0) + angle
            if apart < best:
                best, cars[i].lane = apart, k


@kernel(exact=True)
def neighbours(
    cars: np.ndarray,
    i: int,
    own: int,
    lanes: np.ndarray,
    pieces: np.ndarray,
    offsets: np.ndarray,
    along: np.ndarray,
    across: np.ndarray,
) -> tuple[int, int]:
    """Return the indices of the car in front of car i and behind it on lane `own`; -1 for none.

    Args:
        cars: `CAR` records.
        i: Index of the car.
        own: Index of the lane.
        lanes: `LANE` records.
        pieces: Indices of each lane and of its previous and next lanes, -1 for none, shape (lanes, n).
        offsets: Start of each of these along the lane, shape (lanes, n) [m].
        along: See `project`.
        across: See `project`.
    """
    here, front, rear, ahead, behind = along[i, own], -1, -1, 0.0, 0.0
    for j in range(len(cars)):
        if j == i:
            continue
        for n in range(pieces.shape[1]):
            k = pieces[own, n]
            if k < 0:
                break
            lane: Any = lanes[k]
            place = along[j, k]
            if not -END_MARGIN <= place < lane.length + END_MARGIN:
                continue
            if abs(across[j, k]) > lane.width / 2 + 1.0:
                continue
            place += offsets[own, n]
            if place >= here and (front < 0 or place <= ahead):
                front, ahead = j, place
            if place < here and (rear < 0 or place > behind):
                rear, behind = j, place
            break
    return front, rear


MAX_ACCELERATION, MAX_STEERING = 6.0, pi / 3  # [m/s²], [rad]
TAU_PURSUIT, KP_HEADING, KP_LATERAL = 0.5 * 0.2, 1 / 0.2, 1 / 0.6  # [s], [1/s], [1/s]
LANE_CHANGE_DELAY, MIN_GAIN, MAX_IMPOSED = 1.0, 0.2, 2.0  # [s], [m/s²], [m/s²]
MAX_SPEED = 40.0  # [m/s]
COMFORT_DECELERATION = 3.0  # [m/s²], limit of the ego's deceleration towards its target speed


@kernel(exact=True)
def desired_gap(driver: np.record, car: np.record, front: np.record) -> float:
    """Return the IDM distance that a driver would keep in a car behind another one [m]."""
    closing = car.speed - front.speed * cos(front.heading - car.heading)
    comfort = 2.0 * sqrt(-driver.comfort_acceleration * driver.comfort_deceleration)
    return driver.distance + car.speed * driver.headway + car.speed * closing / comfort


@kernel(exact=True)
def free_acceleration(driver: np.record, car: np.record, lanes: np.ndarray) -> float:
    """Return the IDM acceleration of a driver in a car on a free road [m/s²]."""
    target = min(max(car.target_speed, 0.0), lanes[int(car.lane)].speed_limit)
    ratio = max(car.speed, 0.0) / abs(not_zero(target))
    return driver.comfort_acceleration * (1.0 - pow(ratio, driver.exponent))


@kernel(exact=True)
def idm(
    driver: np.record, cars: np.ndarray, i: int, front: int, lanes: np.ndarray, along: np.ndarray
) -> float:
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
def follow(cars: np.ndarray, i: int, front: int, lanes: np.ndarray, along: np.ndarray) -> float:
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
    cars: np.ndarray,
    number: int,
    i: int,
    new: int,
    lanes: np.ndarray,
    pieces: np.ndarray,
    offsets: np.ndarray,
    along: np.ndarray,
    across: np.ndarray,
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
def is_taken(cars: np.ndarray, number: int, i: int, along: np.ndarray) -> bool:
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
    cars: np.ndarray,
    number: int,
    i: int,
    lanes: np.ndarray,
    pieces: np.ndarray,
    offsets: np.ndarray,
    along: np.ndarray,
    across: np.ndarray,
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
def steer(car: np.record, lane: np.record, along: float, across: float, bend: float) -> float:
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
    cars: np.ndarray,
    number: int,
    lanes: np.ndarray,
    pieces: np.ndarray,
    offsets: np.ndarray,
    along: np.ndarray,
    across: np.ndarray,
    bend: np.ndarray,
    first: int,
    follows: bool,
) -> int:
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
def move(cars: np.ndarray, number: int, slip: np.ndarray, dt: float) -> None:
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


MAX_APART = 8.0  # [m], sum of both coordinates beyond which two cars are not tested for a touch


@kernel(exact=True)
def outline_between(before: np.record, after: np.record, part: float) -> Rectangle:
    """Return the outline of a car after a part of the way from one `CAR` record to another."""
    rest = 1.0 - part
    x, y = rest * before.x + part * after.x, rest * before.y + part * after.y
    return Rectangle(x, y, rest * before.heading + part * after.heading, before.length, before.width)


@kernel(exact=True)
def find_contact(before: np.ndarray, after: np.ndarray, ego: int) -> int:
    """Return which other car or object the ego touches first within a step, without turns and acceleration.

    Args:
        before: `CAR` records at the start of the step.
        after: The same records at its end.
        ego: Index of the ego.

    Returns:
        The index of the touched record; that of the ego without contact.
    """
    found, index = inf, ego
    for i in range(len(before)):
        if i == ego:
            continue
        fraction = uniform_touch(after[ego], after[i], before[ego], before[i])
        if fraction < found:
            found, index = fraction, i
    return index


@kernel(exact=True)
def contact_time(before: np.ndarray, after: np.ndarray, ego: int, other: int, shares: np.ndarray) -> float:
    """Return the time at which the ego touches another record, as a part of the step.

    Args:
        before: `CAR` records at the start of the step.
        after: The same records at its end.
        ego: Index of the ego.
        other: Index of the touched record.
        shares: Shares of its way that the ego has covered at equal times from start to end of the step.

    Returns:
        The time; `inf` if a turn within the step avoids the touch.
    """
    count = len(shares) - 1
    for k in range(count):
        a = outline_between(before[ego], after[ego], shares[k])
        b = outline_between(before[ego], after[ego], shares[k + 1])
        c = outline_between(before[other], after[other], k / count)
        d = outline_between(before[other], after[other], (k + 1) / count)
        touch = touch_between(a, b, c, d)
        if touch <= 1.0:
            return (k + touch) / count
    return inf


@kernel(exact=True)
def mark_collisions(cars: np.ndarray, number: int) -> bool:
    """Mark the cars other than the ego that touch each other as crashed; return whether one is new."""
    found = False
    for i in range(number):
        for j in range(i):
            one, other = cars[i], cars[j]
            if one.is_ego or other.is_ego or abs(other.x - one.x) + abs(other.y - one.y) > MAX_APART:
                continue
            if first_touch(outline_of(one), outline_of(other), 0.0, 0.0) == 0.0:
                found |= one.crashed + other.crashed < 2.0
                one.crashed = other.crashed = 1.0
    return found


@kernel(exact=True)
def fill_bodies(cars: np.ndarray, ego: int, bodies: np.ndarray) -> None:
    """Write `CAR` records to `BODY` records on straight paths, the ego first."""
    for i in range(len(cars)):
        car, body = cars[i], bodies[0 if i == ego else i + (i < ego)]
        body.x, body.y, body.heading, body.speed = car.x, car.y, car.heading, car.speed
        body.steering, body.length, body.width = car.steering, car.length, car.width
        body.kind, body.path_end = BOX, 1
