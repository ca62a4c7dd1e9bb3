"""The picture of README: the composed view of an approach, a moment after the neuron's alert.

python docs/examples/picture.py docs/picture.png
"""

import sys
from pathlib import Path

import gymnasium as gym
from PIL import Image

from lgmd_gym import LGMDView
from lgmd_gym.agents import make_agent


def main(path: Path, ego_speed: float = 11.1, after: int = 8) -> None:
    """Save the view `after` decisions after the first alert of an approach at `ego_speed` [m/s]."""
    agent = make_agent("spike-threshold")
    title = f"LGMD/CCRs-v0 at {3.6 * ego_speed:.0f} km/h   {agent.name}"
    env = LGMDView(gym.make("LGMD/CCRs-v0", ego_speed=ego_speed, shade=60), title=title)
    observation, info = env.reset(seed=0)
    since_alert = 0
    while since_alert < after:
        action = agent.act(observation, info)
        picture = env.render()
        since_alert += bool(since_alert or agent.alert)
        observation, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            break
    Image.fromarray(picture).save(path, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "picture.png"))
