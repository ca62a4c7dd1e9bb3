"""SustainedEdges: a detector of edges that stand still in the frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.errors import check_positive
from lgmd_gym.neuron import sustained_edges_kernels
from lgmd_gym.neuron.frame_neuron import Layer
from lgmd_gym.neuron.motion_neuron import MotionNeuron
from lgmd_gym.neuron.motion_params import ModelParams
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.registry import register


@dataclass(frozen=True, slots=True, kw_only=True)
class SustainedEdgesParams(ModelParams):
    """Parameters of `SustainedEdges`.

    Attributes:
        tau_ms: Time constant of the low-passed light, > 0 [ms].
        sigma: Mean edge strength at which K = 0.73, > 0 [grey levels].

    Raises:
        ValueError: For a value out of range or of another type.
    """

    tau_ms: float = 200.0
    sigma: float = 2.0

    def __post_init__(self) -> None:
        for name in ("tau_ms", "sigma"):
            object.__setattr__(self, name, check_positive(name, getattr(self, name)))

    def gains(self, fps: float) -> tuple[float]:
        """Return the gain dt / (dt + τ) of the low-passed light at a frame rate [Hz]."""
        dt = 1000.0 / fps
        return (dt / (dt + self.tau_ms),)


class SustainedEdges(MotionNeuron):
    """One or N detectors of edges that stand still in the frame, stepped frame by frame.

    An object on collision course keeps its bearing. Seen from a moving car, its edges therefore stand still
    while those of the background move and are blurred by a slow low-pass filter. The model is a minimal one
    of cells with a sustained (tonic) response:

    1. M(t) = M(t-1) + β (L(t) - M(t-1)), β = dt / (dt + `tau_ms`): low-passed light.
    2. e = abs(M(x + 1) - M(x)) of horizontal neighbours: vertical edges of the low-passed light.
    3. K = 1 / (1 + exp(-mean of e / `sigma`)), in [0.5, 1); adaptation, spikes and spike frequency are those
       of the LGMD (`LGMDParams`, eq. 11 and 12).

    In `Response`, `ffi` is the mean of e [grey levels]; `inhibition_weight` and `excitation_latency` are 0.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters of the model, or a mapping of them; None for the defaults.
        num: Number of detectors N, each with its own frames; None for a single one with scalar outputs.
        spikes: Parameters of the adaptation and the spikes; None for those of the paper.
        threads: Number of threads that share the detectors of a step; None or 1 for the calling thread only.

    Raises:
        ValueError: For an argument out of range.
        TypeError: For an argument of another type.

    Example:
        >>> import numpy as np
        >>> detector = SustainedEdges((32, 80), fps=30.0)
        >>> detector.step(np.zeros((32, 80), np.uint8)).membrane_potential
        0.5
    """

    _past = slice(0)  # none
    _shown: ClassVar = {
        "light": Layer("low-passed light", 255.0),
        "edges": Layer("sustained edges", 32.0),
    }

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: SustainedEdgesParams | Mapping[str, Any] | None = None,
        num: int | None = None,
        *,
        spikes: NeuronSpec = None,
        threads: int | None = None,
    ) -> None:
        self.params = SustainedEdgesParams.make(params)
        super().__init__(shape, fps, num, threads, self.params, spikes)
        self._maps = tuple(np.zeros((self._count, *self.shape), np.float32) for _ in range(2))

    def step_range(self, first: int, last: int, frames: NDArray[Any], active: NDArray[np.bool_]) -> None:
        """Step the active detectors among first..last-1; see `FrameNeuron.step_range`."""
        sustained_edges_kernels.step(
            first, last, frames, active, self._scalars, self._const, self._gains[0], *self._maps
        )

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Maps `light`, M, and `edges`, e, of the last frame [grey levels]; new, (H, W) or (N, H, W)."""
        maps = dict(zip(("light", "edges"), self._maps, strict=True))
        return {name: (values[0] if self.num is None else values).copy() for name, values in maps.items()}

    def column_map(self) -> tuple[NDArray[np.float32], float]:
        """Return the map of the columns; see `FrameNeuron.column_map`."""
        return self._maps[1], self.params.sigma


def _make(shape: tuple[int, int], fps: float, num: int, params: LGMDParams) -> SustainedEdges:
    return SustainedEdges(shape, fps, num=num, spikes=params)


register("edges", _make, takes_params=True)
