"""FrameRecorder: reads the camera frames of one environment of a batch into a sensor array."""

from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.neuron import Response
from lgmd_gym.sensing.road_hook import on_road_step
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import make_observation, yaw_rate


class FrameRecorder(gym.Wrapper):
    """Read every camera frame of one environment of a batch.

    The last frame of a decision stays pending, so that those of all environments can be processed together.
    Earlier frames of a decision, and the last one before a reset, are processed at once.

    Args:
        env: A highway-env environment.
        sensors: The cameras and neurons of all environments.
        index: Index of the environment in the batch.
        stride: Simulation steps per camera frame.
        pending: Environments with a frame to process, bool, shape (num_envs,); updated.
        include_frame: Whether `final_observation` includes the frames.

    Attributes:
        motion: Ego speed [m/s] and mean yaw rate of the last decision [rad/s].
        final_observation: Observation at the end of the last episode, without the key ``base``.
        final_response: Outputs of the neurons at the end of the last episode, arrays of shape (cameras,).
    """

    final_observation: dict[str, Any]
    final_response: Response

    def __init__(
        self,
        env: gym.Env,
        sensors: SensorArray,
        index: int,
        stride: int,
        pending: np.ndarray,
        include_frame: bool,
    ) -> None:
        super().__init__(env)
        self.sensors, self.index, self.stride, self.pending = sensors, index, stride, pending
        self.include_frame = include_frame
        self.motion = 0.0, 0.0
        self._substeps, self._heading = 0, 0.0
        self._keep_outputs()

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        """Reset the environment and its neurons, and read its first frame."""
        self._process_pending()
        self._keep_outputs()
        result = self.env.reset(**arguments)
        on_road_step(self.env, self._on_substep)
        self._substeps = 0
        self.sensors.reset(np.arange(self.sensors.num_envs) == self.index)
        base: Any = self.env.unwrapped
        self.sensors.set_camera_fields(self.index, getattr(base, "camera_fields", None))
        self._read()
        self.motion, self._heading = (float(base.vehicle.speed), 0.0), float(base.vehicle.heading)
        return result

    def step(self, action: Any) -> Any:
        """Step the environment and read its camera frames."""
        substeps, heading = self._substeps, self._heading
        result = self.env.step(action)
        base: Any = self.env.unwrapped
        self._heading = float(base.vehicle.heading)
        elapsed = (self._substeps - substeps) / base.config["simulation_frequency"]
        self.motion = float(base.vehicle.speed), yaw_rate(self._heading, heading, elapsed)
        return result

    def _on_substep(self) -> None:
        self._substeps += 1
        if self._substeps % self.stride == 0:
            self._read()

    def _read(self) -> None:
        self._process_pending()
        self.sensors.read(self.env, self.index)
        self.pending[self.index] = True

    def _process_pending(self) -> None:
        if self.pending[self.index]:
            self.sensors.process(self.index, self.index + 1)
            self.pending[self.index] = False

    def _keep_outputs(self) -> None:
        self.final_observation = make_observation(self.sensors, self.index, *self.motion, self.include_frame)
        self.final_response = self.sensors.response_of(self.index)
