"""Trainings small enough to test, and drives that nobody drove."""

import numpy as np

from lgmd_gym.training.config import Order
from lgmd_gym.training.offline.episodes import Drive

YAML = """
default:
  env_wrapper:
    - lgmd_gym.training.PolicyView:
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


def order(tmp_path, **changes):
    file = tmp_path / "hyper.yml"
    file.write_text(YAML)
    given = {"algo": "recorded", "camera": ("fovea",), "hyperparams": file, "eval_episodes": 4}
    return Order(**given | changes)


def made_up(length=4, seed=0, threat=True, frame=False):
    """A drive of so many decisions of the environment."""
    rng = np.random.default_rng(seed)
    names = ("ego_speed", "ego_yaw_rate", "spike_frequency")
    seen = {name: rng.random((length, 1), dtype=np.float32) * 20 for name in names}
    frames = rng.integers(0, 255, (length, 40, 40, 2), dtype=np.uint8) if frame else None
    contacts = np.arange(length) > length // 2 if threat else np.zeros(length, bool)
    drawn = rng.normal(size=(2, length)).astype(np.float32)
    return Drive(seen, frames, drawn[0], drawn[1], contacts, threat)
