"""The picture and the GIF of the README: an approach to a standing car.

python docs/experiments/picture.py docs/picture.png docs/approach.gif
"""

import sys
from pathlib import Path

import gymnasium as gym
from PIL import Image

from lgmd_gym import LGMDView
from lgmd_gym.agents import make_agent
from lgmd_gym.rendering.canvas import PINK, RED, SKY, UNLIT, YELLOW

START, EVERY, WIDTH = 2.0, 3, 800  # start of the film [s], decisions per film frame, width [px]

# Colours of small areas (signals, vehicles in the top view), which pixel counts would drop from the palette.
SIGNALS = (SKY, YELLOW, RED, PINK, UNLIT, (50, 200, 0), (100, 200, 255))


def main(path: Path, film: Path | None = None, ego_speed: float = 11.1, after: int = 8) -> None:
    """Save the view `after` decisions after the first alert of an approach at `ego_speed` [m/s].

    Args:
        path: Picture file.
        film: GIF file of the whole approach; without it, the approach ends at the picture.
        ego_speed: Ego speed [m/s].
        after: Number of decisions from the alert to the picture.
    """
    agent = make_agent("spike-threshold")
    title = f"LGMD/CCRs-v0 at {3.6 * ego_speed:.0f} km/h   {agent.name}"
    env = LGMDView(gym.make("LGMD/CCRs-v0", ego_speed=ego_speed, shade=60, world="laboratory"), title=title)
    observation, info = env.reset(seed=0)
    decisions = since_alert = 0
    done, pictures = False, []
    while not done:
        action = agent.act(observation, info)
        env.agent_alert = agent.alert
        since_alert += bool(since_alert or agent.alert)
        if since_alert == after:
            Image.fromarray(env.render()).save(path, optimize=True)
            if film is None:
                return
        if film is not None and decisions >= START * 30 and decisions % EVERY == 0:
            pictures.append(Image.fromarray(env.render()).resize((WIDTH, WIDTH * 9 // 16)))
        observation, _, terminated, truncated, info = env.step(action)
        done, decisions = terminated or truncated, decisions + 1
    if film is not None:
        save_gif([*pictures, *pictures[-1:] * 8], film)


def save_gif(pictures: list[Image.Image], path: Path) -> None:
    """Save a GIF with one palette and no dithering, which would flicker and increase the file size."""
    common = pictures[-10].quantize(96).getpalette()[: 3 * 96]
    palette = Image.new("P", (1, 1))
    palette.putpalette([*common, *(value for colour in SIGNALS for value in colour)])
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=1000 * EVERY // 30, loop=0)


if __name__ == "__main__":
    main(*[Path(item) for item in sys.argv[1:3]] or [Path("picture.png")])
