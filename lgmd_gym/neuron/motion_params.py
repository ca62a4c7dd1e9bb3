"""Parameters that the models beside the LGMD share."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from lgmd_gym.errors import check_keys, check_positive
from lgmd_gym.neuron.bounds import made_params


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelParams:
    """Base class of the parameters of a model with the spikes of the LGMD.

    Attributes:
        sigma: Response at which K = 0.73, > 0 [grey levels].
    """

    sigma: float = 1.0

    def gains(self, fps: float) -> tuple[float, ...]:
        """Return the gains of the model's filters at a frame rate [Hz]."""
        raise NotImplementedError

    @classmethod
    def make(cls, spec: "Self | Mapping[str, Any] | None") -> Self:
        """Return the parameters for a `params` argument: an instance, a mapping, or None for the defaults.

        Raises:
            ValueError: For an unknown key, a value out of range, or another type.
        """
        return made_params(cls, spec, cls._from_dict)

    @classmethod
    def _from_dict(cls, values: Mapping[str, Any]) -> Self:
        known = (field.name for field in dataclasses.fields(cls))
        check_keys(f"{cls.__name__.removesuffix('Params')} parameter", values, known)
        return cls(**values)


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionParams(ModelParams):
    """Parameters of motion detectors; see `LPLC2` for the equations.

    Attributes:
        tau_mean_ms: Time constant of the mean light that photoreceptors subtract, > 0 [ms].
        tau_delay_ms: Time constant of the delay of the motion detectors, > 0 [ms].
        sigma: Response at which K = 0.73, > 0 [grey levels].

    Raises:
        ValueError: For a value out of range or of another type.
    """

    tau_mean_ms: float = 100.0
    tau_delay_ms: float = 30.0

    def __post_init__(self) -> None:
        for name in ("tau_mean_ms", "tau_delay_ms", "sigma"):
            object.__setattr__(self, name, check_positive(name, getattr(self, name)))

    def gains(self, fps: float) -> tuple[float, float]:
        """Return the gains dt / (dt + τ) of the mean light and of the delay at a frame rate [Hz]."""
        dt = 1000.0 / fps
        return dt / (dt + self.tau_mean_ms), dt / (dt + self.tau_delay_ms)
