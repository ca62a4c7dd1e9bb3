"""Checks of the arguments of the engine."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from lgmd_gym.camera import BirdsEye, CameraSpec
from lgmd_gym.errors import unknown_name
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.sensing.cameras import make_cameras
from lgmd_gym.sensing.sensor_array import SensorArray

_MODES = {mode.value for mode in AutoresetMode}


def make_sensors(camera: CameraSpec, fps: float, neuron: LGMDParams, num_envs: int) -> SensorArray:
    """Return the cameras and neurons of the environments.

    Args:
        camera: See `LGMDObservation`.
        fps: Camera frame rate [Hz].
        neuron: Parameters of the neurons.
        num_envs: Number of environments.

    Raises:
        ValueError: If a camera is a top view.
    """
    for name, made in make_cameras(camera).items():
        if isinstance(made, BirdsEye):
            raise ValueError(
                f"camera {name!r} is a top view, which highway-env draws; "
                "use gym.make_vec(…, vectorization_mode='sync')"
            )
    return SensorArray(camera, fps, neuron, num_envs)


def at_least_one(name: str, value: int) -> int:
    """Return a count, an argument called `name`; raise ValueError if it is no integer >= 1."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise ValueError(f"{name} must be an integer >= 1, got {value!r}")
    return int(value)


def autoreset_mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """Return an autoreset mode; raise ValueError for an unknown one."""
    if not isinstance(mode, AutoresetMode) and mode not in _MODES:
        raise unknown_name("autoreset_mode", mode, _MODES)
    return AutoresetMode(mode)


def seeds_of(seed: Any, num_envs: int) -> list[int | None]:
    """Return one seed per environment; raise ValueError for another number of seeds, or an invalid seed."""
    if seed is None:
        return [None] * num_envs
    seeds = [seed + index for index in range(num_envs)] if isinstance(seed, int | np.integer) else seed
    if not isinstance(seeds, Sequence | np.ndarray) or len(seeds) != num_envs:
        raise ValueError(f"seed must be one number or {num_envs} numbers, got {seed!r}")
    for value in seeds:
        if value is not None and (not isinstance(value, int | np.integer) or value < 0):
            raise ValueError(f"seed must be None or integers >= 0, got {value!r}")
    return [None if value is None else int(value) for value in seeds]


def mask_of(mask: Any, num_envs: int) -> np.ndarray:
    """Return a selection of environments, bool, shape (num_envs,); None selects all.

    Raises:
        ValueError: If the mask has another type or shape, or selects no environment.
    """
    if mask is None:
        return np.ones(num_envs, np.bool_)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (num_envs,):
        raise ValueError(f"options['reset_mask'] must be a bool array of shape ({num_envs},), got {mask!r}")
    if not mask.any():
        raise ValueError("options['reset_mask'] must select at least one environment, got none")
    return mask
