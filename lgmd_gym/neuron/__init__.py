"""Neurons: the LGMD with its reference model and danger zone, other models, and the registry of all."""

from lgmd_gym.neuron.base import FrameNeuron, Layer, Response, Signal
from lgmd_gym.neuron.difference import FrameChange, FrameChangeParams
from lgmd_gym.neuron.dsn import DSN, DSNParams
from lgmd_gym.neuron.edges import SustainedEdges, SustainedEdgesParams
from lgmd_gym.neuron.events import EventCamera, EventLGMD, EventParams, EventRecording
from lgmd_gym.neuron.lgmd.adaptive import AdaptiveLGMD, AdaptiveParams
from lgmd_gym.neuron.lgmd.danger_zone import danger_zone
from lgmd_gym.neuron.lgmd.model import LGMD
from lgmd_gym.neuron.lgmd.params import PRESETS, LGMDParams, NeuronSpec
from lgmd_gym.neuron.lplc2 import LPLC2, LPLC2Params
from lgmd_gym.neuron.registry import (
    Model,
    base_name,
    check_model,
    describe,
    import_models,
    make,
    names,
    outside_code,
    register,
)

__all__ = ["DSN", "LGMD", "LPLC2", "PRESETS", "AdaptiveLGMD", "AdaptiveParams", "DSNParams", "EventCamera"]
__all__ += ["EventLGMD", "EventParams", "EventRecording", "FrameChange", "FrameChangeParams", "FrameNeuron"]
__all__ += ["LGMDParams", "LPLC2Params", "Layer", "Model", "NeuronSpec", "Response", "Signal"]
__all__ += ["SustainedEdges", "SustainedEdgesParams", "base_name", "check_model", "danger_zone", "describe"]
__all__ += ["import_models", "make", "names", "outside_code", "register"]
