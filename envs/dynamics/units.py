"""Checks and conversions at the border: speeds in m/s, overlap as the protocols count it."""

from math import copysign, isfinite

MAX_SPEED = 40.0  # [m/s], highway-env's own cap, 144 km/h
KMH = 1.0 / 3.6  # one km/h in m/s


def check_speed(name: str, value: float, *, zero: bool = False) -> float:
    """Return `value` as float if it is a speed in (0, 40] m/s (or [0, 40] with `zero`).

    Raises:
        ValueError: Names the value, and for one that looks like km/h the m/s to pass instead.
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
    """Return `value` as float, or raise ValueError if it is not a finite number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a number, got {value!r}") from None
    if not isfinite(number):
        raise ValueError(f"{name} must be finite, got {value!r}")
    return number


def check_within(name: str, value: float, low: float, high: float, unit: str = "") -> float:
    """Return `value` as float if it lies in [low, high], or raise ValueError."""
    number = check_finite(name, value)
    if not low <= number <= high:
        raise ValueError(f"{name} must be in [{low:g}, {high:g}]{f' {unit}' if unit else ''}, got {value!r}")
    return number


def offset_from_overlap(overlap: float, ego_width: float, target_width: float) -> float:
    """Return the lateral offset of a target whose given fraction of the ego's width is covered.

    Args:
        overlap: Share of the ego's width in [-1, 1]; the sign says the side (+ left), |1| is aligned
            (Euro NCAP AEB C2C v4.3.1, 3.4).
        ego_width: [m].
        target_width: [m].

    Returns:
        The target's centreline minus the ego's, + left [m].
    """
    share = check_within("overlap", overlap, -1.0, 1.0)
    if abs(share) == 1.0:
        return 0.0
    return copysign((ego_width + target_width) / 2 - abs(share) * ego_width, share)
