"""Offline training: recorded episodes, datasets and the learner; independent of `TrainConfig`."""
