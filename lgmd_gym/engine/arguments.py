"""Checks of the arguments of the engine."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from lgmd_gym.camera import BirdsEye
from lgmd_gym.errors import check_known, is_integer, shown
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.sensing.channel import ChannelSpec, make_channels
from lgmd_gym.sensing.sensor_array import SensorArray

_MODES = {mode.value for mode in AutoresetMode}


def make_sensors(
    camera: ChannelSpec, neuron: str, fps: float, params: LGMDParams, num_envs: int
) -> SensorArray:
    """Return the cameras and neurons of the environments.

    Args:
        camera: See `LGMDObservation`.
        neuron: See `LGMDObservation`.
        fps: Camera frame rate [Hz].
        params: Parameters of the neurons.
        num_envs: Number of environments.

    Raises:
        ValueError: If a camera is a top view.
    """
    channels = make_channels(camera, neuron)
    for channel in channels:
        if isinstance(channel.camera, BirdsEye):
            raise ValueError(
                f"camera {channel.name!r} is a top view, which highway-env draws; "
                "use gym.make_vec(…, vectorization_mode='sync')"
            )
    return SensorArray(channels, fps, params, num_envs)


def autoreset_mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """Return an autoreset mode; raise ValueError for an unknown one."""
    if isinstance(mode, AutoresetMode):
        return mode
    return AutoresetMode(check_known("autoreset_mode", mode, _MODES))


def seeds_of(seed: Any, num_envs: int) -> list[int | None]:
    """Return one seed per environment; raise ValueError for another number of seeds, or an invalid seed."""
    if seed is None:
        return [None] * num_envs
    seeds = [seed + index for index in range(num_envs)] if is_integer(seed) else seed
    seeds = seeds.tolist() if isinstance(seeds, np.ndarray) else seeds
    if not isinstance(seeds, Sequence) or len(seeds) != num_envs:
        raise ValueError(f"seed must be one number or {num_envs} numbers, got {shown(seed)}")
    for value in seeds:
        if value is not None and (not is_integer(value) or value < 0):
            raise ValueError(f"seed must be None or integers >= 0, got {shown(value)}")
    return [None if value is None else int(value) for value in seeds]


def mask_of(mask: Any, num_envs: int) -> np.ndarray:
    """Return a selection of environments, bool, shape (num_envs,); None selects all.

    Raises:
        ValueError: If the mask has another type or shape, or selects no environment.
    """
    if mask is None:
        return np.ones(num_envs, np.bool_)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (num_envs,):
        raise ValueError(
            f"options['reset_mask'] must be a bool array of shape ({num_envs},), got {shown(mask)}"
        )
    if not mask.any():
        raise ValueError("options['reset_mask'] must select at least one environment, got none")
    return mask
