"""Dashboard of camera frame, neuron layers and road: drawing, playback, window and recording."""
