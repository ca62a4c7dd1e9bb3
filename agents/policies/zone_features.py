"""Policy inputs from the fields of `stopping-zone` and `all-round`: levels and their averages over time."""

from typing import NamedTuple

import numpy as np

from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.sides import NUM_ALL_ROUND, NUM_COLUMNS, NUM_MOTION_FIELDS
from lgmd_gym.agents.zones import NUM_FIELDS

TIME_CONSTANTS_S = (0.1, 0.4, 1.2)
NUM_LEVELS = 1 + len(TIME_CONSTANTS_S)  # features per field
POTENTIALS = ("membrane_potential", "column_potential")  # converted to responses
NORM = 3.4  # about log(1 + 2 · 15), so that the features of `zones` are in [0, 1.01]
GAINS = 1.0 / (1.0 + FPS * np.array(TIME_CONSTANTS_S)[:, None])
_MARGIN = 3e-7  # of K to 0 and 1, so that responses are at most 15


class FieldInput(NamedTuple):
    """Definition of a policy input.

    Attributes:
        source: Observation that it is computed from.
        factor: Factor of the values before the logarithm.
        first: First of its values: a camera, or a column of `column_potential`.
        last: Last one + 1.
    """

    source: str
    factor: float
    first: int = 0
    last: int = NUM_FIELDS

    @property
    def size(self) -> int:
        """Number of features."""
        return NUM_LEVELS * (self.last - self.first)


ZONE_INPUTS = {
    "zones": FieldInput("membrane_potential", 2.0),  # as response k/(n σ3), at most 15
    "zones_spikes": FieldInput("spike_frequency", 0.1),  # [spikes/s]; ten spikes per frame at 30 Hz are 300
    "zones_ffi": FieldInput("ffi", 2.0),  # [grey levels]
    "sides": FieldInput("membrane_potential", 2.0, NUM_FIELDS, NUM_MOTION_FIELDS),  # LGMD and DSN
    "sides_ffi": FieldInput("ffi", 2.0, NUM_FIELDS, NUM_MOTION_FIELDS),
    "columns": FieldInput("column_potential", 2.0, 0, NUM_COLUMNS),
}


class ZoneFeatures:
    """Levels of the fields and their low-pass filtered values, see `levels_of`.

    Args:
        name: A key of `ZONE_INPUTS`.
    """

    def __init__(self, name: str) -> None:
        self._name, self._input = name, ZONE_INPUTS[name]
        self.source = self._input.source
        fields = self._input.last - self._input.first
        self._level = self._last = np.zeros(fields)
        self._averages = np.zeros((len(TIME_CONSTANTS_S), fields))
        self._started = False

    def update(self, signal: np.ndarray) -> None:
        """Process one frame: observation of the neurons, shape (cameras,)."""
        level = levels_of(self._name, np.asarray(signal))
        self._last, self._level = (self._level if self._started else level), level
        self._averages += GAINS * (level - self._averages)
        self._started = True

    def collect(self) -> np.ndarray:
        """Return the features, shape (4 · fields,).

        For all fields in turn: the weaker level of the last two frames, then the averages of the level with
        time constants of 0.1, 0.4 and 1.2 s, which begin at 0.
        """
        return np.concatenate([weaker(self._level, self._last), self._averages.ravel()])


def levels_of(name: str, signal: np.ndarray) -> np.ndarray:
    """Return the levels of the fields of an input: its signal on a logarithmic scale, float64, (..., fields).

    Membrane potentials K are converted to responses log(K / (1 - K)). The response of a direction-selective
    neuron is negative for motion to the left, and so is its level.

    Args:
        name: A key of `ZONE_INPUTS`.
        signal: Observation of the neurons, shape (..., cameras) or (..., columns).

    Raises:
        ValueError: If the observation comes from other cameras than the input requires.
    """
    check_zone_shape(name, signal.shape[-1:])
    field = ZONE_INPUTS[name]
    values = signal[..., field.first : field.last].astype(np.float64)
    if field.source in POTENTIALS:
        values = response_of(values)
    return np.copysign(np.log1p(field.factor * np.abs(values)), values) / NORM


def weaker(level: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return the level with the smaller magnitude, of two frames, so that a single frame is not enough."""
    return np.where(np.abs(level) <= np.abs(last), level, last)


def response_of(potential: np.ndarray) -> np.ndarray:
    """Return log(K / (1 - K)), the inverse of eq. 10, in [-15, 15]."""
    k = np.clip(potential, _MARGIN, 1.0 - _MARGIN)
    return np.log(k / (1.0 - k))


def check_zone_shape(name: str, shape: tuple[int, ...]) -> None:
    """Raise ValueError unless an observation comes from the cameras that an input requires."""
    if ZONE_INPUTS[name].source == "column_potential":
        agent, allowed, kind = "all-round", (NUM_COLUMNS,), "columns"
    elif ZONE_INPUTS[name].last == NUM_FIELDS:
        agent, allowed, kind = "stopping-zone", (NUM_FIELDS, NUM_ALL_ROUND), "cameras"
    else:
        agent, allowed, kind = "all-round", (NUM_ALL_ROUND,), "cameras"
    if shape not in [(count,) for count in allowed]:
        raise ValueError(
            f"policy input {name!r} requires the {allowed[0]} {kind} of {agent}, got {shape[0]}; "
            f"train with --sensors-of {agent}"
        )
