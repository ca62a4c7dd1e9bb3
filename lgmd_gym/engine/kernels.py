"""Compiled steps of a range of environments; Python is called neither per environment nor per step."""

import math
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.objects import BRAKE_LIGHT_MPS2, MAX_RANGE, MODEL_BOX, MODEL_CAR, MODEL_MARK
from lgmd_gym.envs.dynamics.bodies import BOX, CAR
from lgmd_gym.envs.dynamics.brake import put_demand
from lgmd_gym.envs.dynamics.episode import is_terminated, is_truncated, step_bodies
from lgmd_gym.envs.dynamics.jit import compiled
from lgmd_gym.envs.info import write_info
from lgmd_gym.envs.reward import step_reward


class Physics(NamedTuple):
    """Arrays of the physics, the environments along the first axis.

    Attributes:
        bodies: See `World`.
        episodes: See `World`.
        egos: See `World`.
        lines: See `World`.
        pending: See `World`.
        segments: See `World`.
        paths: See `World`.
        before: See `World`.
        brakes: `BRAKE` records, shape (N,).
        weights: `REWARD` records, shape (N,).
    """

    bodies: np.ndarray
    episodes: np.ndarray
    egos: np.ndarray
    lines: np.ndarray
    pending: np.ndarray
    segments: np.ndarray
    paths: np.ndarray
    before: np.ndarray
    brakes: np.ndarray
    weights: np.ndarray


class Clock(NamedTuple):
    """Progress of the present decision, the environments along the first axis.

    Attributes:
        demands: Longitudinal demands, float64, shape (N,).
        remaining: Simulation steps left in the decision, int64, shape (N,); −1 for no decision.
        due: Output: whether a camera frame is due, bool, shape (N,).
        headings: Heading before the decision, float64, shape (N,) [rad].
    """

    demands: np.ndarray
    remaining: np.ndarray
    due: np.ndarray
    headings: np.ndarray


class Outcome(NamedTuple):
    """Results of the present decision, the environments along the first axis.

    Attributes:
        infos: `INFO` records, shape (N,).
        rewards: float64, shape (N,).
        terminated: bool, shape (N,).
        truncated: bool, shape (N,).
    """

    infos: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray


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
def start_decisions(first: int, last: int, steps: int, physics: Physics, clock: Clock) -> None:
    """Put the demands of the environments with `remaining` >= 0 into their delay lines.

    Args:
        first: First environment.
        last: Last environment + 1.
        steps: Simulation steps per decision.
        physics: `Physics`.
        clock: `Clock`.
    """
    for i in range(first, last):
        if clock.remaining[i] < 0:
            continue
        clock.remaining[i] = steps
        ego, episode, brake = physics.bodies[i, 0], physics.episodes[i], physics.brakes[i]
        clock.headings[i] = ego.heading
        episode.last_speed, episode.last_acceleration = ego.speed, ego.acceleration
        demand = clock.demands[i]
        demand = demand if demand < 0.0 or brake.throttle > 0.0 else 0.0
        put_demand(physics.lines[i], physics.pending[i], brake.delay, demand)


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
    any_due = False
    for i in range(first, last):
        clock.due[i] = False
        episode = physics.episodes[i]
        while clock.remaining[i] > 0 and not clock.due[i]:
            step_bodies(
                physics.bodies[i], episode, physics.egos[i], physics.lines[i], physics.pending[i],
                physics.brakes[i], physics.segments[i], physics.paths[i], physics.before[i], 1.0 / rate,
            )  # fmt: skip
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
def finish_decisions(
    first: int, last: int, policy_rate: float, physics: Physics, clock: Clock, outcome: Outcome
) -> None:
    """Write info, reward and end of the environments with a decision.

    Args:
        first: First environment.
        last: Last environment + 1.
        policy_rate: Decisions per second [Hz].
        physics: `Physics`.
        clock: `Clock`.
        outcome: Output.
    """
    for i in range(first, last):
        if clock.remaining[i] < 0:
            continue
        bodies, episode, ego, info = physics.bodies[i], physics.episodes[i], physics.egos[i], outcome.infos[i]
        dt = 1.0 / policy_rate
        episode.time += dt
        write_info(bodies, episode, ego, physics.paths[i], info)
        outcome.rewards[i] = step_reward(
            bodies[0], ego, episode, physics.brakes[i], physics.weights[i], info.ttc, dt
        )
        outcome.terminated[i] = is_terminated(bodies, episode)
        outcome.truncated[i] = is_truncated(episode)


@compiled
def start_episodes(
    first: int, last: int, rate: float, selected: np.ndarray, physics: Physics, clock: Clock, view: View,
    outcome: Outcome,
) -> None:  # fmt: skip
    """Write the first info and the first view of the selected environments."""
    for i in range(first, last):
        if selected[i]:
            write_info(
                physics.bodies[i], physics.episodes[i], physics.egos[i], physics.paths[i], outcome.infos[i]
            )
            show(i, rate, physics, view)
            clock.headings[i] = physics.bodies[i, 0].heading
            outcome.rewards[i] = 0.0
            outcome.terminated[i] = outcome.truncated[i] = False
