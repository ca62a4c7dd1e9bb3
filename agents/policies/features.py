"""What a learned policy is shown of an observation: scaled, and with a memory of the last decisions."""

from collections import deque
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents.options import positive, whole
from lgmd_gym.agents.policies.zone_memory import TOLD, ZONED, ZoneMemory, check_zones
from lgmd_gym.errors import check_keys, unknown_name

# Where each observation is brought near [-1, 1] from: (value - offset) / scale.
SCALES = {
    "spike_frequency": (0.0, 100.0),  # [spikes/s]; ten spikes a frame at 30 Hz are 300
    "membrane_potential": (0.5, 0.5),  # K starts at 0.5 and ends at 1
    "ffi": (0.0, 20.0),  # [grey levels]; roads give 1 to 9
    "ego_speed": (0.0, 20.0),  # [m/s]
    "ego_yaw_rate": (0.0, 0.5),  # [rad/s]
}
# What is made of one observation over time: which one, and how it is scaled.
DERIVED = {
    "speed_change": ("ego_speed", 1.0),  # since the last decision [m/s]; full braking takes 0.9 in 0.1 s
    "spike_peak": ("spike_frequency", 100.0),  # fades by FADE a frame: silence is not clearance
}
FADE = 0.955  # half is left after half a second
LATCH_DEMAND = -0.5  # a demand of this or less is hard braking, which may latch
LIMIT = 5.0  # beyond this, scaled values are clipped
FRAME = "frame"  # passed on as it is; `shrink` pixels become one
INPUTS = (*SCALES, *DERIVED, *ZONED, FRAME)


@dataclass(frozen=True)
class FeatureConfig:
    """What a policy sees.

    Attributes:
        inputs: Observation keys, or what is derived from them over time: `speed_change` and `spike_peak`, the
            highest spike frequency lately; with the eye of `stopping-zone` also `zones`, `zones_spikes` and
            `zones_ffi`, its fields sorted by own speed (`ZoneMemory`).
        history: Number of decisions remembered, the present one included, >= 1.
        repeat: Environment decisions that one decision of the policy holds for, >= 1; at 30 Hz, 3 let it
            decide at 10 Hz.
        shrink: Side of the squares of pixels whose mean a frame keeps, >= 1 [px].
        latch: Whether the first hard braking (a demand of -0.5 or less) is held to the episode's end, as
            rules hold theirs; what is learned is then when to brake.
        reward_scale: What rewards are multiplied by in training; contacts cost up to 20, and DQN's loss is
            no longer quadratic beyond 1.
    """

    inputs: tuple[str, ...] = (*SCALES, *DERIVED)
    history: int = 6
    repeat: int = 3
    shrink: int = 2
    latch: bool = False
    reward_scale: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", tuple(self.inputs))
        if not self.inputs:
            raise ValueError("inputs needs at least one observation key, got none")
        for name in self.inputs:
            if name not in INPUTS:
                raise unknown_name("policy input", name, INPUTS)
        for name in ("history", "repeat", "shrink"):
            object.__setattr__(self, name, whole(name, getattr(self, name), 1))
        if not isinstance(self.latch, bool):
            raise ValueError(f"latch must be true or false, got {self.latch!r}")
        object.__setattr__(self, "reward_scale", positive("reward_scale", self.reward_scale))

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "FeatureConfig":
        """Return features from plain values; unknown keys are refused."""
        check_keys("policy feature", values, cls.__dataclass_fields__)
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self) | {"inputs": list(self.inputs)}

    def latches(self, demand: float) -> bool:
        """Return whether a demand in [-1, 1] is to be held to the episode's end."""
        return self.latch and demand <= LATCH_DEMAND

    def box_arguments(
        self, shapes: dict[str, tuple[int, ...]]
    ) -> dict[str, tuple[Any, Any, tuple[int, ...], Any]]:
        """Return lowest value, highest value, shape and dtype of each input, given the observation's shapes.

        Signals are (history · n,), oldest first; frames (height, width, channels · history).

        Raises:
            ValueError: If the eye is not the one that an input needs.
        """
        spaces = {}
        for name in self.inputs:
            shape = shapes[source_observation(name)]
            if name == FRAME:
                height, width, channels = shape
                shape = (height // self.shrink, width // self.shrink, channels * self.history)
                spaces[name] = (0, 255, shape, np.uint8)
            else:
                if name in ZONED:
                    check_zones(name, shape)
                size = TOLD if name in ZONED else shape[0]
                spaces[name] = (-LIMIT, LIMIT, (self.history * size,), np.float32)
        return spaces


def source_observation(name: str) -> str:
    """Return the observation that an input is made of."""
    return (DERIVED | ZONED)[name][0] if name in DERIVED or name in ZONED else name


class FeatureHistory:
    """What a policy is shown: it takes in every observation, and tells at the policy's own pace.

    Args:
        features: What is kept.
    """

    def __init__(self, features: FeatureConfig) -> None:
        self.features = features
        self._needed = {source_observation(name) for name in features.inputs}
        if any(name in ZONED for name in features.inputs):
            self._needed |= {"ego_speed", "ego_yaw_rate"}
        self._needed.discard(FRAME)  # only the one at the decision counts
        self.reset()

    def reset(self) -> None:
        """Forget everything; the next thing told then fills the whole history."""
        self._kept: dict[str, deque[np.ndarray]] = {}
        self._observation: dict[str, Any] = {}
        self._speed: np.ndarray | None = None
        self._peak: np.ndarray | None = None
        self._zones = {name: ZoneMemory(name, FADE) for name in self.features.inputs if name in ZONED}

    def update(self, observation: dict[str, Any]) -> None:
        """Take in an observation of `LGMDObservation`; to be called at every decision of the environment.

        Raises:
            ValueError: If the observation lacks an input, or the eye is not the one it needs.
        """
        for name in self._needed:
            if name not in observation:
                raise ValueError(f"the policy needs the observation {name!r}, which this eye does not give")
        self._observation = observation
        if "spike_peak" in self.features.inputs:
            now = np.asarray(observation["spike_frequency"])
            self._peak = now if self._peak is None else np.maximum(now, FADE * self._peak)
        for zones in self._zones.values():
            speed, yaw_rate = (float(observation[name][0]) for name in ("ego_speed", "ego_yaw_rate"))
            zones.see(observation[zones.source], speed, yaw_rate)

    def stack(self) -> dict[str, np.ndarray]:
        """Return what the policy is shown; to be called at each of its decisions, after `see`."""
        shown = {}
        for name in self.features.inputs:
            value = self._prepared(name)
            kept = self._kept.setdefault(name, deque([value] * self.features.history, self.features.history))
            kept.append(value)
            shown[name] = np.concatenate(kept, axis=-1)
        return shown

    def _prepared(self, name: str) -> np.ndarray:
        if name in ZONED:
            return self._zones[name].told().astype(np.float32)
        value = np.asarray(self._observation[source_observation(name)])
        if name == FRAME:
            return shrink_frame(value, self.features.shrink)
        if name == "speed_change":
            value, self._speed = value - (value if self._speed is None else self._speed), value
        elif name == "spike_peak":
            value = np.asarray(self._peak)
        offset, scale = SCALES.get(name) or (0.0, DERIVED[name][1])
        return np.clip((value - offset) / scale, -LIMIT, LIMIT).astype(np.float32)


def shrink_frame(frame: np.ndarray, side: int) -> np.ndarray:
    """Return a frame, uint8 (height, width, channels), with each square of `side` px as its mean."""
    if side == 1:
        return frame
    height, width, channels = frame.shape
    rows, columns = height // side, width // side
    blocks = frame[: rows * side, : columns * side].reshape(rows, side, columns, side, channels)
    return np.round(blocks.mean(axis=(1, 3), dtype=np.float32)).astype(np.uint8)
