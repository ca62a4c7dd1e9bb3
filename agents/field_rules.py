"""Rules on the excitation of several camera fields, without the upright fields of `StoppingZone`."""

from dataclasses import dataclass
from math import atan, degrees
from typing import Any

import numpy as np

from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.agents.batch_rules import FieldBatch
from lgmd_gym.agents.filters import ConsecutiveFrames, YawRateGate
from lgmd_gym.agents.params import RuleParams, parameter
from lgmd_gym.agents.rule import Rule, SensorReading, excitation, read_ahead
from lgmd_gym.agents.zones import (
    CAMERA_SETBACK,
    DRY_DECELERATION,
    FULL_DECELERATION,
    REACTION,
    stopping_distance,
    zone_camera,
)

NESTED_DEG = (5.0, 7.0, 10.0, 14.0, 20.0, 40.0)  # horizontal fields of view, narrowest first


class FieldRule(Rule):
    """Base class: brakes fully when the excitation of the field for the ego speed reaches a level.

    Condition: excitation ≥ `level` in `frames` consecutive camera frames, while the yaw rate has not exceeded
    `yaw_rate` in the last `settle` frames.
    """

    num_fields: int

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this rule for `num_envs` environments."""
        return FieldBatch(self, num_envs)

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        p = self.params
        self._streaks = [ConsecutiveFrames(p.frames) for _ in range(self.num_fields)]
        self._gate = YawRateGate(p.yaw_rate, p.settle)

    def should_brake(self, reading: SensorReading) -> bool:
        """Return whether the field for the ego speed has reached the level for the required frames."""
        self.require_cameras(len(reading.membrane_potential), self.num_fields)
        reached = [
            streak.update(level >= self.params.level)
            for streak, level in zip(self._streaks, excitation(reading.membrane_potential), strict=True)
        ]
        return self._gate.update(reading.yaw_rate) and reached[self.field_index(reading.speed)]

    def cameras_in_use(
        self, speed: np.ndarray, yaw_rate: np.ndarray, potential: np.ndarray | None = None
    ) -> np.ndarray:
        """Return when the field for the speed is read; see `Agent.cameras_in_use`."""
        gate = YawRateGate(self.params.yaw_rate, self.params.settle)
        active = np.array([gate.update(rate) for rate in yaw_rate.tolist()], np.bool_)
        fields = np.array([self.field_index(value) for value in speed.tolist()])
        read = active[:, None] & (np.arange(self.num_fields) == fields[:, None])
        return read_ahead(read, self.params.frames - 1)

    def field_index(self, speed: float) -> int:
        """Return the index of the field for an ego speed [m/s]."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class NestedFieldsParams(RuleParams):
    """Parameters of `NestedFields`.

    Attributes:
        level: Excitation threshold, > 0; see `lgmd_gym.agents.rule.excitation`.
        frames: Number of consecutive camera frames at or above the level, >= 1.
        half_width: Half the lane width that the field covers at the stopping distance, > 0 [m].
        reaction: Reaction time of the stopping distance, > 0 [s].
        yaw_rate: Absolute yaw rate above which the rule is inactive, > 0 [rad/s].
        settle: Number of latest camera frames that must be free of such yaw rates, >= 1.
    """

    level: float = parameter(1.5, 0.5, 5.0)
    frames: int = parameter(6, 1, 20)
    half_width: float = parameter(1.4, 0.6, 2.5)
    reaction: float = parameter(0.5, 0.2, 1.0)
    yaw_rate: float = parameter(0.03, 0.01, 0.3)
    settle: int = parameter(15, 1, 60)


class NestedFields(FieldRule):
    """Brakes fully on the excitation of one of six nested fields along the path, chosen by the ego speed.

    The field for the ego speed v is the narrowest one that covers the lane at the stopping distance d: its
    angle is at least 2·atan(`half_width` / (d + 1.7 m)), with d = v² / (2 · 9 m/s²) + `reaction` · v.
    Condition: see `FieldRule`.

    Observes `membrane_potential`, `ego_speed`, `ego_yaw_rate`. Parameters: `NestedFieldsParams`.
    """

    name = "nested-fields"
    Params = NestedFieldsParams
    num_fields = len(NESTED_DEG)

    @property
    def camera(self) -> list[dict[str, Any]]:
        """Nested fields, narrowest first."""
        shared = {"gaze": "path", "shape": [90, 160]}
        return [{"name": f"nested{angle:g}", "hfov_deg": angle, **shared} for angle in NESTED_DEG]

    def field_index(self, speed: float) -> int:
        """Return the index of the narrowest field that covers the lane at the stopping distance."""
        p = self.params
        distance = stopping_distance(max(speed, 0.0), FULL_DECELERATION, p.reaction) + CAMERA_SETBACK
        angle = 2 * degrees(atan(p.half_width / distance))
        return min(int(np.searchsorted(NESTED_DEG, angle)), self.num_fields - 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class DangerZoneParams(RuleParams):
    """Parameters of `DangerZone`.

    Attributes:
        level: Excitation threshold, > 0; see `lgmd_gym.agents.rule.excitation`.
        frames: Number of consecutive camera frames at or above the level, >= 1.
        deceleration: Deceleration of the stopping distance on a dry road, > 0 [m/s²]; determines the field.
        reaction: Reaction time of the stopping distance, > 0 [s]; determines the field.
        yaw_rate: Absolute yaw rate above which the rule is inactive, > 0 [rad/s].
        settle: Number of latest camera frames that must be free of such yaw rates, >= 1.
    """

    level: float = parameter(4.0, 2.0, 9.0)
    frames: int = parameter(3, 1, 12)
    deceleration: float = parameter(DRY_DECELERATION, 6.0, 9.0, affects_camera=True)
    reaction: float = parameter(REACTION, 0.3, 0.7, affects_camera=True)
    yaw_rate: float = parameter(0.05, 0.02, 0.3)
    settle: int = parameter(1, 1, 60)


class DangerZone(FieldRule):
    """Brakes fully on the excitation of one ground field, whose far end is at the stopping distance.

    This is `StoppingZone` with one zone and without upright and low fields. Shadows, patches and steel plates
    cause false activations. Condition: see `FieldRule`.

    Observes `membrane_potential`, `ego_speed`, `ego_yaw_rate`. Parameters: `DangerZoneParams`.
    """

    name = "danger-zone"
    Params = DangerZoneParams
    num_fields = 1

    @property
    def camera(self) -> list[dict[str, Any]]:
        """The ground field."""
        return [zone_camera("ground", 1.0, self.params.deceleration, self.params.reaction)]

    def field_index(self, speed: float) -> int:
        """Return 0, the index of the only field."""
        return 0
