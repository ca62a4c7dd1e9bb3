"""Inputs of learned policies: scaled observations with a history."""

from collections import deque
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents.policies.zone_features import ZONE_INPUTS, ZoneFeatures, check_zone_shape
from lgmd_gym.agents.zones import NUM_FIELDS
from lgmd_gym.errors import check_flag, check_items, check_keys, check_known, check_positive, check_whole

# Offset and scale of each observation: (value - offset) / scale is near [-1, 1].
SCALES = {
    "spike_frequency": (0.0, 100.0),  # [spikes/s]; ten spikes per frame at 30 Hz are 300
    "membrane_potential": (0.5, 0.5),  # K is in [0.5, 1]
    "ffi": (0.0, 20.0),  # [grey levels]; roads give 1 to 9
    "ego_speed": (0.0, 20.0),  # [m/s]
    "ego_yaw_rate": (0.0, 0.5),  # [rad/s]
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

MAX_HISTORY = 1000  # decisions; also the limit of `repeat` and `shrink`


@dataclass(frozen=True)
class FeatureConfig:
    """Inputs, decision rate and latch of a learned policy.

    Attributes:
        inputs: Observation keys, among them `frame` and `known_deceleration`, and inputs derived from them:
            `speed_change`, the change since the last decision; `spike_peak`, the decaying peak of the spike
            frequency; with the cameras of `stopping-zone`, `zones`, `zones_spikes` and `zones_ffi`; and with
            those of `all-round` also `sides`, `sides_ffi` and `columns` (see `ZoneFeatures`).
        history: Number of decisions in the history, including the present one, >= 1; inputs of zones,
            sides and columns contain averages over time and have no history.
        repeat: Number of environment decisions per decision of the policy, >= 1. At 30 Hz, 3 gives 10 Hz.
        shrink: Side of the pixel blocks that frames are averaged over, >= 1 [px].
        latch: Whether the first demand of -0.5 or less is held until the episode ends.
        reward_scale: Factor on training rewards, > 0. Contacts cost up to 20, and the loss of DQN is linear
            beyond 1.
    """

    inputs: tuple[str, ...] = DEFAULT_INPUTS
    history: int = 6
    repeat: int = 3
    shrink: int = 2
    latch: bool = False
    reward_scale: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", check_items("inputs", self.inputs, str, "names"))
        if not self.inputs:
            raise ValueError("inputs must contain at least one policy input, got none")
        for name in self.inputs:
            check_known("policy input", name, INPUTS)
            if self.inputs.count(name) > 1:
                raise ValueError(f"inputs must contain each policy input once, got {name!r} twice")
        for name in ("history", "repeat", "shrink"):
            object.__setattr__(self, name, check_whole(name, getattr(self, name), 1, MAX_HISTORY))
        object.__setattr__(self, "latch", check_flag("latch", self.latch))
        object.__setattr__(self, "reward_scale", check_positive("reward_scale", self.reward_scale))

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "FeatureConfig":
        """Return the configuration from plain values; unknown keys raise ValueError."""
        check_keys("policy feature", values, cls.__dataclass_fields__)
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as plain values."""
        return asdict(self) | {"inputs": list(self.inputs)}

    @property
    def cameras_of(self) -> str | None:
        """Agent whose cameras the inputs require: "stopping-zone" or "all-round"; None for any cameras."""
        required = [ZONE_INPUTS[name].last for name in self.inputs if name in ZONE_INPUTS]
        if not required:
            return None
        return "stopping-zone" if max(required) == NUM_FIELDS else "all-round"

    def latches(self, demand: float) -> bool:
        """Return whether a demand in [-1, 1] is held until the episode ends."""
        return self.latch and demand <= LATCH_DEMAND

    def box_arguments(self, shapes: dict[str, tuple[int, ...]]) -> dict[str, tuple[Any, ...]]:
        """Return low, high, shape and dtype of a Gymnasium `Box` for each input.

        Vectors have shape (history · n,), oldest first; frames (height, width, channels · history). `shapes`
        contains the shape of each observation.

        Raises:
            ValueError: If an input requires other cameras, or `shrink` is larger than the frame.
        """
        boxes = {}
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


class FeatureHistory:
    """Features of a policy over its last decisions.

    Call `update` at every decision of the environment and `stack` at every decision of the policy.

    Args:
        features: Configuration of the policy.
    """

    def __init__(self, features: FeatureConfig) -> None:
        self.features = features
        self._required = {source_observation(name) for name in features.inputs}
        self._required.discard(FRAME)  # `update` does not process frames
        self.reset()

    def reset(self) -> None:
        """Clear the history; the first features of the next episode fill it."""
        self._history: dict[str, deque[np.ndarray]] = {}
        self._observation: dict[str, Any] = {}
        self._speed: np.ndarray | None = None
        self._peak: np.ndarray | None = None
        names = [name for name in self.features.inputs if name in ZONE_INPUTS]
        self._zones = {name: ZoneFeatures(name) for name in names}

    def update(self, observation: dict[str, Any]) -> None:
        """Process an observation of `LGMDObservation`.

        Raises:
            ValueError: If an observation is missing, or comes from other cameras than an input requires.
        """
        for name in self._required:
            if name not in observation:
                raise ValueError(f"the policy requires the observation {name!r}, got {sorted(observation)}")
        self._observation = observation
        if "spike_peak" in self.features.inputs:
            frequency = np.asarray(observation["spike_frequency"])
            self._peak = frequency if self._peak is None else np.maximum(frequency, PEAK_DECAY * self._peak)
        for zones in self._zones.values():
            zones.update(observation[zones.source])

    def stack(self) -> dict[str, np.ndarray]:
        """Append the present features to the history and return the history of each input."""
        stacked = {}
        for name in self.features.inputs:
            value = self._feature(name)
            length = self.features.history_of(name)
            filled = deque([value] * length, length)
            history = self._history.setdefault(name, filled)
            history.append(value)
            stacked[name] = np.concatenate(history, axis=-1)
        return stacked

    def _feature(self, name: str) -> np.ndarray:
        if name in ZONE_INPUTS:
            return self._zones[name].collect().astype(np.float32)
        value = np.asarray(self._observation[source_observation(name)])
        if name == FRAME:
            return shrink_frame(value, self.features.shrink)
        if name == "speed_change":
            value, self._speed = value - (value if self._speed is None else self._speed), value
        elif name == "spike_peak":
            value = np.asarray(self._peak)
        offset, scale = SCALES.get(name) or (0.0, DERIVED_INPUTS[name][1])
        return np.clip((value - offset) / scale, -CLIP, CLIP).astype(np.float32)


def shrink_frame(frame: np.ndarray, side: int) -> np.ndarray:
    """Return a frame, uint8 (height, width, channels), with each block of `side` × `side` px averaged."""
    if side == 1:
        return frame
    height, width, channels = frame.shape
    rows, columns = height // side, width // side
    blocks = frame[: rows * side, : columns * side].reshape(rows, side, columns, side, channels)
    return np.round(blocks.mean(axis=(1, 3), dtype=np.float32)).astype(np.uint8)
