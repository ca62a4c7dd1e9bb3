"""Training of policies with stable-baselines3, online or on recorded episodes."""

from lgmd_gym.training.config import TrainConfig
from lgmd_gym.training.policy_env import PolicyWrapper
from lgmd_gym.training.trainer import resume, train

__all__ = ["PolicyWrapper", "TrainConfig", "resume", "train"]
