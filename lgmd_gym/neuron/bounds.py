"""What each field of `LGMDParams` may hold."""

import math
from typing import Any, NamedTuple


class _Bound(NamedTuple):
    """The values one field may take."""

    low: float
    high: float = math.inf
    open_low: bool = False
    infinite: bool = False

    def admits(self, value: float) -> bool:
        """Whether `value` lies within; NaN never does."""
        if math.isinf(value):
            return self.infinite and value > 0
        return self.low < value <= self.high if self.open_low else self.low <= value <= self.high

    def __str__(self) -> str:
        low = f"{'>' if self.open_low else '>='} {self.low:g}"
        high = f" and <= {self.high:g}" if self.high < math.inf else "" if self.infinite else " and finite"
        return low + high


_ANY_SIZE = _Bound(0.0)
_ABOVE_ZERO = _Bound(0.0, open_low=True)
_TIME = _Bound(0.0, infinite=True)
_SCALE = _Bound(0.0, open_low=True, infinite=True)
_FRACTION = _Bound(0.0, 1.0)

_BOUNDS: dict[str, _Bound] = {
    "n_p": _Bound(0, 16), "u": _ANY_SIZE, "tau_1": _TIME, "tau_2": _TIME, "weights": _ANY_SIZE,
    "theta_1": _ANY_SIZE, "theta_2": _ANY_SIZE, "theta_3": _ANY_SIZE, "c_w": _ABOVE_ZERO,
    "delta_c": _ABOVE_ZERO, "c_de": _ABOVE_ZERO, "t_de": _ANY_SIZE, "t_f": _SCALE, "sigma_1": _ANY_SIZE,
    "sigma_2": _FRACTION, "tau_g": _ANY_SIZE, "sigma_3": _ABOVE_ZERO, "tau_s": _TIME, "t_sfa": _ANY_SIZE,
    "sigma_4": _ANY_SIZE, "t_sp": _FRACTION, "n_ts": _Bound(1, 256), "t_sf": _ABOVE_ZERO, "t_ffi": _SCALE,
    "ffi_delay": _Bound(0, 1), "on_off_residue": _Bound(0.0, 0.99), "max_spikes": _Bound(1.0, infinite=True),
    "k_0": _Bound(0.0, 0.5),
}  # fmt: skip
_CHOICES = {"delay": ("recursive", "two-tap"), "latency": ("clamp", "jump")}


def checked(name: str, default: Any, value: Any) -> Any:
    """Return `value` in the type of its default, or refuse it by name."""
    if isinstance(default, str):
        if value not in _CHOICES[name]:
            raise ValueError(f"{name} = {value!r} must be one of {', '.join(map(repr, _CHOICES[name]))}")
        return value
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise TypeError(f"{name} = {value!r} must be True or False, not {type(value).__name__}")
        return value
    if isinstance(default, tuple):
        if not isinstance(value, list | tuple) or len(value) != len(default):
            raise ValueError(f"{name} = {value!r} must be {len(default)} numbers: centre, nearest, diagonal")
        return tuple(_checked_number(name, item, float) for item in value)
    return _checked_number(name, value, type(default))


def _checked_number(name: str, value: Any, kind: type) -> float:
    """Return `value` as int or float within the bounds of the field `name`."""
    try:
        number = float(value)
        if isinstance(value, bool | str) or (kind is int and number != int(number)):
            raise TypeError
    except (TypeError, ValueError, OverflowError):
        wanted = "a whole number" if kind is int else "a number"
        raise TypeError(f"{name} = {value!r} must be {wanted}, not {type(value).__name__}") from None
    bound = _BOUNDS[name]
    if not bound.admits(number):
        raise ValueError(f"{name} = {number:g} must be {bound}")
    return int(number) if kind is int else number
