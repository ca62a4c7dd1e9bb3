"""Parameters of the LPLC2 model."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self, TypeAlias

from lgmd_gym.errors import check_flag, check_keys, check_number, check_whole, shown


@dataclass(frozen=True, slots=True, kw_only=True)
class LPLC2Params:
    """Parameters of the LPLC2 model; see `LPLC2` for the equations.

    Attributes:
        tau_mean_ms: Time constant of the mean light that photoreceptors subtract, > 0 [ms].
        tau_delay_ms: Time constant of the delay of the motion detectors, > 0 [ms].
        radius_px: Length of the four arms of a unit, >= 1 [px]; at most half of the smaller side of a frame.
        stride_px: Distance of neighbouring units, >= 1 [px].
        vertical: Whether a unit requires motion along all four arms; if False, it only has the left and the
            right one.
        sigma: Response at which K = 0.73, > 0 [grey levels].

    Raises:
        ValueError: For a value out of range or of another type.
    """

    tau_mean_ms: float = 100.0
    tau_delay_ms: float = 30.0
    radius_px: int = 8
    stride_px: int = 4
    vertical: bool = True
    sigma: float = 1.0

    def __post_init__(self) -> None:
        for name in ("tau_mean_ms", "tau_delay_ms", "sigma"):
            value = check_number(name, getattr(self, name))
            if not 0.0 < value < math.inf:
                raise ValueError(f"{name} must be > 0 and finite, got {value:g}")
            object.__setattr__(self, name, value)
        for name in ("radius_px", "stride_px"):
            object.__setattr__(self, name, check_whole(name, getattr(self, name), 1))
        object.__setattr__(self, "vertical", check_flag("vertical", self.vertical))

    @classmethod
    def make(cls, spec: "LPLC2Spec") -> Self:
        """Return the parameters for a `params` argument: an instance, a mapping, or None for the defaults.

        Raises:
            ValueError: For an unknown key, a value out of range, or another type.
        """
        if spec is None:
            return cls()
        if isinstance(spec, cls):
            return spec
        if isinstance(spec, Mapping):
            check_keys("LPLC2 parameter", spec, (field.name for field in dataclasses.fields(cls)))
            return cls(**spec)
        raise ValueError(f"params must be LPLC2Params, a mapping or None, got {shown(spec)}")


LPLC2Spec: TypeAlias = LPLC2Params | Mapping[str, Any] | None
"""The `params` argument of `LPLC2`; None for the default parameters."""
