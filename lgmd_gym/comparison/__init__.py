"""Comparison of neuron models on stimuli, clips and simulated approaches: one report for any set of them."""
