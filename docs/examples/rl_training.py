"""RL training: stable-baselines3's PPO learns when to brake from spike frequency and own speed.

    pip install "lgmd-gym[train]"
    python docs/examples/rl_training.py 20000

Two thousand steps show that everything fits together; a policy worth showing takes far more.
"""

import sys

import gymnasium as gym
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

import lgmd_gym  # noqa: F401  (registers the environments)


def main(steps: int = 2000) -> PPO:
    """Train for `steps` and play one episode with what was learned."""
    envs = make_vec_env("LGMD/CCRs-v0", n_envs=2, seed=0)
    # Spike frequencies reach 300, potentials 1: scale both before a network sees them.
    envs = VecNormalize(envs, norm_reward=False)
    model = PPO("MultiInputPolicy", envs, n_steps=256, batch_size=128, seed=0, device="cpu")
    model.learn(steps)

    env = gym.make("LGMD/CCRs-v0")
    observation, info = env.reset(seed=1000)
    done = False
    while not done:
        scaled = envs.normalize_obs({key: value[None] for key, value in observation.items()})
        action, _ = model.predict(scaled, deterministic=True)
        observation, _, terminated, truncated, info = env.step(action[0])
        done = terminated or truncated
    ended = "contact" if info["collision"] else "no contact"
    print(f"{steps} steps: {ended} at {3.6 * info['ego_speed']:.0f} km/h, {info['gap']:.1f} m ahead")
    return model


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
