"""RL training: DQN of stable-baselines3 learns when to brake.

    pip install -c constraints.txt ".[train]"
    python docs/examples/rl_training.py 96000

A few thousand decisions only show that the parts work together.
"""

import sys

import gymnasium as gym
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.evaluation import evaluate_policy

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.training.policy_env import PolicyVecEnv

FEATURES = FeatureConfig(
    inputs=("zones", "ego_speed", "ego_yaw_rate"),  # 17 neurons with averages over time; no gap, no TTC
    history=1,
    repeat=8,  # 30 Hz / 8 = 3.75 decisions per second
    latch=True,  # the first braking is held until the episode ends
    reward_scale=0.1,
)
ACTIONS = {"type": "DiscreteDemand", "demands": [0.0, -1.0]}  # hold the speed, or brake fully
REWARD = {"contact": 6.0, "impact": 6.0}


def make_envs(split: str, num_envs: int) -> PolicyVecEnv:
    """Return environments that draw a level of a split at each reset."""
    envs = gym.make_vec(
        "LGMD/RandomBraking-v0",
        num_envs=num_envs,
        split=split,
        camera=make_agent("stopping-zone").camera,
        config={"action": ACTIONS, "reward": REWARD},
        autoreset_mode="Disabled",  # PolicyVecEnv restarts the environments
        threads=2,
    )
    return PolicyVecEnv(envs.unwrapped, FEATURES)


def main(steps: int = 2000, num_envs: int = 32, episodes: int = 96) -> DQN:
    """Train on the training split and print the mean return on levels of the validation split."""
    torch.set_num_threads(1)  # several threads slow down a network this small
    envs = make_envs("train", num_envs)
    model = DQN(
        "MultiInputPolicy",
        envs,
        learning_rate=lambda remaining: 1e-3 * remaining,
        buffer_size=steps,
        batch_size=256,
        gamma=1.0,
        target_update_interval=1000,
        train_freq=1,
        gradient_steps=2,
        learning_starts=640,
        exploration_initial_eps=0.03,  # half of the random actions brake, and the brake latches
        exploration_fraction=0.5,
        exploration_final_eps=0.003,
        policy_kwargs={"net_arch": [256, 256]},
        seed=0,
        device="cpu",
    )
    model.learn(steps)

    validation = make_envs("validation", num_envs)
    validation.seed(10_000)
    mean, spread = evaluate_policy(model, validation, n_eval_episodes=episodes)
    print(f"{model.num_timesteps} decisions: return {mean:.2f} ± {spread:.2f} over {episodes} episodes")
    return model


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
