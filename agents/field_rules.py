"""Rules on several fields: a pyramid of nested ones, and the ground the car needs for stopping."""

from dataclasses import dataclass
from math import atan, degrees
from typing import Any

import numpy as np

from lgmd_gym.agents.params import RuleParams, above_zero, count
from lgmd_gym.agents.rule import Rule, SensorReading, SteeringGate, Streak
from lgmd_gym.agents.stopping_zone import (
    LENS_SETBACK,
    SPEEDS_KMH,
    excitation,
    stopping_distance,
    zone_cameras,
    zone_of,
)

NESTED_DEG = (5.0, 7.0, 10.0, 14.0, 20.0, 40.0)  # fields of the pyramid, narrowest first


@dataclass(frozen=True, slots=True, kw_only=True)
class NestedFieldsParams(RuleParams):
    """Parameters of `NestedFields`.

    Attributes:
        level: Excitation of the chosen field from which a frame counts; see `excitation`.
        frames: Consecutive frames at the level that start braking.
        half_width: Half the width that the field spans where the car would come to a stop [m].
        reaction: Of the stopping distance [s].
        yaw_rate: Own yaw rate beyond which it does not judge [rad/s].
        settle: Frames for which it does not judge after that.
    """

    level: float = above_zero(1.5, 0.5, 5.0)
    frames: int = count(6, 1, 20)
    half_width: float = above_zero(1.4, 0.6, 2.5)
    reaction: float = above_zero(0.5, 0.2, 1.0)
    yaw_rate: float = above_zero(0.03, 0.01, 0.3)
    settle: int = count(15, 1, 60)


class NestedFields(Rule):
    """A pyramid of nested central fields along the path; own speed chooses the one that matters.

    That is the narrowest which still spans the lane where the car would come to a stop: narrow and far at
    speed, wide and near in town.

    Args:
        params: `NestedFieldsParams`; None for those of `options`.
        options: Fields of it.
    """

    name = "nested-fields"
    Params = NestedFieldsParams

    @property
    def camera(self) -> list[dict[str, Any]]:
        """The eye: nested fields, narrowest first."""
        look = {"gaze": "path", "shape": [90, 160]}
        return [{"name": f"nested{field:g}", "hfov_deg": field, **look} for field in NESTED_DEG]

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        p = self.params
        self._streaks = [Streak(p.frames) for _ in NESTED_DEG]
        self._gate = SteeringGate(p.yaw_rate, p.settle)

    def should_brake(self, sight: SensorReading) -> bool:
        """Return whether the field of the present speed has stood at the level."""
        p = self.params
        levels = excitation(sight.membrane_potential)
        stood = [streak.add(level >= p.level) for streak, level in zip(self._streaks, levels, strict=True)]
        distance = stopping_distance(max(sight.speed, 0.0), 9.0, p.reaction) + LENS_SETBACK
        wanted = 2 * degrees(atan(p.half_width / distance))
        field = min(int(np.searchsorted(NESTED_DEG, wanted)), len(NESTED_DEG) - 1)
        return self._gate.open(sight.yaw_rate) and stood[field]


@dataclass(frozen=True, slots=True, kw_only=True)
class DangerZoneParams(RuleParams):
    """Parameters of `DangerZone`.

    Attributes:
        level: Excitation of the ground field from which a frame counts; see `excitation`.
        frames: Consecutive frames at the level that start braking.
        reaction: Of the stopping distance that places the zones [s].
        yaw_rate: Own yaw rate beyond which it does not judge [rad/s].
        settle: Frames for which it does not judge after that.
    """

    level: float = above_zero(4.0, 2.0, 9.0)
    frames: int = count(3, 1, 12)
    reaction: float = above_zero(0.4, 0.25, 0.6, places_eye=True)
    yaw_rate: float = above_zero(0.03, 0.01, 0.3)
    settle: int = count(15, 1, 60)


class DangerZone(Rule):
    """The ground fields of `StoppingZone` alone: what its upright fields add shows in shadows and plates.

    Args:
        params: `DangerZoneParams`; None for those of `options`.
        options: Fields of it.
    """

    name = "danger-zone"
    Params = DangerZoneParams

    @property
    def camera(self) -> list[dict[str, Any]]:
        """The eye: ground fields by rising speed."""
        ends = stopping_distance(np.array(SPEEDS_KMH) / 3.6, 9.0, self.params.reaction)
        return zone_cameras(ends)[: len(SPEEDS_KMH)]

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        p = self.params
        self._streaks = [Streak(p.frames) for _ in SPEEDS_KMH]
        self._gate = SteeringGate(p.yaw_rate, p.settle)

    def should_brake(self, sight: SensorReading) -> bool:
        """Return whether something has entered the zone of the present speed."""
        told = excitation(sight.membrane_potential)
        entered = [s.add(level >= self.params.level) for s, level in zip(self._streaks, told, strict=True)]
        return self._gate.open(sight.yaw_rate) and entered[zone_of(sight.speed)]
