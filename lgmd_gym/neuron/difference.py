# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""FrameChange: the mean change of light between two frames, a baseline without a neuron."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.fields import number, record
from lgmd_gym.kernels import kernel
from lgmd_gym.neuron.base import Layer
from lgmd_gym.neuron.lgmd.params import NeuronSpec
from lgmd_gym.neuron.motion import ModelParams, MotionNeuron, register_model, start
from lgmd_gym.neuron.scalars import AGE, GAIN_G, LATENCY, F, W, fire
from lgmd_gym.neuron.validation import Frames


@record
class FrameChangeParams(ModelParams):
    """Parameters of `FrameChange`."""

    label = "FrameChange"
    sigma: float = number(4.0, "(0, inf)", "grey levels", "Mean change at which K = 0.73.")

    def gains(self, fps: float) -> tuple[float, ...]:
        """Return no gains: the model has no filter."""
        return ()


class FrameChange(MotionNeuron):
    """One or N detectors of change, stepped frame by frame: the baseline that a looming neuron must beat.

    1. d = `|L(t) - L(t-1)|` of each pixel.
    2. K = 1 / (1 + exp(-mean of d / `sigma`)), in [0.5, 1); adaptation, spikes and spike frequency are those
       of the LGMD (`LGMDParams`, eq. 11 and 12).

    In `Response`, `ffi` is the mean of d [grey levels]; `inhibition_weight` and `excitation_latency` are 0.

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
        >>> detector = FrameChange((32, 80), fps=30.0)
        >>> detector.step(np.zeros((32, 80), np.uint8)).membrane_potential
        0.5
    """

    _past = slice(0)  # none
    _shown: ClassVar = {"change": Layer("change", 64.0)}

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: FrameChangeParams | Mapping[str, object] | None = None,
        num: int | None = None,
        *,
        spikes: NeuronSpec = None,
        threads: int | None = None,
    ) -> None:
        self.params = FrameChangeParams.make(params)
        super().__init__(shape, fps, num, threads, self.params, spikes)
        self._maps = tuple(np.zeros((self._count, *self.shape), np.float32) for _ in range(2))

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active detectors among first..last-1; see `FrameNeuron.step_range`."""
        _step(first, last, frames, active, self._scalars, self._const, *self._maps)

    def column_map(self) -> tuple[NDArray[np.float32], float]:
        """Return the map of the columns; see `FrameNeuron.column_map`."""
        return self._maps[1], self.params.sigma

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Map `change`, d, of the last frame [grey levels]; new array, (H, W) or (N, H, W)."""
        change = self._maps[1]
        return {"change": (change[0] if self.num is None else change).copy()}


@kernel(exact=True, arrays=True)
def _step(first, last, frames, active, scalars, const, light, change) -> None:
    """Step the active detectors among first..last-1.

    Args:
        first: First detector.
        last: Last detector + 1.
        frames: Frames, (N, H, W).
        active: Detectors to step, bool, (N,).
        scalars: Scalar state, see `scalars`, (N, ...).
        const: Constants of the stage of spikes, see `scalars.pack_constants`.
        light: Light of the last frame, float32, (N, H, W).
        change: Change d, float32, (N, H, W).
    """
    height, width = frames.shape[1], frames.shape[2]
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[AGE] == 0.0:
            start(frames[n], light[n])
            row[AGE] = 1.0
            continue
        total = 0.0
        for y in range(height):
            for x in range(width):
                value = np.float32(frames[n, y, x])
                change[n, y, x] = abs(value - light[n, y, x])
                light[n, y, x] = value
                total += change[n, y, x]
        mean = total / (height * width)
        row[F], row[W], row[LATENCY], row[GAIN_G] = mean, 0.0, 0.0, 1.0
        fire(row, const, mean)


register_model(
    "difference", FrameChange, FrameChangeParams, "Mean change between two frames; a baseline without neuron."
)
