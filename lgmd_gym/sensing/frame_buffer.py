"""Frame buffers for batches of environments whose neurons are stepped together."""

from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from lgmd_gym.sensing.road_hook import on_road_step
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import yaw_rate


class EgoMotion(NamedTuple):
    """Motion of the ego at the end of a decision: speed [m/s] and mean yaw rate [rad/s]."""

    speed: float
    yaw_rate: float


class FrameBuffer:
    """Frames of a batch of environments during one decision.

    Args:
        sensors: The cameras and neurons of all environments.

    Attributes:
        reset_frames: First frames after the last reset, see `SensorArray.empty_frames`.
        last_frames: Last processed frames; they persist over decisions.
    """

    def __init__(self, sensors: SensorArray) -> None:
        self.sensors = sensors
        self.reset_frames = sensors.empty_frames()
        self.last_frames = sensors.empty_frames()
        self._slots: list[list[np.ndarray]] = []

    def slot(self, index: int) -> list[np.ndarray]:
        """Return the buffers of the frames with this index in the decision; allocated on first use."""
        while len(self._slots) <= index:
            self._slots.append(self.sensors.empty_frames())
        return self._slots[index]


class FrameRecorder(gym.Wrapper):
    """Render every camera frame of one environment of a batch into a frame buffer.

    Args:
        env: A highway-env environment.
        buffer: Buffer for the frames.
        index: Index of the environment in the batch.
        stride: Simulation steps per camera frame.

    Attributes:
        frame_count: Number of frames recorded in this decision, before a reset.
        was_reset: Whether the environment was reset in this decision.
        motion: Ego motion at the end of the decision.
        final_motion: Ego motion at the end of the last episode.
    """

    def __init__(self, env: gym.Env, buffer: FrameBuffer, index: int, stride: int) -> None:
        super().__init__(env)
        self.buffer, self.index, self.stride = buffer, index, stride
        self.motion = self.final_motion = EgoMotion(0.0, 0.0)
        self.start_decision()

    def start_decision(self) -> None:
        """Discard the frames of the last decision."""
        self.frame_count = 0
        self.was_reset = False

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        """Reset the environment and render its first frame."""
        result = self.env.reset(**arguments)
        on_road_step(self.env, self._on_substep)
        self.was_reset = True
        self._substeps = 0
        self.buffer.sensors.apply_camera_fields(self.env, self.index)
        self.buffer.sensors.render(self.env.unwrapped, self.buffer.reset_frames, self.index)
        vehicle = self.env.unwrapped.vehicle  # type: ignore[attr-defined]
        self.final_motion, self.motion = self.motion, EgoMotion(float(vehicle.speed), 0.0)
        self._heading = float(vehicle.heading)
        return result

    def step(self, action: Any) -> Any:
        """Step the environment and record its camera frames."""
        substeps, heading = self._substeps, self._heading
        result = self.env.step(action)
        base: Any = self.env.unwrapped
        self._heading = float(base.vehicle.heading)
        elapsed = (self._substeps - substeps) / base.config["simulation_frequency"]
        self.motion = EgoMotion(float(base.vehicle.speed), yaw_rate(self._heading, heading, elapsed))
        return result

    def _on_substep(self) -> None:
        self._substeps += 1
        if self._substeps % self.stride == 0:
            self.buffer.sensors.render(self.env.unwrapped, self.buffer.slot(self.frame_count), self.index)
            self.frame_count += 1
