"""InfoArrays: the infos of a simulation in the format of Gymnasium's vector environments."""

from typing import Any

import numpy as np

from lgmd_gym.engine.simulation import Simulation
from lgmd_gym.envs.info import INFO_KEYS
from lgmd_gym.neuron import Response
from lgmd_gym.sensing.spaces import SIGNALS
from lgmd_gym.wrappers.observation import TraceFrame


class InfoArrays:
    """One array per key of the info, each with a mask of the environments that have it.

    Args:
        simulation: The environments.
        trace: Whether to add ``lgmd/trace``, a list of a `TraceFrame` per camera frame of the decision.
    """

    def __init__(self, simulation: Simulation, trace: bool) -> None:
        self._simulation = simulation
        self._episodes: dict[str, np.ndarray] = {}
        self._traces: list[list[TraceFrame]] | None = None
        if trace and simulation.sensors is not None:
            self._traces = [[] for _ in range(simulation.num_envs)]
            simulation.on_frames = self._append_frames

    def set_episode(self, index: int, info: dict[str, Any]) -> None:
        """Set the keys of the info that are constant in the episode of environment `index`."""
        for key, value in info.items():
            if key not in self._episodes:
                kind = type(value) if isinstance(value, int | float | bool) else object
                self._episodes[key] = np.zeros(self._simulation.num_envs, kind)
            self._episodes[key][index] = value

    def read(self, selected: np.ndarray) -> dict[str, Any]:
        """Return the infos of the selected environments, and start new traces.

        Args:
            selected: bool, shape (N,); values of other environments are 0, False or None.
        """
        infos = self._simulation.outcome.infos
        arrays: dict[str, np.ndarray] = {key: infos[key] for key in INFO_KEYS} | self._episodes
        sensors = self._simulation.sensors
        if sensors is not None:
            for name in SIGNALS:
                values = getattr(sensors.responses, name)
                for camera, column in zip(sensors.names, values.T, strict=True):
                    arrays[f"lgmd/{camera}/{name}"] = column
            arrays["lgmd/alert"] = sensors.responses.alert.any(axis=1)
        if self._traces is not None:
            arrays["lgmd/trace"] = self._take_traces(selected)
        if selected.all():
            copied: dict[str, Any] = {key: np.array(values) for key, values in arrays.items()}
        else:
            copied = {key: _only(values, selected) for key, values in arrays.items()}
        return copied | {f"_{key}": selected.copy() for key in copied}

    def _append_frames(self, first: int, last: int, due: np.ndarray) -> None:
        """Append the present camera frame of the environments in a range to their traces."""
        sensors, state = self._simulation.sensors, self._simulation.state
        assert sensors is not None
        assert self._traces is not None
        for index in (first + np.flatnonzero(due[first:last])).tolist():
            response = Response(*(field[index].copy() for field in sensors.responses))
            time = float(state.episodes[index]["steps"]) / self._simulation.rates.simulation
            speed = float(state.bodies[index, 0]["speed"])
            self._traces[index].append(TraceFrame(time, speed, response))

    def _take_traces(self, selected: np.ndarray) -> np.ndarray:
        """Return the traces of the selected environments since the last call."""
        assert self._traces is not None
        taken = np.full(len(self._traces), None, dtype=object)
        for index in np.flatnonzero(selected).tolist():
            taken[index], self._traces[index] = self._traces[index], []
        return taken


def _only(values: np.ndarray, selected: np.ndarray) -> np.ndarray:
    """Return a copy with the values of other environments set to 0, False or None."""
    empty = np.full(values.shape, None, dtype=object) if values.dtype == object else np.zeros_like(values)
    empty[selected] = values[selected]
    return empty
