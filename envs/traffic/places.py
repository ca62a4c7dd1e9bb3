"""Cars and lanes of a traffic road as records; compiled places of the cars on the lanes.

Every result is equal to the bit to that of highway-env's formulas on plain floats: sums and products are in
the same order, `dot` rounds as `numpy.dot` does, and the caller computes the functions that NumPy and the C
library round differently.
"""

from math import inf, pi, sin, sqrt
from typing import Any

import numpy as np
from numba import extending, types

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
def _fma(typingctx: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a·b + c with one rounding."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
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
def project(cars: Any, lanes: Any, polar: Any, along: Any, across: Any) -> None:
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
def heading_at(lane: Any, along: float, bend: float) -> float:
    """Return the heading of a lane [rad]; `bend` is the angle of a sine lane to its axis."""
    if lane.shape == CIRCLE:
        return lane.turn * along / lane.radius + lane.phase + pi / 2 * lane.turn
    return lane.heading + bend if lane.shape == SINE else lane.heading


@kernel(exact=True)
def locate(cars: Any, number: int, lanes: Any, along: Any, across: Any, bend: Any) -> None:
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
    cars: Any, i: int, own: int, lanes: Any, pieces: Any, offsets: Any, along: Any, across: Any
) -> Any:
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
            lane, place = lanes[k], along[j, k]
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
