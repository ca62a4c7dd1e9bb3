"""Policy inputs from the cameras of `stopping-zone`: levels of all fields and their averages over time."""

import numpy as np

from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.rule import excitation
from lgmd_gym.agents.zones import NUM_FIELDS

TIME_CONSTANTS_S = (0.1, 0.4, 1.2)
NUM_ZONE_FEATURES = (1 + len(TIME_CONSTANTS_S)) * NUM_FIELDS
# Input: the observation it is computed from, and the factor of its values before the logarithm.
ZONE_INPUTS = {
    "zones": ("membrane_potential", 2.0),  # as excitation k/(n σ3), at most 15
    "zones_spikes": ("spike_frequency", 0.1),  # [spikes/s]; ten spikes per frame at 30 Hz are 300
    "zones_ffi": ("ffi", 2.0),  # [grey levels]
}
_NORM = 3.4  # log(1 + 2 · 15), so that the features of `zones` are in [0, 1]
_GAINS = 1.0 / (1.0 + FPS * np.array(TIME_CONSTANTS_S)[:, None])


class ZoneFeatures:
    """Levels of the fields and their low-pass filtered values, on a logarithmic scale.

    Args:
        name: "zones", "zones_spikes" or "zones_ffi".
    """

    def __init__(self, name: str) -> None:
        self.source, self._factor = ZONE_INPUTS[name]
        self._name = name
        self._level = self._last = np.zeros(NUM_FIELDS)
        self._averages = np.zeros((len(TIME_CONSTANTS_S), NUM_FIELDS))
        self._started = False

    def update(self, signal: np.ndarray) -> None:
        """Process one frame: observation of the neurons, shape (17,)."""
        check_zone_shape(self._name, signal.shape)
        values = excitation(signal) if self._name == "zones" else np.asarray(signal, np.float64)
        level = np.log1p(self._factor * values) / _NORM
        self._last, self._level = (self._level if self._started else level), level
        self._averages += _GAINS * (level - self._averages)
        self._started = True

    def collect(self) -> np.ndarray:
        """Return the features, shape (68,).

        For all fields in turn: the smaller level of the last two frames, then the averages of the level with
        time constants of 0.1, 0.4 and 1.2 s, which begin at 0.
        """
        return np.concatenate([np.minimum(self._level, self._last), self._averages.ravel()])


def check_zone_shape(name: str, shape: tuple[int, ...]) -> None:
    """Raise ValueError unless an observation comes from the cameras of `stopping-zone`."""
    if shape != (NUM_FIELDS,):
        raise ValueError(
            f"policy input {name!r} requires the {NUM_FIELDS} cameras of stopping-zone, got {shape[0]}; "
            "train with --sensors-of stopping-zone"
        )
