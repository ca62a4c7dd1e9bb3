"""The experiments of the seed paper: stimuli, measurements, claims and figures."""
