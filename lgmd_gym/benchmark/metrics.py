"""The metrics of an episode: small functions `outcome -> (value, valid)` in a register.

A value that is not valid becomes null in the row: what is undefined is never written as 0 or −1. SI units,
but for the two names that say otherwise.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan, degrees, inf, isfinite, nan
from typing import Any

import numpy as np

from lgmd_gym.benchmark.episode import Episode

GRAVITY = 9.80665  # [m/s²]
NUISANCE = 0.25 * GRAVITY  # 49 CFR 571.127 S5.3: more than this beyond the driver is a false activation
BRAKING, ONSET = 1.0, 0.3  # [m/s²], Euro NCAP AEB C2C v4.3.1, 2.1: beyond the one, walked back to the other
EMERGENCY = 5.0  # [m/s²], UN R152 Rev.2, 5.2.1.2: where emergency braking begins
PREMATURE = 4.0  # [s] before the counterfactual contact; the protocols' T0

Value = tuple[Any, bool]
UNDEFINED: Value = (None, False)


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


@dataclass(frozen=True, slots=True)
class Outcome:
    """An episode beside what would have happened without braking: all that a metric sees.

    Attributes:
        episode: What happened.
        truth: What happens to `no-brake`.
        premature: Braking earlier than this before the counterfactual contact is no success [s].
        onset: Index of the moment at which braking begins; None for never.
        alert: Index of the first alert; None for never.
    """

    episode: Episode
    truth: Counterfactual
    premature: float
    onset: int | None
    alert: int | None

    @classmethod
    def of(cls, episode: Episode, truth: Counterfactual, premature: float = PREMATURE) -> "Outcome":
        """Return an episode's outcome."""
        alerts = np.flatnonzero(episode.series["alert"])
        onset = brake_onset(episode.series["deceleration"])
        return cls(episode, truth, premature, onset, int(alerts[0]) if alerts.size else None)

    def at(self, name: str, index: int | None) -> Value:
        """Return a series' value at an index; undefined for None, NaN and infinity."""
        return UNDEFINED if index is None else number(self.episode.series[name][index])


Metric = Callable[[Outcome], Value]
METRICS: dict[str, Metric] = {}


def metric(function: Metric) -> Metric:
    """Enter a metric into `METRICS` under its function's name, which becomes a key of every row.

    Raises:
        ValueError: For a name that is taken.
    """
    name = function.__name__
    if name in METRICS:
        raise ValueError(f"metric {name!r} is defined twice")
    METRICS[name] = function
    return function


def measure(outcome: Outcome) -> dict[str, Any]:
    """Return the value of every metric, None where it is not valid."""
    values = {name: function(outcome) for name, function in METRICS.items()}
    return {name: value if valid else None for name, (value, valid) in values.items()}


def number(value: Any) -> Value:
    """Return a number and whether it is finite; JSON knows no NaN."""
    return float(value), isfinite(value)


def brake_onset(deceleration: np.ndarray) -> int | None:
    """Return the index at which braking begins: the first beyond 1 m/s², walked back to 0.3 m/s²."""
    beyond = np.flatnonzero(deceleration > BRAKING)
    if beyond.size == 0:
        return None
    below = np.flatnonzero(deceleration[: beyond[0]] < ONSET)
    return int(below[-1]) if below.size else 0


@metric
def threat(o: Outcome) -> Value:
    """Whether `no-brake` has contact in this case with this seed."""
    return o.truth.threat, True


@metric
def collision(o: Outcome) -> Value:
    """Whether the ego touched anybody."""
    return o.episode.collision, True


@metric
def avoided(o: Outcome) -> Value:
    """Whether a threat ended without contact and without premature braking."""
    return not o.episode.collision and not premature_brake(o)[0], o.truth.threat


@metric
def ego_speed(o: Outcome) -> Value:
    """The ego's speed at the start."""
    return number(o.episode.series["ego_speed"][0])


@metric
def target_speed(o: Outcome) -> Value:
    """The first actor's speed at the start."""
    return number(o.episode.series["target_speed"][0])


@metric
def target_shade(o: Outcome) -> Value:
    """The first actor's body grey in [0, 255]; the asphalt's mean is 104 by day."""
    return number(o.episode.target_shade)


@metric
def impact_speed(o: Outcome) -> Value:
    """The ego's speed at contact."""
    return number(o.episode.impact_speed)


@metric
def relative_impact_speed(o: Outcome) -> Value:
    """Impact speed less the other's along the ego's heading."""
    return number(o.episode.relative_impact_speed)


@metric
def speed_reduction(o: Outcome) -> Value:
    """By how much the relative impact speed fell against no braking; all of it without contact."""
    if not o.truth.threat:
        return UNDEFINED
    left = o.episode.relative_impact_speed if o.episode.collision else 0.0
    return number(o.truth.relative_impact_speed - left)


@metric
def ttc_at_alert(o: Outcome) -> Value:
    """Time to contact at the first alert."""
    return o.at("ttc", o.alert)


@metric
def distance_at_alert(o: Outcome) -> Value:
    """Free distance ahead along the ego's path at the first alert."""
    return o.at("gap", o.alert)


@metric
def theta_at_alert_deg(o: Outcome) -> Value:
    """Angular size of the first actor at the first alert, from the front bumper."""
    gap, seen = o.at("gap", o.alert)
    if not seen or gap <= 0.0:
        return UNDEFINED
    return number(degrees(2 * atan(o.episode.target_width / 2 / gap)))


@metric
def l_over_v_ms(o: Outcome) -> Value:
    """Half the first actor's width over the closing speed at the first alert, l/|v|."""
    if o.alert is None:
        return UNDEFINED
    closing = float(o.at("ego_speed", o.alert)[0] - o.at("target_speed", o.alert)[0])
    return number(1000.0 * o.episode.target_width / 2 / closing) if closing > 0 else UNDEFINED


@metric
def warning_lead_time(o: Outcome) -> Value:
    """From the first alert to emergency braking (5 m/s²), negative if the alert came later.

    UN R152 Rev.2, 5.2.1.1, asks for 0.8 s, or where that cannot be foreseen for no later than the braking.
    """
    hard = np.flatnonzero(o.episode.series["deceleration"] >= EMERGENCY)
    if hard.size == 0 or o.alert is None:
        return UNDEFINED
    time = o.episode.series["time"]
    return number(time[hard[0]] - time[o.alert])


@metric
def ttc_at_brake(o: Outcome) -> Value:
    """Time to contact when braking begins."""
    return o.at("ttc", o.onset)


@metric
def distance_at_brake(o: Outcome) -> Value:
    """Free distance ahead along the ego's path when braking begins."""
    return o.at("gap", o.onset)


@metric
def drac_at_brake(o: Outcome) -> Value:
    """Deceleration rate to avoid a crash, Δv²/(2·gap), when braking begins."""
    return o.at("drac", o.onset)


@metric
def max_drac(o: Outcome) -> Value:
    """Highest deceleration rate to avoid a crash; undefined with contact, where it has no bound."""
    values = o.episode.series["drac"]
    if o.episode.collision or not np.isfinite(values).any():
        return UNDEFINED
    return number(np.nanmax(values))


@metric
def min_ttc(o: Outcome) -> Value:
    """Lowest time to contact; 0 with contact, undefined if no contact was ever ahead."""
    if o.episode.collision:
        return 0.0, True
    values = o.episode.series["ttc"]
    return number(np.nanmin(values)) if np.isfinite(values).any() else UNDEFINED


@metric
def stopping_margin(o: Outcome) -> Value:
    """Least free distance ahead of a braked threat that ended without contact."""
    gaps = o.episode.series["gap"]
    if not o.truth.threat or o.episode.collision or o.onset is None or not np.isfinite(gaps).any():
        return UNDEFINED
    return number(np.nanmin(gaps))


@metric
def peak_deceleration(o: Outcome) -> Value:
    """Highest deceleration beyond the script."""
    return number(o.episode.series["deceleration"].max())


@metric
def false_activation(o: Outcome) -> Value:
    """Whether the ego braked beyond 0.25 g where there is no threat."""
    return not o.truth.threat and peak_deceleration(o)[0] > NUISANCE, True


@metric
def premature_brake(o: Outcome) -> Value:
    """Whether it began to brake, or to hold a standing car, too early before the contact."""
    series = o.episode.series
    braked = [] if o.onset is None else [series["time"][o.onset]]
    begun = float(min((*braked, *series["time"][series["held"] > 0]), default=inf))
    return o.truth.threat and begun < o.truth.contact_time - o.premature, True


@metric
def episode_return(o: Outcome) -> Value:
    """Sum of the environment's rewards, without discount: what policies are trained for."""
    return number(o.episode.reward_sum)


@metric
def distance(o: Outcome) -> Value:
    """Distance driven."""
    return number(np.trapezoid(o.episode.series["ego_speed"], o.episode.series["time"]))


@metric
def duration(o: Outcome) -> Value:
    """Time until the end."""
    return number(o.episode.series["time"][-1])


@metric
def fps(o: Outcome) -> Value:
    """Camera frames per second."""
    return number(o.episode.fps)
