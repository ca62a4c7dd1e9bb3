"""Observation of recorded traffic: cameras and neurons of many episodes in one call per frame."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.benchmark.episode import Step
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.reader import Moment, SceneFrame
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.sensing.channel import BIRDSEYE
from lgmd_gym.sensing.frame_rate import camera_rate
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import make_observation, signal_keys
from lgmd_gym.wrappers.observation import TraceFrame


class Observer:
    """Draws the frames of a batch of traffic episodes, steps the neurons and returns the observations.

    The observations and infos equal those of `LGMDObservation` with `trace=True`.

    Args:
        sensor_config: Camera and neuron parameters.
        num_envs: Number of episodes.

    Attributes:
        sensors: The cameras and neurons.
        fps: Camera frame rate [Hz].
    """

    def __init__(self, sensor_config: SensorConfig, num_envs: int = 1) -> None:
        arguments = sensor_config.for_agent().arguments
        self.fps = camera_rate(None, TrafficEnv.default_config()["simulation_frequency"])
        params = LGMDParams.make(arguments["params"])
        self.sensors = SensorArray(arguments["camera"], self.fps, params, num_envs)
        self._include_frame: bool = arguments["include_frame"]
        self._keys = signal_keys(self.sensors.names)
        self._top_views = [k for k, name in enumerate(self.sensors.names) if name == BIRDSEYE]

    def observe(self, moments: Sequence[Moment | None]) -> list[Step | None]:
        """Process the frames of one decision of every episode and return its steps.

        Args:
            moments: The moment of every episode; None for an episode that is not played.
        """
        traces: list[list[TraceFrame]] = [[] for _ in moments]
        for number in range(max(len(moment.frames) for moment in moments if moment)):
            for index in self._process(moments, number):
                frame = moments[index].frames[number]  # type: ignore[union-attr]
                traces[index].append(TraceFrame(frame.time, frame.speed, self.sensors.response_of(index)))
        return [
            None if moment is None else self._step(index, moment, traces[index])
            for index, moment in enumerate(moments)
        ]

    def _process(self, moments: Sequence[Moment | None], number: int) -> list[int]:
        """Draw one frame of every episode, step the neurons, and return the episodes that have this frame.

        Args:
            moments: The moment of every episode; None for an episode that is not played.
            number: Number of the frame in the decision.
        """
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

    def _step(self, index: int, moment: Moment, trace: list[TraceFrame]) -> Step:
        responses: Any = self.sensors.responses
        observation = make_observation(
            self.sensors, index, moment.speed, moment.yaw_rate, self._include_frame
        )
        info = dict(moment.info)
        for signal, keys in self._keys.items():
            info.update(zip(keys, getattr(responses, signal)[index].tolist(), strict=True))
        info["lgmd/alert"] = bool(responses.alert[index].any())
        info["lgmd/trace"] = trace
        return Step(observation, info, 0.0, moment.done)
