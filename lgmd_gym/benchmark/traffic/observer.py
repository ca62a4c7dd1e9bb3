"""Observation of recorded traffic: cameras and neurons of many episodes in one call per frame."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.agents.base import TRACE, InfoArrays
from lgmd_gym.aliases import Info
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.reader import Moment, SceneFrame, plain
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.neuron import LGMDParams, Response
from lgmd_gym.sensing.assembly import Assembly, EgoMotion, TraceFrame
from lgmd_gym.sensing.highway import camera_rate
from lgmd_gym.sensing.sensor_array import SensorArray


class TrafficInfos:
    """`Infos` of a batch of traffic episodes.

    Args:
        moments: The present moment of every episode; None for one that is not played.
        arrays: Infos of the neurons.
    """

    def __init__(self, moments: Sequence[Moment | None], arrays: InfoArrays) -> None:
        self._arrays = arrays
        played = [moment.info for moment in moments if moment is not None]
        self._infos = [played[0] if moment is None else moment.info for moment in moments]

    def __contains__(self, key: object) -> bool:
        return key in self._arrays or key in self._infos[0]

    def __getitem__(self, key: str) -> Any:
        if key in self._arrays:
            return self._arrays[key]
        return np.array([info[key] for info in self._infos])

    def row(self, index: int) -> Info:
        """Return the info of one episode."""
        return self._infos[index] | self._arrays.row(index)


class Observed(NamedTuple):
    """Observations of one decision of a batch of traffic episodes.

    The rows of episodes that are not played are undefined. The next call of the observer may overwrite the
    arrays of the infos.
    """

    observations: dict[str, np.ndarray]
    infos: TrafficInfos
    moments: Sequence[Moment | None]  # None for an episode that is not played


class Observer:
    """Draws the frames of a batch of traffic episodes, steps the neurons and returns the observations.

    The observations and infos equal those of `LGMDObservation` with `trace=True`.

    Attributes:
        sensors: The cameras and neurons.
        fps: Camera frame rate [Hz].
    """

    def __init__(self, sensor_config: SensorConfig, num_envs: int = 1) -> None:
        arguments = sensor_config.for_agent().arguments
        frequency = TrafficEnv.default_config()["simulation_frequency"]
        self.fps = camera_rate(None, frequency)
        params = LGMDParams.make(arguments["params"])
        self.sensors = SensorArray(arguments["camera"], self.fps, params, num_envs)
        self._assembly = Assembly(self.sensors, frequency, arguments["include_frame"])
        self._top_views = self.sensors.top_views
        self._scenes, self._objects = plain(self.sensors.scenes), plain(self.sensors.objects)

    def observe(self, moments: Sequence[Moment | None]) -> Observed:
        """Process the frames of one decision of every episode; None stands for one that is not played."""
        trace = self.process(moments)
        motions = [(0.0, 0.0, 0.0) if moment is None else moment.motion for moment in moments]
        observations = self._assembly.observations(EgoMotion(*np.array(motions).T))
        infos = InfoArrays(self._assembly.infos() | {TRACE: trace})
        return Observed(observations, TrafficInfos(moments, infos), moments)

    def process(self, moments: Sequence[Moment | None]) -> list[TraceFrame]:
        """Draw the frames of one decision, step the neurons, and return their outputs, see `Infos`."""
        episodes = [() if moment is None else moment.frames for moment in moments]
        return [
            self._process([frames[number] if number < len(frames) else None for frames in episodes])
            for number in range(max(map(len, episodes)))
        ]

    def _process(self, frames: list[SceneFrame | None]) -> TraceFrame:
        """Process one frame of every episode; None stands for no frame."""
        shown = np.array([frame is not None for frame in frames])
        times, speeds = np.full(len(frames), np.nan), np.zeros(len(frames))
        for index, frame in enumerate(frames):
            if frame is not None:
                self._show(index, frame)
                times[index], speeds[index] = frame.time, frame.speed
        self.sensors.process(0, self.sensors.num_envs, shown)
        response = Response(*(field.copy() for field in self.sensors.responses))
        return TraceFrame(times, speeds, response)  # type: ignore[arg-type]  # arrays, see `Infos`

    def _show(self, index: int, frame: SceneFrame) -> None:
        """Write the state of one frame into the sensors."""
        count = len(frame.objects)
        self._scenes[index : index + 1] = frame.scene
        self._objects[index, :count], self.sensors.object_counts[index] = frame.objects, count
        for camera, picture in zip(self._top_views, frame.top_views, strict=True):
            self.sensors.frame_of(camera, index)[:] = picture
