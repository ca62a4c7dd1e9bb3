"""Training on recorded episodes: recorders, dataset and learner; independent of `TrainConfig`."""
