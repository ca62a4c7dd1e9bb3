"""Baseline rules on camera frames, without a neuron.

The defaults come from `lgmd-gym tune --cameras fovea tele wide` on the splits train and validation (60 trials
for `FrameDifference`, 24 for `FlowDivergence`); docs/benchmark.md compares them with rules on the neuron.
"""

from typing import Any

import numpy as np

from lgmd_gym.agents.base import FPS, Infos, Observations, State
from lgmd_gym.agents.rules import COUNT, POSITIVE, Reading, Rule, RuleParams, readings
from lgmd_gym.aliases import Values
from lgmd_gym.fields import number, record, whole
from lgmd_gym.processes.extras import missing_extra


class ImageRule(Rule):
    """Base class: brakes fully when a measure of two successive frames reaches a level.

    Condition: measure ≥ `level` in `frames` consecutive camera frames. A frame does not count if the yaw rate
    has exceeded `yaw_rate` in the last `settle` frames. The rule uses one 10° camera along the path and one
    frame per decision.
    """

    include_frame = True
    reads_neuron = False
    _previous: np.ndarray | None = None  # last frame of each environment, uint8 (N, height, width)

    @property
    def camera(self) -> Values:
        """The preset `fovea`, turned along the path."""
        return {"name": "fovea", "gaze": "path"}

    def initial(self) -> State:
        """Return the number of frames at the level, the state of the gate, and no previous frame."""
        return super().initial() | {"streak": 0, "closed": 0, "has_previous": False, "measure": 0.0}

    def brake_conditions(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Measure the latest two frames; return whether the rule's condition holds for the latest reading."""
        frames = np.ascontiguousarray(observations["frame"][:, :, :, 0])
        if self._previous is None:
            self._previous = np.zeros_like(frames)
        for index in np.flatnonzero(active).tolist():
            known = self.state["has_previous"][index]
            value = self.measure(self._previous[index], frames[index]) if known else 0.0
            self.state["measure"][index] = value
        self._previous[active], self.state["has_previous"][active] = frames[active], True
        found = list(readings(observations, infos))
        if not found:  # no environment has a new frame in this decision
            return np.zeros(self.num_envs, np.bool_)
        return self._process(found[-1]._replace(due=np.any([reading.due for reading in found], axis=0)))

    def should_brake(self, reading: Reading) -> np.ndarray:
        """Return whether the measure has reached the level for the required number of frames."""
        reached = self.gate(reading.yaw_rate) & (self.state["measure"] >= self.params.level)
        return self.consecutive("streak", reached, self.params.frames)

    def _allocate(self, num_envs: int) -> None:
        super()._allocate(num_envs)
        self._previous = None

    def measure(self, previous: np.ndarray, frame: np.ndarray) -> float:
        """Return the measure of two successive frames, uint8 (height, width)."""
        raise NotImplementedError


@record
class FrameDifferenceParams(RuleParams):
    """Parameters of `FrameDifference`."""

    level: float = number(
        4.78, POSITIVE, "grey levels", "Threshold of the mean absolute frame difference.", search=(0.5, 20.0)
    )
    frames: int = whole(
        8, COUNT, "", "Number of consecutive camera frames at or above the level.", search=(1, 12)
    )
    yaw_rate: float = number(
        0.0384, POSITIVE, "rad/s", "Absolute yaw rate above which the rule is inactive.", search=(0.01, 0.3)
    )
    settle: int = whole(
        60, COUNT, "", "Number of latest camera frames that must be free of such yaw rates.", search=(1, 60)
    )


class FrameDifference(ImageRule):
    """Brakes fully on the mean absolute frame difference, `mean |L(t) − L(t − 1)|` [grey levels].

    Condition: see `ImageRule`. Observes `frame`, `ego_yaw_rate`. Parameters: `FrameDifferenceParams`.
    """

    name = "frame-difference"
    Params = FrameDifferenceParams

    def measure(self, previous: np.ndarray, frame: np.ndarray) -> float:
        """Return the mean absolute difference [grey levels]."""
        return float(np.abs(frame.astype(np.int16) - previous).mean())


@record
class FlowDivergenceParams(RuleParams):
    """Parameters of `FlowDivergence`."""

    level: float = number(
        0.454,
        POSITIVE,
        "1/s",
        "Threshold of the mean divergence; 2/τ for a plane that fills the field of view.",
        search=(0.05, 3.0),
    )
    frames: int = whole(
        4, COUNT, "", "Number of consecutive camera frames at or above the level.", search=(1, 12)
    )
    yaw_rate: float = number(
        0.0713, POSITIVE, "rad/s", "Absolute yaw rate above which the rule is inactive.", search=(0.01, 0.3)
    )
    settle: int = whole(
        25, COUNT, "", "Number of latest camera frames that must be free of such yaw rates.", search=(1, 60)
    )


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
