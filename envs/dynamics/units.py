"""Argument checks and unit conversions."""

from math import isfinite

MAX_SPEED = 40.0  # [m/s], highway-env's limit, 144 km/h
KMH = 1.0 / 3.6  # one km/h in m/s


def check_speed(name: str, value: float, *, zero: bool = False) -> float:
    """Return `value` as float if it is a speed in (0, 40] m/s, or in [0, 40] m/s with `zero`.

    Raises:
        ValueError: If it is not; for values that look like km/h the message states the value in m/s.
    """
    speed = check_finite(name, value)
    low = "[" if zero else "("
    if speed < 0.0 or (speed == 0.0 and not zero):
        raise ValueError(f"{name} must be in {low}0, {MAX_SPEED:g}] m/s, got {value!r}")
    if speed > MAX_SPEED:
        raise ValueError(
            f"{name}: {speed:g} m/s = {speed / KMH:g} km/h, beyond {MAX_SPEED:g} m/s; "
            f"for {speed:g} km/h pass {speed * KMH:.2f}"
        )
    return speed


def check_finite(name: str, value: float) -> float:
    """Return `value` as float, or raise ValueError if it is a bool or not a finite number."""
    try:
        if isinstance(value, bool):
            raise TypeError
        number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number, got {value!r}") from None
    except OverflowError:
        raise ValueError(f"{name} must be below 1e308, got a longer integer") from None
    if not isfinite(number):
        raise ValueError(f"{name} must be finite, got {value!r}")
    return number


def check_within(name: str, value: float, low: float, high: float, unit: str = "") -> float:
    """Return `value` as float if it is in [low, high], or raise ValueError."""
    number = check_finite(name, value)
    if not low <= number <= high:
        raise ValueError(f"{name} must be in [{low:g}, {high:g}]{f' {unit}' if unit else ''}, got {value!r}")
    return number
