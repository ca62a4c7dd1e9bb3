"""What the neuron answers to one frame."""

from typing import Any, NamedTuple


class Response(NamedTuple):
    """The neuron's answer to one frame: plain numbers, or arrays of shape (N,) from N neurons.

    Attributes:
        spike_frequency: Spikes of the last n_ts frames per second [spikes/s] (eq. 12); float, float64 array.
        spikes: Spikes of this frame (eq. 11); int, int64 array.
        membrane_potential: K in [0.5, 1] (eq. 10), k_0 before the first change; float, float64 array.
        adapted_potential: K after spike frequency adaptation, the one that spikes; float, float64 array.
        ffi: Feed-forward inhibition F, low-passed mean `|P|` [luminance] (eq. 2); float, float64 array.
        inhibition_weight: w, the weight of I in S (eq. 9); float, float64 array.
        excitation_latency: Time constant of G [ms] (eq. 9); float, float64 array.
        alert: Whether the frequency has reached t_sf (eq. 12, "Coll"); bool, bool array.
    """

    spike_frequency: Any
    spikes: Any
    membrane_potential: Any
    adapted_potential: Any
    ffi: Any
    inhibition_weight: Any
    excitation_latency: Any
    alert: Any
