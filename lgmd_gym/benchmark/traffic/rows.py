"""What is kept of a drive through traffic, and its row."""

from dataclasses import dataclass, field
from math import isfinite
from typing import Any

from lgmd_gym.benchmark.metrics import NUISANCE, PREMATURE
from lgmd_gym.benchmark.traffic.recording import Seen, Trace

SUITE = "traffic"

# Every key of a row in its order; null where undefined. SI units.
KEYS = (
    "agent",
    "camera",
    "suite",
    "case",
    "seed",
    "threat",
    "collision",
    "avoided",
    "side",
    "impact_speed",
    "relative_impact_speed",
    "alerts",
    "brakes",
    "false_activations",
    "premature_brakes",
    "stops",
    "peak_deceleration",
    "distance",
    "duration",
    "fps",
    "error",
)


@dataclass(slots=True)
class Braking:
    """One time that an agent brakes.

    Attributes:
        start: Of the first demand [s].
        need: From the start to the emergency that comes without it [s]; None for no emergency.
        last: Time of the last demand [s].
        peak: Highest deceleration beyond the driver's [m/s²].
    """

    start: float
    need: float | None
    last: float
    peak: float = 0.0

    @property
    def felt(self) -> bool:
        """Whether it counts: beyond 0.25 g (49 CFR 571.127 S5.3)."""
        return self.peak > NUISANCE

    @property
    def false(self) -> bool:
        """Whether it counts and nothing made it necessary."""
        return self.felt and self.need is None

    @property
    def premature(self) -> bool:
        """Whether it counts and was necessary, but more than 4 s later."""
        return self.felt and self.need is not None and self.need > PREMATURE


@dataclass(slots=True)
class Log:
    """What happened on a drive.

    Attributes:
        brakings: In their order.
        alerts: Number of them.
        stops: Standstills brought about by braking.
        end: What was seen last.
        duration: Of the drive [s].
        peak: Highest deceleration beyond the driver's [m/s²].
    """

    brakings: list[Braking] = field(default_factory=list)
    alerts: int = 0
    stops: int = 0
    end: Seen | None = None
    duration: float = 0.0
    peak: float = 0.0


def make_row(name: str, trace: Trace, log: Log) -> dict[str, Any]:
    """Return the row of one drive.

    Args:
        name: The agent's string.
        trace: The recording.
        log: What happened.
    """
    assert log.end is not None
    info, without = log.end.info, trace.seen[-1].info
    threat, collision = bool(without["collision"]), bool(info["collision"])
    return (
        dict.fromkeys(KEYS)
        | _named(name, trace.kind, trace.seed)
        | {
            "threat": threat,
            "collision": collision,
            "avoided": not collision if threat else None,
            "side": info["side"] or None,
            "impact_speed": _number(info["impact_speed"]),
            "relative_impact_speed": _number(info["relative_impact_speed"]),
            "alerts": int(log.alerts),
            "brakes": sum(braking.felt for braking in log.brakings),
            "false_activations": sum(braking.false for braking in log.brakings),
            "premature_brakes": sum(braking.premature for braking in log.brakings),
            "stops": log.stops,
            "peak_deceleration": float(log.peak),
            "distance": float(info["distance"]),
            "duration": log.duration,
            "fps": trace.fps,
        }
    )


def error_row(name: str, kind: str, seed: int, error: str) -> dict[str, Any]:
    """Return the row of a drive that could not be played to its end."""
    return dict.fromkeys(KEYS) | _named(name, kind, seed) | {"error": error}


def case_name(kind: str, seed: int) -> str:
    """Return the name of one seed's traffic, such as "traffic/highway/s3"."""
    return f"{SUITE}/{kind}/s{seed}"


def _named(name: str, kind: str, seed: int) -> dict[str, Any]:
    return {"agent": name, "suite": SUITE, "case": case_name(kind, seed), "seed": seed}


def _number(value: float) -> float | None:
    return float(value) if isfinite(value) else None
