"""Bounds of the numeric fields of `CameraParams`."""

from typing import Any, NamedTuple

from lgmd_gym.errors import check_finite, is_integer, shown


class _Interval(NamedTuple):
    low: float
    high: float
    low_allowed: bool
    high_allowed: bool
    unit: str


MIN_STOP = 4.0
"""Least stopping distance of the gaze `"stopping"` [m]."""
BOUNDS = {
    "hfov_deg": _Interval(1.0, 170.0, False, False, "degrees"),
    "mount_height": _Interval(0.0, 100.0, False, True, "m above the ground"),
    "mount_setback": _Interval(-10.0, 50.0, True, True, "m behind the front bumper"),
    "mount_left": _Interval(-10.0, 10.0, True, True, "m left of the centreline"),
    "pitch_deg": _Interval(-60.0, 60.0, True, True, "degrees"),
    "yaw_deg": _Interval(-360.0, 360.0, True, True, "degrees"),
    "texture": _Interval(0.0, 5.0, True, True, "times the natural contrast"),
    "roadside": _Interval(0.0, 4.0, True, True, "times the natural density"),
    "seed": _Interval(0, 2**32 - 1, True, True, ""),
    "visibility_m": _Interval(0.0, 1e6, True, True, "m (0 is clear air)"),
    "shot_noise": _Interval(0.0, 10.0, True, True, "grey levels at mid-grey"),
    "read_noise": _Interval(0.0, 50.0, True, True, "grey levels"),
    "auto_exposure_s": _Interval(0.0, 60.0, True, True, "s (0 is a fixed exposure)"),
    "contrast_s": _Interval(0.0, 60.0, True, True, "s (0 is a fixed contrast)"),
    "dive_deg": _Interval(0.0, 2.0, True, True, "degrees per m/s²"),
    "shutter_s": _Interval(0.0, 0.1, True, True, "s"),
    "reach": _Interval(0.1, 10.0, True, True, "stopping distances"),
    "span_m": _Interval(0.1, 100.0, True, True, "m"),
    "offset_m": _Interval(-50.0, 50.0, True, True, "m left of the path"),
    "lift": _Interval(-5.0, 5.0, True, True, "times the depression of the aim"),
    "stop_deceleration": _Interval(0.5, 12.0, True, True, "m/s²"),
    "max_deceleration": _Interval(0.1, 12.0, True, True, "m/s²"),
    "stop_reaction": _Interval(0.0, 3.0, True, True, "s"),
}


def checked_number(name: str, value: Any) -> float | int:
    """Return the value of a numeric field of `CameraParams`.

    Raises:
        ValueError: If it is not a number, or out of range.
    """
    bound = BOUNDS[name]
    check_finite(f"camera {name}", value)
    value = int(value) if is_integer(value) else float(value)
    above = value >= bound.low if bound.low_allowed else value > bound.low
    below = value <= bound.high if bound.high_allowed else value < bound.high
    if not (above and below):
        opening, closing = "[" if bound.low_allowed else "(", "]" if bound.high_allowed else ")"
        interval = f"{opening}{bound.low:g}, {bound.high:g}{closing}"
        raise ValueError(
            f"camera {name} must be in {interval} {bound.unit}".rstrip() + f", got {shown(value)}"
        )
    if name == "seed":
        if not isinstance(value, int):
            raise ValueError(f"camera seed must be an integer, got {shown(value)}")
        return value
    return float(value)
