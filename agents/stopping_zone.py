"""`StoppingZone`: the reference rule, on ten pairs of camera fields."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.agents.batch_rules import StoppingZoneBatch
from lgmd_gym.agents.filters import YawRateGate
from lgmd_gym.agents.params import RuleParams, parameter
from lgmd_gym.agents.rule import Rule, SensorReading, excitation, held, read_ahead
from lgmd_gym.agents.zones import (
    FULL_DECELERATION,
    NUM_ZONES,
    zone_cameras,
    zone_ends,
    zone_index,
    zone_indices,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoppingZoneParams(RuleParams):
    """Parameters of `StoppingZone`.

    Attributes:
        deceleration: Deceleration of full braking, > 0 [m/s²]; determines the zones.
        reaction: Time from the demand to full braking, > 0 [s]; determines the zones.
        ground: Excitation threshold of ground fields, > 0.
        upright: Excitation threshold of the present zone's upright field, > 0.
        frames: Number of consecutive camera frames with the ground field at its threshold, >= 1.
        memory: Number of camera frames for which an excitation of the upright field counts, >= 1.
        near_upright: Excitation threshold of nearer zones' upright fields, > 0.
        near_frames: Number of consecutive camera frames with both fields of a nearer zone at their
            thresholds, >= 1.
        near_share: Minimum design speed of the nearer zones relative to the ego speed, > 0. Optic flow of the
            roadside excites the fields of zones for lower speeds.
        yaw_rate: Absolute yaw rate above which the rule is inactive, > 0 [rad/s].
        settle: Number of latest camera frames that must be free of such yaw rates, >= 1.
        crawl: Ego speed up to which the rule is inactive, > 0 [m/s]. The lowest speed of UN R152 5.2.1.3 is
            10 km/h (2.8 m/s).
    """

    deceleration: float = parameter(FULL_DECELERATION, 7.0, 10.0, affects_camera=True)
    reaction: float = parameter(0.4, 0.25, 0.6, affects_camera=True)
    ground: float = parameter(3.0, 2.0, 7.0)
    upright: float = parameter(0.5, 0.2, 1.2)
    frames: int = parameter(2, 1, 8)
    memory: int = parameter(15, 3, 40)
    near_upright: float = parameter(1.4, 0.8, 3.0)
    near_frames: int = parameter(4, 1, 8)
    near_share: float = parameter(0.5, 0.3, 0.8)
    yaw_rate: float = parameter(0.03, 0.01, 0.1)
    settle: int = parameter(15, 1, 60)
    crawl: float = parameter(2.5, 0.5, 2.7)


class StoppingZone(Rule):
    """Brakes fully for an upright obstacle in the zone of the ego's stopping distance.

    The rule has ten zones for ego speeds from 10 to 90 km/h, each with a ground field, an upright field and
    one neuron per field; see `lgmd_gym.agents.zones`. G and U are the excitations k/(n σ3) of the two neurons
    of a zone. The zone for the ego speed v is the one with the next higher design speed. An empty road, a
    lead car at a distance and cars in other lanes do not excite its ground field.

    Condition: one of the following, while v > `crawl` and the yaw rate has not exceeded `yaw_rate` in the
    last `settle` frames.

    - Zone for v: G ≥ `ground` in `frames` consecutive frames, and U ≥ `upright` in one of the last `memory`
      frames. The second part excludes shadows and steel plates, which excite the ground field alone.
    - A nearer zone with a design speed of at least `near_share` · v: G ≥ `ground` and U ≥ `near_upright` in
      `near_frames` consecutive frames. A lead car that was always nearer than the zone for v does not enter
      that zone.

    The rule does not detect obstacles in curves tighter than v / `yaw_rate`, or crossing traffic. Above
    90 km/h the zone is too short.

    Observes `membrane_potential`, `ego_speed`, `ego_yaw_rate`. Parameters: `StoppingZoneParams`.
    """

    name = "stopping-zone"
    Params = StoppingZoneParams

    @property
    def camera(self) -> list[dict[str, Any]]:
        """Ground fields in order of design speed, then upright fields."""
        return zone_cameras(zone_ends(self.params.deceleration, self.params.reaction))

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this rule for `num_envs` environments."""
        return StoppingZoneBatch(self, num_envs)

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        p = self.params
        self._ground_frames = np.zeros(NUM_ZONES, np.int64)  # consecutive frames at the threshold
        self._near_frames = np.zeros(NUM_ZONES, np.int64)
        self._frames_since_upright = np.full(NUM_ZONES, p.memory)
        self._gate = YawRateGate(p.yaw_rate, p.settle)

    def should_brake(self, reading: SensorReading) -> bool:
        """Return whether an upright obstacle is in the zone for the ego speed or in a nearer one."""
        p = self.params
        self.require_cameras(len(reading.membrane_potential), 2 * NUM_ZONES)
        levels = excitation(reading.membrane_potential)
        ground, upright = levels[:NUM_ZONES], levels[NUM_ZONES:]
        on_ground = ground >= p.ground
        self._ground_frames = (self._ground_frames + 1) * on_ground
        self._near_frames = (self._near_frames + 1) * (on_ground & (upright >= p.near_upright))
        self._frames_since_upright = (self._frames_since_upright + 1) * (upright < p.upright)
        if not self._gate.update(reading.yaw_rate) or reading.speed <= p.crawl:
            return False
        zone, nearest = zone_index(reading.speed), zone_index(p.near_share * reading.speed)
        entered = self._ground_frames[zone] >= p.frames and self._frames_since_upright[zone] < p.memory
        return bool(entered or np.any(self._near_frames[nearest:zone] >= p.near_frames))

    def cameras_in_use(
        self, speed: np.ndarray, yaw_rate: np.ndarray, potential: np.ndarray | None = None
    ) -> np.ndarray:
        """Return when the fields of the present and the nearer zones are read; see `Agent.cameras_in_use`.

        An upright field matters only if its ground field is at its threshold.
        """
        p = self.params
        gate = YawRateGate(p.yaw_rate, p.settle)
        active = np.array([gate.update(rate) for rate in yaw_rate.tolist()], np.bool_) & (speed > p.crawl)
        zone, nearest = zone_indices(speed)[:, None], zone_indices(p.near_share * speed)[:, None]
        zones = np.arange(NUM_ZONES)
        present = active[:, None] & (zones == zone)
        nearer = active[:, None] & (zones >= nearest) & (zones < zone)
        ground = read_ahead(present, p.frames - 1) | read_ahead(nearer, p.near_frames - 1)
        if potential is None:
            return np.concatenate([ground, np.zeros_like(ground)], axis=1)
        on_ground = ground & (excitation(potential[:, :NUM_ZONES]) >= p.ground)
        present &= held(on_ground, p.frames)
        nearer &= held(on_ground, p.near_frames)
        upright = read_ahead(present, p.memory - 1) | read_ahead(nearer, p.near_frames - 1)
        return np.concatenate([ground, upright], axis=1)
