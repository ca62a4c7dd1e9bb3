"""A single-file training loop in CleanRL's style, with Gymnasium's `RecordEpisodeStatistics` and NumPy only.

    python docs/examples/vector_cleanrl.py 2000

A linear policy chooses between no braking and full braking; REINFORCE with the returns of the episodes that
end in an iteration adjusts its weights. Replace the policy by a network to get CleanRL's `ppo.py`.
"""

import sys

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

import lgmd_gym  # noqa: F401  (registers the environments)

CONFIG = {"action": {"type": "DiscreteDemand", "demands": [0.0, -1.0]}, "policy_frequency": 10}
SCALES = {"spike_frequency": 300.0, "membrane_potential": 1.0, "ffi": 100.0, "ego_speed": 30.0}


def make_envs(num_envs: int) -> VectorEnv:
    """Return the engine with episode statistics."""
    envs = gym.make_vec(
        "LGMD/RandomBraking-v0", num_envs=num_envs, threads=2, config=CONFIG, autoreset_mode="SameStep"
    )
    return RecordEpisodeStatistics(envs)


def features(observations: dict[str, np.ndarray]) -> np.ndarray:
    """Return the inputs of the policy, float32, shape (num_envs, 5)."""
    columns = [observations[name] / scale for name, scale in SCALES.items()]
    return np.concatenate([*columns, np.ones_like(columns[0])], axis=1)


def main(iterations: int = 3, num_envs: int = 16, steps: int = 32, rate: float = 0.05) -> list[float]:
    """Train; return the mean return of the last 100 episodes after each iteration."""
    envs, rng = make_envs(num_envs), np.random.default_rng(0)
    assert isinstance(envs.single_action_space, gym.spaces.Discrete)
    weights = np.zeros(len(SCALES) + 1)
    # Sum over an episode of the gradient of the log-probabilities.
    traces = np.zeros((num_envs, len(weights)))
    observations, _ = envs.reset(seed=0)
    returns: list[float] = []
    for iteration in range(iterations):
        gradient = np.zeros_like(weights)
        for _ in range(steps):
            inputs = features(observations)
            brake = 1.0 / (1.0 + np.exp(3.0 - inputs @ weights))
            actions = (rng.random(num_envs) < brake).astype(np.int64)
            traces += (actions - brake)[:, None] * inputs
            observations, _, terminated, truncated, infos = envs.step(actions)
            ended = terminated | truncated
            if "episode" in infos:
                advantages = infos["episode"]["r"][ended] - np.mean(envs.return_queue)
                gradient += advantages @ traces[ended]
                traces[ended] = 0.0
        weights += rate * gradient / num_envs
        if envs.return_queue:
            returns.append(float(np.mean(envs.return_queue)))
            print(f"step {(iteration + 1) * steps * num_envs}: mean return {returns[-1]:.2f}")
    envs.close()
    return returns


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]), num_envs=64)
