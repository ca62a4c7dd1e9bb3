"""Policy inputs from the cameras of `stopping-zone`, ordered relative to the zone for the ego speed."""

import numpy as np

from lgmd_gym.agents.filters import YawRateGate
from lgmd_gym.agents.rule import excitation
from lgmd_gym.agents.stopping_zone import StoppingZoneParams
from lgmd_gym.agents.zones import NUM_ZONES, zone_index

NUM_SELECTED = 5  # values of `select_fields`
NUM_ZONE_FEATURES = 2 * NUM_SELECTED + 1
NEAR_FRAMES = 4  # consecutive frames over which the nearer zones are confirmed
# Input: the observation it is computed from, and the scale of its values before tanh.
ZONE_INPUTS = {
    "zones": ("membrane_potential", 3.0),  # as excitation k/(n σ3); thresholds of the rule are 0.5 to 3
    "zones_spikes": ("spike_frequency", 100.0),  # [spikes/s]; ten spikes per frame at 30 Hz are 300
    "zones_ffi": ("ffi", 10.0),  # [grey levels]
}


class ZoneFeatures:
    """Accumulate the fields near the zone for the ego speed between two decisions of a policy.

    All values are 0 at speeds up to `StoppingZoneParams.crawl` and while the yaw rate gate is closed, because
    ego rotation excites the fields as an obstacle does.

    Args:
        name: "zones", "zones_spikes" or "zones_ffi".
        decay: Factor by which peaks decay per frame.
    """

    def __init__(self, name: str, decay: float) -> None:
        self.source, self._scale = ZONE_INPUTS[name]
        self._name, self._decay = name, decay
        params = StoppingZoneParams()
        self._near_share, self._crawl = params.near_share, params.crawl
        self._gate = YawRateGate(params.yaw_rate, params.settle)
        self._recent: list[np.ndarray] = []  # newest last, at most NEAR_FRAMES
        self._peak, self._confirmed = np.zeros(NUM_SELECTED), np.zeros(NUM_SELECTED + 1)

    def update(self, signal: np.ndarray, speed: float, yaw_rate: float) -> None:
        """Process one frame: observation of the neurons, shape (20,), speed [m/s] and yaw rate [rad/s]."""
        check_zone_shape(self._name, signal.shape)
        active = self._gate.update(yaw_rate) and speed > self._crawl
        values = excitation(signal) if self._name == "zones" else np.asarray(signal, np.float64)
        ground, upright = np.split(values, 2)
        selected = select_fields(ground, upright, speed, self._near_share) * active
        self._recent = [*self._recent, selected][-NEAR_FRAMES:]
        pair = np.minimum.reduce(self._recent[-2:])
        near = min(frame[-1] for frame in self._recent)
        self._confirmed = np.maximum(self._confirmed, [*pair, near])
        self._peak = np.maximum(selected, self._decay * self._peak) if active else np.zeros(NUM_SELECTED)

    def collect(self) -> np.ndarray:
        """Return the features since the last call, shape (11,), in [0, 1).

        The five values of `select_fields` as maxima over two consecutive frames (each pair counts with its
        minimum), the last of them also over four consecutive frames, then the five as decaying peaks.
        """
        features = np.tanh(np.concatenate([self._confirmed, self._peak]) / self._scale)
        self._confirmed = np.zeros(NUM_SELECTED + 1)
        return features


def select_fields(ground: np.ndarray, upright: np.ndarray, speed: float, near_share: float) -> np.ndarray:
    """Return the values of the fields that matter at an ego speed, shape (5,).

    The values are: ground and upright field of the zone for the speed, ground and upright field of the next
    farther zone, and the maximum over the nearer zones of the smaller of their two fields (0 without a nearer
    zone).

    Args:
        ground: Values of the ground fields, shape (10,).
        upright: Values of the upright fields, shape (10,).
        speed: Ego speed [m/s].
        near_share: Minimum design speed of nearer zones, relative to the ego speed.
    """
    zone, nearest = zone_index(speed), zone_index(near_share * speed)
    farther = min(zone + 1, NUM_ZONES - 1)
    near = np.minimum(ground[nearest:zone], upright[nearest:zone]).max(initial=0.0)
    return np.array([ground[zone], upright[zone], ground[farther], upright[farther], near])


def check_zone_shape(name: str, shape: tuple[int, ...]) -> None:
    """Raise ValueError unless an observation comes from the cameras of `stopping-zone`."""
    if shape != (2 * NUM_ZONES,):
        raise ValueError(
            f"policy input {name!r} requires the {2 * NUM_ZONES} cameras of stopping-zone, got {shape[0]}; "
            "train with --sensors-of stopping-zone"
        )
