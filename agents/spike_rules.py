"""Rules on the highest spike frequency f of all cameras [spikes/s]."""

from dataclasses import dataclass
from math import inf
from typing import Any

from lgmd_gym.agents.base import FPS, HOLD
from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.agents.batch_rules import (
    AdaptiveThresholdBatch,
    GradedBatch,
    SpeedGatedBatch,
    SpikeThresholdBatch,
)
from lgmd_gym.agents.filters import ConsecutiveFrames, YawRateGate
from lgmd_gym.agents.params import RuleParams, parameter
from lgmd_gym.agents.rule import Rule, SensorReading, sensor_readings


class FrequencyRule(Rule):
    """Base class: brakes fully when f reaches a threshold in `frames` consecutive camera frames."""

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        self._streak = ConsecutiveFrames(self.params.frames)

    def should_brake(self, reading: SensorReading) -> bool:
        """Return whether f has reached the threshold in the required number of frames."""
        return self._streak.update(reading.max_frequency >= self.threshold(reading))

    def threshold(self, reading: SensorReading) -> float:
        """Return the threshold for one camera frame [spikes/s]; called for every frame in order."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class SpikeThresholdParams(RuleParams):
    """Parameters of `SpikeThreshold`.

    Attributes:
        threshold: Spike frequency threshold, > 0 [spikes/s]. The default is tuned for 30 Hz.
        frames: Number of consecutive camera frames at or above the threshold, >= 1.
    """

    threshold: float = parameter(30.0, 15.0, 250.0)
    frames: int = parameter(1, 1, 12)


class SpikeThreshold(FrequencyRule):
    """Brakes fully when the spike frequency reaches a threshold.

    Condition: f ≥ `threshold` in `frames` consecutive camera frames. The alert is the alert of the neuron.
    Observes `spike_frequency`. Parameters: `SpikeThresholdParams`.
    """

    name = "spike-threshold"
    Params = SpikeThresholdParams

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this rule for `num_envs` environments."""
        return SpikeThresholdBatch(self, num_envs)

    @property
    def alert(self) -> bool:
        """Alert of the neuron."""
        return self._alert

    def threshold(self, reading: SensorReading) -> float:
        """Return the constant threshold [spikes/s]."""
        return self.params.threshold


@dataclass(frozen=True, slots=True, kw_only=True)
class AdaptiveThresholdParams(RuleParams):
    """Parameters of `AdaptiveThreshold`.

    Attributes:
        threshold: Minimum threshold, > 0 [spikes/s].
        gain: Ratio of the threshold to the mean frequency, > 0.
        memory: Time constant of the mean, >= 1 [camera frames].
        frames: Number of consecutive camera frames at or above the threshold, >= 1.
    """

    threshold: float = parameter(30.0, 15.0, 250.0)
    gain: float = parameter(3.0, 1.0, 10.0)
    memory: int = parameter(60, 10, 200)
    frames: int = parameter(2, 1, 12)


class AdaptiveThreshold(FrequencyRule):
    """Brakes fully when the spike frequency reaches a multiple of its running mean.

    Condition: f(t) ≥ max(`threshold`, `gain` · m(t − 1)) in `frames` consecutive camera frames, with the
    first-order low-pass m(t) = m(t − 1) + (f(t) − m(t − 1)) / `memory`. The paper proposes an adaptive
    threshold as future work.

    Observes `spike_frequency`. Parameters: `AdaptiveThresholdParams`.
    """

    name = "adaptive-threshold"
    Params = AdaptiveThresholdParams

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this rule for `num_envs` environments."""
        return AdaptiveThresholdBatch(self, num_envs)

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        self._mean = 0.0

    def threshold(self, reading: SensorReading) -> float:
        """Return the threshold from the mean of the frames before, and update the mean."""
        threshold = max(self.params.threshold, self.params.gain * self._mean)
        self._mean += (reading.max_frequency - self._mean) / self.params.memory
        return threshold


@dataclass(frozen=True, slots=True, kw_only=True)
class GradedParams(RuleParams):
    """Parameters of `Graded`.

    Attributes:
        low: Predicted frequency at which braking begins, > 0 [spikes/s].
        span: Increase of the frequency from no braking to full braking, > 0 [spikes/s].
        lead: Prediction horizon, > 0 [s].
        fall: Time in which full braking decays to zero, > 0 [s].
    """

    low: float = parameter(30.0, 15.0, 250.0)
    span: float = parameter(120.0, 10.0, 270.0)
    lead: float = parameter(0.1, 0.01, 0.5)
    fall: float = parameter(2.0, 0.2, 6.0)


class Graded(Rule):
    """Brakes in proportion to the predicted spike frequency and releases slowly, without a latch.

    Demand: −b(t) with b(t) = max(u(t), b(t − 1) − Δt / `fall`), u(t) = clip((f̂(t) − `low`) / `span`, 0, 1)
    and the prediction f̂(t) = f(t) + `lead` · (f(t) − f(t − 1)) / Δt, where Δt = 1/30 s.

    Without the latch, a short activation does not stop the car. The brake can release before contact if the
    neuron stops spiking.

    Observes `spike_frequency`. Parameters: `GradedParams`.
    """

    name = "graded"
    Params = GradedParams
    latching = False

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this rule for `num_envs` environments."""
        return GradedBatch(self, num_envs)

    @property
    def alert(self) -> bool:
        """Whether the rule brakes."""
        return self._braking > 0.0

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        self._braking, self._previous = 0.0, 0.0

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return the demand in [-1, 0]."""
        p = self.params
        for reading in sensor_readings(observation, info):
            frequency = reading.max_frequency
            predicted = frequency + (frequency - self._previous) * FPS * p.lead
            proportional = min(max((predicted - p.low) / p.span, 0.0), 1.0)
            self._braking = max(proportional, self._braking - 1.0 / (p.fall * FPS))
            self._previous = frequency
        return -self._braking if self._braking > 0.0 else HOLD


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedGatedParams(RuleParams):
    """Parameters of `SpeedGated`.

    Attributes:
        threshold: Threshold at standstill, > 0 [spikes/s].
        per_speed: Increase of the threshold with the ego speed, > 0 [spikes/s per m/s].
        frames: Number of consecutive camera frames at or above the threshold, >= 1.
        yaw_rate: Absolute yaw rate above which the rule is inactive, > 0 [rad/s].
        settle: Number of latest camera frames that must be free of such yaw rates, >= 1.
    """

    threshold: float = parameter(30.0, 15.0, 150.0)
    per_speed: float = parameter(1.0, 0.1, 8.0)
    frames: int = parameter(3, 1, 12)
    yaw_rate: float = parameter(0.03, 0.01, 0.3)
    settle: int = parameter(15, 1, 60)


class SpeedGated(FrequencyRule):
    """Brakes fully when the spike frequency reaches a threshold that rises with the ego speed v.

    Condition: f ≥ `threshold` + `per_speed` · v in `frames` consecutive camera frames. A frame does not count
    if the yaw rate has exceeded `yaw_rate` in the last `settle` frames. Optic flow from ego motion rises with
    speed and yaw rate.

    Observes `spike_frequency`, `ego_speed`, `ego_yaw_rate`. Parameters: `SpeedGatedParams`.
    """

    name = "speed-gated"
    Params = SpeedGatedParams

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this rule for `num_envs` environments."""
        return SpeedGatedBatch(self, num_envs)

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        self._gate = YawRateGate(self.params.yaw_rate, self.params.settle)

    def threshold(self, reading: SensorReading) -> float:
        """Return the threshold for the ego speed; infinity while the gate is closed."""
        p, active = self.params, self._gate.update(reading.yaw_rate)
        return p.threshold + p.per_speed * max(reading.speed, 0.0) if active else inf
