"""Random cameras in random scenes: `python tests/fuzz/camera.py --seconds 60`.

Every frame must be finite and within bounds, equal when it is drawn again, by a new camera, and by a sensor
array with a second camera, and it must leave the drawing memory empty.
"""

import functools
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]

from highway_env.vehicle.kinematics import Vehicle
from support.cameras import Rig, ego_camera, rig
from support.fuzz import run_cases
from support.roads import (
    FIGURES,
    add_car,
    add_figure,
    add_mark,
    add_obstacle,
    env_of,
    ring_road,
    straight_env,
)

from lgmd_gym import LGMDParams
from lgmd_gym.sensing.sensor_array import SensorArray

IDS = (
    *("highway-v0", "merge-v1", "intersection-v2", "roundabout-v1", "racetrack-v1", "parking-v0"),
    *("two-way-v0", "LGMD/CCRs-v0", "LGMD/Oncoming-v0", "LGMD/CurveGuardRail-v0", "LGMD/BridgeShadow-v0"),
)
LIGHT_BOUNDS = (-1.0, 500.0)  # [grey levels], for natural contrast without noise; halos add up to 200


def draw_camera(rng, name, shape):
    """Return a random camera and scene."""
    choice, stopping = rng.choice, rng.random() < 0.2
    gaze = {"gaze": str(choice(["fixed", "path"]))}
    if stopping:
        gaze = {
            "gaze": "stopping",
            "reach": float(rng.uniform(0.2, 3.0)),
            "span_m": float(rng.uniform(0.2, 6.0)),
            "offset_m": float(rng.uniform(-20.0, 20.0)),
            "lift": float(rng.uniform(-1.5, 0.5)),
        }
    return rig(
        name=name,
        shape=shape,
        hfov_deg=float(rng.uniform(2.0, 160.0)),
        height_m=float(choice([0.05, 1.2, 5.0])),
        setback_m=float(rng.uniform(1.2 if stopping else -3.0, 5.0)),
        left_m=float(rng.uniform(-1.0, 1.0)),
        pitch_deg=float(choice([0.0, rng.uniform(-60.0, 60.0)])),
        yaw_deg=float(choice([0.0, rng.uniform(-360.0, 360.0)])),
        stabiliser="gyroscope" if rng.integers(2) else None,
        calibrated=bool(rng.integers(2)),
        texture=float(choice([0.0, 1.0])),
        roadside=float(choice([0.0, 1.0, 4.0])),
        vehicles=str(choice(["car", "box"])),
        panorama="natural" if not stopping and rng.random() < 0.1 else "skyline",
        guard_rail=bool(rng.integers(2)),
        seed=int(rng.integers(2)),
        light=str(choice(["day", "night"])),
        upper_beam=bool(rng.random() < 0.3),
        visibility_m=float(choice([0.0, 0.0, 1e-3, 1.0, 5.0, 100.0])),
        road=str(choice(["still", "rough"])),
        dive_deg=float(choice([0.0, 0.1])),
        shutter_s=float(choice([0.0, 0.0, 0.03])),
        linear_light=bool(rng.integers(2)),
        auto_exposure_s=float(choice([0.0, 0.2])),
        **gaze,
    )


def draw_scene(rng):
    """Return the description of a random scene and its environment."""
    kind = rng.integers(3)
    if kind == 0:
        name, seed = str(rng.choice(IDS)), int(rng.integers(4))
        return f"{name} seed {seed}", registered(name, seed)
    if kind == 1:
        road, lane = ring_road(clockwise=bool(rng.integers(2)))
        along = float(rng.uniform(0.0, lane.length))
        env = env_of(road, Vehicle(road, lane.position(along, 0.0), lane.heading_at(along), 10.0))
    else:
        env = straight_env(int(rng.integers(1, 6)), heading=float(rng.uniform(-4.0, 4.0)), speed=20.0)
    env.steps = int(rng.integers(1000))
    env.vehicle.action = {
        "steering": float(rng.uniform(-0.7, 0.7)),
        "acceleration": float(rng.uniform(-9, 3)),
    }
    x, y = env.vehicle.position
    for _ in range(rng.integers(0, 30)):
        at = x + rng.normal(0.0, float(rng.choice([3.0, 60.0]))), y + rng.normal(0.0, 8.0)
        body = rng.integers(8)
        if body == 0:
            add_mark(env, *at, size=tuple(rng.uniform(0.1, 20.0, 2)))
        elif body == 1:
            add_obstacle(env, *at)
        elif body == 2:
            add_random_figure(env, rng, *at)
        else:
            size, speed = rng.uniform((0.1, 0.1, 0.1), (30.0, 5.0, 5.0)), float(rng.uniform(-40.0, 40.0))
            add_car(env, *at, heading=float(rng.uniform(-4.0, 4.0)), size=tuple(size), speed=speed)
    return ("ring" if kind == 1 else "straight"), env


def add_random_figure(env, rng, x, y):
    """Add a pedestrian or a two-wheeler, of its usual size or of a size without proportion."""
    kind, size = str(rng.choice(list(FIGURES))), None
    if rng.random() < 0.3:
        size = tuple(rng.uniform((0.1, 0.1, 0.1), (3.0, 1.0, 3.0)))
    heading, speed, travelled = rng.uniform((-4.0, -2.0, -50.0), (4.0, 10.0, 50.0)).tolist()
    add_figure(env, kind, x, y, heading=heading, size=size, speed=speed, travelled=travelled)


@functools.cache
def registered(name, seed):
    """Return an environment after its reset."""
    env = gym.make(name)
    env.reset(seed=seed)
    return env.unwrapped


def check(env, cameras, noise):
    """Draw the frames of two cameras, and compare them with those of a sensor array."""
    frames = []
    for params in cameras:
        camera = ego_camera(params)
        frame = camera.render(env)
        assert np.isfinite(camera.light).all()
        low, high = LIGHT_BOUNDS
        assert low <= camera.light.min(), camera.light.min()
        assert camera.light.max() <= high, camera.light.max()
        assert not camera.buffers.ground.any()
        assert not camera.buffers.solids.any()
        assert np.array_equal(camera.render(env), frame)
        frames.append(ego_camera(params, read_noise=noise, shot_noise=noise).render(env))
        assert noise or np.array_equal(frames[-1], frame)
    noisy = [rig(params, read_noise=noise, shot_noise=noise).camera for params in cameras]
    array = SensorArray(noisy, 30.0, LGMDParams())
    array.set_scene(0, cameras[0].scene)
    for _ in range(2):
        array.read(env)
        array.process(0, 1)
        for index, frame in enumerate(frames):
            assert np.array_equal(array.frame_of(index), frame), f"camera {index} of the sensor array"
    array.close()


def draw_case(rng):
    """Return the description of a random scene with two cameras, and its checks."""
    text, env = draw_scene(rng)
    shape = tuple(rng.integers(4, 64, 2).tolist())
    other = shape if rng.integers(2) else tuple(rng.integers(4, 64, 2).tolist())
    first, second = draw_camera(rng, "one", shape), draw_camera(rng, "two", other)
    scene = rig(first, panorama="skyline").scene if second.camera.gaze.kind == "stopping" else first.scene
    cameras = [Rig(first.camera, scene), Rig(second.camera, scene)]
    noise = float(rng.choice([0.0, 3.0]))
    return f"{text} {cameras}", lambda: check(env, cameras, noise)


if __name__ == "__main__":
    sys.exit(run_cases(draw_case, __doc__))
