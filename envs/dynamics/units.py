"""Check of speeds and unit conversions."""

from lgmd_gym.errors import check_finite, shown

MAX_SPEED = 40.0  # [m/s], highway-env's limit, 144 km/h
MIN_SPEED = 1e-3  # [m/s], apart from 0; lower speeds have no finite duration
KMH = 1.0 / 3.6  # one km/h in m/s


def check_speed(name: str, value: object, *, zero: bool = False) -> float:
    """Return `value` as float if it is a speed in (0, 40] m/s, or in [0, 40] m/s with `zero`.

    Raises:
        ValueError: If it is not; for values that look like km/h the message states the value in m/s.
    """
    speed = check_finite(name, value)
    low = "[" if zero else "("
    if speed < 0.0 or (speed == 0.0 and not zero):
        raise ValueError(f"{name} must be in {low}0, {MAX_SPEED:g}] m/s, got {shown(value)}")
    if 0.0 < speed < MIN_SPEED:
        raise ValueError(f"{name} must be >= {MIN_SPEED:g} m/s, got {shown(value)}")
    if speed > MAX_SPEED:
        raise ValueError(
            f"{name}: {speed:g} m/s = {speed / KMH:g} km/h, beyond {MAX_SPEED:g} m/s; "
            f"for {speed:g} km/h pass {speed * KMH:.2f}"
        )
    return speed
