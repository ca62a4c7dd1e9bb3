"""Small offline learners and datasets of synthetic episodes."""

from dataclasses import replace

import numpy as np
from support.recordings import offline_config, synthetic_episode

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.training.offline.dataset import OfflineDataset
from lgmd_gym.training.offline.episodes import RecordedEpisode
from lgmd_gym.training.offline.learner import OfflineLearner

FEATURES = FeatureConfig(inputs=("spike_frequency", "ego_speed"), history=3, repeat=1, latch=True)
NETWORK = {"net_arch": {"pi": [8], "vf": []}}


def dataset(episodes, features=FEATURES):
    return OfflineDataset(episodes, features)


def learner(folder, features=FEATURES, **algo_kwargs):
    config = replace(offline_config(folder), features=features)
    defaults = {"n_epochs": 60, "batch_size": 8, "learning_rate": 0.03, "policy_kwargs": NETWORK}
    env = config.make_policy_env("train")
    return OfflineLearner("MultiInputPolicy", env, config.demands, **(defaults | algo_kwargs))


def spike_episodes(count, seed):
    """Episodes in which braking returns 5 at a spike and -5 at any other decision."""
    rng, episodes = np.random.default_rng(seed), []
    for number in range(count):
        length, threat = int(rng.integers(5, 9)), number % 2 == 0
        spike = int(rng.integers(1, length - 1))
        episode = synthetic_episode(length, seed=number, threat=threat)
        spikes = np.zeros((length, 1), np.float32)
        braking_returns = np.full(length, -5.0, np.float32)
        if threat:
            spikes[spike], braking_returns[spike] = 200.0, 5.0
        contacts = np.arange(length) != spike if threat else np.zeros(length, bool)
        observations = {**episode.observations, "spike_frequency": spikes}
        rewards = np.full(length, -0.1, np.float32)
        episodes.append(RecordedEpisode(observations, rewards, braking_returns, contacts, threat))
    return episodes
