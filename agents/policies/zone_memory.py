"""What the eye of `stopping-zone` tells a policy: fields sorted by own speed, and what has stood in them."""

from typing import Any

import numpy as np

from lgmd_gym.agents.rule import SteeringGate
from lgmd_gym.agents.stopping_zone import SPEEDS_KMH, StoppingZoneParams, excitation, zone_of

PAIR = 2 * len(SPEEDS_KMH)  # signals of that eye: ground fields, then upright ones
AROUND = 5  # values that `around_the_zone` gives
TOLD = 2 * AROUND + 1
NEAR_FRAMES = 4  # consecutive ones, over which the nearer zones' pair is told once more
# Input -> the observation it is made of, and what its values are divided by before tanh.
ZONED = {
    "zones": ("membrane_potential", 3.0),  # as excitation k/(n σ3); the rule's levels are 0.5 to 3
    "zones_spikes": ("spike_frequency", 100.0),  # [spikes/s]; ten spikes a frame at 30 Hz are 300
    "zones_ffi": ("ffi", 10.0),  # mean change of light [grey levels]
}


class ZoneMemory:
    """The fields around the zone of own speed, over the frames since the policy's last decision.

    As the rule of that eye does, it believes what two consecutive frames tell, and nothing at a crawl, while
    the car turns, and for half a second after that: own rotation excites the fields as an obstacle does.

    Args:
        name: "zones", "zones_spikes" or "zones_ffi".
        fade: What is left of a peak one frame later.
    """

    def __init__(self, name: str, fade: float) -> None:
        self.source, self._scale = ZONED[name]
        self._name, self._fade = name, fade
        params = StoppingZoneParams()
        self._near_share, self._crawl = params.near_share, params.crawl
        self._gate = SteeringGate(params.yaw_rate, params.settle)
        self._last: list[np.ndarray] = []  # newest last, NEAR_FRAMES at most
        self._peak, self._held = np.zeros(AROUND), np.zeros(AROUND + 1)

    def see(self, signal: np.ndarray, speed: float, yaw_rate: float) -> None:
        """Take in one frame.

        Args:
            signal: Of the twenty neurons, shape (20,).
            speed: Own speed [m/s].
            yaw_rate: Own yaw rate [rad/s].

        Raises:
            ValueError: If the eye is another one.
        """
        check_zones(self._name, signal.shape)
        trusted = self._gate.open(yaw_rate) and speed > self._crawl
        told = excitation(signal) if self._name == "zones" else np.asarray(signal, np.float64)
        ground, upright = np.split(told, 2)
        around = around_the_zone(ground, upright, speed, self._near_share) * trusted
        first = not self._last
        self._last = [*self._last, around][-NEAR_FRAMES:]
        stood = around if first else np.minimum(*self._last[-2:])
        near = min(frame[-1] for frame in self._last)
        self._held = np.maximum(self._held, [*stood, near])
        self._peak = np.maximum(around, self._fade * self._peak) if trusted else np.zeros(AROUND)

    def told(self) -> np.ndarray:
        """Return what stood since the last call, and the peaks: shape (11,), in [0, 1).

        Five values of `around_the_zone` that stood in two consecutive frames, the last of them in four; then
        the five as fading peaks.
        """
        told = np.tanh(np.concatenate([self._held, self._peak]) / self._scale)
        self._held = np.zeros(AROUND + 1)
        return told


def around_the_zone(ground: np.ndarray, upright: np.ndarray, speed: float, near_share: float) -> np.ndarray:
    """Return what the fields that matter at a speed [m/s] tell, from one value per ground and upright field.

    Five values: ground and upright field of the zone of that speed, the same of the next one farther, and the
    strongest pair of the nearer zones, as the weaker of its two (0 if there is none). Of these only those
    made for `near_share` of the speed or more count.
    """
    here, nearest = zone_of(speed), zone_of(near_share * speed)
    ahead = min(here + 1, len(SPEEDS_KMH) - 1)
    near = np.minimum(ground[nearest:here], upright[nearest:here]).max(initial=0.0)
    return np.array([ground[here], upright[here], ground[ahead], upright[ahead], near])


def check_zones(name: str, shape: Any) -> None:
    """Refuse signals that are not those of the eye of `stopping-zone`.

    Raises:
        ValueError: Names the input and the mend.
    """
    if shape != (PAIR,):
        raise ValueError(
            f"the policy input {name!r} needs the eye of stopping-zone with {PAIR} cameras, got {shape[0]}; "
            "train with --eye stopping-zone"
        )
