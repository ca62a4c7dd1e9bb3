"""The films of the landing page, from the panels of `LGMDView`.

python docs/films.py docs/films
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, cast

import gymnasium as gym
import numpy as np
from PIL import Image

from lgmd_gym import LGMDView
from lgmd_gym.agents import make_agent
from lgmd_gym.rendering.canvas import BACKGROUND, PixelBox

WIDTH, EVERY, HOLD_S = 480, 3, 1.0  # width [px], decisions per film frame, time of the last frame [s]
QUALITY = 55  # of WebP
# Parts of the dashboard, one below the other.
LAMPS, CAMERA, TRACE = (752, 8, 1260, 50), (24, 60, 824, 510), (20, 536, 652, 714)
LAYERS, MOTION = (844, 56, 1260, 334), (848, 60, 1044, 192)


class Film(NamedTuple):
    """One film.

    Attributes:
        id: Id of the environment.
        arguments: Arguments of the environment.
        panels: Parts of the dashboard.
        agent: Agent that drives.
        start: Time at which the film starts [s].
        end: Time at which it ends if the episode has not [s].
    """

    id: str
    arguments: dict[str, Any]
    panels: tuple[PixelBox, ...] = (LAMPS, CAMERA, TRACE)
    agent: str = "spike-threshold"
    start: float = 2.0
    end: float = 8.0


FILMS = {
    "braking": Film("LGMD/CCRb-v0", {"world": "laboratory"}),
    "cut-in": Film("LGMD/CutIn-v0", {"world": "laboratory"}),
    "pedestrian": Film("LGMD/CPNA-v0", {"world": "laboratory", "camera": "standard"}),
    "layers": Film("LGMD/CCRs-v0", {"world": 8003}, (LAMPS, CAMERA, LAYERS), "ttc-oracle"),
    "dsn": Film(
        "LGMD/CPFA-v0",
        {"world": "laboratory", "camera": "standard", "neuron": "dsn"},
        (LAMPS, CAMERA, MOTION),
        "ttc-oracle",
    ),
}


def pictures(film: Film) -> Iterator[Image.Image]:
    """Yield the frames of a film."""
    agent = make_agent(film.agent)
    env = LGMDView(gym.make(film.id, **film.arguments))
    observation, info = env.reset(seed=0)
    agent.reset(0)
    rate = env.metadata["render_fps"]
    for decision in range(round(film.end * rate)):
        action = agent.act(observation, info)
        env.agent_alert = agent.alert
        if decision >= film.start * rate and decision % EVERY == 0:
            yield stacked(cast(np.ndarray, env.render()), film.panels)
        observation, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            break
    yield stacked(cast(np.ndarray, env.render()), film.panels)
    env.close()


def stacked(picture: np.ndarray, panels: tuple[PixelBox, ...]) -> Image.Image:
    """Return the panels of a dashboard one below the other, with the width of the films."""
    parts = [Image.fromarray(picture).crop(box) for box in panels]
    parts = [part.resize((WIDTH, round(part.height * WIDTH / part.width))) for part in parts]
    image = Image.new("RGB", (WIDTH, sum(part.height for part in parts)), BACKGROUND)
    top = 0
    for part in parts:
        image.paste(part, (0, top))
        top += part.height
    return image


def save(frames: list[Image.Image], path: Path) -> None:
    """Save a film as an animated WebP."""
    interval = 1000 * EVERY // 30
    durations = [interval] * (len(frames) - 1) + [round(1000 * HOLD_S)]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=QUALITY, method=3
    )


def main(folder: Path, names: list[str]) -> None:
    """Write the films with the given names, or all, to a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names or FILMS:
        save(list(pictures(FILMS[name])), folder / f"{name}.webp")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "films"), sys.argv[2:])
