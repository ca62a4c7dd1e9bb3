"""Compiled steps of a range of environments; Python is called neither per environment nor per step."""

import math
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.objects import BRAKE_LIGHT_MPS2, MAX_RANGE, MODEL_BOX, MODEL_CAR, MODEL_MARK
from lgmd_gym.envs.decisions import Clock
from lgmd_gym.envs.dynamics.bodies import BOX, CAR
from lgmd_gym.envs.dynamics.episode import Physics, step_environment
from lgmd_gym.envs.dynamics.jit import compiled


class View(NamedTuple):
    """What the cameras see, the environments along the first axis; see `SensorArray`.

    Attributes:
        scenes: `SCENE` records, shape (N,).
        objects: `OBJECT` records, shape (N, objects).
        counts: Number of objects, int64, shape (N,).
    """

    scenes: np.ndarray
    objects: np.ndarray
    counts: np.ndarray


@compiled
def advance(
    first: int, last: int, stride: int, rate: float, physics: Physics, clock: Clock, view: View
) -> bool:
    """Advance each environment up to its next camera frame, at most to the end of its decision.

    Args:
        first: First environment.
        last: Last environment + 1.
        stride: Simulation steps per camera frame.
        rate: Simulation frequency [Hz].
        physics: `Physics`.
        clock: `Clock`.
        view: `View`; written for the environments with a frame.

    Returns:
        Whether a frame is due in any of the environments, see `Clock.due`.
    """
    physics, clock, view = Physics(*physics), Clock(*clock), View(*view)
    any_due = False
    for i in range(first, last):
        clock.due[i] = False
        episode = physics.episodes[i]
        while clock.remaining[i] > 0 and not clock.due[i]:
            step_environment(i, 1.0 / rate, physics)
            clock.remaining[i] -= 1
            # highway-env counts a step after the frame of that step.
            clock.due[i] = (episode.steps + 1) % stride == 0
            if clock.due[i]:
                show(i, rate, physics, view)
                any_due = True
            episode.steps += 1
    return any_due


@compiled
def show(i: int, rate: float, physics: Physics, view: View) -> None:
    """Write the present state of environment i for its cameras."""
    bodies, count = physics.bodies[i], physics.episodes[i].bodies
    ego, scene, objects = bodies[0], view.scenes[i], view.objects[i]
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
        item.model = MODEL_CAR if body.kind == CAR else MODEL_BOX if body.kind == BOX else MODEL_MARK
        item.braking = 1 if body.kind == CAR and body.acceleration < BRAKE_LIGHT_MPS2 else 0
    view.counts[i] = count - 1


@compiled
def show_episodes(
    first: int, last: int, rate: float, selected: np.ndarray, physics: Physics, view: View
) -> None:
    """Write the present state of the selected environments for their cameras."""
    physics, view = Physics(*physics), View(*view)
    for i in range(first, last):
        if selected[i]:
            show(i, rate, physics, view)
