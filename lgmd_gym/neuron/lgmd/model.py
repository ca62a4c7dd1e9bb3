"""LGMD: the stateful neuron."""

from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.aliases import Values
from lgmd_gym.fields import Record, declarations
from lgmd_gym.neuron import maps
from lgmd_gym.neuron.base import FrameNeuron, Layer, Signal, spiking_signals
from lgmd_gym.neuron.lgmd import general, kernels
from lgmd_gym.neuron.lgmd.params import PRESETS, LGMDParams, NeuronSpec, preset_changes
from lgmd_gym.neuron.registry import register
from lgmd_gym.neuron.scalars import initial_scalars, pack_constants
from lgmd_gym.neuron.validation import Frames, checked_region


class LGMD(FrameNeuron):
    """One or N locust looming neurons, stepped frame by frame.

    The first frame has no predecessor, so it causes no change and no spikes. A step starts no thread unless
    `threads` is given.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz]. Outputs depend on it, because spikes per frame do not scale with the frame
            interval.
        params: Parameters of the model, or a mapping of them; None for the defaults, those of the paper.
        num: Number of neurons N, each with its own frames; None for a single neuron with scalar outputs.
        mask: Pixel weights in [0, 1], shape (height, width), for example from `danger_zone`. F and K are
            means over the pixels with a weight > 0. Other pixels have no effect.
        roi: Region of interest (top, left, height, width) [px]; equals a mask of 1 inside and 0 outside.
        threads: Number of threads that share the neurons of a step; None or 1 for the calling thread only.

    Attributes:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters of the model.
        num: Number of neurons; None for a single neuron.

    Raises:
        ValueError: For an argument out of range.
        TypeError: For an argument of another type.

    Example:
        >>> import numpy as np
        >>> neuron = LGMD((90, 160), fps=30.0)
        >>> neuron.step(np.zeros((90, 160), np.uint8)).spikes
        0
    """

    _shown: ClassVar = {
        "P": Layer("P  change, ON and OFF", 64.0, signed=True),
        "I": Layer("I  delayed inhibition", 64.0),
        "S": Layer("S  remaining excitation", 64.0),
        "G": Layer("G  grouped excitation", 64.0),
    }

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: NeuronSpec = None,
        num: int | None = None,
        *,
        mask: ArrayLike | None = None,
        roi: tuple[int, int, int, int] | None = None,
        threads: int | None = None,
    ) -> None:
        super().__init__(shape, fps, num, threads)
        self.params = LGMDParams.make(params)

        region = checked_region(self.shape, mask, roi)
        self._y0, self._x0, region_shape, self._weight, n_pixels = region
        self._const = pack_constants(self.params, self.fps, n_pixels)
        self._initial = initial_scalars(self.params)
        self._scalars = np.tile(self._initial, (self._count, 1))
        self._previous = np.zeros((self._count, *region_shape), np.uint8)
        self._fast = kernels.supports(self.params)
        if self._fast:
            self._maps = kernels.allocate(self._count, region_shape)
        else:
            self._maps = general.allocate(self._count, region_shape, self.params.n_p)

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active neurons among first..last-1; see `FrameNeuron.step_range`."""
        kernel = cast(Any, kernels if self._fast else general).step
        kernel(
            first, last, frames, self._previous, self._y0, self._x0, self._weight, active, self._scalars,
            self._const, *self._maps,
        )  # fmt: skip

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
        maps.shift_light(*chosen, self._previous, frames, self._y0, self._x0)
        width = self._previous.shape[2]
        if not self._fast:
            p, e, memory, _, _, g = self._maps
            for values in (p, e, memory, g):
                rows = values.reshape(self._count, -1, values.shape[-1])
                maps.shift_rows(*chosen, rows, values.shape[-1])
            return
        p, memory, g = kernels.shifted_views(self._maps, self._previous.shape[1])
        for frame in range(2):
            maps.shift_rows(*chosen, p[:, frame], width)
        maps.shift_rows(*chosen, g, width)
        maps.shift_blocks(*chosen, memory, width)

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Maps P, E, I, S and G of the last frame; new arrays of shape (H, W), or (N, H, W) for N neurons.

        E is `|P|` by path, and I is that of the path which P excites (ON where P >= 0); see `LGMDParams` for
        the equations. All maps are 0 before the first change. Outside the mask, only I of adjacent pixels is
        not 0.
        """
        read = cast(Any, kernels if self._fast else general).layers
        maps = read(self._scalars, self._const, *self._maps)
        h, w = self._previous.shape[1:]
        images: dict[str, NDArray[np.float32]] = {}
        for name, values in maps.items():
            image = np.zeros((self._count, *self.shape), np.float32)
            image[:, self._y0 : self._y0 + h, self._x0 : self._x0 + w] = values[..., :w]
            images[name] = image[0] if self.num is None else image
        return images

    @property
    def signals(self) -> dict[str, Signal]:
        """Bounds and units of the outputs; F̂ has full-range changes in every frame, with persistence."""
        return spiking_signals(self.params, self.fps, 0.5, 255.0 / (1.0 - sum(self.params.persistence)))

    def column_map(self) -> tuple[NDArray[np.float32], float]:
        """Return the map of the columns; see `FrameNeuron.column_map`."""
        if self._weight.size > 0 or self._previous.shape[1:] != self.shape:
            raise ValueError("columns require a neuron without mask and roi; leave both out")
        g: NDArray[np.float32] = self._maps[4] if self._fast else self._maps[5]
        return g.reshape(self._count, self.shape[0], -1), self.params.sigma_3

    def _use_floats(self) -> None:
        super()._use_floats()
        self._previous = self._previous.astype(np.float32, copy=False)


def _make(
    shape: tuple[int, int],
    fps: float,
    num: int,
    params: LGMDParams,
    *,
    preset: str | None = None,
    **options: object,
) -> LGMD:
    """Return neurons with the changes of a preset, then those of options, to the parameters in use."""
    changes: Values = {} if preset is None else preset_changes(preset)
    return LGMD(shape, fps, num=num, params=LGMDParams.make(params, **changes | options))


OPTIONS = tuple(item.name for item in declarations(LGMDParams) if not isinstance(item.default, tuple))


def register_variant(
    name: str, variant: Callable[..., LGMD], own: type[Record], argument: str, about: str
) -> None:
    """Register an LGMD with further parameters, whose options are those of both.

    Args:
        name: Name of the model.
        variant: Its class.
        own: Class of its further parameters.
        argument: Argument of the class that takes them.
        about: See `register`.
    """
    names = tuple(item.name for item in declarations(own))

    def make(shape: tuple[int, int], fps: float, num: int, params: LGMDParams, **options: object) -> LGMD:
        further = {key: options.pop(key) for key in names if key in options}
        return variant(shape, fps, LGMDParams.make(params, **options), num, **{argument: further})

    register(name, make, takes_params=True, options=(*names, *OPTIONS), about=about)


_ABOUT = {
    "lgmd": "LGMD1 of Fu et al. (2019), as on the page of the neuron.",
    "literal": "LGMD with the equations as printed in the paper.",
    "released": "LGMD as in the first author's C# release of 2019.",
    "fixed-inhibition": "LGMD without adaptation to F; a high F silences it.",
    "off-only": "LGMD without its ON path; responds to dark objects.",
}
register("lgmd", _make, takes_params=True, options=OPTIONS, about=_ABOUT["lgmd"])
for _preset in PRESETS:
    register(
        _preset,
        partial(_make, preset=_preset),
        takes_params=True,
        options=OPTIONS,
        about=_ABOUT[_preset],
    )
