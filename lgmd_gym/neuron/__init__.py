"""Neurons: the LGMD with its reference model and danger zone, LPLC2, and detectors of motion and edges."""

from lgmd_gym.neuron.danger_zone import danger_zone
from lgmd_gym.neuron.dsn import DSN, DSNParams
from lgmd_gym.neuron.frame_neuron import FrameNeuron, Layer, Signal
from lgmd_gym.neuron.lplc2 import LPLC2
from lgmd_gym.neuron.lplc2_params import LPLC2Params
from lgmd_gym.neuron.model import LGMD
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.registry import Model, make, names, register
from lgmd_gym.neuron.response import Response
from lgmd_gym.neuron.sustained_edges import SustainedEdges, SustainedEdgesParams

__all__ = ["DSN", "LGMD", "LPLC2", "DSNParams", "FrameNeuron", "LGMDParams", "LPLC2Params", "Layer", "Model"]
__all__ += ["NeuronSpec", "Response", "Signal", "SustainedEdges", "SustainedEdgesParams"]
__all__ += ["danger_zone", "make", "names", "register"]
