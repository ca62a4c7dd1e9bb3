"""Scenes and cameras of the golden frames.

Run `python tests/support/golden_frames.py` in the root of the project to write tests/golden/camera.npz anew
after an intended change of the rendering, and state the reason in the changelog.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from highway_env.vehicle.kinematics import Vehicle
from support.cameras import ego_camera
from support.roads import (
    add_car,
    add_figure,
    add_mark,
    add_obstacle,
    env_of,
    lens_x,
    ring_road,
    straight_env,
)

from lgmd_gym.camera import WEATHERS

PATH = Path(__file__).parents[1] / "golden" / "camera.npz"
SHAPE = (45, 80)
PRESETS = ("wide", "standard", "tele", "fovea")
OPTIONS = {
    "box": {"vehicles": "box", "seed": 7},
    "rail": {"guard_rail": True, "texture": 2.0},
    "panorama": {"panorama": "natural", "pitch_deg": 7.0, "roadside": 3.0},
    "mount": {"gaze": "path", "height_m": 1.6, "left_m": 0.4, "pitch_deg": -8.0, "yaw_deg": 12.0},
    "motion": {"road": "rough", "dive_deg": 0.3, "shutter_s": 0.03},
    "night-rail": {"light": "night", "guard_rail": True},
    "world-sunny": {"world": 11, "road": "normal"},
    "world-overcast": {"world": 1, "road": "rough"},
    "world-night": {"world": 4, "weather": "night"},
    "world-rain": {"world": 6, "weather": "rain"},
    "world-low-sun": {"world": 10, "weather": "low_sun"},
    "night-fog": {"light": "night", "visibility_m": 30.0},
    "world-night-fog": {"world": 4, "light": "night", "visibility_m": 60.0, "road": "rough"},
    "stopping": {"gaze": "stopping", "reach": 1.3, "lift": -0.6, "road": "rough", "stabiliser": "gyroscope"},
    "stopping-night": {"gaze": "stopping", "offset_m": 6.0, "span_m": 9.0, "light": "night"},
    "world-stopping": {"gaze": "stopping", "world": 6, "wet": True, "calibrated": True, "contrast_s": 0.5},
}
"""Camera fields that the golden frames cover in addition to the named weathers."""


def busy_road():
    """Return a straight road with moving cars, a truck, an oncoming car, obstacles and marks."""
    env = straight_env(x=0.3)
    env.steps = 3
    env.vehicle.action = {"steering": 0.06, "acceleration": -3.0}
    for k in range(5):
        car = add_car(env, 14.0 + 9.0 * k, 3.5 * (k % 3), 40 + 40 * k, heading=0.2 * k, speed=3.0 * k)
        car.action = {"acceleration": -2.0 * (k % 2), "steering": 0.0}
    add_car(env, 35.0, 7.5, heading=np.pi, speed=10.0)
    add_car(env, 60.0, 0.0, size=(12.0, 2.5, 3.4))
    add_obstacle(env, 30.0, 1.0)
    add_obstacle(env, 22.0, 6.0, shade=120)
    add_mark(env, 20.0, 4.5)
    add_mark(env, 25.0, 0.0, shade=40, size=(8.0, 3.0))
    add_mark(env, 15.0, 6.0, shade=180, size=(3.0, 2.0))
    return env


def curve():
    """Return a ring road with a car ahead."""
    road, lane = ring_road()
    env = env_of(road, Vehicle(road, lane.position(1.0, 0.0), lane.heading_at(1.0), 10.0), steps=5)
    add_car(env, *lane.position(15.0, 0.0), heading=lane.heading_at(15.0))
    return env


FIGURES = {
    "pedestrian-crossing": (("Pedestrian", 8.0, 5.0, np.pi / 2, 1.4, 0.5), {"world": 11}),
    "bicycle-night": (("Bicycle", 12.0, 4.5, 1.0, 4.2, 0.8), {"light": "night"}),
    "motorcycle-fog": (("Motorcycle", 14.0, 4.0, 0.1, 12.0, 3.0), {"visibility_m": 40.0}),
}
"""Kind, distance ahead, y, heading, speed and distance travelled of a figure, and camera fields."""


def road_with_figure(kind, ahead, y, heading, speed, travelled):
    """Return a straight road with one figure."""
    env = straight_env()
    x = lens_x(env) + ahead
    add_figure(env, kind, x, y, 70, heading=heading, speed=speed, travelled=travelled)
    return env


def golden_frames():
    """Return all frames by name, uint8, shape (45, 80)."""
    frames = {}
    for preset in PRESETS:
        for weather in WEATHERS:
            camera = ego_camera(preset, shape=SHAPE, weather=weather)
            frames[f"{preset}-{weather}"] = camera.render(busy_road())
        frames[f"{preset}-curve"] = ego_camera(preset, shape=SHAPE).render(curve())
    for name, fields in OPTIONS.items():
        frames[name] = ego_camera("wide", shape=SHAPE, **fields).render(busy_road())
    for name, (figure, fields) in FIGURES.items():
        camera = ego_camera("standard", shape=SHAPE, **fields)
        frames[name] = camera.render(road_with_figure(*figure))
    return frames


if __name__ == "__main__":
    np.savez_compressed(PATH, **golden_frames())
    print(f"{len(np.load(PATH).files)} frames in {PATH}")
