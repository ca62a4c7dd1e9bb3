"""Golden traces of the neuron, and the stimuli that they were made from."""
