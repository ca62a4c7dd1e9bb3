"""What a learned policy is shown of an observation: scaled, and with a memory of the last decisions."""

from collections import deque
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lgmd_gym.agents.options import positive, whole
from lgmd_gym.agents.stopping_zone import SPEEDS_KMH, around_the_zone, excitation
from lgmd_gym.errors import check_keys, unknown_name

# Where each observation is brought near [-1, 1] from: (value - offset) / scale.
SCALES = {
    "spike_frequency": (0.0, 100.0),  # [spikes/s]; ten spikes a frame at 30 Hz are 300
    "membrane_potential": (0.5, 0.5),  # K starts at 0.5 and ends at 1
    "ffi": (0.0, 20.0),  # [grey levels]; roads give 1 to 9
    "ego_speed": (0.0, 20.0),  # [m/s]
    "ego_yaw_rate": (0.0, 0.5),  # [rad/s]
}
# What is made of observations over decisions: its sources, how it is scaled.
DERIVED = {
    "speed_change": (("ego_speed",), 1.0),  # since the last decision [m/s]; full braking takes 0.9 in 0.1 s
    "spike_peak": (("spike_frequency",), 100.0),  # fades by FADE a decision: silence is not clearance
}
# What the eye of `stopping-zone` tells, sorted by own speed; see `around_the_zone`.
ZONED = {
    "zones": (("membrane_potential", "ego_speed"), 3.0),  # excitation k/(n σ3)
    "zones_peak": (("membrane_potential", "ego_speed"), 3.0),  # the same, fading as spike_peak does
    "zones_ffi": (("ffi", "ego_speed"), 20.0),  # the mean change of light in its place [grey levels]
}
AROUND = 5  # values that `around_the_zone` gives
FADE = 0.93
HARD = -0.5  # a demand of this or less is hard braking, which may latch
LIMIT = 5.0  # beyond this, scaled values are clipped
FRAME = "frame"  # passed on as it is; `shrink` pixels become one
INPUTS = (*SCALES, *DERIVED, *ZONED, FRAME)


@dataclass(frozen=True)
class Features:
    """What a policy sees.

    Attributes:
        inputs: Observation keys, or what is derived from them over decisions: `speed_change` and
            `spike_peak`, the highest spike frequency lately; with the eye of `stopping-zone` also `zones`,
            `zones_peak` and `zones_ffi`, its fields sorted by own speed.
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
    def from_dict(cls, values: dict[str, Any]) -> "Features":
        """Return features from plain values; unknown keys are refused."""
        check_keys("policy feature", values, cls.__dataclass_fields__)
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self) | {"inputs": list(self.inputs)}

    def latches(self, demand: float) -> bool:
        """Return whether a demand in [-1, 1] is to be held to the episode's end."""
        return self.latch and demand <= HARD

    def limits(self, shapes: dict[str, tuple[int, ...]]) -> dict[str, tuple[Any, Any, tuple[int, ...], Any]]:
        """Return lowest value, highest value, shape and dtype of each input, given the observation's shapes.

        Signals are (history · n,), oldest first; frames (height, width, channels · history).

        Raises:
            ValueError: If the eye is not the one that an input needs.
        """
        spaces = {}
        for name in self.inputs:
            shape = shapes[sources_of(name)[0]]
            if name == FRAME:
                height, width, channels = shape
                shape = (height // self.shrink, width // self.shrink, channels * self.history)
                spaces[name] = (0, 255, shape, np.uint8)
            else:
                if name in ZONED:
                    check_zones(name, shape)
                size = AROUND if name in ZONED else shape[0]
                spaces[name] = (-LIMIT, LIMIT, (self.history * size,), np.float32)
        return spaces


def sources_of(name: str) -> tuple[str, ...]:
    """Return the observations that an input is made of."""
    return (DERIVED | ZONED)[name][0] if name in DERIVED or name in ZONED else (name,)


class Memory:
    """The last decisions' inputs.

    Args:
        features: What is kept.
    """

    def __init__(self, features: Features) -> None:
        self.features = features
        self._kept: dict[str, deque[np.ndarray]] = {}
        self.clear()

    def clear(self) -> None:
        """Forget everything; the next observation then fills the whole history."""
        self._kept = {}
        self._speed: np.ndarray | None = None
        self._peaks: dict[str, np.ndarray] = {}

    def see(self, observation: dict[str, Any]) -> dict[str, np.ndarray]:
        """Take in an observation of `LGMDObservation` and return what the policy is shown.

        Raises:
            ValueError: If the observation lacks an input, or the eye is not the one it needs.
        """
        shown = {}
        for name in self.features.inputs:
            for source in sources_of(name):
                if source not in observation:
                    raise ValueError(
                        f"the policy needs the observation {source!r}, which this eye does not give"
                    )
            value = self._prepared(name, observation)
            kept = self._kept.setdefault(name, deque([value] * self.features.history, self.features.history))
            kept.append(value)
            shown[name] = np.concatenate(kept, axis=-1)
        return shown

    def _prepared(self, name: str, observation: dict[str, Any]) -> np.ndarray:
        value = np.asarray(observation[sources_of(name)[0]])
        if name == FRAME:
            return shrunk(value, self.features.shrink)
        if name in ZONED:
            value = zoned(name, value, float(observation["ego_speed"][0]))
        if name == "speed_change":
            value, self._speed = value - (value if self._speed is None else self._speed), value
        elif name.endswith("_peak"):
            before = self._peaks.get(name)
            self._peaks[name] = value = value if before is None else np.maximum(value, FADE * before)
        offset, scale = SCALES.get(name) or (0.0, (DERIVED | ZONED)[name][1])
        return np.clip((value - offset) / scale, -LIMIT, LIMIT).astype(np.float32)


def zoned(name: str, value: np.ndarray, speed: float) -> np.ndarray:
    """Return an input that is sorted by own speed [m/s], shape (5,)."""
    check_zones(name, value.shape)
    ground, upright = np.split(value if name == "zones_ffi" else excitation(value), 2)
    return around_the_zone(ground, upright, speed)


def check_zones(name: str, shape: tuple[int, ...]) -> None:
    """Refuse values that are not those of the eye of `stopping-zone`.

    Raises:
        ValueError: Names the input and the mend.
    """
    if shape != (2 * len(SPEEDS_KMH),):
        raise ValueError(
            f"the policy input {name!r} needs the eye of stopping-zone with {2 * len(SPEEDS_KMH)} cameras, "
            f"got {shape[0]}; train with --eye stopping-zone"
        )


def shrunk(frame: np.ndarray, side: int) -> np.ndarray:
    """Return a frame, uint8 (height, width, channels), with each square of `side` px as its mean."""
    if side == 1:
        return frame
    height, width, channels = frame.shape
    rows, columns = height // side, width // side
    blocks = frame[: rows * side, : columns * side].reshape(rows, side, columns, side, channels)
    return np.round(blocks.mean(axis=(1, 3), dtype=np.float32)).astype(np.uint8)
