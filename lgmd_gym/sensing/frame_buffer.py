"""A wrapper that queues what an environment's cameras see, for neurons that are stepped elsewhere."""

from typing import Any, NamedTuple

import gymnasium as gym

from lgmd_gym.sensing.road_hook import on_road_step
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import yaw_rate


class Motion(NamedTuple):
    """The ego's own motion at the end of a decision: speed [m/s] and mean yaw rate [rad/s]."""

    speed: float
    yaw_rate: float


class FrameBuffer:
    """The frames of one decision of a batch of environments.

    Attributes:
        first: The frame of each environment's reset.
        shown: The last frame of each environment, kept over decisions.
    """

    def __init__(self, sensors: SensorArray) -> None:
        self.sensors = sensors
        self.first = sensors.empty_frames()
        self.shown = sensors.empty_frames()
        self._turns: list[Any] = []

    def turn(self, number: int) -> Any:
        """Return the buffers of frame `number` of the decision, made when first needed."""
        while len(self._turns) <= number:
            self._turns.append(self.sensors.empty_frames())
        return self._turns[number]


class FrameRecorder(gym.Wrapper):
    """Renders one environment of a batch into a queue, frame after frame.

    Args:
        env: A highway-env environment.
        queue: Where frames go.
        index: The environment's number in the batch.
        stride: Simulation steps per camera frame.

    Attributes:
        frames: Frames queued in this decision before a reset, if there was one.
        was_reset: Whether there was a reset in this decision.
        motion: At the end of the decision.
        final: At the end of the episode that the last reset ended.
    """

    def __init__(self, env: gym.Env, queue: FrameBuffer, index: int, stride: int) -> None:
        super().__init__(env)
        self.queue, self.index, self.stride = queue, index, stride
        self.motion = self.final = Motion(0.0, 0.0)
        self.begin()

    def begin(self) -> None:
        """Start a decision: nothing is queued yet."""
        self.frames = 0
        self.was_reset = False

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        """Reset the environment and render its first frame."""
        observed = self.env.reset(**arguments)
        on_road_step(self.env, self._on_substep)
        self.was_reset = True
        self._substeps = 0
        self.queue.sensors.fit(self.env, self.index)
        self.queue.sensors.render(self.env.unwrapped, self.queue.first, self.index)
        vehicle = self.env.unwrapped.vehicle  # type: ignore[attr-defined]
        self.final, self.motion = self.motion, Motion(float(vehicle.speed), 0.0)
        self._heading = float(vehicle.heading)
        return observed

    def step(self, action: Any) -> Any:
        """Step the environment; every camera frame is queued on the way."""
        substeps, heading = self._substeps, self._heading
        stepped = self.env.step(action)
        base: Any = self.env.unwrapped
        self._heading = float(base.vehicle.heading)
        elapsed = (self._substeps - substeps) / base.config["simulation_frequency"]
        self.motion = Motion(float(base.vehicle.speed), yaw_rate(self._heading, heading, elapsed))
        return stepped

    def _on_substep(self) -> None:
        self._substeps += 1
        if self._substeps % self.stride == 0:
            self.queue.sensors.render(self.env.unwrapped, self.queue.turn(self.frames), self.index)
            self.frames += 1
