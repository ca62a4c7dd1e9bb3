"""MotionNeuron: base class of the models beside the LGMD."""

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.neuron.frame_neuron import FrameNeuron, Signal, spiking_signals
from lgmd_gym.neuron.motion_params import ModelParams
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.scalars import initial_scalars, pack_constants
from lgmd_gym.neuron.shift_kernels import shift_light, shift_rows


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
        frames: NDArray[Any],
        active: NDArray[np.bool_],
        turns_px: NDArray[np.int64],
    ) -> None:
        """Shift the state of active neurons among first..last-1; see `FrameNeuron.shift_range`."""
        chosen = first, last, active, self._scalars, turns_px
        shift_light(*chosen, self._maps[0], frames, 0, 0)
        for values in self._maps[self._past]:
            shift_rows(*chosen, values, self.shape[1])
