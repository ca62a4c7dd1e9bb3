"""Observation space and arrays of `LGMDObservation`."""

from math import pi
from typing import Any

import numpy as np
from gymnasium import spaces

from lgmd_gym.sensing.kernels import SIGNALS
from lgmd_gym.sensing.sensor_array import SensorArray

SPEED_BOUND = 100.0  # [m/s], above highway-env's limit of 40 m/s
DECELERATION_BOUND = 15.0  # [m/s²], above 12 m/s² with the largest error of an estimate


def make_space(
    sensors: SensorArray,
    simulation_frequency: float,
    include_frame: bool,
    base: spaces.Space[Any] | None,
) -> spaces.Dict:
    """Return the observation space of one environment.

    Args:
        sensors: The cameras and neurons.
        simulation_frequency: Simulation frequency [Hz].
        include_frame: Whether to include the frames.
        base: The observation space of the environment; None to exclude it.

    Raises:
        ValueError: For `include_frame` with cameras of different shapes.
    """
    count = (len(sensors.names),)
    parts: dict[str, spaces.Space[Any]] = {
        **{signal: spaces.Box(*sensors.bounds(signal), dtype=np.float32) for signal in SIGNALS},
        "ego_speed": spaces.Box(-SPEED_BOUND, SPEED_BOUND, (1,), np.float32),
        # The heading changes by at most half a turn per simulation step.
        "ego_yaw_rate": spaces.Box(-pi * simulation_frequency, pi * simulation_frequency, (1,), np.float32),
    }
    if sensors.known_decelerations is not None:
        parts["known_deceleration"] = spaces.Box(0.0, DECELERATION_BOUND, (1,), np.float32)
    if any(sensors.columns):
        parts["column_potential"] = spaces.Box(0.0, 1.0, (sum(sensors.columns),), np.float32)
    if include_frame:
        if len(set(sensors.shapes)) > 1:
            shapes = dict(zip(sensors.names, sensors.shapes, strict=True))
            raise ValueError(
                f"cameras must have the same shape for include_frame, got {shapes}; change their shape"
            )
        height, width = sensors.shapes[0]
        parts["frame"] = spaces.Box(0, 255, (height, width, *count), np.uint8)
    if base is not None:
        parts["base"] = base
    return spaces.Dict(parts)


def make_observation(
    sensors: SensorArray, index: int, speed: float, yaw_rate: float, include_frame: bool
) -> dict[str, Any]:
    """Return the observation of environment `index` as new arrays, without the key ``base``.

    Args:
        sensors: The cameras and neurons.
        index: Index of the environment.
        speed: Ego speed [m/s].
        yaw_rate: Mean yaw rate of the decision [rad/s].
        include_frame: Whether to include the frames.
    """
    frequency, potential, ffi = sensors.signals[index].astype(np.float32)
    observation = {
        "spike_frequency": frequency,
        "membrane_potential": potential,
        "ffi": ffi,
        "ego_speed": np.array([speed], dtype=np.float32),
        "ego_yaw_rate": np.array([yaw_rate], dtype=np.float32),
    }
    if sensors.known_decelerations is not None:
        observation["known_deceleration"] = sensors.known_decelerations[index].astype(np.float32)
    if any(sensors.columns):
        observation["column_potential"] = sensors.column_potentials()[index].astype(np.float32)
    if include_frame:
        observation["frame"] = sensors.stacked_frames()[index].transpose(1, 2, 0).copy()
    return observation


def signal_keys(names: list[str]) -> dict[str, list[str]]:
    """Return the info keys of the cameras, by signal."""
    return {signal: [f"lgmd/{camera}/{signal}" for camera in names] for signal in SIGNALS}


def signal_info(sensors: SensorArray, index: int, keys: list[str]) -> dict[str, Any]:
    """Return the ``lgmd/`` keys of the info of environment `index`.

    Args:
        sensors: The cameras and neurons.
        index: Index of the environment.
        keys: The keys of `signal_keys` in one list.
    """
    info: dict[str, Any] = dict(zip(keys, sensors.signals[index].ravel().tolist(), strict=True))
    info["lgmd/alert"] = True in sensors.responses.alert[index].tolist()
    return info


def yaw_rate(heading: float, previous: float, elapsed: float) -> float:
    """Return the mean yaw rate [rad/s] between two headings [rad] by the shorter turn; 0 without duration."""
    turned = (heading - previous + pi) % (2 * pi) - pi
    return turned / elapsed if elapsed > 0.0 else 0.0
