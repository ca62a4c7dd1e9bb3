"""Compiled steps of a range of environments; Python is called neither per environment nor per step."""

import numpy as np

from lgmd_gym.envs.decisions import Clock
from lgmd_gym.envs.dynamics.episode import Arrays, Physics, step_environment
from lgmd_gym.envs.scene import SceneArrays, write_scene
from lgmd_gym.kernels import kernel


@kernel(exact=True)
def advance(
    first: int, last: int, stride: int, rate: float, physics: Arrays, clock: Arrays, scenes: Arrays
) -> bool:
    """Advance each environment up to its next camera frame, at most to the end of its decision.

    Args:
        first: First environment.
        last: Last environment + 1.
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
        while clock.remaining[i] > 0 and not clock.due[i]:
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
def show_episodes(
    first: int, last: int, rate: float, selected: np.ndarray, physics: Arrays, scenes: Arrays
) -> None:
    """Write the present state of the selected environments for their cameras."""
    physics, scenes = Physics(*physics), SceneArrays(*scenes)
    for i in range(first, last):
        if selected[i]:
            write_scene(i, rate, physics, scenes)
