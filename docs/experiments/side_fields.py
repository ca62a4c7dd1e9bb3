# pyright: standard
# Not strict: Gymnasium and matplotlib state few types.
"""A picture of the fields at the sides of `policy:all-round`, with a crossing car and without it.

python docs/experiments/side_fields.py docs/side_fields.png
"""

import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.sides import SIDES, side_cameras

FAMILY, SEED = "CCCscp", 2  # of the validation levels
TIMES = (2.0, 1.5, 1.0, 0.5)  # before the contact [s]
ORDER = ("far_left", "middle_left", "near_left", "near_right", "middle_right", "far_right")


def main(path: Path, seed: int = SEED) -> np.ndarray:
    """Save the picture, and return the mean grey levels with and without the car, (2, fields, times)."""
    with_target = [film(FAMILY, camera_of(name), seed) for name in ORDER]
    without = [film(f"{FAMILY}WithoutTarget", camera_of(name), seed) for name in ORDER]
    contact = len(with_target[0])
    moments = [contact - round(FPS * time) for time in TIMES]
    heights = [pair.height_px for pair in SIDES.values()]
    figure, axes = plt.subplots(
        2 * len(TIMES), len(ORDER), figsize=(9.0, 3.4), gridspec_kw={"hspace": 0.12, "wspace": 0.04}
    )
    for row, (films, moment) in enumerate(
        (item, time) for item in (with_target, without) for time in moments
    ):
        for column, frames in enumerate(films):
            draw(axes[row, column], frames[moment], max(heights))
    for column, name in enumerate(ORDER):
        pair, side = SIDES[name.split("_")[0]], name.split("_")[1]
        axes[0, column].set_title(f"{side} {pair.yaw_deg:.0f}°", fontsize=8)
    for row, time in enumerate([*TIMES, *TIMES]):
        axes[row, 0].set_ylabel(f"{time} s", fontsize=7, rotation=0, ha="right", va="center")
    for row, label in ((0, "with the car"), (len(TIMES), "without it")):
        axes[row, -1].text(1.04, 0.5, label, transform=axes[row, -1].transAxes, fontsize=8, va="center")
    figure.savefig(path, dpi=130, bbox_inches="tight", pil_kwargs={"optimize": True})
    plt.close(figure)
    return np.array([[frames[moments].mean((1, 2)) for frames in item] for item in (with_target, without)])


def camera_of(name: str) -> dict[str, Any]:
    """Return the channel of a field with the DSN; that with the edges has the same camera."""
    return next(camera for camera in side_cameras() if camera["name"] == f"{name}_dsn")


def film(family: str, camera: dict[str, Any], seed: int) -> np.ndarray:
    """Return the frames of an episode without braking, uint8, (T, height, width)."""
    env = gym.make(
        "LGMD/RandomBraking-v0", families=[family], split="validation", camera=camera, include_frame=True
    )
    observation, _ = env.reset(seed=seed)
    frames, done = [], False
    while not done:
        frames.append(observation["frame"].reshape(camera["camera"]["shape"]))
        observation, _, terminated, truncated, _ = env.step(np.zeros(1, np.float32))
        done = terminated or truncated
    env.close()
    return np.array(frames)


def draw(axis: Any, frame: np.ndarray, height: int) -> None:
    """Draw a frame at the top of a field of a common height."""
    axis.imshow(frame, cmap="gray", vmin=0, vmax=255, aspect="equal")
    axis.set_ylim(height - 0.5, -0.5)
    axis.set_xticks([])
    axis.set_yticks([])
    for spine in axis.spines.values():
        spine.set_visible(False)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("side_fields.png"))
