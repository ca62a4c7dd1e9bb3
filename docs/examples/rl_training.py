"""RL training: PPO of stable-baselines3 with spike frequency and ego speed as inputs.

    pip install -c constraints.txt ".[train]"
    python docs/examples/rl_training.py 100000 docs/tutorials/rl_training.png

Two thousand steps only show that the parts work together.
"""

import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import torch
from matplotlib.figure import Figure
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym.benchmark.metrics import NUISANCE
from lgmd_gym.plotting.style import COLOURS

ENV = "LGMD/RandomBraking-v0"


def main(steps: int = 2000, figure_path: Path | None = None, episodes: int = 2) -> PPO:
    """Train on the training split in clear weather and test on `episodes` levels of the test split."""
    torch.set_num_threads(1)  # several threads slow down a network this small
    envs = make_vec_env(ENV, n_envs=2, seed=0, env_kwargs={"split": "train", "conditions": ["clear"]})
    # Spike frequencies reach 300 and membrane potentials 1, so the observations are normalised.
    envs = VecNormalize(envs, norm_reward=False)
    model = PPO("MultiInputPolicy", envs, n_steps=256, batch_size=128, seed=0, device="cpu")
    model.learn(steps)
    envs.training = False

    results = [run_episode(model, envs, seed) for seed in range(episodes)]
    threats = [run_episode(None, envs, seed)[0] for seed in range(episodes)]
    contacts = [contact for (contact, _), threat in zip(results, threats, strict=True) if threat]
    false = [braked for (_, braked), threat in zip(results, threats, strict=True) if not threat]
    print(
        f"{steps} steps: contact in {sum(contacts)} of {len(contacts)} threats (all of them without braking)"
    )
    print(f"and false activations in {sum(false)} of {len(false)} non-threats")
    if figure_path is not None:
        draw([np.array(env.get_episode_rewards()) for env in envs.venv.envs], figure_path)
    return model


def run_episode(model: PPO | None, envs: VecNormalize, seed: int) -> tuple[bool, bool]:
    """Run a level of the test split, without braking if there is no model; return contact and braking."""
    env = gym.make(ENV, split="test", conditions=["clear"])
    observation, info = env.reset(seed=seed)
    done = braked = False
    while not done:
        action = np.zeros(1, np.float32)
        if model is not None:
            scaled = envs.normalize_obs({key: value[None] for key, value in observation.items()})
            action = model.predict(scaled, deterministic=True)[0][0]
        observation, _, terminated, truncated, info = env.step(action)
        braked = braked or info["deceleration"] > NUISANCE
        done = terminated or truncated
    return info["collision"], braked


def draw(rewards: list[np.ndarray], path: Path) -> None:
    """Plot the sum of rewards of each training episode and its moving average over 20 episodes."""
    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    axis = figure.subplots()
    for index, values in enumerate(rewards):
        axis.plot(values, ".", color=COLOURS[2 + index], alpha=0.3, markersize=3)
        mean = np.convolve(values, np.ones(20) / 20, mode="valid")
        axis.plot(np.arange(mean.size) + 19, mean, color=COLOURS[2 + index], label=f"environment {index}")
    axis.set(xlabel="training episode", ylabel="sum of rewards")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000, *map(Path, sys.argv[2:3]), episodes=40)
