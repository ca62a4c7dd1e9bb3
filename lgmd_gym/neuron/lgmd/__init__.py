"""The LGMD: parameters, kernels, the stateful neuron, its reference in NumPy, and the danger zone."""
