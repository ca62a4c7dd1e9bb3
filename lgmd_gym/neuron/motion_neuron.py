"""MotionNeuron: base class of the models beside the LGMD."""

import numpy as np

from lgmd_gym.neuron.frame_neuron import FrameNeuron
from lgmd_gym.neuron.motion_params import ModelParams
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.scalars import initial_scalars, pack_constants


class MotionNeuron(FrameNeuron):
    """One or N neurons of a model of its own, with the membrane potential and the spikes of the LGMD.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        num: Number of neurons N, each with its own frames; None for a single one with scalar outputs.
        threads: Number of threads that share the neurons of a step; None or 1 for the calling thread only.
        params: Parameters of the model.
        spikes: Parameters of the adaptation and the spikes; None for those of the paper.
    """

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
        stage = LGMDParams.make(spikes)
        self._initial = initial_scalars(stage)
        self._scalars = np.tile(self._initial, (self._count, 1))
        constants = LGMDParams.make({**stage.to_dict(), "sigma_3": params.sigma})
        self._const = pack_constants(constants, self.fps, n_pixels=1)
        self._gains = np.array(params.gains(self.fps), np.float32)
