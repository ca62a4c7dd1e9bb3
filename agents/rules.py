"""Rules on the neuron: thresholds of the spike frequency, and of the excitation of camera fields."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from lgmd_gym.agents.base import TRACE, Infos, LatchingAgent, Observations, State
from lgmd_gym.agents.stages import Evidence, StageParams
from lgmd_gym.agents.zones import (
    DRY_DECELERATION,
    LOW_FIELD,
    LOW_ZONES,
    NUM_FIELDS,
    NUM_ZONES,
    REACHES,
    REACTION,
    zone_camera,
    zone_cameras,
)
from lgmd_gym.aliases import Values
from lgmd_gym.errors import check_keys, check_type, shown
from lgmd_gym.fields import Record, declarations, number, record, whole
from lgmd_gym.processes.inputs import read_toml

POSITIVE, COUNT = "(0, inf)", "[1, inf)"
CAMERA = "camera"  # group of the parameters that determine the cameras of a rule
POTENTIAL_MARGIN = 3e-7  # of K to 0 and 1, so that excitations are at most 15


def excitation(membrane_potential: ArrayLike) -> np.ndarray:
    """Return the mean excitation k/(n σ3) = log(K / (1 - K)), the inverse of eq. 10, in [-15, 15], float64.

    The membrane potential K saturates: excitations above 3 map to the interval from 0.95 to 1. Those of a
    direction-selective neuron are negative for motion to the left.
    """
    k = np.asarray(membrane_potential, dtype=np.float64)
    k = np.minimum(np.maximum(k, POTENTIAL_MARGIN), 1.0 - POTENTIAL_MARGIN)  # faster than np.clip
    return np.log(k / (1.0 - k))


class Reading(NamedTuple):
    """Neuron outputs and ego motion of N environments for one camera frame."""

    frequency: np.ndarray  # highest spike frequency of all cameras, shape (N,) [spikes/s]
    potential: np.ndarray  # membrane potentials K of eq. 10, shape (N, cameras)
    speed: np.ndarray  # ego speeds, shape (N,) [m/s]
    yaw_rate: np.ndarray  # ego yaw rates, means over the decision interval, shape (N,) [rad/s]
    due: np.ndarray  # environments that have this frame, bool, shape (N,)


def readings(observations: Observations, infos: Infos) -> Iterator[Reading]:
    """Yield one reading per camera frame since the last decision; without a trace, that of the last frame."""
    yaw_rate = observations["ego_yaw_rate"][:, 0].astype(np.float64)
    if TRACE not in infos:
        frequency = observations["spike_frequency"].max(axis=1).astype(np.float64)
        speed = observations["ego_speed"][:, 0].astype(np.float64)
        due = np.ones(len(speed), np.bool_)
        yield Reading(frequency, observations["membrane_potential"], speed, yaw_rate, due)
        return
    for frame in infos[TRACE]:
        yield Reading(
            frequency=frame.response.spike_frequency.max(axis=1).astype(np.float64),
            potential=frame.response.membrane_potential,
            speed=np.asarray(frame.ego_speed),
            yaw_rate=yaw_rate,
            due=~np.isnan(frame.time),
        )


class RuleParams(Record):
    """Base class of the parameters of rules, from agent strings or TOML files.

    A field states the range that tuning searches. The fields of the group "camera" determine the cameras.
    """

    __slots__ = ()

    @classmethod
    def from_options(cls, agent: str, options: Mapping[str, Any]) -> Self:
        """Return parameters for the options of an agent string.

        Args:
            agent: Agent name, for error messages.
            options: Values by field name. The key `toml` names a file with further values; values in
                `options` take precedence. Missing fields keep their defaults.

        Raises:
            ValueError: For an unknown option, a value out of bounds, or an unreadable file.
        """
        values = dict(options)
        if "toml" in values:
            values = {**_read_toml(values.pop("toml")), **values}
        check_keys(f"option of agent {agent}", values, [*(item.name for item in declarations(cls)), "toml"])
        return cls(**values)


class Rule(LatchingAgent):
    """Base class: brakes fully once `should_brake` returns True for a camera frame, and latches.

    A latched brake is required because a spike frequency of 0 does not imply a free road: when a uniform
    surface fills a narrow field of view, the image is constant and the neuron stops spiking.

    Args:
        params: Parameters; None to build them from `options`.
        options: Fields of the parameters, or `toml` for a file of them.

    Attributes:
        Params: Class of the parameters.
    """

    Params: ClassVar[type[RuleParams]]

    def __init__(self, params: RuleParams | None = None, **options: Any) -> None:
        if params is None:
            params = self.Params.from_options(self.name, options)
        elif options:
            raise ValueError(f"params and options exclude each other, got params and {', '.join(options)}")
        self.params: Any = check_type("params", params, self.Params)
        super().__init__()

    @classmethod
    def options(cls) -> dict[str, object]:
        """Return the options of the rule's string with their defaults."""
        return {item.name: item.default for item in declarations(cls.Params)}

    def brake_conditions(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return whether `should_brake` is True for any camera frame since the last decision."""
        brake = np.zeros(self.num_envs, np.bool_)
        for reading in readings(observations, infos):
            brake |= self._process(reading)
        return brake

    def should_brake(self, reading: Reading) -> np.ndarray:
        """Return whether the rule's condition holds, bool, shape (N,); called for every frame in order."""
        raise NotImplementedError

    def consecutive(self, name: str, conditions: np.ndarray, required: int | np.ndarray) -> np.ndarray:
        """Return whether conditions have held in the last frames, and count this one.

        Args:
            name: Name of the counts in the state.
            conditions: Whether each condition holds in this frame, bool, shape (N, …).
            required: Number of frames, of each condition or of all.
        """
        counts = self.state[name] = (self.state[name] + 1) * conditions
        return counts >= required

    def gate(self, yaw_rate: np.ndarray) -> np.ndarray:
        """Return whether the yaw rate [rad/s] was at most `yaw_rate` in the last `settle` frames, shape (N,).

        The rotation in and shortly after turns moves the whole image. The state has the number of frames for
        which the gate remains closed as "closed".
        """
        turning, closed = np.abs(yaw_rate) > self.params.yaw_rate, self.state["closed"]
        closed = self.state["closed"] = np.where(turning, self.params.settle, np.maximum(closed - 1, 0))
        return closed == 0

    def require_cameras(self, given: int, count: int) -> None:
        """Raise ValueError unless readings come from `count` cameras."""
        if given != count:
            raise ValueError(f"{self.name} requires its own {count} cameras, got {given}; leave --camera out")

    def _process(self, reading: Reading) -> np.ndarray:
        """Return the condition, and keep the state of environments that do not have the frame."""
        if reading.due.all():
            return self.should_brake(reading)
        before, waits = {name: values.copy() for name, values in self.state.items()}, ~reading.due
        conditions = self.should_brake(reading)
        for name, values in self.state.items():
            values[waits] = before[name][waits]
        return conditions & reading.due


class FrequencyRule(Rule):
    """Base class: brakes fully when f reaches a threshold in `frames` consecutive camera frames.

    f is the highest spike frequency of all cameras [spikes/s].
    """

    def initial(self) -> State:
        """Return the number of consecutive frames at the threshold."""
        return super().initial() | {"streak": 0}

    def should_brake(self, reading: Reading) -> np.ndarray:
        """Return whether f has reached the threshold in the required number of frames."""
        return self.consecutive("streak", reading.frequency >= self.threshold(reading), self.params.frames)

    def threshold(self, reading: Reading) -> np.ndarray | float:
        """Return the threshold for one camera frame [spikes/s]; called for every frame in order."""
        return self.params.threshold


@record
class SpikeThresholdParams(RuleParams):
    """Parameters of `SpikeThreshold`."""

    threshold: float = number(
        30.0, POSITIVE, "spikes/s", "Threshold of the spike frequency, tuned for 30 Hz.", search=(15.0, 250.0)
    )
    frames: int = whole(
        1, COUNT, "", "Number of consecutive camera frames at or above the threshold.", search=(1, 12)
    )


class SpikeThreshold(FrequencyRule):
    """Brakes fully when the spike frequency reaches a threshold.

    Condition: f ≥ `threshold` in `frames` consecutive camera frames. The alert is the alert of the neuron.
    Observes `spike_frequency`. Parameters: `SpikeThresholdParams`.
    """

    name = "spike-threshold"
    Params = SpikeThresholdParams

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the demands; the alerts remain those of the neurons."""
        alerts = self.alerts
        demands = super().demands(observations, infos, active)
        self.alerts = alerts
        return demands


@record
class AdaptiveThresholdParams(RuleParams):
    """Parameters of `AdaptiveThreshold`."""

    threshold: float = number(30.0, POSITIVE, "spikes/s", "Minimum threshold.", search=(15.0, 250.0))
    gain: float = number(
        3.0, POSITIVE, "", "Ratio of the threshold to the mean frequency.", search=(1.0, 10.0)
    )
    memory: int = whole(60, COUNT, "camera frames", "Time constant of the mean.", search=(10, 200))
    frames: int = whole(
        2, COUNT, "", "Number of consecutive camera frames at or above the threshold.", search=(1, 12)
    )


class AdaptiveThreshold(FrequencyRule):
    """Brakes fully when the spike frequency reaches a multiple of its running mean.

    Condition: f(t) ≥ max(`threshold`, `gain` · m(t − 1)) in `frames` consecutive camera frames, with the
    first-order low-pass m(t) = m(t − 1) + (f(t) − m(t − 1)) / `memory`. The paper proposes an adaptive
    threshold as future work.

    Observes `spike_frequency`. Parameters: `AdaptiveThresholdParams`.
    """

    name = "adaptive-threshold"
    Params = AdaptiveThresholdParams

    def initial(self) -> State:
        """Return the mean frequency and the number of frames."""
        return super().initial() | {"mean": 0.0}

    def threshold(self, reading: Reading) -> np.ndarray:
        """Return the thresholds from the means of the frames before, and update the means."""
        mean = self.state["mean"]
        self.state["mean"] = mean + (reading.frequency - mean) / self.params.memory
        return np.maximum(self.params.threshold, self.params.gain * mean)


@record
class DangerZoneParams(RuleParams):
    """Parameters of `DangerZone`."""

    level: float = number(4.0, POSITIVE, "", "Threshold of the excitation.", search=(2.0, 9.0))
    frames: int = whole(
        3, COUNT, "", "Number of consecutive camera frames at or above the level.", search=(1, 12)
    )
    deceleration: float = number(
        DRY_DECELERATION,
        POSITIVE,
        "m/s²",
        "Deceleration of the stopping distance on a dry road; determines the field.",
        search=(6.0, 9.0),
        group=CAMERA,
    )
    reaction: float = number(
        REACTION,
        POSITIVE,
        "s",
        "Reaction time of the stopping distance; determines the field.",
        search=(0.3, 0.7),
        group=CAMERA,
    )
    yaw_rate: float = number(
        0.05, POSITIVE, "rad/s", "Absolute yaw rate above which the rule is inactive.", search=(0.02, 0.3)
    )
    settle: int = whole(
        1, COUNT, "", "Number of latest camera frames that must be free of such yaw rates.", search=(1, 60)
    )


class DangerZone(Rule):
    """Brakes fully on the excitation of one ground field, whose far end is at the stopping distance.

    This is `StoppingZone` with one zone and without upright and low fields. Shadows, patches and steel plates
    cause false activations.

    Condition: excitation ≥ `level` in `frames` consecutive camera frames, while the yaw rate has not exceeded
    `yaw_rate` in the last `settle` frames.

    Observes `membrane_potential`, `ego_yaw_rate`. Parameters: `DangerZoneParams`.
    """

    name = "danger-zone"
    Params = DangerZoneParams

    @property
    def camera(self) -> list[Values]:
        """The ground field."""
        return [zone_camera("ground", 1.0, self.params.deceleration, self.params.reaction)]

    def initial(self) -> State:
        """Return the number of frames at the level and the state of the gate."""
        return super().initial() | {"streak": 0, "closed": 0}

    def should_brake(self, reading: Reading) -> np.ndarray:
        """Return whether the field has reached the level for the required number of frames."""
        self.require_cameras(reading.potential.shape[1], 1)
        excited = excitation(reading.potential[:, 0]) >= self.params.level
        return self.consecutive("streak", excited, self.params.frames) & self.gate(reading.yaw_rate)


@record
class StoppingZoneParams(RuleParams):
    """Parameters of `StoppingZone`."""

    deceleration: float = number(
        DRY_DECELERATION,
        POSITIVE,
        "m/s²",
        "Deceleration of the stopping distance on a dry road; determines the zones.",
        search=(6.0, 9.0),
        group=CAMERA,
    )
    reaction: float = number(
        REACTION,
        POSITIVE,
        "s",
        "Time from the demand to full braking; determines the zones.",
        search=(0.3, 0.7),
        group=CAMERA,
    )
    reach: float = number(
        1.8,
        f"[{REACHES[0]}, inf)",
        "",
        "Greatest reach of the zones that brake, at least that of the nearest zone.",
        search=(0.75, 1.8),
    )
    ground: float = number(5.0, POSITIVE, "", "Excitation threshold of ground fields.", search=(2.0, 9.0))
    upright: float = number(0.6, POSITIVE, "", "Excitation threshold of upright fields.", search=(0.2, 1.2))
    low: float = number(1.0, POSITIVE, "", "Excitation threshold of low fields.", search=(0.4, 3.0))
    frames: int = whole(
        2,
        COUNT,
        "",
        "Number of consecutive camera frames with the ground field at its threshold.",
        search=(1, 8),
    )
    upright_frames: int = whole(4, COUNT, "", "The same for the upright field.", search=(1, 8))
    low_frames: int = whole(2, COUNT, "", "The same for the low field.", search=(1, 8))
    memory: int = whole(
        6,
        COUNT,
        "",
        "Number of camera frames for which excitations of the upright and low fields count.",
        search=(1, 20),
    )
    yaw_rate: float = number(
        0.05, POSITIVE, "rad/s", "Absolute yaw rate above which the rule is inactive.", search=(0.02, 0.3)
    )
    crawl: float = number(
        1.0, POSITIVE, "m/s", "Ego speed up to which the rule is inactive.", search=(0.5, 2.7)
    )
    warning: float = number(
        0.5, "(0, 1]", "", "Share of the thresholds of the excitations at which the rule warns."
    )
    release_s: float = number(
        1.3,
        "[0, inf]",
        "s",
        "Time with every ground field below its threshold and no warning, after which the brake is released; "
        "inf for never.",
    )


class StoppingZone(Rule):
    """Warns, then brakes fully for an upright obstacle on the path, near the ego's stopping distance.

    The rule has seven zones, whose far ends are at 0.28 to 1.8 stopping distances, and 17 fields with one
    neuron each; see `lgmd_gym.agents.zones`. G, U and L are the excitations k/(n σ3) of the ground,
    upright and low field of a zone. The fields are parts of a stabilised, calibrated camera with contrast
    control, and follow the ego's path. Plain asphalt does not excite the ground fields.

    Condition: in one of the zones up to `reach`, G ≥ `ground` in `frames` consecutive frames, while U ≥
    `upright` in `upright_frames` and L ≥ `low` in `low_frames` consecutive frames that ended within the last
    `memory` frames; at a speed above `crawl` and a yaw rate of at most `yaw_rate`. Flat marks and shadows
    excite ground fields alone. The rule warns under the same condition with `warning` times the thresholds.
    It releases the brake after `release_s` with G < `ground` in all zones and no warning, but not near
    standstill.

    The stopping distance is that of `deceleration` on a dry road and of two thirds of it on a wet one: the
    sensor knows that the road is wet, as a car with a rain sensor does.

    Observes `membrane_potential`, `ego_speed`, `ego_yaw_rate`. Parameters: `StoppingZoneParams`.
    """

    name = "stopping-zone"
    Params = StoppingZoneParams

    def __init__(self, params: StoppingZoneParams | None = None, **options: Any) -> None:
        super().__init__(params, **options)
        p, counts = self.params, (NUM_ZONES, NUM_ZONES, len(LOW_ZONES))
        thresholds = np.repeat([p.ground, p.upright, p.low], counts)
        self._thresholds = np.stack([thresholds, p.warning * thresholds])
        self.brake = StageParams(release_s=p.release_s)
        self._required = np.repeat([p.frames, p.upright_frames, p.low_frames], counts)
        self._zones = np.array(REACHES) <= p.reach

    @property
    def camera(self) -> list[Values]:
        """Ground fields, nearest zone first, then upright fields, then low fields."""
        return zone_cameras(self.params.deceleration, self.params.reaction)

    def initial(self) -> State:
        """Return the numbers of frames at the thresholds, and since the required number of them.

        The first row of each has the thresholds of braking, the second those of the warning.
        """
        ages: np.ndarray = np.full((2, NUM_FIELDS), self.params.memory)
        streaks: np.ndarray = np.zeros((2, NUM_FIELDS), np.int64)
        return super().initial() | {"streaks": streaks, "ages": ages, "warns": False, "present": False}

    def evidence(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the evidence of an upright obstacle."""
        brakes = self.brake_conditions(observations, infos, active)
        kept = np.where(self.state["present"], Evidence.PRESENT, Evidence.CLEAR)
        return np.where(brakes, Evidence.FULL, np.where(self.state["warns"], Evidence.WARNING, kept))

    def should_brake(self, reading: Reading) -> np.ndarray:
        """Return whether an upright obstacle is in a zone, and note whether to warn."""
        p = self.params
        self.require_cameras(reading.potential.shape[1], NUM_FIELDS)
        excited = excitation(reading.potential)[:, None] >= self._thresholds
        reached = self.consecutive("streaks", excited, self._required)
        ages = self.state["ages"] = (self.state["ages"] + 1) * ~reached
        active = (reading.speed > p.crawl) & (np.abs(reading.yaw_rate) <= p.yaw_rate)
        recent = ages[..., NUM_ZONES:] < p.memory
        upright, low = recent[..., :NUM_ZONES], recent[..., NUM_ZONES:]
        zones = self._zones & reached[..., :NUM_ZONES] & upright & low[..., LOW_FIELD]
        standing = active[:, None] & zones.any(axis=2)
        warns: np.ndarray = standing[:, 1]
        self.state["warns"] = warns
        present: np.ndarray = np.any(excited[:, 0, :NUM_ZONES], axis=1)
        self.state["present"] = present
        return standing[:, 0]


def _read_toml(path: object) -> Values:
    try:
        return read_toml(Path(str(path)))
    except OSError as error:
        raise ValueError(f"agent file {shown(str(path))} cannot be read: {error.strerror}") from None
    except ValueError as error:  # also of a path with a null character
        raise ValueError(f"agent file {shown(str(path))} is not TOML: {error}") from None
