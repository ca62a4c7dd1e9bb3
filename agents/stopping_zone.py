"""The brake that watches the ground on which the car would come to a stop, and what stands upright there."""

from dataclasses import dataclass
from math import atan, degrees
from typing import Any

import numpy as np

from lgmd_gym.agents.params import RuleParams, above_zero, count
from lgmd_gym.agents.rule import Rule, SensorReading, SteeringGate, Streak

SPEEDS_KMH = (10, 20, 25, 30, 40, 50, 60, 70, 80, 90)  # one pair of fields each
LENS_HEIGHT, LENS_SETBACK, HALF_WIDTH = 1.2, 1.7, 1.2  # [m]
# Shapes and pitches of the two fields; their width is that of the zone at its far end. In units of the angle
# from the horizon down to the far end: the ground field spans 1.0 to 1.75 below the horizon, the upright
# field 0.15 below to 0.35 above. A car of 1.4 m at the zone's end reaches 0.19 above, a guard rail none.
GROUND_SHAPE, GROUND_PITCH = (30, 80), -1.375
UPRIGHT_SHAPE, UPRIGHT_PITCH = (20, 80), 0.1
KMH = 1 / 3.6  # [m/s]


@dataclass(frozen=True, slots=True, kw_only=True)
class StoppingZoneParams(RuleParams):
    """Parameters of `StoppingZone`.

    Attributes:
        deceleration: Of full braking, which places the zones [m/s²].
        reaction: From the far end's crossing to full braking, which places them, too [s].
        ground: Excitation of the ground field from which a frame counts; see `excitation`.
        upright: Excitation of the upright field that must have been reached within `memory`.
        frames: Consecutive frames in which the ground field must stand at its level.
        memory: Frames for which the upright field's answer counts.
        near_upright: Level of the upright field of a nearer zone, together with `ground`.
        near_frames: Consecutive frames in which both fields of a nearer zone must stand at these.
        near_share: Zones made for less than this share of own speed are not judged: at such a speed what
            flows by is enough to excite their upright fields, and a steel plate the ground ones.
        yaw_rate: Own yaw rate beyond which it does not judge [rad/s].
        settle: Frames for which it does not judge after that.
        crawl: Own speed below which it does not judge [m/s]; UN R152 5.2.1.3 begins at 10 km/h (2.8 m/s).
    """

    deceleration: float = above_zero(9.0, 7.0, 10.0, places_eye=True)
    reaction: float = above_zero(0.4, 0.25, 0.6, places_eye=True)
    ground: float = above_zero(3.0, 2.0, 7.0)
    upright: float = above_zero(0.5, 0.2, 1.2)
    frames: int = count(2, 1, 8)
    memory: int = count(15, 3, 40)
    near_upright: float = above_zero(1.4, 0.8, 3.0)
    near_frames: int = count(4, 1, 8)
    near_share: float = above_zero(0.5, 0.3, 0.8)
    yaw_rate: float = above_zero(0.03, 0.01, 0.1)
    settle: int = count(15, 1, 60)
    crawl: float = above_zero(2.5, 0.5, 2.7)


class StoppingZone(Rule):
    """Brakes fully when something upright enters the ground it needs for stopping, as told by two LGMDs.

    Ten pairs of narrow fields, for 10 to 90 km/h, each with a neuron of its own; own speed chooses the pair.
    The ground field looks at the lane just this side of where the car would come to a stop, where an empty
    road, a car followed at a distance and a car in the next lane leave it silent. What comes nearer than
    that enters it from above. So does a shadow or a steel plate: the upright field, at the height of the
    horizon, tells that it stands up. Neither judges while the car turns.

    A car that was followed closer than the zone never enters it: in the zones nearer than that, both fields
    must stand at higher levels together.

    Only the cameras' answers, own speed and own yaw rate are read. It is blind in curves tighter than
    speed / `yaw_rate`, to what crosses from the side, and beyond 90 km/h sees no farther than at 90.

    Args:
        params: `StoppingZoneParams`; None for those of `options`.
        options: Fields of it.
    """

    name = "stopping-zone"
    Params = StoppingZoneParams

    @property
    def camera(self) -> list[dict[str, Any]]:
        """The eye: ground fields by rising speed, then upright fields."""
        return zone_cameras(self.zones)

    @property
    def zones(self) -> np.ndarray:
        """Far end of each zone ahead of the front bumper, shape (10,) [m]."""
        speeds = np.array(SPEEDS_KMH) * KMH
        return stopping_distance(speeds, self.params.deceleration, self.params.reaction)

    def reset(self, seed: int | None = None) -> None:
        """Release the brake and forget what was seen."""
        super().reset(seed)
        p = self.params
        self._streaks = [Streak(p.frames) for _ in SPEEDS_KMH]
        self._near = [Streak(p.near_frames) for _ in SPEEDS_KMH]
        self._since_upright = np.full(len(SPEEDS_KMH), p.memory)
        self._gate = SteeringGate(p.yaw_rate, p.settle)

    def should_brake(self, sight: SensorReading) -> bool:
        """Return whether something upright is in the zone of the present speed, or nearer."""
        p = self.params
        ground, upright = np.split(excitation(self._checked(sight)), 2)
        on_ground = ground >= p.ground
        entered = [streak.add(held) for streak, held in zip(self._streaks, on_ground, strict=True)]
        self._since_upright = np.where(upright >= p.upright, 0, self._since_upright + 1)
        both = on_ground & (upright >= p.near_upright)
        near = [streak.add(held) for streak, held in zip(self._near, both, strict=True)]
        can_judge = self._gate.open(sight.yaw_rate) and sight.speed > p.crawl
        here = zone_of(sight.speed)
        nearest = zone_of(p.near_share * sight.speed)
        in_zone = entered[here] and bool(self._since_upright[here] < p.memory)
        return can_judge and (in_zone or any(near[nearest:here]))

    def _checked(self, sight: SensorReading) -> np.ndarray:
        potential = sight.membrane_potential
        if len(potential) != 2 * len(SPEEDS_KMH):
            raise ValueError(
                f"agent {self.name} needs its own eye of {2 * len(SPEEDS_KMH)} cameras, got "
                f"{len(potential)}; leave --camera out"
            )
        return potential


def zone_of(speed: float) -> int:
    """Return the index of the zone for a speed [m/s]: the first made for it or more, else the last."""
    return min(int(np.searchsorted(np.array(SPEEDS_KMH) * KMH, speed)), len(SPEEDS_KMH) - 1)


def stopping_distance(speed: Any, deceleration: float, reaction: float) -> Any:
    """Return speed²/(2 · deceleration) + speed · reaction [m]."""
    return speed**2 / (2 * deceleration) + speed * reaction


def excitation(potential: Any) -> np.ndarray:
    """Return the mean excitation k/(n σ3) behind membrane potentials, eq. 10 solved for it; at most 15.

    The potential itself saturates: all of interest beyond 3 lies between 0.95 and 1.
    """
    k = np.clip(np.asarray(potential, dtype=np.float64), 0.5, 1.0 - 3e-7)
    return np.log(k / (1.0 - k))


def zone_cameras(ends: np.ndarray) -> list[dict[str, Any]]:
    """Return the cameras of zones that end so far ahead of the bumper [m]: ground fields, then upright."""
    looks = (("ground", GROUND_SHAPE, GROUND_PITCH), ("upright", UPRIGHT_SHAPE, UPRIGHT_PITCH))
    cameras = []
    for name, shape, pitch in looks:
        for speed, end in zip(SPEEDS_KMH, ends, strict=True):
            depth = float(end) + LENS_SETBACK
            cameras.append(
                {
                    "name": f"{name}{speed}",
                    "shape": list(shape),
                    "hfov_deg": round(2 * degrees(atan(HALF_WIDTH / depth)), 4),
                    "pitch_deg": round(pitch * degrees(atan(LENS_HEIGHT / depth)), 4),
                    "gaze": "path",
                }
            )
    return cameras
