"""Rules on the highest spike frequency of any camera."""

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from lgmd_gym.agents.base import HOLD
from lgmd_gym.agents.params import RuleParams, above_zero, count
from lgmd_gym.agents.rule import Rule, SensorReading, SteeringGate, Streak, sensor_readings

FPS = 30.0  # [Hz] the frame rate all of these rules were chosen at


@dataclass(frozen=True, slots=True, kw_only=True)
class SpikeThresholdParams(RuleParams):
    """Parameters of `SpikeThreshold`.

    Attributes:
        threshold: Spike frequency from which a camera frame counts [spikes/s]; read it with the frame rate,
            it was chosen at 30 Hz.
        frames: Number of consecutive camera frames at the threshold that start braking.
    """

    threshold: float = above_zero(30.0, 15.0, 250.0)
    frames: int = count(1, 1, 12)


class SpikeThreshold(Rule):
    """Brakes fully once the spike frequency has stood at a threshold, and keeps braking to a standstill.

    Any camera's frequency counts. It warns with the neuron's own alert.

    Args:
        params: `SpikeThresholdParams`; None for those of `options`.
        options: Fields of it.
    """

    name = "spike-threshold"
    Params = SpikeThresholdParams

    @property
    def alert(self) -> bool:
        """The neuron's own alert."""
        return self._alert

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        self._streak = Streak(self.params.frames)

    def should_brake(self, sight: SensorReading) -> bool:
        """Return whether the frequency has stood at the threshold long enough."""
        return self._streak.add(float(np.max(sight.spike_frequency)) >= self.params.threshold)


@dataclass(frozen=True, slots=True, kw_only=True)
class AdaptiveThresholdParams(RuleParams):
    """Parameters of `AdaptiveThreshold`.

    Attributes:
        threshold: Least alert level [spikes/s].
        gain: How many times the scene's own activity the level is.
        memory: Frames over which that activity is averaged (first-order low-pass).
        frames: Consecutive frames at the level that start braking.
    """

    threshold: float = above_zero(30.0, 15.0, 250.0)
    gain: float = above_zero(3.0, 1.0, 10.0)
    memory: int = count(60, 10, 200)
    frames: int = count(2, 1, 12)


class AdaptiveThreshold(Rule):
    """Brakes where the spike frequency stands out of the scene's own activity of the last seconds.

    The paper names such a level as open work. The mean is that of the frames before the present one.

    Args:
        params: `AdaptiveThresholdParams`; None for those of `options`.
        options: Fields of it.
    """

    name = "adaptive-threshold"
    Params = AdaptiveThresholdParams

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and forget the scene."""
        super().reset(seed)
        self._streak, self._mean = Streak(self.params.frames), 0.0

    def should_brake(self, sight: SensorReading) -> bool:
        """Return whether the frequency has stood out long enough."""
        p, frequency = self.params, float(np.max(sight.spike_frequency))
        level = max(p.threshold, p.gain * self._mean)
        self._mean += (frequency - self._mean) / p.memory
        return self._streak.add(frequency >= level)


@dataclass(frozen=True, slots=True, kw_only=True)
class GradedParams(RuleParams):
    """Parameters of `Graded`.

    Attributes:
        low: Frequency from which it brakes [spikes/s].
        span: By how much more it brakes fully [spikes/s].
        lead: How far ahead the frequency's slope is followed [s].
        fall: Seconds in which full braking fades once the frequency is gone [s].
    """

    low: float = above_zero(30.0, 15.0, 250.0)
    span: float = above_zero(120.0, 10.0, 270.0)
    lead: float = above_zero(0.1, 0.01, 0.5)
    fall: float = above_zero(2.0, 0.2, 6.0)


class Graded(Rule):
    """Brakes the harder the higher the spike frequency is and the faster it rises; eases off slowly.

    Easing off slowly rather than latching: it never brakes to a standstill on a passing stir, and pays for
    it where the neuron falls silent before contact.

    Args:
        params: `GradedParams`; None for those of `options`.
        options: Fields of it.
    """

    name = "graded"
    Params = GradedParams
    latching = False

    @property
    def alert(self) -> bool:
        """Whether it brakes."""
        return self._level > 0.0

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        self._level, self._before = 0.0, 0.0

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return the present level of braking, in [-1, 0]."""
        p = self.params
        for sight in sensor_readings(observation, info):
            frequency = float(np.max(sight.spike_frequency))
            coming = frequency + (frequency - self._before) * FPS * p.lead
            wish = min(max((coming - p.low) / p.span, 0.0), 1.0)
            self._level = max(wish, self._level - 1.0 / (p.fall * FPS))
            self._before = frequency
        return -self._level if self._level > 0.0 else HOLD


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedGatedParams(RuleParams):
    """Parameters of `SpeedGated`.

    Attributes:
        threshold: Level at standstill [spikes/s].
        per_speed: Rise of the level with own speed [spikes/s per m/s].
        frames: Consecutive frames at the level that start braking.
        yaw_rate: Own yaw rate beyond which it does not judge [rad/s].
        settle: Frames for which it does not judge after that.
    """

    threshold: float = above_zero(30.0, 15.0, 150.0)
    per_speed: float = above_zero(1.0, 0.1, 8.0)
    frames: int = count(3, 1, 12)
    yaw_rate: float = above_zero(0.03, 0.01, 0.3)
    settle: int = count(15, 1, 60)


class SpeedGated(Rule):
    """Brakes at a spike frequency that rises with own speed, as own-motion flow does; not while turning.

    Args:
        params: `SpeedGatedParams`; None for those of `options`.
        options: Fields of it.
    """

    name = "speed-gated"
    Params = SpeedGatedParams

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        self._streak = Streak(self.params.frames)
        self._gate = SteeringGate(self.params.yaw_rate, self.params.settle)

    def should_brake(self, sight: SensorReading) -> bool:
        """Return whether the frequency has stood at the present speed's level."""
        p = self.params
        level = p.threshold + p.per_speed * max(sight.speed, 0.0) if self._gate.open(sight.yaw_rate) else inf
        return self._streak.add(float(np.max(sight.spike_frequency)) >= level)
