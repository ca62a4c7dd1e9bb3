"""Rows of the traffic suites."""

from dataclasses import dataclass, field
from math import isfinite

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import ID_KEYS, EpisodeRow
from lgmd_gym.benchmark.metrics import NUISANCE
from lgmd_gym.benchmark.traffic.branch import Branch
from lgmd_gym.benchmark.traffic.reader import Moment
from lgmd_gym.benchmark.traffic.recording import TrafficRecording
from lgmd_gym.envs.dynamics.brake import EMERGENCY
from lgmd_gym.envs.surrogate_safety import PREDICTION
from lgmd_gym.envs.traffic.emergencies import HORIZON

LOOK_AHEAD = HORIZON + PREDICTION  # [s], latest contact that a needed brake can have been for
AFTERMATH = 5.0  # [s] after its last demand or standstill in which a braking event can cause a contact


class TrafficRow(EpisodeRow):
    """Row of a traffic suite, whose family is the kind of traffic; `side` is that of the contact."""

    side: str | None
    alerts: int
    brakes: int
    false_activations: int
    stops: int
    moving_time: float
    needed_time: float
    scaled_needed_time: float
    needless_activations: int
    speed_lost: float
    activations: list[list[float]]
    avoidable: bool | None
    avoided_by_brake: bool | None
    caused: bool


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
    "scaled_needed_time",
    "needless_activations",
    "speed_lost",
    "activations",
    "avoidable",
    "avoided_by_brake",
    "caused",
    "fps",
    "error",
)


@dataclass(slots=True)
class BrakingEvent:
    """One braking event of an agent."""

    start: float  # time of the first demand [s]
    # time from the start to the emergency without it [s]; None if it is not needed
    time_to_emergency: float | None
    last: float  # time of the last demand, or of the standstill [s]
    peak: float = 0.0  # highest deceleration beyond the driver's [m/s²]
    needed: bool = False  # whether it is needed by the emergencies that are scaled to the brake, see `judge`
    contact: float | None = None  # time of the contact without it, up to `LOOK_AHEAD` after its start [s]
    speed_lost: float = 0.0  # largest difference of the speeds without and with it [m/s]

    @property
    def counts(self) -> bool:
        """Whether the deceleration exceeds 0.25 g (49 CFR 571.127 S5.3)."""
        return self.peak > NUISANCE

    @property
    def false(self) -> bool:
        """Whether the event counts and is not needed, see `lgmd_gym.envs.traffic.emergencies`."""
        return self.counts and self.time_to_emergency is None

    @property
    def needless(self) -> bool:
        """Whether the event counts and is not needed by the emergencies that are scaled to the brake."""
        return self.counts and not self.needed

    @classmethod
    def begin(cls, decision: int, without: Branch, recording: TrafficRecording) -> "BrakingEvent":
        """Return the event that begins with the demand of a decision.

        Args:
            decision: Number of the decision.
            without: The drive without the event.
            recording: The recording of the drive.
        """
        time = decision / recording.policy_hz
        horizon = decision + round(HORIZON * recording.policy_hz)
        event = cls(time, without.emergencies(horizon, EMERGENCY).time_until(time), time)
        event.judge(decision, without, recording)
        return event

    def judge(self, decision: int, without: Branch, recording: TrafficRecording) -> None:
        """Set whether the event is needed at a decision, and the contact without it; arguments of `begin`.

        A staged brake begins below 0.25 g, earlier than its full braking, so that its need is judged at its
        first demand and again when it begins to count.
        """
        hz = recording.policy_hz
        emergencies = without.emergencies(decision + round(HORIZON * hz), recording.scaled_emergency)
        self.needed = emergencies.time_until(decision / hz) is not None
        contact = without.contact(decision + round(LOOK_AHEAD * hz)) if self.needed else None
        self.contact = None if contact is None else contact / hz


@dataclass(slots=True)
class EpisodeLog:
    """Events of one agent in one episode."""

    events: list[BrakingEvent] = field(default_factory=list[BrakingEvent])  # braking events in order
    alerts: int = 0
    stops: int = 0  # number of standstills caused by braking events that count
    end: Moment | None = None  # last decision
    duration: float = 0.0  # duration of the episode [s]
    peak: float = 0.0  # highest deceleration beyond the driver's [m/s²]
    caused: bool = False  # whether a braking event caused the contact at the end

    def avoided_by_brake(self, time: float) -> bool | None:
        """Return whether a needed braking event avoided the contact that occurs without the agent.

        Args:
            time: Time of the contact without the agent [s].

        Returns:
            True if a needed event begins before that contact and would itself be followed by one without it,
            and the drive has none up to `HORIZON` after the time. False if the drive has a contact until then
            that no braking caused. None if there is neither: earlier braking has changed the traffic.
        """
        assert self.end is not None
        if not self.end.info["collision"] or self.duration > time + HORIZON:
            needed = any(event.contact is not None and event.start <= time for event in self.events)
            return True if needed else None
        return None if self.caused else False


def measure(recording: TrafficRecording, log: EpisodeLog) -> Values:
    """Return the measured values of a row."""
    assert log.end is not None
    info = log.end.info
    moving, needed, scaled = recording.moving_and_needed
    threat, collision = bool(recording.moments[-1].info["collision"]), bool(info["collision"])
    avoided_by_brake = None
    if recording.contact is not None and recording.avoidable:
        avoided_by_brake = log.avoided_by_brake(recording.contact / recording.policy_hz)
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
        "scaled_needed_time": scaled,
        "needless_activations": sum(event.needless for event in log.events),
        "speed_lost": float(sum(event.speed_lost for event in log.events if not event.needed)),
        "activations": [
            [round(event.start, 4), round(event.last, 4), round(event.speed_lost, 4), int(event.needed)]
            for event in log.events
            if event.counts
        ],
        "avoidable": recording.avoidable,
        "avoided_by_brake": avoided_by_brake,
        "caused": log.caused,
        "fps": recording.fps,
    }


def _finite(value: float) -> float | None:
    return float(value) if isfinite(value) else None
