"""Observation of recorded traffic: cameras and neurons of many episodes in one call per frame."""

from collections.abc import Sequence

import numpy as np

from lgmd_gym.benchmark.episode import Step
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.reader import Moment, SceneFrame
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.sensing.assembly import Assembly, EgoMotion, Traces, row_of
from lgmd_gym.sensing.highway import camera_rate
from lgmd_gym.sensing.sensor_array import SensorArray


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
        self._traces = Traces(self.sensors)
        self._top_views = self.sensors.top_views

    def observe(self, moments: Sequence[Moment | None]) -> list[Step | None]:
        """Process the frames of one decision of every episode; None stands for one that is not played."""
        for number in range(max(len(moment.frames) for moment in moments if moment)):
            for index in self._process(moments, number):
                frame = moments[index].frames[number]  # type: ignore[union-attr]
                self._traces.append(index, frame.time, frame.speed)
        motions = [(0.0, 0.0, 0.0) if moment is None else moment.motion for moment in moments]
        motion = EgoMotion(*np.array(motions).T)
        observations, infos = self._assembly.observations(motion), self._assembly.infos()
        steps: list[Step | None] = [None] * len(moments)
        for index, moment in enumerate(moments):
            if moment is not None:
                info = moment.info | row_of(infos, index) | {"lgmd/trace": self._traces.take(index)}
                steps[index] = Step(row_of(observations, index), info, 0.0, moment.done)
        return steps

    def _process(self, moments: Sequence[Moment | None], number: int) -> list[int]:
        """Draw one frame of every episode, step the neurons, and return the episodes that have this frame."""
        shown = np.zeros(self.sensors.num_envs, np.bool_)
        for index, moment in enumerate(moments):
            if moment is not None and number < len(moment.frames):
                shown[index] = True
                self._show(index, moment.frames[number])
        self.sensors.process(0, self.sensors.num_envs, shown)
        return np.flatnonzero(shown).tolist()

    def _show(self, index: int, frame: SceneFrame) -> None:
        """Write the state of one frame into the sensors."""
        sensors, count = self.sensors, len(frame.objects)
        sensors.scenes[index] = frame.scene
        sensors.objects[index, :count], sensors.object_counts[index] = frame.objects, count
        for camera, picture in zip(self._top_views, frame.top_views, strict=True):
            sensors.frame_of(camera, index)[:] = picture
