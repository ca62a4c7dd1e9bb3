"""The experiments of the LGMD paper: stimuli, measurements, claims and figures."""
