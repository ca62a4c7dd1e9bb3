"""Exact longitudinal motion: acceleration with bounded jerk, and cars that stop at zero speed.

highway-env integrates with explicit Euler, an error of 0.9 m at 50 km/h and 15 Hz, and brakes through zero
into reverse. Here the acceleration is piecewise linear in time within one step. Speed and distance have a
closed form, and stopping distances do not depend on the step size.
"""

from math import copysign, inf, sqrt

from lgmd_gym.kernels import kernel


@kernel(exact=True)
def advance(
    speed: float, acceleration: float, target: float, jerk: float, dt: float
) -> tuple[float, float, float]:
    """Move for `dt` while the acceleration ramps towards `target`; never reverse.

    Args:
        speed: Speed at the start, >= 0 [m/s].
        acceleration: Acceleration at the start [m/s²].
        target: Acceleration at the end of the ramp [m/s²].
        jerk: Slope of the ramp, > 0; `math.inf` for a jump [m/s³].
        dt: Duration, >= 0 [s].

    Returns:
        Distance travelled [m], speed [m/s] and acceleration [m/s²] at the end. A car that reaches zero speed
        while not accelerating stays there with acceleration 0.
    """
    if jerk == inf:
        acceleration = target
    change = target - acceleration
    ramp = min(abs(change) / jerk, dt)
    distance = 0.0
    for duration, slope in ((ramp, copysign(jerk, change)), (dt - ramp, 0.0)):
        if duration <= 0.0:
            continue
        stop = time_to_stop(speed, acceleration, slope)
        if stop <= duration:
            distance += stop * (speed + stop * (acceleration / 2 + stop * slope / 6))
            return distance, 0.0, 0.0
        distance += duration * (speed + duration * (acceleration / 2 + duration * slope / 6))
        speed += duration * (acceleration + duration * slope / 2)
        acceleration = target if slope and ramp < dt else acceleration + duration * slope
    return distance, max(speed, 0.0), acceleration


@kernel(exact=True)
def time_to_stop(speed: float, acceleration: float, jerk: float) -> float:
    """Return the first time at which v + a·t + j·t²/2 falls to zero [s]; `math.inf` if it never does."""
    if speed <= 0.0 and (acceleration < 0.0 or (acceleration == 0.0 and jerk <= 0.0)):
        return 0.0
    if jerk == 0.0:
        return -speed / acceleration if acceleration < 0.0 else inf
    under_root = acceleration * acceleration - 2.0 * jerk * speed
    if under_root < 0.0 or (acceleration >= 0.0 and jerk > 0.0):
        return inf
    root = sqrt(under_root)
    # The form of the first root without cancellation.
    if acceleration >= 0.0:
        return (acceleration + root) / -jerk
    return 2.0 * speed / (root - acceleration)
