"""Arguments of neurons: parameters from a `params` argument, types and bounds of `LGMDParams`."""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeVar

from lgmd_gym.errors import check_flag, check_number, shown

P = TypeVar("P")


class _Bound(NamedTuple):
    """Range of a field; `exclusive` excludes `low` itself."""

    low: float
    high: float = math.inf
    exclusive: bool = False
    infinite: bool = False

    def contains(self, value: float) -> bool:
        """Return whether a value is in range; NaN never is."""
        if math.isinf(value):
            return self.infinite and value > 0
        return self.low < value <= self.high if self.exclusive else self.low <= value <= self.high

    def __str__(self) -> str:
        low = f"{'>' if self.exclusive else '>='} {self.low:g}"
        high = f" and <= {self.high:g}" if self.high < math.inf else "" if self.infinite else " and finite"
        return low + high


_NON_NEGATIVE = _Bound(0.0)
_POSITIVE = _Bound(0.0, exclusive=True)
_TIME = _Bound(0.0, infinite=True)
_SCALE = _Bound(0.0, exclusive=True, infinite=True)
_FRACTION = _Bound(0.0, 1.0)

_BOUNDS: dict[str, _Bound] = {
    "n_p": _Bound(0, 16), "u": _NON_NEGATIVE, "tau_1": _TIME, "tau_2": _TIME, "weights": _NON_NEGATIVE,
    "theta_1": _NON_NEGATIVE, "theta_2": _NON_NEGATIVE, "theta_3": _NON_NEGATIVE, "c_w": _POSITIVE,
    "delta_c": _POSITIVE, "c_de": _POSITIVE, "t_de": _NON_NEGATIVE, "t_f": _SCALE, "sigma_1": _NON_NEGATIVE,
    "sigma_2": _FRACTION, "tau_g": _NON_NEGATIVE, "sigma_3": _POSITIVE, "tau_s": _TIME,
    "t_sfa": _NON_NEGATIVE, "sigma_4": _NON_NEGATIVE, "t_sp": _FRACTION, "n_ts": _Bound(1, 256),
    "t_sf": _POSITIVE, "t_ffi": _SCALE, "ffi_delay": _Bound(0, 1), "on_off_residue": _Bound(0.0, 0.99),
    "max_spikes": _Bound(1.0, infinite=True), "k_0": _Bound(0.0, 0.5),
}  # fmt: skip
_CHOICES = {
    "delay": ("recursive", "two-tap"),
    "latency": ("clamp", "jump"),
    "spikes_from": ("adapted", "membrane"),
}


def made_params(cls: type[P], spec: Any, from_mapping: Callable[[Mapping[str, Any]], P]) -> P:
    """Return the parameters of a class for a `params` argument.

    Args:
        cls: Class of the parameters; without arguments it has the defaults.
        spec: An instance of the class, a mapping, or None for the defaults.
        from_mapping: Builds the parameters from a mapping.

    Raises:
        ValueError: For another type, or a mapping that `from_mapping` refuses.
    """
    if spec is None:
        return cls()
    if isinstance(spec, cls):
        return spec
    if isinstance(spec, Mapping):
        return from_mapping(spec)
    raise ValueError(f"params must be {cls.__name__}, a mapping or None, got {shown(spec)}")


def checked_field(name: str, default: Any, value: Any) -> Any:
    """Return a field's value in the type of its default.

    Raises:
        ValueError: For a value out of range or of another type.
    """
    if isinstance(default, str):
        if not isinstance(value, str) or value not in _CHOICES[name]:
            raise ValueError(
                f"{name} must be one of {', '.join(map(repr, _CHOICES[name]))}, got {shown(value)}"
            )
        return value
    if isinstance(default, bool):
        return check_flag(name, value)
    if isinstance(default, tuple):
        if not isinstance(value, list | tuple) or len(value) != len(default):
            raise ValueError(f"{name} must be 3 numbers (centre, nearest, diagonal), got {shown(value)}")
        return tuple(_checked_number(name, item, float) for item in value)
    return _checked_number(name, value, type(default))


def _checked_number(name: str, value: Any, kind: type) -> float:
    """Return a number in range as the given type, int or float."""
    number = check_number(name, value)
    if kind is int and not number.is_integer():
        raise ValueError(f"{name} must be an integer, got {shown(value)}")
    if not _BOUNDS[name].contains(number):
        raise ValueError(f"{name} must be {_BOUNDS[name]}, got {number:g}")
    return int(number) if kind is int else number
