# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""DSN: a neuron that is selective to the direction of horizontal motion."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.fields import record
from lgmd_gym.kernels import kernel
from lgmd_gym.neuron.base import Layer
from lgmd_gym.neuron.lgmd.params import NeuronSpec
from lgmd_gym.neuron.motion import (
    MotionNeuron,
    MotionParams,
    detect_motion_right,
    filter_light,
    register_model,
    start,
    update_delay,
)
from lgmd_gym.neuron.scalars import AGE, GAIN_G, LATENCY, F, W, fire
from lgmd_gym.neuron.validation import Frames


@record
class DSNParams(MotionParams):
    """Parameters of the direction-selective neuron, those of `MotionParams`."""

    label = "DSN"


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
        params: DSNParams | Mapping[str, object] | None = None,
        num: int | None = None,
        *,
        spikes: NeuronSpec = None,
        threads: int | None = None,
    ) -> None:
        self.params = DSNParams.make(params)
        super().__init__(shape, fps, num, threads, self.params, spikes)
        self._maps = tuple(np.zeros((self._count, *self.shape), np.float32) for _ in range(6))

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active neurons among first..last-1; see `FrameNeuron.step_range`."""
        _step(first, last, frames, active, self._scalars, self._const, self._gains, *self._maps)

    def column_map(self) -> tuple[NDArray[np.float32], float]:
        """Return the map of the columns; see `FrameNeuron.column_map`."""
        return self._maps[5], self.params.sigma

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Map `right` of the last frame, the motion m [grey levels]; new array, (H, W) or (N, H, W)."""
        right = self._maps[5]
        return {"right": (right[0] if self.num is None else right).copy()}


@kernel(exact=True, arrays=True)
def _step(
    first, last, frames, active, scalars, const, gains, mean, on, off, late_on, late_off, right
) -> None:
    """Step the active neurons among first..last-1.

    Args:
        first: First neuron.
        last: Last neuron + 1.
        frames: Frames, (N, H, W).
        active: Neurons to step, bool, (N,).
        scalars: Scalar state, see `scalars`, (N, ...).
        const: Constants of the stage of spikes, see `scalars.pack_constants`.
        gains: Gains of the mean light and of the delay, float32, (2,).
        mean: Mean light; this and the other maps are float32, (N, H, W).
        on: ON of the last frame.
        off: OFF of the last frame.
        late_on: Delayed ON.
        late_off: Delayed OFF.
        right: Motion to the right.
    """
    pixels = frames.shape[1] * frames.shape[2]
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[AGE] == 0.0:
            start(frames[n], mean[n])
            row[AGE] = 1.0
            continue
        filter_light(frames[n], mean[n], on[n], off[n], gains[0])
        total, strength = detect_motion_right(on[n], off[n], late_on[n], late_off[n], right[n])
        update_delay(on[n], off[n], late_on[n], late_off[n], gains[1])
        row[F], row[W], row[LATENCY], row[GAIN_G] = strength / pixels, 0.0, 0.0, 1.0
        fire(row, const, total / pixels)


register_model("dsn", DSN, DSNParams, "Neuron that is selective to motion to the right.")
