"""Inputs of learned policies: scaled observations with a history, levels of fields, and normalisation."""

import pickle
import sys
import zipfile
from collections.abc import Mapping
from functools import cache
from multiprocessing import current_process
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lgmd_gym.agents.base import FPS, Observations
from lgmd_gym.agents.policies.kernels import PART, update_fields
from lgmd_gym.agents.sides import NUM_ALL_ROUND, NUM_COLUMNS, NUM_FORWARD_FIELDS, NUM_SIDE_FIELDS
from lgmd_gym.agents.zones import NUM_FIELDS
from lgmd_gym.aliases import Values
from lgmd_gym.errors import check_items, check_known, shown
from lgmd_gym.fields import Record, flag, number, record, value, whole
from lgmd_gym.processes.files import complete_file
from lgmd_gym.processes.inputs import MAX_BYTES, check_members, check_regular, read_bytes

TIME_CONSTANTS_S = (0.1, 0.4, 1.2)
NUM_LEVELS = 1 + len(TIME_CONSTANTS_S)  # features per field
POTENTIALS = ("membrane_potential", "column_potential")  # converted to excitations
NORM = 3.4  # about log(1 + 2 · 15), so that the features of `zones` are in [0, 1.01]
GAINS = 1.0 / (1.0 + FPS * np.array(TIME_CONSTANTS_S)[:, None])


class FieldInput(NamedTuple):
    """Definition of a policy input."""

    source: str  # observation that it is computed from
    factor: float  # factor of the values before the logarithm
    first: int = 0  # first of its values: a camera, or a column of `column_potential`
    last: int = NUM_FIELDS  # last one + 1

    @property
    def size(self) -> int:
        """Number of features."""
        return NUM_LEVELS * (self.last - self.first)


ZONE_INPUTS = {
    "zones": FieldInput("membrane_potential", 2.0),  # as excitation k/(n σ3), at most 15
    "zones_spikes": FieldInput("spike_frequency", 0.1),  # [spikes/s]; ten spikes per frame at 30 Hz are 300
    "zones_ffi": FieldInput("ffi", 2.0),  # [grey levels]
    "sides_ffi": FieldInput("ffi", 2.0, NUM_FORWARD_FIELDS, NUM_FORWARD_FIELDS + NUM_SIDE_FIELDS),  # DSN
    "columns": FieldInput("column_potential", 2.0, 0, NUM_COLUMNS),
}

# Offset and scale of each observation: (value - offset) / scale is near [-1, 1].
SCALES = {
    "spike_frequency": (0.0, 100.0),  # [spikes/s]; ten spikes per frame at 30 Hz are 300
    "membrane_potential": (0.5, 0.5),  # K is in [0.5, 1]
    "ffi": (0.0, 20.0),  # [grey levels]; roads give 1 to 9
    "ego_speed": (0.0, 20.0),  # [m/s]
    "ego_yaw_rate": (0.0, 0.5),  # [rad/s]
    "ego_acceleration": (0.0, 5.0),  # [m/s²]
    "known_deceleration": (7.5, 2.5),  # [m/s²]; wet and dry roads give 5 to 9.5
}
# Inputs computed over time: the observation they are computed from, and their scale.
DERIVED_INPUTS = {
    "speed_change": ("ego_speed", 1.0),  # since the last decision [m/s]; full braking changes 0.9 in 0.1 s
    "spike_peak": ("spike_frequency", 100.0),  # decays by PEAK_DECAY per frame
}
PEAK_DECAY = 0.955  # halves a peak in half a second at 30 Hz
LATCH_DEMAND = -0.5  # demands up to this value may latch
CLIP = 5.0  # limit of scaled values
FRAME = "frame"  # not scaled; reduced by `shrink`
INPUTS = (*SCALES, *DERIVED_INPUTS, *ZONE_INPUTS, FRAME)
DEFAULT_INPUTS = tuple(name for name in (*SCALES, *DERIVED_INPUTS) if name != "known_deceleration")

NORMALIZER_SUFFIX = ".npz"  # of the statistics of a `VecNormalize`
MAX_HISTORY = 1000  # decisions; also the limit of `repeat` and `shrink`


def _check_inputs(name: str, inputs: object) -> tuple[str, ...]:
    names = check_items(name, inputs, str, "names")
    if not names:
        raise ValueError(f"{name} must contain at least one policy input, got none")
    for item in names:
        check_known("policy input", item, INPUTS)
        if names.count(item) > 1:
            raise ValueError(f"{name} must contain each policy input once, got {item!r} twice")
    return names


@record
class FeatureConfig(Record):
    """Inputs, decision rate and latch of a learned policy."""

    label = "policy"

    inputs: tuple[str, ...] = value(
        DEFAULT_INPUTS,
        _check_inputs,
        "Observation keys, among them `frame` and `known_deceleration`, and inputs derived from them: "
        "`speed_change`, the change since the last decision; `spike_peak`, the decaying peak of the spike "
        "frequency; with the cameras of `stopping-zone`, `zones`, `zones_spikes` and `zones_ffi`; and with "
        "those of `all-round` `sides_ffi` and `columns` (see `FeatureHistory`)",
    )
    history: int = whole(
        6,
        f"[1, {MAX_HISTORY}]",
        "",
        "Number of decisions in the history, including the present one; inputs of zones, sides and columns "
        "contain averages over time and have no history",
    )
    repeat: int = whole(
        3,
        f"[1, {MAX_HISTORY}]",
        "",
        "Number of environment decisions per decision of the policy; at 30 Hz, 3 gives 10 Hz",
    )
    shrink: int = whole(
        2, f"[1, {MAX_HISTORY}]", "px", "Side of the pixel blocks that frames are averaged over"
    )
    latch: bool = flag(False, "Whether the first demand of -0.5 or less is held until the episode ends")
    reward_scale: float = number(
        1.0,
        "(0, inf)",
        "",
        "Factor on training rewards: contacts cost up to 20, and the loss of DQN is linear beyond 1",
    )

    def check(self) -> None:
        """Raise ValueError for inputs that require the cameras of two agents."""
        by_agent = {_cameras_for(name)[0]: name for name in self.inputs if name in ZONE_INPUTS}
        if len(by_agent) > 1:
            needs = " and ".join(f"{name!r} those of {agent}" for agent, name in by_agent.items())
            raise ValueError(f"policy inputs must have the same cameras: {needs}; omit one of the two")

    @property
    def cameras_of(self) -> str | None:
        """Agent whose cameras the inputs require: "stopping-zone" or "all-round"; None for any cameras."""
        return next((_cameras_for(name)[0] for name in self.inputs if name in ZONE_INPUTS), None)

    def latches(self, demands: Any) -> Any:
        """Return whether demands in [-1, 1] are held until the episode ends, bool, shape (N,)."""
        return (demands <= LATCH_DEMAND) & self.latch

    def box_arguments(self, shapes: dict[str, tuple[int, ...]]) -> dict[str, tuple[Any, ...]]:
        """Return low, high, shape and dtype of a Gymnasium `Box` for each input.

        Vectors have shape (history · n,), oldest first; frames (height, width, channels · history). `shapes`
        contains the shape of each observation.

        Raises:
            ValueError: If an input requires other cameras, or `shrink` is larger than the frame.
        """
        boxes: dict[str, tuple[Any, ...]] = {}
        for name in self.inputs:
            shape = shapes.get(source_observation(name), (0,))
            if name == FRAME:
                height, width, channels = shape
                if self.shrink > min(height, width):
                    side = f"the shorter side of the frame, {min(height, width)} px"
                    raise ValueError(f"shrink must be at most {side}, got {self.shrink}")
                shape = (height // self.shrink, width // self.shrink, channels * self.history)
                boxes[name] = (0, 255, shape, np.uint8)
                continue
            size = shape[0]
            if name in ZONE_INPUTS:
                check_zone_shape(name, shape)
                size = ZONE_INPUTS[name].size
            boxes[name] = (-CLIP, CLIP, (self.history_of(name) * size,), np.float32)
        return boxes

    def history_of(self, name: str) -> int:
        """Return the number of decisions in the history of an input."""
        return 1 if name in ZONE_INPUTS else self.history


def source_observation(name: str) -> str:
    """Return the observation that an input is computed from."""
    if name in ZONE_INPUTS:
        return ZONE_INPUTS[name].source
    return DERIVED_INPUTS[name][0] if name in DERIVED_INPUTS else name


Chosen: TypeAlias = np.ndarray | slice
"""Rows of arrays of environments."""


class FeatureHistory:
    """Features of a policy over its last decisions, in N environments.

    Call `update` at every decision of the environment and `stack` at every decision of the policy.

    For each field of a camera, `zones` and similar inputs have four features: the weaker level of the last
    two frames, then averages of the level with time constants of 0.1, 0.4 and 1.2 s. An average is the mean
    of all frames until their number reaches its time constant: averages that begin at 0 would tell a network
    the time since the start, which predicts the threat of a scenario but of no drive.

    The level of a field is its signal on a logarithmic scale. Membrane potentials K are converted to
    excitations log(K / (1 - K)). That of a direction-selective neuron is negative for motion to the left, and
    so is its level.

    Args:
        features: Configuration of the policy.
        num_envs: Number of environments N.
        zone_type: Type of the inputs in `ZONE_INPUTS`.
    """

    def __init__(
        self, features: FeatureConfig, num_envs: int = 1, zone_type: type[np.floating] = np.float32
    ) -> None:
        self.features, self._zone_type = features, zone_type
        self._required = {source_observation(name) for name in features.inputs}
        self._scaled = [name for name in features.inputs if name in SCALES or name in DERIVED_INPUTS]
        self._parts: dict[str, slice] = {}  # values of the scaled inputs, known at the first observation
        self._fields = _Fields([name for name in features.inputs if name in ZONE_INPUTS], num_envs)
        self._allocated = False
        self._all = np.arange(num_envs)
        self._updated = np.zeros(num_envs, np.bool_)  # environments with an observation
        self._stacked = np.zeros(num_envs, np.bool_)  # environments with a history

    def reset(self, mask: np.ndarray | None = None) -> None:
        """Clear the histories of some environments, or of all; their next features fill them."""
        selected = slice(None) if mask is None else mask
        self._updated[selected] = self._stacked[selected] = False

    def update(self, observations: Observations, rows: np.ndarray | None = None) -> None:
        """Process observations of `LGMDObservation`.

        Args:
            observations: Observations, shape (N, …) each.
            rows: Indices of the environments to update; None for all.

        Raises:
            ValueError: If an observation is missing, or comes from other cameras than an input requires.
        """
        chosen = self._chosen(rows)
        for name in self._required:
            if name not in observations:
                raise ValueError(f"the policy requires the observation {name!r}, got {sorted(observations)}")
        for name in self._fields.parts:
            check_zone_shape(name, np.shape(observations[source_observation(name)])[1:])
        if not self._allocated:
            self._allocate(observations)
        for name, part in self._parts.items():
            value = np.asarray(observations[source_observation(name)])[chosen]
            if name == "spike_peak":
                decayed = PEAK_DECAY * self._values[chosen, part]
                value = np.where(self._updated[chosen, None], np.maximum(value, decayed), value)
            self._values[chosen, part] = value
        if FRAME in self.features.inputs:
            self._frames[chosen] = np.asarray(observations[FRAME])[chosen]
        if self._fields.parts:
            indices = self._all if isinstance(chosen, slice) else chosen
            self._fields.update(observations, chosen, indices, self._updated)
        self._updated[chosen] = True

    def stack(self, rows: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Append the present features to the histories and return the histories of each input.

        Args:
            rows: Indices of M environments; None for all.

        Returns:
            Features, oldest first, arrays of shape (M, …).
        """
        chosen = self._chosen(rows)
        stacked: dict[str, np.ndarray] = {}
        if self._parts:
            scaled = _append(self._history, self._scale(chosen), chosen, self._stacked)
            for name, part in self._parts.items():
                stacked[name] = scaled[:, :, part].reshape(len(scaled), -1)
        if self._fields.parts:
            features = self._fields.features[chosen].astype(self._zone_type)
            stacked |= {name: features[:, part] for name, part in self._fields.parts.items()}
        if FRAME in self.features.inputs:
            small = shrink_frames(self._frames[chosen], self.features.shrink)
            frames = _append(self._frame_history, small, chosen, self._stacked)
            stacked[FRAME] = np.concatenate(list(np.moveaxis(frames, 1, 0)), axis=-1)
        self._stacked[chosen] = True
        return {name: stacked[name] for name in self.features.inputs}

    def _allocate(self, observations: Observations) -> None:
        """Make the arrays of the state for the shapes of observations."""
        num_envs, length, size = len(self._updated), self.features.history, 0
        offsets: list[float] = []
        scales: list[float] = []
        for name in self._scaled:
            count = np.shape(observations[source_observation(name)])[1]
            self._parts[name] = slice(size, size + count)
            offset, scale = SCALES.get(name) or (0.0, DERIVED_INPUTS[name][1])
            offsets, scales, size = offsets + [offset] * count, scales + [scale] * count, size + count
        self._offsets, self._scales = np.array([offsets, scales], np.float32)
        self._values = np.zeros((num_envs, size), np.float32)
        self._last = self._values.copy()  # at the last decision
        self._history = np.zeros((num_envs, length, size), np.float32)
        if FRAME in self.features.inputs:
            frames = np.asarray(observations[FRAME])
            shape = shrink_frames(frames[:1], self.features.shrink).shape[1:]
            self._frames = np.zeros((num_envs, *frames.shape[1:]), np.uint8)
            self._frame_history = np.zeros((num_envs, length, *shape), np.uint8)
        self._allocated = True

    def _scale(self, chosen: Chosen) -> np.ndarray:
        """Return the present scaled features of some environments, float32, shape (M, values)."""
        values = self._values[chosen]
        if "speed_change" in self._parts:
            part, present = self._parts["speed_change"], values
            values = present.copy()
            changes = present[:, part] - self._last[chosen, part]
            values[:, part] = np.where(self._stacked[chosen, None], changes, 0.0)
            self._last[chosen] = present
        scaled = (values - self._offsets) / self._scales
        return np.minimum(np.maximum(scaled, -CLIP), CLIP)  # faster than np.clip

    def _chosen(self, rows: np.ndarray | None) -> Chosen:
        """Return the rows of arrays of the state; a slice, which makes no copies, for all of them."""
        return slice(None) if rows is None or len(rows) == len(self._updated) else rows


class _Fields:
    """Features of the inputs in `ZONE_INPUTS`, in N environments.

    Args:
        names: Names of the inputs.
        num_envs: Number of environments N.

    Attributes:
        parts: Places of the features of each input.
        features: Present features, float64, shape (N, features).
    """

    def __init__(self, names: list[str], num_envs: int) -> None:
        self.parts: dict[str, slice] = {}
        if not names:
            return
        parts: list[tuple[int, int, float, bool]] = []
        size = 0
        for name in names:
            source, factor, first, last = ZONE_INPUTS[name]
            parts.append((size, last - first, factor, source in POTENTIALS))
            self.parts[name] = slice(NUM_LEVELS * size, NUM_LEVELS * (size + last - first))
            size += last - first
        self._definitions = np.array(parts, PART)
        self._signals, self._levels = np.zeros((2, num_envs, size))
        self._frames, self._gains = np.zeros(num_envs), np.ascontiguousarray(GAINS[:, 0])
        self.features = np.zeros((num_envs, NUM_LEVELS * size))

    def update(
        self, observations: Observations, chosen: Chosen, rows: np.ndarray, started: np.ndarray
    ) -> None:
        """Process observations of the environments `rows`, which `chosen` selects too."""
        for name, part in self.parts.items():
            source, _, first, last = ZONE_INPUTS[name]
            signal = np.asarray(observations[source])
            place = part.start // NUM_LEVELS
            self._signals[chosen, place : place + last - first] = signal[chosen, first:last]
        update_fields(
            self._signals, rows, started, self._definitions, self._gains, NORM,
            self._levels, self._frames, self.features,
        )  # fmt: skip


def _append(history: np.ndarray, values: np.ndarray, chosen: Chosen, started: np.ndarray) -> np.ndarray:
    """Append values, shape (M, …), to histories, shape (N, length, …), and return those of the environments.

    Values fill the histories of environments that have not started.
    """
    new = values[:, None]
    if history.shape[1] == 1:
        return new
    old = np.concatenate([history[chosen][:, 1:], new], axis=1)
    history[chosen] = np.where(started[chosen].reshape(-1, *[1] * values.ndim), old, new)
    return history[chosen].copy()


def shrink_frames(frames: np.ndarray, side: int) -> np.ndarray:
    """Return frames, uint8 (N, height, width, channels), with blocks of `side` × `side` px averaged."""
    if side == 1:
        return frames.copy()
    count, height, width, channels = frames.shape
    rows, columns = height // side, width // side
    blocks = frames[:, : rows * side, : columns * side].reshape(count, rows, side, columns, side, channels)
    means: np.ndarray = blocks.mean(axis=(2, 4), dtype=np.float32)
    return np.round(means).astype(np.uint8)


def check_zone_shape(name: str, shape: tuple[int, ...]) -> None:
    """Raise ValueError unless an observation comes from the cameras that an input requires."""
    agent, count, kind = _cameras_for(name)
    if shape != (count,):
        raise ValueError(
            f"policy input {name!r} requires the {count} {kind} of {agent}, got {shape[0]}; "
            f"train with --sensors-of {agent}"
        )


def _cameras_for(name: str) -> tuple[str, int, str]:
    """Return the agent whose cameras an input requires, and the number of its values."""
    if name == "columns":
        return "all-round", NUM_COLUMNS, "columns"
    if name == "sides_ffi":
        return "all-round", NUM_ALL_ROUND, "cameras"
    return "stopping-zone", NUM_FIELDS, "cameras"


@cache
def announce_pickle(path: Path) -> None:
    """Print once that loading a file executes code in it; worker processes leave it to their parent."""
    if current_process().name == "MainProcess":
        print(f"lgmd-gym: loading {shown(str(path))} executes the pickled code in this file", file=sys.stderr)


class Normalizer:
    """Statistics of a `VecNormalize` as arrays, in a NumPy file.

    Args:
        arrays: `epsilon`, `clip`, and `mean/NAME` and `var/NAME` of each normalised observation.
    """

    def __init__(self, arrays: Mapping[str, np.ndarray]) -> None:
        self._epsilon, self._clip = float(arrays["epsilon"]), float(arrays["clip"])
        self._means = {key[5:]: arrays[key] for key in arrays if key.startswith("mean/")}
        self._variances = {name: arrays[f"var/{name}"] for name in self._means}

    def normalize_obs(self, inputs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the inputs as `VecNormalize.normalize_obs` does."""
        normalized = dict(inputs)
        for name, mean in self._means.items():
            values = (inputs[name] - mean) / np.sqrt(self._variances[name] + self._epsilon)
            normalized[name] = np.clip(values, -self._clip, self._clip).astype(np.float32)
        return normalized


def save_normalizer(normalizer: Any, path: Path) -> None:
    """Write the statistics of a `VecNormalize` with a `Dict` observation to a NumPy file."""
    arrays: Values = {"epsilon": normalizer.epsilon, "clip": normalizer.clip_obs}
    for name in normalizer.norm_obs_keys if normalizer.norm_obs else ():
        statistics = normalizer.obs_rms[name]
        arrays |= {f"mean/{name}": statistics.mean, f"var/{name}": statistics.var}
    with complete_file(path) as part, part.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load_normalizer(path: Path) -> Any:
    """Return the statistics in a file of `save_normalizer`; a file of `VecNormalize.save` is unpickled.

    Raises:
        ValueError: If the file cannot be read or holds something else.
    """
    try:
        if path.suffix == NORMALIZER_SUFFIX:
            check_regular(path)
            with zipfile.ZipFile(path) as archive:
                check_members(archive, MAX_BYTES)
            with np.load(path, allow_pickle=False) as arrays:
                return Normalizer(dict(arrays))
        data = read_bytes(path)
        announce_pickle(path)
        normalizer: Any = pickle.loads(data)
    except OSError as error:
        raise ValueError(f"vec_normalize {shown(str(path))} cannot be read: {error.strerror}") from None
    except Exception as error:  # any exception of the unpickled code
        raise ValueError(f"vec_normalize {shown(str(path))} cannot be loaded ({error})") from None
    if not isinstance(normalizer, Mapping) and hasattr(normalizer, "normalize_obs"):
        normalizer.training = False
        return normalizer
    raise ValueError(f"vec_normalize {shown(str(path))} must be a file of VecNormalize.save")
