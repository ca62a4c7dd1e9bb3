"""Observations and infos of the environments of a simulation, for agents of one or of all environments."""

from typing import Any

import numpy as np

from lgmd_gym.engine.observations import Observations
from lgmd_gym.engine.simulation import Simulation
from lgmd_gym.envs.info import INFO_KEYS
from lgmd_gym.neuron import LGMDParams
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

    def record_traces(self) -> None:
        """Record the traces that `info` contains."""
        self._simulation.on_frames = self._append_frames

    def start(self, index: int, info: dict[str, Any]) -> None:
        """Set the info that is constant in the episode of environment `index`."""
        self._episode_infos[index] = info
        self._traces[index], self._substeps[index] = [], 0

    def read(self) -> None:
        """Read the present observations into new arrays."""
        self.observations = self._reader.read()

    def observation(self, index: int) -> dict[str, np.ndarray]:
        """Return the observation of one environment."""
        return {key: values[index] for key, values in self.observations.items()}

    def info(self, index: int) -> dict[str, Any]:
        """Return the info of one environment, and start a new trace."""
        values = self._simulation.outcome.infos[index].tolist()
        info: dict[str, Any] = dict(zip(INFO_KEYS, values, strict=True)) | self._episode_infos[index]
        for signal, keys in self._keys.items():
            info.update(zip(keys, getattr(self._sensors.responses, signal)[index].tolist(), strict=True))
        info["lgmd/alert"] = bool(self._sensors.responses.alert[index].any())
        info["lgmd/trace"], self._traces[index] = self._traces[index], []
        return info

    def batch_infos(self) -> dict[str, Any]:
        """Return the infos of all environments, for simulations with one camera frame per decision."""
        infos, responses = self._simulation.outcome.infos, self._sensors.responses
        times: Any = self._simulation.state.episodes["steps"] / self._simulation.rates.simulation
        speeds: Any = infos["ego_speed"]
        trace = (TraceFrame(times, speeds, responses),)
        alerts = responses.alert.any(axis=1)
        return {key: infos[key] for key in INFO_KEYS} | {"lgmd/alert": alerts, "lgmd/trace": trace}

    def _append_frames(self, first: int, last: int, due: np.ndarray) -> None:
        """Append the present camera frame of the environments in a range to their traces."""
        rates = self._simulation.rates
        for index in (first + np.flatnonzero(due[first:last])).tolist():
            time = self._substeps[index] / rates.simulation
            speed = float(self._sensors.scenes[index]["speed"])
            self._traces[index].append(TraceFrame(time, speed, self._sensors.response_of(index)))
            self._substeps[index] += rates.stride
