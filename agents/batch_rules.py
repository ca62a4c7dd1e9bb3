"""Rules in many environments: the conditions of `Rule` classes, computed on arrays of environments.

Every class has the rule's state with the environments along the first axis. The arithmetic is that of the
rule, operation by operation, so that the demands are equal to the bit.
"""

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lgmd_gym.agents.base import BRAKE, FPS, HOLD
from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.agents.rule import excitation
from lgmd_gym.agents.zones import LOW_FIELD, NUM_FIELDS, NUM_ZONES

if TYPE_CHECKING:
    from lgmd_gym.agents.field_rules import FieldRule
    from lgmd_gym.agents.rule import Rule
    from lgmd_gym.agents.stopping_zone import StoppingZone


class BatchReading(NamedTuple):
    """Neuron outputs and ego motion of N environments for one camera frame; see `SensorReading`.

    Attributes:
        frequency: Highest spike frequency of all cameras, shape (N,) [spikes/s].
        potential: Membrane potentials, shape (N, cameras).
        speed: Ego speeds, shape (N,) [m/s].
        yaw_rate: Ego yaw rates, shape (N,) [rad/s].
    """

    frequency: np.ndarray
    potential: np.ndarray
    speed: np.ndarray
    yaw_rate: np.ndarray

    @classmethod
    def of(cls, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any]) -> "BatchReading":
        """Return the reading of the last camera frame, from the trace if there is one."""
        yaw_rate = observations["ego_yaw_rate"][:, 0].astype(np.float64)
        if "lgmd/trace" in infos:
            (frame,) = infos["lgmd/trace"]
            frequency, potential = frame.response.spike_frequency, frame.response.membrane_potential
            speed = np.asarray(frame.ego_speed)
        else:
            frequency, potential = observations["spike_frequency"], observations["membrane_potential"]
            speed = observations["ego_speed"][:, 0].astype(np.float64)
        return cls(frequency.max(axis=1).astype(np.float64), potential, speed, yaw_rate)


class ConsecutiveFrameCounts:
    """`ConsecutiveFrames` for many conditions.

    Args:
        required: Number of frames, >= 1, of each condition or of all.
        shape: Shape of the conditions, the environments along the first axis.
    """

    def __init__(self, required: int | np.ndarray, shape: tuple[int, ...]) -> None:
        self.required = required
        self.counts = np.zeros(shape, np.int64)

    def reset(self, index: int) -> None:
        """Start a new episode in environment `index`."""
        self.counts[index] = 0

    def update(self, conditions: np.ndarray) -> np.ndarray:
        """Process one frame; return whether the conditions have held in the last `required` frames."""
        self.counts = (self.counts + 1) * conditions
        return self.counts >= self.required


class YawRateGates:
    """`YawRateGate` for N environments.

    Args:
        yaw_rate: Absolute yaw rate above which the car turns [rad/s].
        settle: Number of latest camera frames that must be free of turning for the gate to be open.
        num_envs: Number of environments N.
    """

    def __init__(self, yaw_rate: float, settle: int, num_envs: int) -> None:
        self.yaw_rate, self.settle = yaw_rate, settle
        self._remaining = np.zeros(num_envs, np.int64)

    def reset(self, index: int) -> None:
        """Start a new episode in environment `index`."""
        self._remaining[index] = 0

    def update(self, yaw_rates: np.ndarray) -> np.ndarray:
        """Process the yaw rates of one frame [rad/s]; return whether the gates are open."""
        turning = np.abs(yaw_rates) > self.yaw_rate
        self._remaining = np.where(turning, self.settle, np.maximum(self._remaining - 1, 0))
        return self._remaining == 0


class RuleBatch(BatchAgent):
    """Base class: a latching rule in N environments.

    Args:
        rule: The rule.
        num_envs: Number of environments N.
    """

    def __init__(self, rule: "Rule", num_envs: int) -> None:
        super().__init__(num_envs)
        self.rule, self.params = rule, rule.params
        self._latched = np.zeros(num_envs, np.bool_)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Release the brake and clear all state of environment `index`."""
        self._latched[index] = False

    def demands(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        """Return `BRAKE` for the environments that have latched, else `HOLD`."""
        self._latched = self.should_brake(BatchReading.of(observations, infos)) | self._latched
        self.alerts = self._latched
        return np.where(self._latched, BRAKE, HOLD)

    def should_brake(self, reading: BatchReading) -> np.ndarray:
        """Return whether the rule's condition holds, bool, shape (N,)."""
        raise NotImplementedError


class FrequencyBatch(RuleBatch):
    """`FrequencyRule` in N environments."""

    def __init__(self, rule: "Rule", num_envs: int) -> None:
        super().__init__(rule, num_envs)
        self._streaks = ConsecutiveFrameCounts(self.params.frames, (num_envs,))

    def reset(self, index: int, seed: int | None = None) -> None:
        """Release the brake and clear all state of environment `index`."""
        super().reset(index, seed)
        self._streaks.reset(index)

    def should_brake(self, reading: BatchReading) -> np.ndarray:
        """Return whether f has reached the threshold in the required number of frames."""
        return self._streaks.update(reading.frequency >= self.thresholds(reading))

    def thresholds(self, reading: BatchReading) -> np.ndarray | float:
        """Return the thresholds [spikes/s]."""
        return self.params.threshold


class SpikeThresholdBatch(FrequencyBatch):
    """`SpikeThreshold` in N environments."""

    def demands(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        """Return the demands; the alerts remain those of the neurons."""
        alerts = self.alerts
        demands = super().demands(observations, infos, active)
        self.alerts = alerts
        return demands


class AdaptiveThresholdBatch(FrequencyBatch):
    """`AdaptiveThreshold` in N environments."""

    def __init__(self, rule: "Rule", num_envs: int) -> None:
        super().__init__(rule, num_envs)
        self._means = np.zeros(num_envs)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Release the brake and clear all state of environment `index`."""
        super().reset(index, seed)
        self._means[index] = 0.0

    def thresholds(self, reading: BatchReading) -> np.ndarray:
        """Return the thresholds from the means of the frames before, and update the means."""
        thresholds = np.maximum(self.params.threshold, self.params.gain * self._means)
        self._means = self._means + (reading.frequency - self._means) / self.params.memory
        return thresholds


class SpeedGatedBatch(FrequencyBatch):
    """`SpeedGated` in N environments."""

    def __init__(self, rule: "Rule", num_envs: int) -> None:
        super().__init__(rule, num_envs)
        self._gates = YawRateGates(self.params.yaw_rate, self.params.settle, num_envs)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Release the brake and clear all state of environment `index`."""
        super().reset(index, seed)
        self._gates.reset(index)

    def thresholds(self, reading: BatchReading) -> np.ndarray:
        """Return the thresholds for the ego speeds; infinity while a gate is closed."""
        p, active = self.params, self._gates.update(reading.yaw_rate)
        return np.where(active, p.threshold + p.per_speed * np.maximum(reading.speed, 0.0), inf)


class GradedBatch(RuleBatch):
    """`Graded` in N environments."""

    def __init__(self, rule: "Rule", num_envs: int) -> None:
        super().__init__(rule, num_envs)
        self._braking, self._previous = np.zeros(num_envs), np.zeros(num_envs)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Release the brake and clear all state of environment `index`."""
        self._braking[index] = self._previous[index] = 0.0

    def demands(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        """Return the demands in [-1, 0]."""
        p, frequency = self.params, BatchReading.of(observations, infos).frequency
        predicted = frequency + (frequency - self._previous) * FPS * p.lead
        proportional = np.minimum(np.maximum((predicted - p.low) / p.span, 0.0), 1.0)
        self._braking = np.maximum(proportional, self._braking - 1.0 / (p.fall * FPS))
        self._previous = frequency
        self.alerts = self._braking > 0.0
        return np.where(self.alerts, -self._braking, HOLD)


class FieldBatch(RuleBatch):
    """`FieldRule` in N environments."""

    rule: "FieldRule"

    def __init__(self, rule: "FieldRule", num_envs: int) -> None:
        super().__init__(rule, num_envs)
        p = self.params
        self._streaks = ConsecutiveFrameCounts(p.frames, (num_envs, rule.num_fields))
        self._gates = YawRateGates(p.yaw_rate, p.settle, num_envs)
        self._rows = np.arange(num_envs)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Release the brake and clear all state of environment `index`."""
        super().reset(index, seed)
        self._streaks.reset(index)
        self._gates.reset(index)

    def should_brake(self, reading: BatchReading) -> np.ndarray:
        """Return whether the field for the ego speed has reached the level for the required frames."""
        self.rule.require_cameras(reading.potential.shape[1], self.rule.num_fields)
        reached = self._streaks.update(excitation(reading.potential) >= self.params.level)
        fields = [self.rule.field_index(speed) for speed in reading.speed.tolist()]
        return self._gates.update(reading.yaw_rate) & reached[self._rows, fields]


class StoppingZoneBatch(RuleBatch):
    """`StoppingZone` in N environments."""

    rule: "StoppingZone"

    def __init__(self, rule: "StoppingZone", num_envs: int) -> None:
        super().__init__(rule, num_envs)
        self._streaks = ConsecutiveFrameCounts(rule.required, (num_envs, NUM_FIELDS))
        self._ages = np.full((num_envs, NUM_FIELDS), self.params.memory)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Release the brake and clear all state of environment `index`."""
        super().reset(index, seed)
        self._streaks.reset(index)
        self._ages[index] = self.params.memory

    def should_brake(self, reading: BatchReading) -> np.ndarray:
        """Return whether an upright obstacle is in a zone."""
        p = self.params
        self.rule.require_cameras(reading.potential.shape[1], NUM_FIELDS)
        reached = self._streaks.update(excitation(reading.potential) >= self.rule.thresholds)
        self._ages = (self._ages + 1) * ~reached
        active = (reading.speed > p.crawl) & (np.abs(reading.yaw_rate) <= p.yaw_rate)
        upright, low = np.split(self._ages[:, NUM_ZONES:] < p.memory, [NUM_ZONES], axis=1)
        standing = self.rule.zones & reached[:, :NUM_ZONES] & upright & low[:, LOW_FIELD]
        return active & standing.any(axis=1)
