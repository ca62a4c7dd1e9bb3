"""What the cameras see of a braking environment, as the records of the camera."""

import math
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.objects import (
    BRAKE_LIGHT_MPS2,
    MAX_RANGE,
    MODEL_BICYCLE,
    MODEL_BOX,
    MODEL_CAR,
    MODEL_MARK,
    MODEL_MOTORCYCLE,
    MODEL_PEDESTRIAN,
)
from lgmd_gym.envs.dynamics.bodies import BICYCLE, CAR, MOTORCYCLE, PEDESTRIAN, ROAD_MARKING
from lgmd_gym.envs.dynamics.episode import Arrays, Physics
from lgmd_gym.kernels import kernel


class SceneArrays(NamedTuple):
    """What the cameras see, the environments along the first axis; see `SensorArray`."""

    scenes: np.ndarray  # `SCENE` records, shape (N,)
    objects: np.ndarray  # `OBJECT` records, shape (N, objects)
    counts: np.ndarray  # number of objects, int64, shape (N,)


@kernel(exact=True)
def write_scene(i: int, rate: float, physics: Arrays, arrays: Arrays) -> None:
    """Write the present state of environment i for its cameras.

    Args:
        i: Index of the environment.
        rate: Simulation frequency [Hz].
        physics: `Physics`.
        arrays: `SceneArrays`.
    """
    physics, arrays = Physics(*physics), SceneArrays(*arrays)
    bodies, count = physics.bodies[i], physics.episodes[i].bodies
    ego, scene, objects = bodies[0], arrays.scenes[i], arrays.objects[i]
    scene.x, scene.y, scene.heading, scene.speed = ego.x, ego.y, ego.heading, ego.speed
    scene.steering, scene.acceleration, scene.length = ego.steering, ego.acceleration, ego.length
    scene.steps = physics.episodes[i].steps
    scene.time_s = scene.steps / rate
    for k in range(1, count):
        body, item = bodies[k], objects[k - 1]
        item.x, item.y, item.speed = body.x, body.y, body.speed
        item.cos, item.sin = math.cos(body.heading), math.sin(body.heading)
        item.length, item.width, item.height, item.shade = body.length, body.width, body.height, body.shade
        item.range = MAX_RANGE
        item.model, item.travelled = _model_of(body.kind), body.travelled
        item.braking = 1 if body.kind == CAR and body.acceleration < BRAKE_LIGHT_MPS2 else 0
    arrays.counts[i] = count - 1


@kernel(exact=True)
def _model_of(kind: int) -> int:
    """Return the model that a kind of body is drawn with."""
    if kind == CAR:
        return MODEL_CAR
    if kind == ROAD_MARKING:
        return MODEL_MARK
    if kind == PEDESTRIAN:
        return MODEL_PEDESTRIAN
    if kind == BICYCLE:
        return MODEL_BICYCLE
    return MODEL_MOTORCYCLE if kind == MOTORCYCLE else MODEL_BOX
