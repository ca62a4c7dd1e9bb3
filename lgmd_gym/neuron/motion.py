# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""What the models beside the LGMD share: parameters, the base class, and kernels of motion detectors.

Equation numbers are those in the docstring of `LPLC2`.
"""

from collections.abc import Callable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.fields import Record, declarations, number, record
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import (
    LANES,
    load_part,
    magnitude,
    maximum,
    select_by_sign,
    splat,
    square_root,
    store_part,
    total,
)
from lgmd_gym.neuron.base import FrameNeuron, Signal, spiking_signals
from lgmd_gym.neuron.lgmd.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.maps import shift_light, shift_rows
from lgmd_gym.neuron.registry import register
from lgmd_gym.neuron.scalars import initial_scalars, pack_constants
from lgmd_gym.neuron.validation import Frames


@record
class ModelParams(Record):
    """Base class of the parameters of a model with the spikes of the LGMD."""

    sigma: float = number(1.0, "(0, inf)", "grey levels", "Response at which K = 0.73.")

    def gains(self, fps: float) -> tuple[float, ...]:
        """Return the gains of the model's filters at a frame rate [Hz]."""
        raise NotImplementedError


@record
class MotionParams(ModelParams):
    """Parameters of motion detectors; see `LPLC2` for the equations."""

    tau_mean_ms: float = number(
        100.0, "(0, inf)", "ms", "Time constant of the mean light that photoreceptors subtract."
    )
    tau_delay_ms: float = number(
        30.0, "(0, inf)", "ms", "Time constant of the delay of the motion detectors."
    )

    def gains(self, fps: float) -> tuple[float, float]:
        """Return the gains dt / (dt + τ) of the mean light and of the delay at a frame rate [Hz]."""
        dt = 1000.0 / fps
        return dt / (dt + self.tau_mean_ms), dt / (dt + self.tau_delay_ms)


SPIKE_OPTIONS = ("tau_s", "t_sfa", "sigma_4", "t_sp", "n_ts", "t_sf")
"""Fields of `LGMDParams` that the spikes of every model have."""


def register_model(
    name: str, model: "Callable[..., MotionNeuron]", params: type[ModelParams], about: str
) -> None:
    """Register a model whose options are its own parameters, and those of the spikes."""
    own = tuple(item.name for item in declarations(params))

    def make(
        shape: tuple[int, int], fps: float, num: int, spikes: LGMDParams, **options: object
    ) -> MotionNeuron:
        of_spikes = {key: item for key, item in options.items() if key not in own}
        chosen = params.make({key: item for key, item in options.items() if key in own})
        return model(shape, fps, chosen, num, spikes=LGMDParams.make(spikes, **of_spikes))

    register(name, make, takes_params=True, options=(*own, *SPIKE_OPTIONS), about=about)


class MotionNeuron(FrameNeuron):
    """One or N neurons of a model of its own, with the membrane potential and the spikes of the LGMD.

    The first map of a subclass is its low-passed light; `_past` selects the other maps that the next frame
    depends on.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        num: Number of neurons N, each with its own frames; None for a single one with scalar outputs.
        threads: Number of threads that share the neurons of a step; None or 1 for the calling thread only.
        params: Parameters of the model.
        spikes: Parameters of the adaptation and the spikes; None for those of the paper.
    """

    _past: ClassVar[slice]
    _lowest: ClassVar[float] = 0.5  # lower bound of K

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float,
        num: int | None,
        threads: int | None,
        params: ModelParams,
        spikes: NeuronSpec,
    ) -> None:
        super().__init__(shape, fps, num, threads)
        self._stage = stage = LGMDParams.make(spikes)
        self._initial = initial_scalars(stage)
        self._scalars = np.tile(self._initial, (self._count, 1))
        constants = LGMDParams.make({**stage.to_dict(), "sigma_3": params.sigma})
        self._const = pack_constants(constants, self.fps, n_pixels=1)
        self._gains = np.array(params.gains(self.fps), np.float32)

    @property
    def signals(self) -> dict[str, Signal]:
        """Bounds and units of the outputs; no motion or edge is stronger than the range of grey levels."""
        return spiking_signals(self._stage, self.fps, self._lowest, 255.0)

    def shift_range(
        self,
        first: int,
        last: int,
        frames: Frames,
        active: NDArray[np.bool_],
        turns_px: NDArray[np.int64],
    ) -> None:
        """Shift the state of active neurons among first..last-1; see `FrameNeuron.shift_range`."""
        chosen = first, last, active, self._scalars, turns_px
        shift_light(*chosen, self._maps[0], frames, 0, 0)
        for values in self._maps[self._past]:
            shift_rows(*chosen, values, self.shape[1])


@kernel(exact=True, arrays=True)
def start(frame, mean):
    """Set the mean light to the first frame."""
    for y in range(mean.shape[0]):
        for x in range(mean.shape[1]):
            mean[y, x] = frame[y, x]


@kernel(exact=True, arrays=True)
def filter_light(frame, mean, on, off, gain):
    """Subtract the mean light and split the difference into ON and OFF (eq. 1 and 2)."""
    zero, rate = splat(np.float32(0.0)), splat(gain)
    pixels = mean.size
    for at in range(0, pixels, LANES):
        count = pixels - at
        light = load_part(mean, at, count)
        change = load_part(frame, at, count) - light
        store_part(mean, at, count, light + rate * change)
        store_part(on, at, count, maximum(change, zero))
        store_part(off, at, count, maximum(zero - change, zero))


@kernel(exact=True, inline=True, arrays=True)
def _correlation(on, off, late_on, late_off, at, step, count):
    """Return m of `count` pixels from index `at` on, each with that `step` pixels after it (eq. 4)."""
    near = load_part(late_on, at, count) * load_part(on, at + step, count)
    value = near - load_part(on, at, count) * load_part(late_on, at + step, count)
    near = load_part(late_off, at, count) * load_part(off, at + step, count)
    value = value + (near - load_part(off, at, count) * load_part(late_off, at + step, count))
    root = square_root(magnitude(value))
    return select_by_sign(value, root, splat(np.float32(0.0)) - root)


@kernel(exact=True, arrays=True)
def detect_motion_right(on, off, late_on, late_off, right):
    """Correlate each pixel with the next one to the right (eq. 4); return the sums of m and |m|."""
    height, width = on.shape
    sum_motion = sum_strength = 0.0
    for y in range(height):
        motion = strength = splat(np.float32(0.0))
        for x in range(0, width - 1, LANES):
            at, count = y * width + x, width - 1 - x
            value = _correlation(on, off, late_on, late_off, at, 1, count)
            store_part(right, at, count, value)
            motion, strength = motion + value, strength + magnitude(value)
        sum_motion, sum_strength = sum_motion + total(motion), sum_strength + total(strength)
    return sum_motion, sum_strength


@kernel(exact=True, arrays=True)
def detect_motion_down(on, off, late_on, late_off, down):
    """Correlate each pixel with the next one below (eq. 4)."""
    height, width = on.shape
    pixels = (height - 1) * width
    for at in range(0, pixels, LANES):
        count = pixels - at
        store_part(down, at, count, _correlation(on, off, late_on, late_off, at, width, count))


@kernel(exact=True, inline=True, arrays=True)
def _approach(values, target, at, count, rate):
    """Move sixteen values, at most `count`, from index `at` on towards those of another map by a share."""
    past = load_part(values, at, count)
    store_part(values, at, count, past + rate * (load_part(target, at, count) - past))


@kernel(exact=True, arrays=True)
def update_delay(on, off, late_on, late_off, gain):
    """Update the delayed ON and OFF (eq. 3)."""
    rate, pixels = splat(gain), on.size
    for at in range(0, pixels, LANES):
        count = pixels - at
        _approach(late_on, on, at, count, rate)
        _approach(late_off, off, at, count, rate)
