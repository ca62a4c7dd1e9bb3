"""What the eye sees: every road of highway-env under every condition, in one picture.

    python docs/examples/contact_sheet.py docs/contact_sheet.png

The same camera, the same moment; only the condition changes.
"""

import sys
import warnings
from pathlib import Path

import gymnasium as gym
import highway_env  # noqa: F401  (registers the environments)
import numpy as np

from lgmd_gym import CameraParams, EgoCamera
from lgmd_gym.plots import contact_sheet

# Road: seed and simulation steps that have something to see.
ROADS = {
    "highway-v0": (1, 30),
    "merge-v0": (0, 60),
    "roundabout-v0": (0, 60),
    "intersection-v0": (2, 40),
    "racetrack-v0": (3, 15),
    "exit-v0": (1, 30),
    "two-way-v0": (0, 45),
    "lane-keeping-v0": (0, 15),
    "u-turn-v0": (0, 30),
    "parking-v0": (2, 10),
}
CONDITIONS = ("clear", "night", "fog", "robust")


def road_frames(env_id: str, cameras: dict[str, EgoCamera]) -> dict[str, np.ndarray]:
    """Drive on for a while without steering or braking, then render one frame per camera."""
    seed, steps = ROADS[env_id]
    config = {"simulation_frequency": 30, "policy_frequency": 30}
    if env_id in ("highway-v0", "exit-v0"):
        config["vehicles_count"] = 8
    env = gym.make(env_id, config=config).unwrapped
    env.reset(seed=seed)
    for _ in range(steps):
        env.road.act()
        env.road.step(1 / 30)
        env.steps += 1
    frames = {name: camera.render(env) for name, camera in cameras.items()}
    env.close()
    return frames


def main(
    path: str | Path = "docs/contact_sheet.png", quick: bool = False
) -> dict[str, dict[str, np.ndarray]]:
    """Draw the sheet; `quick` takes two roads and two conditions."""
    roads = list(ROADS)[:2] if quick else list(ROADS)
    conditions = CONDITIONS[:2] if quick else CONDITIONS
    wide = CameraParams.preset("wide")
    cameras = {name: EgoCamera(wide.with_condition(name)) for name in conditions}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # highway-env's remarks on its own spaces and versions
        sheet = {env_id: road_frames(env_id, cameras) for env_id in roads}
    contact_sheet(Path(path), sheet)
    print(f"{len(roads)} roads under {len(conditions)} conditions: {path}")
    return sheet


if __name__ == "__main__":
    main(*sys.argv[1:2])
