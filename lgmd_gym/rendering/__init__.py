"""The composed picture of camera frame, neuron layers and road, its window and its recording."""
