"""`StoppingZone`: the reference rule, on fields that follow the stopping distance."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.agents.batch_rules import StoppingZoneBatch
from lgmd_gym.agents.params import RuleParams, parameter
from lgmd_gym.agents.rule import Rule, SensorReading, excitation
from lgmd_gym.agents.zones import (
    DRY_DECELERATION,
    LOW_FIELD,
    LOW_ZONES,
    NUM_FIELDS,
    NUM_ZONES,
    REACHES,
    REACTION,
    zone_cameras,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoppingZoneParams(RuleParams):
    """Parameters of `StoppingZone`.

    Attributes:
        deceleration: Deceleration of the stopping distance on a dry road, > 0 [m/s²]; determines the zones.
        reaction: Time from the demand to full braking, > 0 [s]; determines the zones.
        reach: Greatest reach of the zones that brake, >= 0.28, that of the nearest zone.
        ground: Excitation threshold of ground fields, > 0.
        upright: Excitation threshold of upright fields, > 0.
        low: Excitation threshold of low fields, > 0.
        frames: Number of consecutive camera frames with the ground field at its threshold, >= 1.
        upright_frames: The same for the upright field, >= 1.
        low_frames: The same for the low field, >= 1.
        memory: Number of camera frames for which excitations of the upright and low fields count, >= 1.
        yaw_rate: Absolute yaw rate above which the rule is inactive, > 0 [rad/s].
        crawl: Ego speed up to which the rule is inactive, > 0 [m/s].
    """

    deceleration: float = parameter(DRY_DECELERATION, 6.0, 9.0, affects_camera=True)
    reaction: float = parameter(REACTION, 0.3, 0.7, affects_camera=True)
    reach: float = parameter(1.8, 0.75, 1.8)
    ground: float = parameter(5.0, 2.0, 9.0)
    upright: float = parameter(0.6, 0.2, 1.2)
    low: float = parameter(1.0, 0.4, 3.0)
    frames: int = parameter(2, 1, 8)
    upright_frames: int = parameter(4, 1, 8)
    low_frames: int = parameter(2, 1, 8)
    memory: int = parameter(6, 1, 20)
    yaw_rate: float = parameter(0.05, 0.02, 0.3)
    crawl: float = parameter(1.0, 0.5, 2.7)

    def __post_init__(self) -> None:
        RuleParams.__post_init__(self)
        if self.reach < REACHES[0]:
            raise ValueError(f"reach must be >= {REACHES[0]}, that of the nearest zone, got {self.reach:g}")


class StoppingZone(Rule):
    """Brakes fully for an upright obstacle on the path, near the ego's stopping distance.

    The rule has seven zones, whose far ends are at 0.28 to 1.8 stopping distances, and 17 fields with one
    neuron each; see `lgmd_gym.agents.zones`. G, U and L are the excitations k/(n σ3) of the ground,
    upright and low field of a zone. The fields are parts of a stabilised, calibrated camera with contrast
    control, and follow the ego's path. Plain asphalt does not excite the ground fields.

    Condition: in one of the zones up to `reach`, G ≥ `ground` in `frames` consecutive frames, while U ≥
    `upright` in `upright_frames` and L ≥ `low` in `low_frames` consecutive frames that ended within the last
    `memory` frames; at a speed above `crawl` and a yaw rate of at most `yaw_rate`. Flat marks and shadows
    excite ground fields alone.

    The stopping distance is that of `deceleration` on a dry road and of two thirds of it on a wet one: the
    sensor knows that the road is wet, as a car with a rain sensor does.

    Observes `membrane_potential`, `ego_speed`, `ego_yaw_rate`. Parameters: `StoppingZoneParams`.
    """

    name = "stopping-zone"
    Params = StoppingZoneParams

    @property
    def camera(self) -> list[dict[str, Any]]:
        """Ground fields, nearest zone first, then upright fields, then low fields."""
        return zone_cameras(self.params.deceleration, self.params.reaction)

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this rule for `num_envs` environments."""
        return StoppingZoneBatch(self, num_envs)

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        self._streaks = np.zeros(NUM_FIELDS, np.int64)  # consecutive frames at the threshold
        self._ages = np.full(NUM_FIELDS, self.params.memory)  # frames since the required streak
        self.thresholds, self.required = field_limits(self.params)
        self.zones = np.array(REACHES) <= self.params.reach

    def should_brake(self, reading: SensorReading) -> bool:
        """Return whether an upright obstacle is in a zone."""
        p = self.params
        self.require_cameras(len(reading.membrane_potential), NUM_FIELDS)
        levels = excitation(reading.membrane_potential)
        self._streaks = (self._streaks + 1) * (levels >= self.thresholds)
        reached = self._streaks >= self.required
        self._ages = (self._ages + 1) * ~reached
        if not reading.speed > p.crawl or abs(reading.yaw_rate) > p.yaw_rate:
            return False
        upright, low = np.split(self._ages[NUM_ZONES:] < p.memory, [NUM_ZONES])
        return bool(np.any(self.zones & reached[:NUM_ZONES] & upright & low[list(LOW_FIELD)]))


def field_limits(p: StoppingZoneParams) -> tuple[np.ndarray, np.ndarray]:
    """Return the excitation threshold and the required number of frames of each field, shape (fields,)."""
    counts = NUM_ZONES, NUM_ZONES, len(LOW_ZONES)
    thresholds = np.repeat([p.ground, p.upright, p.low], counts)
    return thresholds, np.repeat([p.frames, p.upright_frames, p.low_frames], counts)
