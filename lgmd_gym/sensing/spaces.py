"""What `LGMDObservation` tells: the spaces with their true bounds, and the arrays that go into them."""

from math import exp, floor, isinf, pi
from typing import Any

import numpy as np
from gymnasium import spaces

from lgmd_gym.neuron import LGMDParams, Response
from lgmd_gym.sensing.sensor_array import SensorArray

MAX_SPEED = 100.0  # [m/s], beyond highway-env's own cap of 40 and its overshoot
SIGNALS = ("spike_frequency", "membrane_potential", "ffi")


def make_space(
    sensors: SensorArray,
    params: LGMDParams,
    fps: float,
    simulation_frequency: float,
    frame: bool,
    base: spaces.Space | None,
) -> spaces.Dict:
    """Return the observation space of one environment.

    Args:
        sensors: The cameras and neurons.
        params: The neurons' parameters.
        fps: Camera frames per second [Hz].
        simulation_frequency: Simulation steps per second [Hz].
        frame: Whether frames are part of it.
        base: The environment's own space, if that is part of it.

    Raises:
        ValueError: For `frame` with cameras of different shapes.
    """
    count = (len(sensors.names),)
    parts: dict[str, spaces.Space] = {
        "spike_frequency": spaces.Box(0.0, highest_frequency(params, fps), count, np.float32),
        "membrane_potential": spaces.Box(min(params.k_0, 0.5), 1.0, count, np.float32),
        "ffi": spaces.Box(0.0, highest_ffi(params), count, np.float32),
        "ego_speed": spaces.Box(-MAX_SPEED, MAX_SPEED, (1,), np.float32),
        # A heading cannot turn by more than half a turn between two simulation steps.
        "ego_yaw_rate": spaces.Box(-pi * simulation_frequency, pi * simulation_frequency, (1,), np.float32),
    }
    if frame:
        if len(set(sensors.shapes)) > 1:
            shapes = dict(zip(sensors.names, sensors.shapes, strict=True))
            raise ValueError(
                f"include_frame needs cameras of one shape, got {shapes}; give them the same shape"
            )
        height, width = sensors.shapes[0]
        parts["frame"] = spaces.Box(0, 255, (height, width, *count), np.uint8)
    if base is not None:
        parts["base"] = base
    return spaces.Dict(parts)


def signals(response: Response, index: int) -> dict[str, np.ndarray]:
    """Return environment number `index`'s part of an answer, each float32 (cameras,)."""
    return {name: getattr(response, name)[index].astype(np.float32) for name in SIGNALS}


def signal_info(response: Response, index: int, names: list[str]) -> dict[str, Any]:
    """Return the `lgmd/` keys of `info` for environment number `index`."""
    info: dict[str, Any] = {}
    for name in SIGNALS:
        for camera, value in zip(names, getattr(response, name)[index], strict=True):
            info[f"lgmd/{camera}/{name}"] = float(value)
    info["lgmd/alert"] = bool(response.alert[index].any())
    return info


def yaw_rate(heading: float, before: float, elapsed: float) -> float:
    """Return the mean yaw rate [rad/s] between two headings [rad], the short way round; 0 for no time."""
    turned = (heading - before + pi) % (2 * pi) - pi
    return turned / elapsed if elapsed > 0.0 else 0.0


def highest_frequency(params: LGMDParams, fps: float) -> float:
    """Return the ceiling of the spike frequency [spikes/s]: K̂ never exceeds s = τ_s/(τ_s + dt)."""
    interval_ms = params.frame_interval_ms(fps)
    highest = 1.0 if isinf(params.tau_s) else params.tau_s / (params.tau_s + interval_ms)
    spikes = floor(exp(params.sigma_4 * (highest - params.t_sp)))
    return min(spikes, params.max_spikes) * 1000.0 / interval_ms


def highest_ffi(params: LGMDParams) -> float:
    """Return the bound of F̂ in grey levels: a full-range change every frame, and its persistence."""
    # float32 sums of many frames may land a little above the bound in exact arithmetic.
    return 255.0 / (1.0 - sum(params.persistence)) * 1.0001
