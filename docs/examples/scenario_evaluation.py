"""Scenario evaluation: time to contact at the neuron's alert, by speed and camera.

    python docs/examples/scenario_evaluation.py docs/tutorials/scenario_evaluation.png

No agent brakes, so that all cameras are compared on the same approach to a standing car. An early alert is
useful only if an empty road causes none; the script therefore counts alerts on an empty road too.
"""

import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
from matplotlib.figure import Figure

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym.plotting.style import COLOURS

# Delay of a demand: one camera frame, the dead time, and half of the linear build-up.
DELAY, DECELERATION = 1 / 30 + 0.1 + 0.2 / 2, 9.0  # [s], [m/s²]


def ttc_at_alert(camera: str, kmh: float, seed: int) -> float:
    """Return the time to contact [s] at the first alert without braking; NaN without an alert."""
    env = gym.make("LGMD/CCRs-v0", ego_speed=kmh / 3.6, camera=camera, world="laboratory")
    _, info = env.reset(seed=seed)
    hold = np.zeros(1, np.float32)
    while not info["collision"]:
        if info["lgmd/alert"]:
            return float(info["ttc"])
        *_, info = env.step(hold)
    return float("nan")


def alerts_on_empty_road(camera: str, kmh: float, seeds: int) -> int:
    """Return the number of seeds with an alert on an empty road."""
    env = gym.make("LGMD/EmptyRoad-v0", ego_speed=kmh / 3.6, camera=camera, world="laboratory")
    count = 0
    for seed in range(seeds):
        _, info = env.reset(seed=seed)
        done = alerted = False
        while not (done or alerted):
            *_, terminated, truncated, info = env.step(np.zeros(1, np.float32))
            done, alerted = terminated or truncated, bool(info["lgmd/alert"])
        count += alerted
    return count


def ttc_needed(kmh: float) -> float:
    """Return the time to contact [s] at which full braking just avoids contact with a standing car."""
    return DELAY + kmh / 3.6 / (2 * DECELERATION)


def main(
    picture: Path | None = None,
    cameras: tuple[str, ...] = ("wide", "tele", "fovea"),
    speeds: tuple[int, ...] = (10, 20, 30, 40, 50, 60),
    seeds: int = 5,
) -> dict[str, np.ndarray]:
    """Print the median over seeds; return all times per camera, each float64 of shape (speeds, seeds) [s]."""
    found = {
        camera: np.array([[ttc_at_alert(camera, kmh, seed) for seed in range(seeds)] for kmh in speeds])
        for camera in cameras
    }
    empty = {
        camera: np.array([alerts_on_empty_road(camera, kmh, seeds) for kmh in speeds]) for camera in cameras
    }
    print("time to contact at the alert, median (in brackets: seeds with an alert on an empty road)")
    print("km/h   " + "".join(f"{camera:>16}" for camera in cameras) + "    needed")
    for row, kmh in enumerate(speeds):
        cells = [
            f"{np.median(found[camera][row]):8.2f} s ({empty[camera][row]}/{seeds})" for camera in cameras
        ]
        print(f"{kmh:4}   " + "".join(cells) + f"{ttc_needed(kmh):8.2f} s")
    if picture is not None:
        draw(found, empty, speeds, picture)
    return found


def draw(
    found: dict[str, np.ndarray], empty: dict[str, np.ndarray], speeds: tuple[int, ...], picture: Path
) -> None:
    """Plot medians as lines and seeds as dots; hollow markers mean alerts on an empty road."""
    figure = Figure(figsize=(7.5, 3.8), layout="constrained")
    axis = figure.subplots()
    for index, (camera, values) in enumerate(found.items()):
        colour, marker = COLOURS[1 + index], "osv^"[index % 4]
        medians = np.median(values, axis=1)
        axis.plot(speeds, medians, color=colour, marker=marker, label=camera)
        doubtful = np.where(empty[camera] > 0, medians, np.nan)
        axis.plot(speeds, doubtful, color=colour, marker=marker, markerfacecolor="white", linestyle="")
        axis.plot(speeds, values, ".", color=colour, alpha=0.4, markersize=4)
    smooth = np.linspace(speeds[0], speeds[-1], 50)
    axis.plot(smooth, [ttc_needed(kmh) for kmh in smooth], "--", color="0.4", label="needed to stop")
    axis.plot([], [], "o", color="0.4", markerfacecolor="white", label="alerts on an empty road too")
    axis.set(xlabel="ego speed [km/h]", ylabel="time to contact at the alert [s]", ylim=(0, None))
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main(*[Path(item) for item in sys.argv[1:2]])
