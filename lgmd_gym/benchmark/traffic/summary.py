"""What the rows of the traffic suite sum up to: needless brakes per 100 km, with an exact interval."""

from collections.abc import Callable
from math import inf
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.benchmark.summary import Rate

Row = dict[str, Any]
PER = 100_000.0  # [m] to which rates refer


def poisson_interval(count: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the exact two-sided interval of a Poisson mean after `count` events (Garwood 1936).

    The low end is the mean for which that many or more have the chance (1 − confidence)/2, the high end
    that for which that many or fewer have it; both are quantiles of χ², found here by bisection.

    Args:
        count: Events seen, >= 0.
        confidence: In (0, 1).

    Example:
        >>> [round(bound, 3) for bound in poisson_interval(0)]
        [0.0, 3.689]
    """
    if count < 0 or not 0.0 < confidence < 1.0:
        raise ValueError(f"count must be >= 0 and confidence in (0, 1), got {count!r} and {confidence!r}")
    tail = (1.0 - confidence) / 2
    top = count + 20.0 * (count + 4.0) ** 0.5 + 40.0
    low = 0.0 if count == 0 else _bisect(lambda mean: 1.0 - _at_most(count - 1, mean) - tail, top)
    return low, _bisect(lambda mean: tail - _at_most(count, mean), top)


def _at_most(count: int, mean: float) -> float:
    """Return the chance of `count` events or fewer at a Poisson mean."""
    if mean <= 0.0:
        return 1.0
    numbers = np.arange(count + 1)
    factorials = np.concatenate(([0.0], np.cumsum(np.log(numbers[1:]))))
    return float(np.exp(numbers * np.log(mean) - mean - factorials).sum())


def _bisect(rising: Callable[[float], float], top: float) -> float:
    """Return where a rising function crosses zero in [0, top]."""
    low, high = 0.0, top
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (low, middle) if rising(middle) > 0.0 else (middle, high)
    return (low + high) / 2


class TrafficScore(NamedTuple):
    """One agent over a set of drives.

    Attributes:
        agent: The agent's string.
        kind: Of the traffic; "" for all.
        drives: Number of drives played.
        distance: All of them together [m].
        alerts: Number of alerts.
        brakes: Number of brakes beyond 0.25 g.
        false_activations: Those that nothing made necessary.
        premature: Those that were necessary, but more than 4 s later.
        avoided: Of the drives with a contact without braking, those without one.
        contacts: Drives that ended in contact.
        rear_ended: Those in which another car ran into the ego's rear.
        peak: Highest deceleration beyond the driver's [m/s²].
        errors: Drives that could not be played.
    """

    agent: str
    kind: str
    drives: int
    distance: float
    alerts: int
    brakes: int
    false_activations: int
    premature: int
    avoided: Rate
    contacts: int
    rear_ended: int
    peak: float
    errors: int

    def per_100km(self, count: float) -> float:
        """Return a count as a rate per 100 km; infinite if nothing was driven."""
        return count * PER / self.distance if self.distance > 0.0 else inf

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the false brakes per 100 km."""
        low, high = poisson_interval(self.false_activations)
        return (self.per_100km(low) if low else 0.0), self.per_100km(high)


def traffic_score(agent: str, kind: str, rows: list[Row]) -> TrafficScore:
    """Sum up one agent's rows."""
    played = [row for row in rows if row["error"] is None]
    return TrafficScore(
        agent,
        kind,
        drives=len(played),
        distance=sum(row["distance"] for row in played),
        alerts=sum(row["alerts"] for row in played),
        brakes=sum(row["brakes"] for row in played),
        false_activations=sum(row["false_activations"] for row in played),
        premature=sum(row["premature_brakes"] for row in played),
        avoided=Rate.of(row["avoided"] for row in played if row["threat"]),
        contacts=sum(row["collision"] for row in played),
        rear_ended=sum(row["side"] == "rear" for row in played),
        peak=max((row["peak_deceleration"] for row in played), default=0.0),
        errors=len(rows) - len(played),
    )


def traffic_scores(rows: list[Row], by_kind: bool = False) -> list[TrafficScore]:
    """Return one score per agent, or per agent and kind, in the order in which they first come."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        kind = row["case"].split("/")[1] if by_kind else ""
        groups.setdefault((row["agent"], kind), []).append(row)
    return [traffic_score(agent, kind, group) for (agent, kind), group in groups.items()]
