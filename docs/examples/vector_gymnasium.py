"""Plain Gymnasium: a braking rule on 64 environments, without a learning library.

    python docs/examples/vector_gymnasium.py

The rule brakes fully from the first alert of the neuron to the end of the episode.
"""

import gymnasium as gym
import numpy as np

import lgmd_gym  # noqa: F401  (registers the environments)


def main(num_envs: int = 64, steps: int = 600) -> tuple[int, int]:
    """Drive for a number of steps; return the number of episodes and of those with contact."""
    envs = gym.make_vec("LGMD/RandomBraking-v0", num_envs=num_envs, threads=2, split="validation")
    _, infos = envs.reset(seed=0)
    braking = np.zeros(num_envs, bool)
    ended = np.zeros(num_envs, bool)
    episodes = contacts = 0
    for _ in range(steps):
        braking |= infos["lgmd/alert"]
        actions = np.where(braking, -1.0, 0.0).astype(np.float32)[:, None]
        _, _, terminated, truncated, infos = envs.step(actions)
        # In the default mode "NextStep", the step after an end resets the environment.
        braking[ended] = False
        ended = terminated | truncated
        episodes += int(ended.sum())
        contacts += int((infos["collision"] & ended).sum())
    envs.close()
    print(f"{steps * num_envs} decisions: {episodes} episodes, contact in {contacts}")
    return episodes, contacts


if __name__ == "__main__":
    main()
