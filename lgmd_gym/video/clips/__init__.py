"""The neuron on video clips: playback, alert detection, summaries, tables and figures."""
