"""Single camera frames of highway-env's roads, and of every camera preset under every condition."""

import warnings
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.camera import CameraParams, EgoCamera
from lgmd_gym.camera.params import CONDITIONS, PRESETS

# Environment id -> seed and number of simulation steps after which vehicles are in view.
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
CAMERAS = ("wide", "standard", "tele", "fovea")
APPROACH_DECISIONS = 90  # decisions of an approach at 8 m/s, after which the target is 16 m ahead


def road_sheet(roads: tuple[str, ...], conditions: tuple[str, ...]) -> dict[str, dict[str, np.ndarray]]:
    """Return frames of the wide camera by road and condition, uint8, shape (height, width)."""
    wide = CameraParams.preset("wide")
    cameras = {name: EgoCamera(wide.with_condition(name)) for name in conditions}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # highway-env's warnings about its own spaces and versions
        return {env_id: _road_frames(env_id, cameras) for env_id in roads}


def camera_sheet() -> dict[str, dict[str, np.ndarray]]:
    """Return frames of the same approach by camera preset and condition, uint8, shape (height, width)."""
    env: Any = gym.make("LGMD/CCRs-v0", ego_speed=8.0, shade=60, camera=None)
    env.reset(seed=0)
    for _ in range(APPROACH_DECISIONS):
        env.step([0.0])
    return {
        preset: {name: EgoCamera(PRESETS[preset].with_condition(name)).render(env) for name in CONDITIONS}
        for preset in CAMERAS
    }


def _road_frames(env_id: str, cameras: dict[str, EgoCamera]) -> dict[str, np.ndarray]:
    """Return one frame per camera after some simulation steps without steering or braking."""
    import highway_env  # noqa: F401  (registers the environments)

    seed, steps = ROADS[env_id]
    config = {"simulation_frequency": 30, "policy_frequency": 30}
    if env_id in ("highway-v0", "exit-v0"):
        config["vehicles_count"] = 8
    env: Any = gym.make(env_id, config=config).unwrapped
    env.reset(seed=seed)
    for _ in range(steps):
        env.road.act()
        env.road.step(1 / 30)
        env.steps += 1
    frames = {name: camera.render(env) for name, camera in cameras.items()}
    env.close()
    return frames
