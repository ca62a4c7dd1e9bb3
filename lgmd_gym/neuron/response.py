"""Response: the outputs of a neuron for one frame."""

from typing import Any, NamedTuple


class Response(NamedTuple):
    """Outputs of a neuron for one frame: Python scalars, or arrays of shape (N,) for N neurons.

    Equation numbers are those of Fu et al. (AIAI 2019).

    Attributes:
        spike_frequency: Spikes of the last n_ts frames per second [spikes/s] (eq. 12); float or float64.
        spikes: Number of spikes of this frame (eq. 11); int or int64.
        membrane_potential: K in [0.5, 1] (eq. 10), k_0 before the first change; float or float64.
        adapted_potential: K̂, which is K after spike frequency adaptation; float or float64.
        ffi: Feed-forward inhibition F̂, low-passed mean of `|P|` [grey levels] (eq. 2); float or float64.
        inhibition_weight: w, the weight of I in S (eq. 9); float or float64.
        excitation_latency: τ̂_g, the time constant of G [ms] (eq. 9); float or float64.
        alert: Whether `spike_frequency` >= t_sf ("Coll" in eq. 12); bool.
    """

    spike_frequency: Any
    spikes: Any
    membrane_potential: Any
    adapted_potential: Any
    ffi: Any
    inhibition_weight: Any
    excitation_latency: Any
    alert: Any
