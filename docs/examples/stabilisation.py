"""Image stabilisation: rotation of the body that is left by the registration of a far-field image.

    python docs/examples/stabilisation.py --worlds 8

In validation worlds, the ego drives 5 s on a normal road without traffic, behind a car, and past oncoming
cars. The table has the RMS of pitch, roll and yaw [degrees] of the body, of the same after subtraction of the
estimate, and of what the gyroscope of `stabilised=True` leaves. The last line is the time of a registration.
"""

import argparse
from collections.abc import Sequence
from time import perf_counter
from typing import NamedTuple

import gymnasium as gym
import numpy as np

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym.camera import CameraParams, EgoCamera
from lgmd_gym.camera.body_motion import PITCH, ROLL, YAW, body_motion, residual_motion, road_gain
from lgmd_gym.camera.params import ROADS
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.sensing.image_stabiliser import far_camera
from lgmd_gym.sensing.registration import FarFieldRegistration

TRAFFIC = {"empty road": "EmptyRoad", "behind a car": "Following", "oncoming cars": "Oncoming"}
SPEEDS = (10.0, 17.0, 25.0)  # [m/s]
CONDITIONS = ("clear", "night", "rain", "fog")
ROAD, FPS = "normal", 30.0
STEP = 137  # between the numbers of the worlds


class Drive(NamedTuple):
    """Rotations of one drive, float64, shape (frames, 3): pitch, roll and yaw [degrees].

    Attributes:
        body: Rotation of the body.
        image: The same without the estimate of the registration.
        gyroscope: Rotation that a gyroscope leaves.
        seconds: Time of the registrations of all frames [s].
    """

    body: np.ndarray
    image: np.ndarray
    gyroscope: np.ndarray
    seconds: float


def drive(family: str, world: int, condition: str, speed: float, frames: int) -> Drive:
    """Return the rotations of a drive in an environment of a family at a speed [m/s]."""
    env = gym.make(f"LGMD/{family}-v0", camera=None, world=world, condition=condition, ego_speed=speed)
    env.reset(seed=world)
    rows = []
    fields = {**env.get_wrapper_attr("camera_fields"), "road": ROAD}
    far = far_camera([CameraParams.make("fovea", stabilised="image", **fields)])
    assert far is not None
    camera, registration = EgoCamera(far), FarFieldRegistration(far.shape, FPS, far.focal_px)
    registration.step(EgoCamera(far, road="still").render(env)[None])
    seconds = 0.0
    for k in range(frames):
        frame, gain = camera.render(env)[None], road_gain(ROADS[ROAD], speed)
        start = perf_counter()
        estimate = registration.step(frame)[0].copy()
        seconds += perf_counter() - start
        rows.append(
            [
                [gain * motion(world, axis, k / FPS) for axis in (PITCH, ROLL, YAW)]
                for motion in (body_motion, residual_motion)
            ]
            + [estimate]
        )
        if env.step(np.zeros(1, np.float32))[3]:
            break
    env.close()
    body, gyroscope, estimates = np.array(rows).transpose(1, 0, 2)
    return Drive(body, body - estimates, gyroscope, seconds)


def rms(drives: Sequence[Drive], kind: str) -> np.ndarray:
    """Return the RMS of pitch, roll and yaw over the frames of drives [degrees]."""
    return np.sqrt(np.mean(np.concatenate([getattr(each, kind) for each in drives]) ** 2, axis=0))


def main(arguments: Sequence[str] | None = None) -> dict[str, list[Drive]]:
    """Print the table and return the drives by condition, and by traffic."""
    parser = argparse.ArgumentParser(description="Residual rotation with image stabilisation")
    parser.add_argument("--worlds", type=int, default=8)
    parser.add_argument("--conditions", nargs="+", choices=CONDITIONS, default=CONDITIONS)
    parser.add_argument("--frames", type=int, default=150)
    chosen = parser.parse_args(arguments)
    first, drives = SPLIT_WORLDS["validation"].start, {}
    for condition in chosen.conditions:
        for number in range(chosen.worlds):
            for k, (traffic, family) in enumerate(TRAFFIC.items()):
                speed = SPEEDS[(number + k) % len(SPEEDS)]
                done = drive(family, first + STEP * number, condition, speed, chosen.frames)
                drives.setdefault(condition, []).append(done)
                drives.setdefault(traffic, []).append(done)
    titles = [
        f"{axis}, {kind}" for axis in ("pitch", "roll", "yaw") for kind in ("body", "image", "gyroscope")
    ]
    print(f"| RMS [degrees] | {' | '.join(titles)} |\n|---|{'---|' * len(titles)}")
    for name, members in drives.items():
        values = np.array([rms(members, kind) for kind in ("body", "image", "gyroscope")]).T.ravel()
        print(f"| {name} | {' | '.join(f'{value:.4f}' for value in values)} |")
    every = [each for condition in chosen.conditions for each in drives[condition]]
    time_us = 1e6 * sum(each.seconds for each in every) / sum(len(each.body) for each in every)
    print(f"{time_us:.0f} µs per registration")
    return drives


if __name__ == "__main__":
    main()
