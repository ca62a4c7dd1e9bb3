"""`StoppingZone`: the reference rule, on ten pairs of camera fields."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents.filters import ConsecutiveFrames, YawRateGate
from lgmd_gym.agents.params import RuleParams, parameter
from lgmd_gym.agents.rule import Rule, SensorReading, excitation
from lgmd_gym.agents.zones import FULL_DECELERATION, NUM_ZONES, zone_cameras, zone_ends, zone_index


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

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and clear all state."""
        super().reset(seed)
        p = self.params
        self._ground_streaks = [ConsecutiveFrames(p.frames) for _ in range(NUM_ZONES)]
        self._near_streaks = [ConsecutiveFrames(p.near_frames) for _ in range(NUM_ZONES)]
        self._frames_since_upright = np.full(NUM_ZONES, p.memory)
        self._gate = YawRateGate(p.yaw_rate, p.settle)

    def should_brake(self, reading: SensorReading) -> bool:
        """Return whether an upright obstacle is in the zone for the ego speed or in a nearer one."""
        p = self.params
        self.require_cameras(reading, 2 * NUM_ZONES)
        ground, upright = np.split(excitation(reading.membrane_potential), 2)
        on_ground = ground >= p.ground
        entered = [streak.update(item) for streak, item in zip(self._ground_streaks, on_ground, strict=True)]
        self._frames_since_upright = np.where(upright >= p.upright, 0, self._frames_since_upright + 1)
        both = on_ground & (upright >= p.near_upright)
        near = [streak.update(item) for streak, item in zip(self._near_streaks, both, strict=True)]
        active = self._gate.update(reading.yaw_rate) and reading.speed > p.crawl
        zone, nearest = zone_index(reading.speed), zone_index(p.near_share * reading.speed)
        in_zone = entered[zone] and bool(self._frames_since_upright[zone] < p.memory)
        return active and (in_zone or any(near[nearest:zone]))
