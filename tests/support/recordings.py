"""Small training configurations, synthetic recorded episodes, and offline learners."""

from dataclasses import replace

import numpy as np

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.dataset import OfflineDataset
from lgmd_gym.training.offline.episodes import RecordedEpisode
from lgmd_gym.training.offline.learner import OfflineLearner

OFFLINE_YAML = """
default:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper:
        inputs: [spike_frequency, spike_peak, membrane_potential, ffi, ego_speed, ego_yaw_rate]
        history: 3
        repeat: 5
        latch: true
        reward_scale: 0.5
  n_timesteps: 6
  n_epochs: 3
  batch_size: 4
  policy_kwargs: {net_arch: {pi: [8], vf: []}}
"""


def write_yaml(folder, text=OFFLINE_YAML):
    """Write a hyperparameter file and return its path."""
    path = folder / "hyper.yml"
    path.write_text(text)
    return path


def offline_config(folder, env_id="LGMD/RandomBraking-v0", **options):
    """Configuration of a small offline training; its hyperparameter file is written to the folder."""
    options = {"camera": "fovea", "eval_episodes": 4} | options
    return TrainConfig.from_hyperparams("offline", env_id, write_yaml(folder), **options)


def synthetic_episode(length=4, seed=0, threat=True, traffic=False, frames=False):
    """Random episode of `length` environment decisions; in a threat, braking late ends in a contact."""
    rng = np.random.default_rng(seed)
    names = ("ego_speed", "ego_yaw_rate", "spike_frequency")
    observations = {name: rng.random((length, 1), dtype=np.float32) * 20 for name in names}
    if frames:
        observations["frame"] = rng.integers(0, 255, (length, 40, 40, 2), dtype=np.uint8)
    contacts = np.arange(length) > length // 2 if threat else np.zeros(length, bool)
    rewards, braking_returns = rng.normal(size=(2, length)).astype(np.float32)
    family = "traffic" if traffic else "CCRs" if threat else "EmptyRoad"
    return RecordedEpisode(observations, rewards, braking_returns, contacts, threat, traffic, family)


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
