"""Small trainings on recorded episodes, and synthetic recorded episodes."""

import numpy as np

from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.episodes import DrivenEpisode

RECORDED_YAML = """
default:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper:
        inputs: [spike_frequency, spike_peak, membrane_potential, ffi, ego_speed, ego_yaw_rate]
        history: 1
        repeat: 5
  n_timesteps: 6
  n_epochs: 3
  batch_size: 64
  mirror: false
  policy_kwargs: {net_arch: {pi: [8], vf: []}}
"""


def write_yaml(folder, text=RECORDED_YAML):
    """Write a hyperparameter file and return its path."""
    path = folder / "hyper.yml"
    path.write_text(text)
    return path


def recorded_config(folder, env_id="LGMD/RandomBraking-v0", **options):
    """Configuration of a small training; its hyperparameter file is written to the folder."""
    options = {"camera": "fovea", "eval_episodes": 4} | options
    return TrainConfig.from_hyperparams("time-to-brake", env_id, write_yaml(folder), **options)


def synthetic_episode(length=4, seed=0, threat=True, traffic=False, frames=False):
    """Random episode of `length` environment decisions; the time to brake of a threat ends at 0."""
    rng = np.random.default_rng(seed)
    names = ("ego_speed", "ego_yaw_rate", "spike_frequency")
    observations = {name: rng.random((length, 1), dtype=np.float32) * 20 for name in names}
    if frames:
        observations["frame"] = rng.integers(0, 255, (length, 40, 40, 2), dtype=np.uint8)
    times = np.arange(length)[::-1] / 30.0 if threat else np.full(length, np.inf)
    demands = rng.choice([0.0, -0.4, -1.0], length).astype(np.float32)
    family = "traffic" if traffic else "CCRs" if threat else "EmptyRoad"
    return DrivenEpisode(observations, times.astype(np.float32), demands, threat, family)
