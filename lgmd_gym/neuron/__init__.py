"""The LGMD neuron: model parameters, compiled kernels, reference model and danger zone."""

from lgmd_gym.neuron.danger_zone import danger_zone
from lgmd_gym.neuron.model import LGMD
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.response import Response

__all__ = ["LGMD", "LGMDParams", "NeuronSpec", "Response", "danger_zone"]
