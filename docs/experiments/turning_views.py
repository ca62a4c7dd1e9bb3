"""A picture of what an LGMD at the side of a turning car responds to, with and without derotation.

python docs/experiments/turning_views.py docs/turning_views.png

The car turns across the path of an oncoming car (a validation level of CCFtap). The picture shows a field at
the side and the change of light |P| of its LGMD. Without derotation the whole image moves; with it, mostly
the oncoming car causes a change.
"""

import sys
from pathlib import Path

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.sides import side_cameras

FAMILY, SEED, FIELD = "CCFtap", 6, "middle_right_dsn"
TIMES = (1.6, 1.3, 1.0, 0.7)  # before the contact [s]
BRIGHTEST = 60.0  # |P| that is drawn white [grey levels]


def main(path: Path, seed: int = SEED) -> np.ndarray:
    """Save the picture, and return the mean |P| without and with derotation, (2, times)."""
    frames, changes, yaw_rates = film(seed)
    moments = [len(frames) - round(FPS * time) for time in TIMES]
    figure, axes = plt.subplots(
        3, len(TIMES), figsize=(9.0, 1.6), gridspec_kw={"hspace": 0.1, "wspace": 0.04}
    )
    for column, (time, moment) in enumerate(zip(TIMES, moments, strict=True)):
        turn = np.degrees(yaw_rates[moment])
        axes[0, column].set_title(f"{time} s, {abs(turn):.0f}°/s", fontsize=8)
        axes[0, column].imshow(frames[moment], cmap="gray", vmin=0, vmax=255)
        for row in range(2):
            axes[1 + row, column].imshow(changes[moment, row], cmap="gray", vmin=0, vmax=BRIGHTEST)
    for axis in axes.flat:
        axis.set_xticks([])
        axis.set_yticks([])
    for axis, label in zip(axes[:, 0], ("frame", "not derotated", "derotated"), strict=True):
        axis.set_ylabel(label, fontsize=8, rotation=0, ha="right", va="center")
    figure.savefig(path, dpi=130, bbox_inches="tight", pil_kwargs={"optimize": True})
    plt.close(figure)
    return changes[moments].mean((2, 3)).T


def film(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an episode without braking.

    Returns:
        Derotated frames, uint8, (T, height, width); |P| without and with derotation, (T, 2, height, width);
        and the yaw rate of the car, (T,) [rad/s].
    """
    channel = next(item for item in side_cameras() if item["name"] == FIELD)
    cameras = [
        channel["camera"] | {"name": str(flag), "gaze": {"kind": "path", "derotated": flag}}
        for flag in (False, True)
    ]
    env = gym.make("LGMD/RandomBraking-v0", families=[FAMILY], split="validation", camera=cameras)
    observation, _ = env.reset(seed=seed)
    sensors = env.get_wrapper_attr("sensors")
    frames, changes, yaw_rates, done = [], [], [], False
    while not done:
        frames.append(sensors.frame_of(1).copy())
        changes.append([np.abs(sensors.layers(index)["P"]) for index in range(2)])
        yaw_rates.append(observation["ego_yaw_rate"][0])
        observation, _, terminated, truncated, _ = env.step(np.zeros(1, np.float32))
        done = terminated or truncated
    env.close()
    return np.array(frames), np.array(changes), np.array(yaw_rates)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("turning_views.png"))
