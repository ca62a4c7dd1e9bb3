"""Baselines on the frames themselves, without a neuron: what simpler measures reach through one fovea.

Their defaults were found by `lgmd-gym tune --cameras fovea tele wide` (60 trials, of the flow 24) on the
splits train and validation, as rules on the neuron are tuned; `docs/benchmark.md` compares them.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents.base import BRAKE, HOLD
from lgmd_gym.agents.params import RuleParams, above_zero, count
from lgmd_gym.agents.rule import Rule, SensorReading, SteeringGate, Streak, sensor_readings

FPS = 30.0  # [Hz]


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageParams(RuleParams):
    """Parameters of a rule on one image measure.

    Attributes:
        level: Of the measure.
        frames: Consecutive frames at the level that start braking.
        yaw_rate: Own yaw rate beyond which it does not judge [rad/s].
        settle: Frames for which it does not judge after that.
    """

    level: float = above_zero(1.0, 0.1, 10.0)
    frames: int = count(4, 1, 12)
    yaw_rate: float = above_zero(0.03, 0.01, 0.3)
    settle: int = count(15, 1, 60)


class ImageRule(Rule):
    """Brakes fully once a measure of two successive frames has stood at a level; not while turning.

    It sees through one 10° fovea along the path and reads a frame per decision.
    """

    Params = ImageParams
    include_frame = True

    @property
    def camera(self) -> dict[str, Any]:
        """The eye."""
        return {"name": "fovea", "gaze": "path"}

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and forget the last frame."""
        super().reset(seed)
        self._streak, self._before = Streak(self.params.frames), None
        self._gate = SteeringGate(self.params.yaw_rate, self.params.settle)

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Measure, then brake fully if latched."""
        frame = np.ascontiguousarray(observation["frame"][:, :, 0])
        self._value = 0.0 if self._before is None else self.measure(self._before, frame)
        self._before = frame
        last = tuple(sensor_readings(observation, info))[-1:]  # none if the decision brought no new frame
        self._latched = any(map(self.should_brake, last)) or self._latched
        return BRAKE if self._latched else HOLD

    def should_brake(self, sight: SensorReading) -> bool:
        """Return whether the measure has stood at the level long enough."""
        return self._streak.add(self._gate.open(sight.yaw_rate) and self._value >= self.params.level)

    def measure(self, before: np.ndarray, now: np.ndarray) -> float:
        """Return the measure of two frames, uint8 (height, width)."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameDifferenceParams(ImageParams):
    """Parameters of `FrameDifference`.

    Attributes:
        level: Mean absolute change of grey per frame that counts [grey levels].
        frames: See `ImageParams`.
        yaw_rate: See `ImageParams`.
        settle: See `ImageParams`.
    """

    level: float = above_zero(4.78, 0.5, 20.0)
    frames: int = count(8, 1, 12)
    yaw_rate: float = above_zero(0.0384, 0.01, 0.3)
    settle: int = count(60, 1, 60)


class FrameDifference(ImageRule):
    """Brakes on the energy of the frame difference: mean `|L(t) − L(t − 1)|` over one fovea.

    Args:
        params: `FrameDifferenceParams`; None for those of `options`.
        options: Fields of it.
    """

    name = "frame-difference"
    Params = FrameDifferenceParams

    def measure(self, before: np.ndarray, now: np.ndarray) -> float:
        """Return the mean absolute change [grey levels]."""
        return float(np.abs(now.astype(np.int16) - before).mean())


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowDivergenceParams(ImageParams):
    """Parameters of `FlowDivergence`.

    Attributes:
        level: Mean divergence that counts, 2/τ for a plane that fills the field [1/s].
        frames: See `ImageParams`.
        yaw_rate: See `ImageParams`.
        settle: See `ImageParams`.
    """

    level: float = above_zero(0.454, 0.05, 3.0)
    frames: int = count(4, 1, 12)
    yaw_rate: float = above_zero(0.0713, 0.01, 0.3)
    settle: int = count(25, 1, 60)


class FlowDivergence(ImageRule):
    """Brakes on the divergence of dense optical flow (Farnebäck) over one fovea; needs OpenCV.

    Args:
        params: `FlowDivergenceParams`; None for those of `options`.
        options: Fields of it.

    Raises:
        ValueError: If OpenCV is not installed.
    """

    name = "flow-divergence"
    Params = FlowDivergenceParams

    def __init__(self, params: Any = None, **options: Any) -> None:
        try:
            import cv2
        except ImportError:
            raise ValueError(f"agent {self.name} needs OpenCV; pip install 'lgmd-gym[flow]'") from None
        self._cv2 = cv2
        super().__init__(params, **options)

    def measure(self, before: np.ndarray, now: np.ndarray) -> float:
        """Return the mean divergence ∂u/∂x + ∂v/∂y [1/s]."""
        flow: Any = np.zeros((*now.shape, 2), np.float32)
        flow = self._cv2.calcOpticalFlowFarneback(before, now, flow, 0.5, 3, 15, 3, 5, 1.2, 0)
        spread = np.gradient(flow[:, :, 0], axis=1) + np.gradient(flow[:, :, 1], axis=0)
        return float(spread.mean()) * FPS
