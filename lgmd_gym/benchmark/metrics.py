"""Metrics of an episode: a registry of functions `paired episode -> (value, valid)`.

An invalid value becomes null in the row; an undefined value is never written as 0 or -1. Units are SI except
where a metric's name gives another.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan, degrees, inf, isfinite
from typing import Any

import numpy as np

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import CASE_KEYS, ID_KEYS, Case, Row, new_row, relative_impact
from lgmd_gym.benchmark.episode import Episode
from lgmd_gym.camera import CLEAR
from lgmd_gym.envs.dynamics.brake import EMERGENCY

GRAVITY = 9.80665  # [m/s²]
NUISANCE = 0.25 * GRAVITY  # 49 CFR 571.127 S5.3: a false activation exceeds this beyond the driver's braking
# Euro NCAP AEB C2C v4.3.1, 2.1: braking begins at the last value below ONSET before the first above BRAKING.
BRAKING, ONSET = 1.0, 0.3  # [m/s²]
PREMATURE = 4.0  # [s] before the counterfactual contact; the protocols' T0

Value = tuple[Any, bool]
UNDEFINED: Value = (None, False)


@dataclass(frozen=True, slots=True)
class Counterfactual:
    """Outcome of `no-brake` in the same case with the same seed."""

    threat: bool  # whether it had contact
    contact_time: float  # time of contact [s]; inf without contact
    relative_impact_speed: float  # relative impact speed [m/s]; inf without contact

    @classmethod
    def of(cls, episode: Episode) -> "Counterfactual":
        """Return the counterfactual given by a `no-brake` episode."""
        contact = float(episode.series["time"][-1]) if episode.collision else inf
        return cls(episode.collision, contact, episode.relative_impact_speed)

    @classmethod
    def of_row(cls, row: Row) -> "Counterfactual":
        """Return the counterfactual given by a `no-brake` row."""
        if not row["collision"]:
            return cls(False, inf, inf)
        return cls(True, row["duration"], relative_impact(row))


@dataclass(frozen=True, slots=True)
class PairedEpisode:
    """An episode with its counterfactual: the input of every metric."""

    episode: Episode
    counterfactual: Counterfactual  # outcome of `no-brake`
    premature: float  # lead before the counterfactual contact beyond which braking is premature [s]
    onset: int | None  # index of the decision at which braking begins; None for never
    alert: int | None  # index of the first alert; None for never

    @classmethod
    def of(
        cls, episode: Episode, counterfactual: Counterfactual, premature: float = PREMATURE
    ) -> "PairedEpisode":
        """Return the pair, with its braking onset and first alert."""
        alerts = np.flatnonzero(episode.series["alert"])
        onsets = brake_onsets(episode.series["deceleration"])
        onset, alert = onsets[0] if onsets else None, int(alerts[0]) if alerts.size else None
        return cls(episode, counterfactual, premature, onset, alert)

    def at(self, name: str, index: int | None) -> Value:
        """Return the value of a series at an index; undefined for None and infinity."""
        return UNDEFINED if index is None else number(self.episode.series[name][index])


Metric = Callable[[PairedEpisode], Value]
METRICS: dict[str, Metric] = {}


def metric(function: Metric) -> Metric:
    """Register a metric in `METRICS` under its function name, which becomes a key of every row.

    Raises:
        ValueError: If the name is taken.
    """
    name = function.__name__
    if name in METRICS:
        raise ValueError(f"metric {name!r} is defined twice; rename one of them")
    METRICS[name] = function
    return function


def measure(pair: PairedEpisode) -> Values:
    """Return the value of every metric, None where it is invalid."""
    values = {name: function(pair) for name, function in METRICS.items()}
    return {name: value if valid else None for name, (value, valid) in values.items()}


def number(value: Any) -> Value:
    """Return a value as a float and whether it is finite, because JSON has no infinity."""
    return float(value), isfinite(value)


def brake_onsets(deceleration: np.ndarray) -> list[int]:
    """Return the indices at which braking begins: the first above 1 m/s², traced back to 0.3 m/s².

    Braking begins again after a deceleration below 0.3 m/s².
    """
    onsets, last = list[int](), 0  # the last value below ONSET
    braking = False
    for index, value in enumerate(deceleration.tolist()):
        if value < ONSET:
            last, braking = index, False
        elif value > BRAKING and not braking:
            onsets.append(last)
            braking = True
    return onsets


@metric
def threat(pair: PairedEpisode) -> Value:
    """Whether `no-brake` has contact in this case with this seed."""
    return pair.counterfactual.threat, True


@metric
def collision(pair: PairedEpisode) -> Value:
    """Whether the ego had contact."""
    return pair.episode.collision, True


@metric
def avoided(pair: PairedEpisode) -> Value:
    """Whether a threat ended without contact and without premature braking."""
    return not pair.episode.collision and not premature_brake(pair)[0], pair.counterfactual.threat


@metric
def ego_speed(pair: PairedEpisode) -> Value:
    """Ego speed at the start."""
    return number(pair.episode.series["ego_speed"][0])


@metric
def target_speed(pair: PairedEpisode) -> Value:
    """Speed of the first actor at the start."""
    return number(pair.episode.series["target_speed"][0])


@metric
def target_shade(pair: PairedEpisode) -> Value:
    """Grey level of the first actor in [0, 255]; the mean of the asphalt is 104 by day."""
    return number(pair.episode.target_shade)


@metric
def impact_speed(pair: PairedEpisode) -> Value:
    """Ego speed at contact."""
    return number(pair.episode.impact_speed)


@metric
def relative_impact_speed(pair: PairedEpisode) -> Value:
    """Impact speed minus the target's speed along the ego's heading."""
    return number(pair.episode.relative_impact_speed)


@metric
def speed_reduction(pair: PairedEpisode) -> Value:
    """Relative impact speed of `no-brake` minus that of the agent, which is 0 without contact."""
    if not pair.counterfactual.threat:
        return UNDEFINED
    left = pair.episode.relative_impact_speed if pair.episode.collision else 0.0
    return number(pair.counterfactual.relative_impact_speed - left)


@metric
def ttc_at_alert(pair: PairedEpisode) -> Value:
    """Time to contact at the first alert."""
    return pair.at("ttc", pair.alert)


@metric
def distance_at_alert(pair: PairedEpisode) -> Value:
    """Free distance ahead along the ego's path at the first alert."""
    return pair.at("gap", pair.alert)


@metric
def theta_at_alert_deg(pair: PairedEpisode) -> Value:
    """Angular size of the first actor at the first alert, from the front bumper."""
    gap, valid = pair.at("gap", pair.alert)
    if not valid or gap <= 0.0:
        return UNDEFINED
    return number(degrees(2 * atan(pair.episode.target_width / 2 / gap)))


@metric
def l_over_v_ms(pair: PairedEpisode) -> Value:
    """Half width of the first actor over the closing speed at the first alert, l/|v|."""
    if pair.alert is None:
        return UNDEFINED
    closing = float(pair.at("ego_speed", pair.alert)[0] - pair.at("target_speed", pair.alert)[0])
    return number(1000.0 * pair.episode.target_width / 2 / closing) if closing > 0 else UNDEFINED


@metric
def warning_lead_time(pair: PairedEpisode) -> Value:
    """Time from the first alert to emergency braking (5 m/s²), negative if the alert came later.

    UN R152 Rev.2, 5.2.1.1, requires 0.8 s, or the time of braking if the collision cannot be anticipated.
    """
    hard = np.flatnonzero(pair.episode.series["deceleration"] >= EMERGENCY)
    if hard.size == 0 or pair.alert is None:
        return UNDEFINED
    time = pair.episode.series["time"]
    return number(time[hard[0]] - time[pair.alert])


@metric
def ttc_at_brake(pair: PairedEpisode) -> Value:
    """Time to contact when braking begins."""
    return pair.at("ttc", pair.onset)


@metric
def distance_at_brake(pair: PairedEpisode) -> Value:
    """Free distance ahead along the ego's path when braking begins."""
    return pair.at("gap", pair.onset)


@metric
def drac_at_brake(pair: PairedEpisode) -> Value:
    """Deceleration rate to avoid a crash, Δv²/(2·gap), when braking begins."""
    return pair.at("drac", pair.onset)


@metric
def max_drac(pair: PairedEpisode) -> Value:
    """Highest deceleration rate to avoid a crash; undefined with contact, where it is unbounded."""
    values = pair.episode.series["drac"]
    values = values[np.isfinite(values)]
    return number(values.max()) if values.size and not pair.episode.collision else UNDEFINED


@metric
def min_ttc(pair: PairedEpisode) -> Value:
    """Lowest time to contact; 0 with contact, undefined if none was ever predicted."""
    if pair.episode.collision:
        return 0.0, True
    return number(pair.episode.series["ttc"].min())


@metric
def stopping_margin(pair: PairedEpisode) -> Value:
    """Lowest free distance ahead in a threat in which the agent braked and had no contact."""
    gaps = pair.episode.series["gap"]
    stopped = pair.counterfactual.threat and not pair.episode.collision and pair.onset is not None
    return number(gaps.min()) if stopped else UNDEFINED


@metric
def peak_deceleration(pair: PairedEpisode) -> Value:
    """Highest deceleration beyond the scripted one."""
    return number(pair.episode.series["deceleration"].max())


@metric
def false_activation(pair: PairedEpisode) -> Value:
    """Whether the ego braked beyond 0.25 g without a threat."""
    return not pair.counterfactual.threat and peak_deceleration(pair)[0] > NUISANCE, True


@metric
def false_alert(pair: PairedEpisode) -> Value:
    """Whether the agent warned without a threat; an alert from the first decision on counts, too."""
    return not pair.counterfactual.threat and pair.alert is not None, True


@metric
def braking_onsets(pair: PairedEpisode) -> Value:
    """Number of times that braking began, each above 1 m/s² after less than 0.3 m/s²."""
    return len(brake_onsets(pair.episode.series["deceleration"])), True


@metric
def premature_brake(pair: PairedEpisode) -> Value:
    """Whether braking or a standstill hold began too long before the counterfactual contact."""
    series = pair.episode.series
    onsets = [] if pair.onset is None else [series["time"][pair.onset]]
    start = float(min((*onsets, *series["time"][series["standstill_hold"] > 0]), default=inf))
    return pair.counterfactual.threat and start < pair.counterfactual.contact_time - pair.premature, True


@metric
def episode_return(pair: PairedEpisode) -> Value:
    """Undiscounted return of the environment, the objective of policies."""
    return number(pair.episode.reward_sum)


@metric
def distance(pair: PairedEpisode) -> Value:
    """Distance driven."""
    return number(np.trapezoid(pair.episode.series["ego_speed"], pair.episode.series["time"]))


@metric
def duration(pair: PairedEpisode) -> Value:
    """Duration of the episode."""
    return number(pair.episode.series["time"][-1])


@metric
def fps(pair: PairedEpisode) -> Value:
    """Camera frame rate."""
    return number(pair.episode.fps)


# Every key of a row of a suite of cases, in order.
KEYS = (*ID_KEYS, *CASE_KEYS, "world", "camera", *METRICS, "error")


def make_row(
    agent: str,
    case: Case,
    seed: int,
    episode: Episode,
    counterfactual: Counterfactual,
    condition: str = CLEAR,
    camera: str | None = None,
) -> Row:
    """Return the row of one episode."""
    values = measure(PairedEpisode.of(episode, counterfactual))
    return new_row(KEYS, agent, case, seed, condition, world=episode.world, camera=camera, **values)
