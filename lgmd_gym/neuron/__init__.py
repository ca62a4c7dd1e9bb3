"""Looming neurons: the LGMD with its reference model and danger zone, and an LPLC2 model."""

from lgmd_gym.neuron.danger_zone import danger_zone
from lgmd_gym.neuron.lplc2 import LPLC2
from lgmd_gym.neuron.lplc2_params import LPLC2Params
from lgmd_gym.neuron.model import LGMD
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.response import Response

__all__ = ["LGMD", "LPLC2", "LGMDParams", "LPLC2Params", "NeuronSpec", "Response", "danger_zone"]
