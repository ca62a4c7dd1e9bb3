"""Observations and infos of the environments of a simulation, for agents."""

from typing import Any

import numpy as np

from lgmd_gym.agents.base import InfoArrays
from lgmd_gym.engine.observations import Observations
from lgmd_gym.engine.simulation import Simulation
from lgmd_gym.envs.info import INFO_KEYS
from lgmd_gym.neuron import LGMDParams, Response
from lgmd_gym.sensing.spaces import make_space, signal_keys
from lgmd_gym.wrappers.observation import TraceFrame


class Views:
    """What agents observe: equal to the observations and infos of `LGMDObservation` with `trace`.

    Args:
        simulation: The environments, with sensors.
        params: Parameters of the neurons.
        include_frame: Whether observations contain the frames.

    Attributes:
        num_envs: Number of environments.
        observations: The present batch of observations.
    """

    def __init__(self, simulation: Simulation, params: LGMDParams, include_frame: bool) -> None:
        assert simulation.sensors is not None
        self._simulation, self._sensors = simulation, simulation.sensors
        self.num_envs = simulation.num_envs
        self._episode_infos: list[dict[str, Any]] = [{}] * self.num_envs
        self._keys = signal_keys(self._sensors.names)
        self._traces: list[list[TraceFrame]] = [[] for _ in range(self.num_envs)]
        self._substeps = [0] * self.num_envs  # simulation steps up to the next camera frame
        rates = simulation.rates
        space = make_space(self._sensors, rates.simulation, include_frame, None)
        self._reader = Observations(simulation, space, include_frame, include_base=False, copy=True)
        self.observations: dict[str, np.ndarray] = {}
        self._one_frame = rates.steps == rates.stride  # per decision, which needs no recording
        if not self._one_frame:
            simulation.on_frames = self._append_frames

    def start(self, index: int, info: dict[str, Any]) -> None:
        """Set the info that is constant in the episode of environment `index`."""
        self._episode_infos[index] = info
        self._traces[index], self._substeps[index] = [], 0

    def read(self) -> None:
        """Read the present observations into new arrays."""
        self.observations = self._reader.read()

    def infos(self) -> "ViewInfos":
        """Return the infos of all environments, and start new traces."""
        infos: Any = self._simulation.outcome.infos
        alerts = self._sensors.responses.alert.any(axis=1)
        arrays = {key: infos[key] for key in INFO_KEYS}
        return ViewInfos(self, arrays | {"lgmd/alert": alerts, "lgmd/trace": self._take_traces(infos)})

    def info(self, index: int) -> dict[str, Any]:
        """Return the info of one environment without its trace."""
        values = self._simulation.outcome.infos[index].tolist()
        info: dict[str, Any] = dict(zip(INFO_KEYS, values, strict=True)) | self._episode_infos[index]
        for signal, keys in self._keys.items():
            info.update(zip(keys, getattr(self._sensors.responses, signal)[index].tolist(), strict=True))
        return info | {"lgmd/alert": bool(self._sensors.responses.alert[index].any())}

    def _take_traces(self, infos: Any) -> list[TraceFrame]:
        """Return the frames since the last decision as arrays of shape (N,) and (N, cameras)."""
        if self._one_frame:
            times: Any = self._simulation.state.episodes["steps"] / self._simulation.rates.simulation
            return [TraceFrame(times, infos["ego_speed"], self._sensors.responses)]
        traces, self._traces = self._traces, [[] for _ in range(self.num_envs)]
        empty = Response(*(np.zeros_like(field[0]) for field in self._sensors.responses))
        missing = TraceFrame(np.nan, 0.0, empty)
        frames = []
        for number in range(max(map(len, traces))):
            rows = [trace[number] if number < len(trace) else missing for trace in traces]
            response = Response(*map(np.stack, zip(*(row.response for row in rows), strict=True)))
            times = np.array([row.time for row in rows])
            frames.append(TraceFrame(times, np.array([row.ego_speed for row in rows]), response))  # type: ignore[arg-type]
        return frames

    def _append_frames(self, first: int, last: int, due: np.ndarray) -> None:
        """Append the present camera frame of the environments in a range to their traces."""
        rates = self._simulation.rates
        for index in (first + np.flatnonzero(due[first:last])).tolist():
            time = self._substeps[index] / rates.simulation
            speed = float(self._sensors.scenes[index]["speed"])
            self._traces[index].append(TraceFrame(time, speed, self._sensors.response_of(index)))
            self._substeps[index] += rates.stride


class ViewInfos(InfoArrays):
    """Infos of `Views`, whose rows have the keys that agents of all environments do not read.

    Args:
        views: The views.
        arrays: The arrays by name.
    """

    def __init__(self, views: Views, arrays: dict[str, Any]) -> None:
        super().__init__(arrays)
        self._views = views

    def row(self, index: int) -> dict[str, Any]:
        """Return the info of one environment."""
        return self._views.info(index) | {"lgmd/trace": super().row(index)["lgmd/trace"]}
