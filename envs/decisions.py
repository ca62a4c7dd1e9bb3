"""Compiled start, steps and end of the decisions of a range of environments.

Python is called neither per environment nor per step of the simulation. The functions take the fields of
`Physics`, `Clock` and `Outcome` as plain tuples, too, which are cheaper to pass from Python.
"""

from typing import NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.brake import put_demand
from lgmd_gym.envs.dynamics.episode import Arrays, Physics, is_terminated, is_truncated, step_environment
from lgmd_gym.envs.info import INFO, write_info
from lgmd_gym.envs.physics_state import PhysicsState
from lgmd_gym.envs.reward import step_reward
from lgmd_gym.envs.scene import SceneArrays, write_scene
from lgmd_gym.envs.surrogate_safety import is_approached
from lgmd_gym.kernels import kernel


class Clock(NamedTuple):
    """Progress of the present decision, the environments along the first axis."""

    demands: np.ndarray  # longitudinal demands, float64, shape (N,)
    remaining: np.ndarray  # simulation steps left in the decision, int64, shape (N,); −1 for no decision
    due: np.ndarray  # output: whether a camera frame is due, bool, shape (N,)
    headings: np.ndarray  # heading before the decision, float64, shape (N,) [rad]
    speeds: np.ndarray  # ego speed before the decision, float64, shape (N,) [m/s]


class Outcome(NamedTuple):
    """Results of the present decision, the environments along the first axis."""

    infos: np.ndarray  # `INFO` records, shape (N,)
    rewards: np.ndarray  # float64, shape (N,)
    terminated: np.ndarray  # bool, shape (N,)
    truncated: np.ndarray  # bool, shape (N,)


def make_physics(state: PhysicsState, brakes: np.ndarray, weights: np.ndarray) -> Physics:
    """Return the arrays of a state; make them again after `PhysicsState.load` has replaced arrays."""
    return Physics(
        bodies=state.bodies,
        episodes=state.episodes,
        egos=state.egos,
        lines=state.lines,
        pending=state.pending,
        segments=state.segments,
        paths=state.paths,
        before=state.before,
        parts=state.parts,
        brakes=brakes,
        weights=weights,
    )


def make_clock(num: int) -> Clock:
    """Return the clock of `num` environments without a decision."""
    return Clock(
        np.zeros(num), np.full(num, -1, np.int64), np.zeros(num, np.bool_), np.zeros(num), np.zeros(num)
    )


def make_outcome(num: int) -> Outcome:
    """Return empty results of `num` environments."""
    flags = np.zeros((2, num), np.bool_)
    return Outcome(np.zeros(num, INFO), np.zeros(num), flags[0], flags[1])


@kernel(exact=True)
def start_decisions(first: int, last: int, steps: int, physics: Arrays, clock: Arrays) -> None:
    """Put the demands of the environments with `remaining` >= 0 into their delay lines.

    Args:
        first: First environment.
        last: Last environment + 1.
        steps: Simulation steps per decision.
        physics: `Physics`.
        clock: `Clock`.
    """
    physics, clock = Physics(*physics), Clock(*clock)
    for i in range(first, last):
        if clock.remaining[i] < 0:
            continue
        clock.remaining[i] = steps
        ego, episode, brake = physics.bodies[i, 0], physics.episodes[i], physics.brakes[i]
        clock.headings[i], clock.speeds[i] = ego.heading, ego.speed
        episode.last_speed, episode.last_acceleration = ego.speed, ego.acceleration
        demand = clock.demands[i]
        demand = demand if demand < 0.0 or brake.throttle > 0.0 else 0.0
        put_demand(physics.lines[i], physics.pending[i], brake.delay, demand)


@kernel(exact=True)
def advance(
    first: int, last: int, left: int, stride: int, rate: float, physics: Arrays, clock: Arrays, scenes: Arrays
) -> bool:
    """Advance each environment up to its next camera frame, or until `left` steps of its decision are left.

    Args:
        first: First environment.
        last: Last environment + 1.
        left: Simulation steps of the decision at which to stop; 0 for its end.
        stride: Simulation steps per camera frame.
        rate: Simulation frequency [Hz].
        physics: `Physics`.
        clock: `Clock`.
        scenes: `SceneArrays`; written for the environments with a frame.

    Returns:
        Whether a frame is due in any of the environments, see `Clock.due`.
    """
    physics, clock, scenes = Physics(*physics), Clock(*clock), SceneArrays(*scenes)
    any_due = False
    for i in range(first, last):
        clock.due[i] = False
        episode = physics.episodes[i]
        while clock.remaining[i] > left and not clock.due[i]:
            step_environment(i, 1.0 / rate, physics)
            clock.remaining[i] -= 1
            # highway-env counts a step after the frame of that step.
            clock.due[i] = (episode.steps + 1) % stride == 0
            if clock.due[i]:
                write_scene(i, rate, physics, scenes)
                any_due = True
            episode.steps += 1
    return any_due


@kernel(exact=True)
def finish_decisions(
    first: int,
    last: int,
    policy_rate: float,
    follow_up: float,
    physics: Arrays,
    clock: Arrays,
    outcome: Arrays,
) -> None:
    """Write info, reward and end of the environments with a decision.

    Args:
        first: First environment.
        last: Last environment + 1.
        policy_rate: Decisions per second [Hz].
        follow_up: See `is_terminated` [s].
        physics: `Physics`.
        clock: `Clock`.
        outcome: Output.
    """
    physics, clock, outcome = Physics(*physics), Clock(*clock), Outcome(*outcome)
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
        standing = bodies[0].speed == 0.0 and is_approached(bodies, episode.bodies, physics.paths[i])
        outcome.terminated[i] = is_terminated(bodies, episode, standing, dt, follow_up)
        outcome.truncated[i] = is_truncated(episode)


@kernel(exact=True)
def start_episodes(
    first: int, last: int, selected: np.ndarray, physics: Arrays, clock: Arrays, outcome: Arrays
) -> None:
    """Write the first info, heading and speed of the selected environments."""
    physics, clock, outcome = Physics(*physics), Clock(*clock), Outcome(*outcome)
    for i in range(first, last):
        if selected[i]:
            write_info(
                physics.bodies[i], physics.episodes[i], physics.egos[i], physics.paths[i], outcome.infos[i]
            )
            clock.headings[i], clock.speeds[i] = physics.bodies[i, 0].heading, physics.bodies[i, 0].speed
            outcome.rewards[i] = 0.0
            outcome.terminated[i] = outcome.truncated[i] = False


@kernel(exact=True)
def show_episodes(
    first: int, last: int, rate: float, selected: np.ndarray, physics: Arrays, scenes: Arrays
) -> None:
    """Write the present state of the selected environments for their cameras."""
    physics, scenes = Physics(*physics), SceneArrays(*scenes)
    for i in range(first, last):
        if selected[i]:
            write_scene(i, rate, physics, scenes)
