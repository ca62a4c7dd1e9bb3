"""Golden traces of the neuron and their stimuli."""
