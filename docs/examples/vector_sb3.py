"""stable-baselines3: PPO on the engine.

pip install -c constraints.txt ".[train]"
python docs/examples/vector_sb3.py 200000
"""

import sys

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecNormalize

from lgmd_gym.engine import SB3VecEnv

ENV = "LGMD/RandomBraking-v0"


def main(steps: int = 2048, num_envs: int = 16, episodes: int = 16) -> PPO:
    """Train on the training split, and print the mean return on levels of the validation split."""
    torch.set_num_threads(1)  # several threads slow down a network this small
    # Spike frequencies reach 300 and membrane potentials 1, so the observations are normalised.
    envs = VecNormalize(SB3VecEnv(ENV, num_envs, threads=2, split="train"), norm_reward=False)
    model = PPO("MultiInputPolicy", envs, n_steps=64, batch_size=256, seed=0, device="cpu")
    model.learn(steps)

    test = VecNormalize(SB3VecEnv(ENV, num_envs, threads=2, split="validation"), training=False)
    test.obs_rms, test.norm_reward = envs.obs_rms, False
    test.seed(0)
    mean, spread = evaluate_policy(model, test, n_eval_episodes=episodes)
    print(f"{model.num_timesteps} steps: return {mean:.2f} ± {spread:.2f} over {episodes} episodes")
    return model


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
