"""From an episode and its counterfactual to one row of `episodes.jsonl`."""

from dataclasses import dataclass
from math import atan, degrees, inf, isfinite, nan
from typing import Any

import numpy as np

from lgmd_gym.benchmark.cases import Case
from lgmd_gym.benchmark.episode import Episode

GRAVITY = 9.80665  # [m/s²]
NUISANCE = 0.25 * GRAVITY  # 49 CFR 571.127 S5.3: more than this beyond the driver is a false activation
BRAKING, ONSET = 1.0, 0.3  # [m/s²], Euro NCAP AEB C2C v4.3.1, 2.1: beyond the one, walked back to the other
PREMATURE = 4.0  # [s] before the counterfactual contact; the protocols' T0

# Every key of a row in its order; null where undefined. SI units but for the two that say otherwise.
KEYS = (
    "agent",
    "suite",
    "case",
    "seed",
    "warned_driver",
    "threat",
    "collision",
    "avoided",
    "ego_speed",
    "target_speed",
    "impact_speed",
    "relative_impact_speed",
    "speed_reduction",
    "ttc_at_alert",
    "theta_at_alert_deg",
    "l_over_v_ms",
    "ttc_at_brake",
    "peak_deceleration",
    "false_brake",
    "premature_brake",
    "distance",
    "duration",
    "fps",
    "error",
)


@dataclass(frozen=True, slots=True)
class Counterfactual:
    """What `no-brake` met in the same case with the same seed.

    Attributes:
        threat: Whether it touched anybody.
        contact_time: When [s]; NaN without contact.
        relative_impact_speed: How fast [m/s]; NaN without contact.
    """

    threat: bool
    contact_time: float
    relative_impact_speed: float

    @classmethod
    def of(cls, episode: Episode) -> "Counterfactual":
        """Return the counterfactual that a `no-brake` episode shows."""
        contact = float(episode.series["time"][-1]) if episode.collision else nan
        return cls(episode.collision, contact, episode.relative_impact_speed)

    @classmethod
    def of_row(cls, row: dict[str, Any]) -> "Counterfactual":
        """Return the counterfactual that a `no-brake` row tells."""
        if not row["collision"]:
            return cls(False, nan, nan)
        return cls(True, row["duration"], row["relative_impact_speed"])


def make_row(
    agent: str,
    case: Case,
    seed: int,
    episode: Episode,
    truth: Counterfactual,
    premature: float = PREMATURE,
) -> dict[str, Any]:
    """Return the row of one episode.

    Args:
        agent: The agent's string.
        case: The case played.
        seed: The seed played.
        episode: What happened.
        truth: What happens to `no-brake`; decides what is a threat.
        premature: Braking earlier than this before the counterfactual contact is no success [s].
    """
    series = episode.series
    onset = brake_onset(series["deceleration"])
    peak = float(series["deceleration"].max())
    early = truth.threat and _begun(series, onset) < truth.contact_time - premature
    row = dict.fromkeys(KEYS)
    row |= {
        "agent": agent,
        "suite": case.suite,
        "case": case.name,
        "seed": seed,
        "warned_driver": case.warned_driver,
        "threat": truth.threat,
        "collision": episode.collision,
        "avoided": (not episode.collision and not early) if truth.threat else None,
        "ego_speed": float(series["ego_speed"][0]),
        "target_speed": _number(series["target_speed"][0]),
        "impact_speed": _number(episode.impact_speed),
        "relative_impact_speed": _number(episode.relative_impact_speed),
        "speed_reduction": _speed_reduction(episode, truth),
        "ttc_at_brake": _number(float(series["ttc"][onset])) if onset is not None else None,
        "peak_deceleration": peak,
        "false_brake": not truth.threat and peak > NUISANCE,
        "premature_brake": early,
        "distance": float(np.trapezoid(series["ego_speed"], series["time"])),
        "duration": float(series["time"][-1]),
        "fps": episode.fps,
    }
    return row | _at_alert(episode)


def error_row(agent: str, case: Case, seed: int, error: str) -> dict[str, Any]:
    """Return the row of an episode that could not be played to its end."""
    named = {"agent": agent, "suite": case.suite, "case": case.name, "seed": seed, "error": error}
    return dict.fromkeys(KEYS) | named | {"warned_driver": case.warned_driver}


def brake_onset(deceleration: np.ndarray) -> int | None:
    """Return the index at which braking begins: the first beyond 1 m/s², walked back to 0.3 m/s²."""
    beyond = np.flatnonzero(deceleration > BRAKING)
    if beyond.size == 0:
        return None
    below = np.flatnonzero(deceleration[: beyond[0]] < ONSET)
    return int(below[-1]) if below.size else 0


def _begun(series: dict[str, np.ndarray], onset: int | None) -> float:
    """Return when the agent began to brake, or to hold a standing car [s]; infinity for never."""
    braked = [] if onset is None else [series["time"][onset]]
    return float(min((*braked, *series["time"][series["held"] > 0]), default=inf))


def _at_alert(episode: Episode) -> dict[str, float | None]:
    """Return time to contact, angular size and l/|v| at the first alert; null without one."""
    series = episode.series
    alerts = np.flatnonzero(series["alert"])
    values: dict[str, float | None] = dict.fromkeys(("ttc_at_alert", "theta_at_alert_deg", "l_over_v_ms"))
    if alerts.size == 0:
        return values
    first = alerts[0]
    half, gap = episode.target_width / 2, float(series["gap"][first])
    closing = float(series["ego_speed"][first] - series["target_speed"][first])
    values["ttc_at_alert"] = _number(float(series["ttc"][first]))
    # Seen from the front bumper, as the protocols measure distance.
    values["theta_at_alert_deg"] = _number(degrees(2 * atan(half / gap)) if gap > 0 else nan)
    values["l_over_v_ms"] = _number(1000.0 * half / closing if closing > 0 else nan)
    return values


def _speed_reduction(episode: Episode, truth: Counterfactual) -> float | None:
    """Return by how much the relative impact speed fell against no braking [m/s]; all of it if avoided."""
    if not truth.threat:
        return None
    left = episode.relative_impact_speed if episode.collision else 0.0
    return float(truth.relative_impact_speed - left)


def _number(value: float) -> float | None:
    """Return a finite value as float, else None: JSON knows no NaN."""
    return float(value) if isfinite(value) else None
