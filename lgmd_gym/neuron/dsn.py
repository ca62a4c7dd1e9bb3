"""DSN: a neuron that is selective to the direction of horizontal motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.neuron import dsn_kernels
from lgmd_gym.neuron.frame_neuron import Layer
from lgmd_gym.neuron.motion_neuron import MotionNeuron
from lgmd_gym.neuron.motion_params import MotionParams
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.registry import register


@dataclass(frozen=True, slots=True, kw_only=True)
class DSNParams(MotionParams):
    """Parameters of the direction-selective neuron, those of `MotionParams`."""


class DSN(MotionNeuron):
    """One or N direction-selective neurons, stepped frame by frame.

    The neuron is excited by motion to the right and inhibited by motion to the left, as direction-selective
    neurons beside the LGMD in collision detectors (Yue & Rind 2013) and the wide-field cells of flies. It
    correlates neighbouring pixels as LPLC2 does (equations 1 to 4 of `LPLC2`) and averages:

    5. Response r: mean of m, the motion to the right, over all pixels; negative for motion to the left.
    6. K = 1 / (1 + exp(-r / `sigma`)), in (0, 1); adaptation, spikes and spike frequency are those of the
       LGMD (`LGMDParams`, eq. 11 and 12), so that the neuron only spikes for motion to the right.

    In `Response`, `ffi` is the mean of `|m|` [grey levels]; `inhibition_weight` and `excitation_latency` are
    0.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters of the model, or a mapping of them; None for the defaults.
        num: Number of neurons N, each with its own frames; None for a single one with scalar outputs.
        spikes: Parameters of the adaptation and the spikes; None for those of the paper.
        threads: Number of threads that share the neurons of a step; None or 1 for the calling thread only.

    Raises:
        ValueError: For an argument out of range.
        TypeError: For an argument of another type.

    Example:
        >>> import numpy as np
        >>> neuron = DSN((32, 80), fps=30.0)
        >>> neuron.step(np.zeros((32, 80), np.uint8)).membrane_potential
        0.5
    """

    _past = slice(3, 5)  # delayed ON and OFF
    _shown: ClassVar = {"right": Layer("motion to the right", 32.0, signed=True)}
    _lowest = 0.0  # motion to the left inhibits below 0.5

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: DSNParams | Mapping[str, Any] | None = None,
        num: int | None = None,
        *,
        spikes: NeuronSpec = None,
        threads: int | None = None,
    ) -> None:
        self.params = DSNParams.make(params)
        super().__init__(shape, fps, num, threads, self.params, spikes)
        self._maps = tuple(np.zeros((self._count, *self.shape), np.float32) for _ in range(6))

    def step_range(self, first: int, last: int, frames: NDArray[Any], active: NDArray[np.bool_]) -> None:
        """Step the active neurons among first..last-1; see `FrameNeuron.step_range`."""
        dsn_kernels.step(first, last, frames, active, self._scalars, self._const, self._gains, *self._maps)

    def column_map(self) -> tuple[NDArray[np.float32], float]:
        """Return the map of the columns; see `FrameNeuron.column_map`."""
        return self._maps[5], self.params.sigma

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Map `right` of the last frame, the motion m [grey levels]; new array, (H, W) or (N, H, W)."""
        right = self._maps[5]
        return {"right": (right[0] if self.num is None else right).copy()}


def _make(shape: tuple[int, int], fps: float, num: int, params: LGMDParams) -> DSN:
    return DSN(shape, fps, num=num, spikes=params)


register("dsn", _make, takes_params=True)
