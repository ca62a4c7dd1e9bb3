"""Neurons: the LGMD with its reference model and danger zone, other models, and the registry of all."""

from lgmd_gym.neuron.base import FrameNeuron, Layer, Response, Signal
from lgmd_gym.neuron.dsn import DSN, DSNParams
from lgmd_gym.neuron.edges import SustainedEdges, SustainedEdgesParams
from lgmd_gym.neuron.lgmd.danger_zone import danger_zone
from lgmd_gym.neuron.lgmd.model import LGMD
from lgmd_gym.neuron.lgmd.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.lplc2 import LPLC2, LPLC2Params
from lgmd_gym.neuron.registry import Model, check_model, make, names, register

__all__ = ["DSN", "LGMD", "LPLC2", "DSNParams", "FrameNeuron", "LGMDParams", "LPLC2Params", "Layer", "Model"]
__all__ += ["NeuronSpec", "Response", "Signal", "SustainedEdges", "SustainedEdgesParams", "check_model"]
__all__ += ["danger_zone", "make", "names", "register"]
