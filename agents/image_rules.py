"""Baseline rules on camera frames, without a neuron.

The defaults come from `lgmd-gym tune --cameras fovea tele wide` on the splits train and validation (60 trials
for `FrameDifference`, 24 for `FlowDivergence`); docs/benchmark.md compares them with rules on the neuron.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.filters import ConsecutiveFrames, YawRateGate
from lgmd_gym.agents.params import RuleParams, parameter
from lgmd_gym.agents.rule import Rule, SensorReading, sensor_readings
from lgmd_gym.processes.extras import missing_extra


class ImageRule(Rule):
    """Base class: brakes fully when a measure of two successive frames reaches a level.

    Condition: measure ≥ `level` in `frames` consecutive camera frames. A frame does not count if the yaw rate
    has exceeded `yaw_rate` in the last `settle` frames. The rule uses one 10° camera along the path and one
    frame per decision.
    """

    include_frame = True
    reads_neuron = False

    @property
    def camera(self) -> dict[str, Any]:
        """The preset `fovea`, turned along the path."""
        return {"name": "fovea", "gaze": "path"}

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        self._streak, self._previous = ConsecutiveFrames(self.params.frames), None
        self._gate = YawRateGate(self.params.yaw_rate, self.params.settle)

    def brake_condition(self, observation: dict[str, Any], info: dict[str, Any]) -> bool:
        """Measure the latest two frames; return whether the rule's condition holds."""
        frame = np.ascontiguousarray(observation["frame"][:, :, 0])
        self._value = 0.0 if self._previous is None else self.measure(self._previous, frame)
        self._previous = frame
        latest = tuple(sensor_readings(observation, info))[-1:]  # empty if the decision has no new frame
        return any(map(self.should_brake, latest))

    def should_brake(self, reading: SensorReading) -> bool:
        """Return whether the measure has reached the level for the required number of frames."""
        return self._streak.update(self._gate.update(reading.yaw_rate) and self._value >= self.params.level)

    def measure(self, previous: np.ndarray, frame: np.ndarray) -> float:
        """Return the measure of two successive frames, uint8 (height, width)."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameDifferenceParams(RuleParams):
    """Parameters of `FrameDifference`.

    Attributes:
        level: Threshold of the mean absolute frame difference, > 0 [grey levels].
        frames: Number of consecutive camera frames at or above the level, >= 1.
        yaw_rate: Absolute yaw rate above which the rule is inactive, > 0 [rad/s].
        settle: Number of latest camera frames that must be free of such yaw rates, >= 1.
    """

    level: float = parameter(4.78, 0.5, 20.0)
    frames: int = parameter(8, 1, 12)
    yaw_rate: float = parameter(0.0384, 0.01, 0.3)
    settle: int = parameter(60, 1, 60)


class FrameDifference(ImageRule):
    """Brakes fully on the mean absolute frame difference, `mean |L(t) − L(t − 1)|` [grey levels].

    Condition: see `ImageRule`. Observes `frame`, `ego_yaw_rate`. Parameters: `FrameDifferenceParams`.
    """

    name = "frame-difference"
    Params = FrameDifferenceParams

    def measure(self, previous: np.ndarray, frame: np.ndarray) -> float:
        """Return the mean absolute difference [grey levels]."""
        return float(np.abs(frame.astype(np.int16) - previous).mean())


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowDivergenceParams(RuleParams):
    """Parameters of `FlowDivergence`.

    Attributes:
        level: Threshold of the mean divergence, > 0 [1/s]; 2/τ for a plane that fills the field of view.
        frames: Number of consecutive camera frames at or above the level, >= 1.
        yaw_rate: Absolute yaw rate above which the rule is inactive, > 0 [rad/s].
        settle: Number of latest camera frames that must be free of such yaw rates, >= 1.
    """

    level: float = parameter(0.454, 0.05, 3.0)
    frames: int = parameter(4, 1, 12)
    yaw_rate: float = parameter(0.0713, 0.01, 0.3)
    settle: int = parameter(25, 1, 60)


class FlowDivergence(ImageRule):
    """Brakes fully on the mean divergence of dense optical flow (Farnebäck), mean(∂u/∂x + ∂v/∂y) [1/s].

    Condition: see `ImageRule`. Observes `frame`, `ego_yaw_rate`. Parameters: `FlowDivergenceParams`.

    Raises:
        ValueError: If OpenCV is not installed.
    """

    name = "flow-divergence"
    Params = FlowDivergenceParams

    def __init__(self, params: FlowDivergenceParams | None = None, **options: Any) -> None:
        try:
            import cv2
        except ImportError:
            raise missing_extra(f"agent {self.name}", "flow") from None
        self._cv2 = cv2
        super().__init__(params, **options)

    def measure(self, previous: np.ndarray, frame: np.ndarray) -> float:
        """Return the mean divergence [1/s]."""
        flow: Any = np.zeros((*frame.shape, 2), np.float32)
        flow = self._cv2.calcOpticalFlowFarneback(previous, frame, flow, 0.5, 3, 15, 3, 5, 1.2, 0)
        divergence = np.gradient(flow[:, :, 0], axis=1) + np.gradient(flow[:, :, 1], axis=0)
        return float(divergence.mean()) * FPS
