"""The path of a car's rear axle from that of its front axle."""

from math import cos, sin, tan

from lgmd_gym.envs.dynamics.bend import Bend

_STEP = 0.1  # [m] along the path of the front axle
_STRAIGHT = 1e-5  # [rad], steering angle below which the car drives straight on


def rear_axle_path(bends: tuple[Bend, ...], wheelbase: float) -> tuple[Bend, ...]:
    """Return the path of the rear axle of a car whose front axle follows a path.

    The wheels do not slip: the rear axle follows the front axle like a trailer, and the car's heading is the
    direction of its path. The first bend should be a straight; after the last one the front axle drives
    straight on until the steering angle is below 10⁻⁵ rad.

    Args:
        bends: Bends of the path of the front axle.
        wheelbase: Distance between the axles, > 0 [m].
    """
    steering, result = 0.0, list[Bend]()
    for bend in bends:
        if steering == bend.curvature == bend.last_curvature == 0.0:
            result.append(bend)
            continue
        count = max(round(bend.length / _STEP), 1)
        slope, step = (bend.last_curvature - bend.curvature) / bend.length, bend.length / count
        for number in range(count):
            curvature = bend.curvature + slope * step * (number + 0.5)
            steering = _follow(steering, curvature, step, wheelbase, result)
    while abs(steering) > _STRAIGHT:
        steering = _follow(steering, 0.0, _STEP, wheelbase, result)
    return tuple(result)


def _follow(steering: float, curvature: float, step: float, wheelbase: float, result: list[Bend]) -> float:
    """Append the rear axle's path over one step of the front axle, and return the steering angle after it.

    Args:
        steering: Direction of the front axle's path relative to the car's heading, + to the left [rad].
        curvature: Mean curvature of the front axle's path in the step, + to the left [1/m].
        step: Length of the step [m].
        wheelbase: Distance between the axles [m].
        result: Bends of the rear axle's path.
    """

    def change(angle: float) -> float:
        return curvature - sin(angle) / wheelbase

    # Fourth-order Runge-Kutta; the heading turns by what the steering angle does not.
    first = change(steering)
    second = change(steering + step / 2 * first)
    third = change(steering + step / 2 * second)
    after = steering + step / 6 * (first + 2 * second + 2 * third + change(steering + step * third))
    turned = curvature * step - (after - steering)
    length = step * (cos(steering) + 4 * cos((steering + after) / 2) + cos(after)) / 6
    start, end = tan(steering) / wheelbase, tan(after) / wheelbase
    rest = turned / length - (start + end) / 2  # makes the bend turn exactly as far as the car
    result.append(Bend(length, start + rest, end + rest))
    return after
