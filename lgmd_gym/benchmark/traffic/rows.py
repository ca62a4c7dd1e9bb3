"""Rows of the traffic suite."""

from dataclasses import dataclass, field
from math import isfinite

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import ID_KEYS, EpisodeRow
from lgmd_gym.benchmark.episode import Step
from lgmd_gym.benchmark.metrics import NUISANCE
from lgmd_gym.benchmark.traffic.recording import TrafficRecording


class TrafficRow(EpisodeRow):
    """Row of the traffic suite, whose family is the kind of traffic; `side` is that of the contact."""

    side: str | None
    alerts: int
    brakes: int
    false_activations: int
    stops: int
    moving_time: float
    needed_time: float


# Every key of a row, in order.
KEYS = (
    *ID_KEYS,
    "family",
    "world",
    "camera",
    "threat",
    "collision",
    "avoided",
    "side",
    "impact_speed",
    "relative_impact_speed",
    "alerts",
    "brakes",
    "false_activations",
    "stops",
    "peak_deceleration",
    "distance",
    "duration",
    "moving_time",
    "needed_time",
    "fps",
    "error",
)


@dataclass(slots=True)
class BrakingEvent:
    """One braking event of an agent."""

    start: float  # time of the first demand [s]
    # time from the start to the emergency without it [s]; None if it is not needed
    time_to_emergency: float | None
    last: float  # time of the last demand [s]
    peak: float = 0.0  # highest deceleration beyond the driver's [m/s²]

    @property
    def counts(self) -> bool:
        """Whether the deceleration exceeds 0.25 g (49 CFR 571.127 S5.3)."""
        return self.peak > NUISANCE

    @property
    def false(self) -> bool:
        """Whether the event counts and is not needed, see `lgmd_gym.envs.traffic.emergencies`."""
        return self.counts and self.time_to_emergency is None


@dataclass(slots=True)
class EpisodeLog:
    """Events of one agent in one episode."""

    events: list[BrakingEvent] = field(default_factory=list[BrakingEvent])  # braking events in order
    alerts: int = 0
    stops: int = 0  # number of standstills caused by braking events that count
    end: Step | None = None  # last step
    duration: float = 0.0  # duration of the episode [s]
    peak: float = 0.0  # highest deceleration beyond the driver's [m/s²]


def measure(recording: TrafficRecording, log: EpisodeLog) -> Values:
    """Return the measured values of a row."""
    assert log.end is not None
    info = log.end.info
    moving, needed = recording.moving_and_needed
    threat, collision = bool(recording.moments[-1].info["collision"]), bool(info["collision"])
    return {
        "threat": threat,
        "collision": collision,
        "avoided": not collision if threat else None,
        "side": info["side"] or None,
        "impact_speed": _finite(info["impact_speed"]),
        "relative_impact_speed": _finite(info["relative_impact_speed"]),
        "alerts": int(log.alerts),
        "brakes": sum(event.counts for event in log.events),
        "false_activations": sum(event.false for event in log.events),
        "stops": log.stops,
        "peak_deceleration": float(log.peak),
        "distance": float(info["distance"]),
        "duration": log.duration,
        "moving_time": moving,
        "needed_time": needed,
        "fps": recording.fps,
    }


def _finite(value: float) -> float | None:
    return float(value) if isfinite(value) else None
