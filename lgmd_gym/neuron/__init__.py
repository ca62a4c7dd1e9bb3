"""The LGMD neuron: parameters, the stepper, its answer, and the danger zone."""

from lgmd_gym.neuron.danger_zone import danger_zone
from lgmd_gym.neuron.model import LGMD
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.response import Response

__all__ = ["LGMD", "LGMDParams", "NeuronSpec", "Response", "danger_zone"]
