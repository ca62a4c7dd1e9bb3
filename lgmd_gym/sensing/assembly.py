"""Assembly of observations and infos from cameras and neurons, on arrays over N environments.

A single environment is N = 1, and takes row 0.
"""

from collections.abc import Mapping
from math import pi
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces

from lgmd_gym.aliases import Values
from lgmd_gym.neuron import Response
from lgmd_gym.sensing.kernels import SIGNALS
from lgmd_gym.sensing.sensor_array import SensorArray

SPEED_BOUND = 100.0  # [m/s], above highway-env's limit of 40 m/s
MOTION = ("ego_speed", "ego_yaw_rate", "ego_acceleration")
"""Observations of the fields of `EgoMotion`."""
ACCELERATION_BOUND = 100.0  # [m/s²], far above that of any car
DECELERATION_BOUND = 15.0  # [m/s²], above 12 m/s² with the largest error of an estimate


class TraceFrame(NamedTuple):
    """Outputs of the neurons for one camera frame.

    Attributes:
        time: Simulated time since the reset [s].
        ego_speed: Ego speed [m/s].
        response: Outputs of the neurons, arrays of shape (channels,).
    """

    time: float
    ego_speed: float
    response: Response


class EgoMotion(NamedTuple):
    """Motion of the egos, arrays of shape (N,), or numbers for a single environment."""

    speed: Any  # speed [m/s]
    yaw_rate: Any  # mean yaw rate of the decision, + right [rad/s]
    acceleration: Any  # mean acceleration of the decision [m/s²]

    @classmethod
    def between(cls, before: "EgoPose", after: "EgoPose", elapsed_s: float) -> "EgoMotion":
        """Return the motion between two states; rates are 0 without duration."""
        if elapsed_s <= 0.0:
            zeros = np.zeros_like(after.heading)
            return cls(after.speed, zeros, zeros)
        turned = (after.heading - before.heading + pi) % (2 * pi) - pi  # the shorter turn
        return cls(after.speed, turned / elapsed_s, (after.speed - before.speed) / elapsed_s)


class EgoPose(NamedTuple):
    """Headings [rad, + right] and speeds [m/s] of the egos, arrays of shape (N,) or numbers."""

    heading: Any
    speed: Any


class Traces:
    """The frames of the present decision of N environments, `lgmd/trace` of their infos.

    Args:
        sensors: The cameras and neurons.
    """

    def __init__(self, sensors: SensorArray) -> None:
        self._sensors = sensors
        self._frames: list[list[TraceFrame]] = [[] for _ in range(sensors.num_envs)]

    def append(self, index: int, time: float, speed: float) -> None:
        """Append the last frame of environment `index`.

        Args:
            index: Index of the environment.
            time: Simulated time since the reset [s].
            speed: Ego speed [m/s].
        """
        self._frames[index].append(TraceFrame(time, speed, self._sensors.response_of(index)))

    def take(self, index: int) -> list[TraceFrame]:
        """Return the frames of environment `index` since the last call."""
        frames, self._frames[index] = self._frames[index], []
        return frames

    def take_arrays(self) -> list[TraceFrame]:
        """Return the frames of all environments since the last call, arrays of shape (N,) and (N, cameras).

        The `time` of a frame is NaN in environments that have fewer frames.
        """
        traces = [self.take(index) for index in range(len(self._frames))]
        empty = Response(*(np.zeros_like(field[0]) for field in self._sensors.responses))
        missing, frames = TraceFrame(np.nan, 0.0, empty), list[TraceFrame]()
        for number in range(max(map(len, traces))):
            rows = [trace[number] if number < len(trace) else missing for trace in traces]
            response = Response(*map(np.stack, zip(*(row.response for row in rows), strict=True)))
            times: Any = np.array([row.time for row in rows])
            speeds: Any = np.array([row.ego_speed for row in rows])
            frames.append(TraceFrame(times, speeds, response))
        return frames


class Assembly:
    """Assembles the observations and infos of N environments; see `LGMDObservation` for their meaning.

    Args:
        sensors: The cameras and neurons.
        simulation_frequency: Simulation frequency [Hz].
        include_frame: Whether observations include the frames.
        base: Observation space of the wrapped environment, which the key `base` has in `space`; None to
            exclude it. The caller adds the values of this key.

    Attributes:
        space: Observation space of one environment.

    Raises:
        ValueError: For `include_frame` with cameras of different shapes.
    """

    def __init__(
        self,
        sensors: SensorArray,
        simulation_frequency: float,
        include_frame: bool = False,
        base: spaces.Space[Any] | None = None,
    ) -> None:
        self._sensors, self._include_frame = sensors, include_frame
        self._has_columns = any(sensors.columns)
        parts = _spaces(sensors, simulation_frequency, include_frame)
        self._shapes = [(name, box.shape, box.dtype) for name, box in parts.items()]
        every: dict[str, spaces.Space[Any]] = {**parts} if base is None else {**parts, "base": base}
        self.space = spaces.Dict(every)
        # The order of the values of `SensorArray.signals` of one environment.
        self._keys = [f"lgmd/{camera}/{signal}" for signal in SIGNALS for camera in sensors.names]

    def empty(self) -> dict[str, np.ndarray]:
        """Return arrays for the observations of all environments, without the key `base`."""
        num_envs = self._sensors.num_envs
        return {name: np.zeros((num_envs, *shape), dtype) for name, shape, dtype in self._shapes}

    def observations(
        self, motion: EgoMotion, out: dict[str, np.ndarray] | None = None
    ) -> dict[str, np.ndarray]:
        """Return the present observations of all environments, without the key `base`.

        Args:
            motion: Motion of the egos.
            out: Arrays of `empty` to write; new ones if None.
        """
        out, sensors = self.empty() if out is None else out, self._sensors
        for row, name in enumerate(SIGNALS):
            out[name][:] = sensors.signals[:, row]
        for name, values in zip(MOTION, motion, strict=True):
            out[name][:, 0] = values
        if sensors.known_decelerations is not None:
            out["known_deceleration"][:] = sensors.known_decelerations
        if self._has_columns:
            out["column_potential"][:] = sensors.column_potentials()
        if self._include_frame:
            np.copyto(out["frame"], sensors.stacked_frames().transpose(0, 2, 3, 1))
        return out

    def infos(self) -> dict[str, np.ndarray]:
        """Return the present infos of all environments, arrays of shape (N,): the keys `lgmd/…` but `trace`.

        The next frame may overwrite the arrays.
        """
        values = self._sensors.signals.reshape(self._sensors.num_envs, -1)
        alerts = self._sensors.responses.alert.any(axis=1)
        return dict(zip(self._keys, values.T, strict=True)) | {"lgmd/alert": alerts}


def row_of(arrays: Mapping[str, np.ndarray], index: int) -> Values:
    """Return the values of one environment: arrays of observations, numbers and objects of infos."""
    return {key: values[index] if values.ndim > 1 else values.item(index) for key, values in arrays.items()}


def _spaces(
    sensors: SensorArray, simulation_frequency: float, include_frame: bool
) -> dict[str, spaces.Box[Any]]:
    """Return the spaces of the observations of one environment, without the key `base`."""
    turn = pi * simulation_frequency  # the heading changes by at most half a turn per simulation step
    parts: dict[str, spaces.Box[Any]] = {
        **{signal: spaces.Box(*sensors.bounds(signal), dtype=np.float32) for signal in SIGNALS},
        "ego_speed": spaces.Box(-SPEED_BOUND, SPEED_BOUND, (1,), np.float32),
        "ego_yaw_rate": spaces.Box(-turn, turn, (1,), np.float32),
        "ego_acceleration": spaces.Box(-ACCELERATION_BOUND, ACCELERATION_BOUND, (1,), np.float32),
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
        parts["frame"] = spaces.Box(0, 255, (*sensors.shapes[0], len(sensors.names)), np.uint8)
    return parts
