"""Intervals of rates, counts and means.

Rates have Wilson's interval for an effective sample size, see `effective_size`; counts have Garwood's exact
Poisson interval (for counts in clusters see `event_counts`), and means a bootstrap that draws whole cases and
whole worlds: runs of one case or of one world are correlated, so drawing single episodes would give an
interval that is too narrow.
"""

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from lgmd_gym.statistics.effective_size import Z95, effective_size

DRAWS = 4000


class Rate(NamedTuple):
    """k of n with its Wilson 95 % interval."""

    k: int
    n: int
    low: float
    high: float

    @classmethod
    def of(cls, flags: Iterable[bool]) -> "Rate":
        """Return the rate of True among independent outcomes."""
        values = list(flags)
        k, n = sum(values), len(values)
        return cls(k, n, *wilson(k, n))

    @classmethod
    def clustered(
        cls, flags: Iterable[bool], cases: Sequence[Hashable], worlds: Sequence[Hashable] | None = None
    ) -> "Rate":
        """Return the rate of True among outcomes that are correlated within a case and within a world.

        Args:
            flags: Outcome of each trial.
            cases: Case of each trial.
            worlds: World of each trial; None for one world.

        Example:
            >>> [round(bound, 2) for bound in Rate.clustered([False] * 60, list(range(6)) * 10)]
            [0, 60, 0.0, 0.39]
        """
        values = list(flags)
        k, n = sum(values), len(values)
        size = effective_size(values, cases, worlds)
        return cls(k, n, *wilson(k / n * size if n else 0.0, size))


class Mean(NamedTuple):
    """A mean with its 95 % interval.

    Attributes:
        value: Mean; None without values.
        low: Lower bound; None for one case in one world.
        high: Upper bound; None for one case in one world.
        n: Number of values.
        clusters: Number of cases.
    """

    value: float | None
    low: float | None
    high: float | None
    n: int
    clusters: int


def wilson(k: float, n: float, z: float = Z95) -> tuple[float, float]:
    """Return the Wilson score interval of k successes in n independent trials; (0, 1) for n = 0.

    Example:
        >>> [round(bound, 3) for bound in wilson(0, 10)]
        [0.0, 0.278]
    """
    if n == 0:
        return 0.0, 1.0
    share = k / n
    centre = share + z * z / (2 * n)
    spread = z * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    scale = 1 + z * z / n
    return max((centre - spread) / scale, 0.0), min((centre + spread) / scale, 1.0)


def poisson_interval(count: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the exact two-sided interval of a Poisson mean after `count` events (Garwood 1936).

    Args:
        count: Number of events, >= 0.
        confidence: Coverage, in (0, 1).

    Raises:
        ValueError: If an argument is out of range.

    Example:
        >>> [round(bound, 3) for bound in poisson_interval(0)]
        [0.0, 3.689]
    """
    if count < 0 or not 0.0 < confidence < 1.0:
        raise ValueError(f"count must be >= 0 and confidence in (0, 1), got {count!r} and {confidence!r}")
    tail = (1.0 - confidence) / 2
    top = count + 20.0 * math.sqrt(count + 4.0) + 40.0
    low = 0.0 if count == 0 else _root(lambda mean: 1.0 - _poisson_cdf(count - 1, mean) - tail, top)
    return low, _root(lambda mean: tail - _poisson_cdf(count, mean), top)


def binomial_tail(k: int, n: int, p: float) -> float:
    """Return the probability of k or more successes in n trials of probability p."""
    return math.fsum(math.comb(n, i) * p**i * (1.0 - p) ** (n - i) for i in range(k, n + 1))


def cluster_mean(
    values: Sequence[float],
    clusters: Sequence[Hashable],
    worlds: Sequence[Hashable] | None = None,
    draws: int = DRAWS,
) -> Mean:
    """Return the mean over all values, and a percentile bootstrap interval over cases and worlds.

    Cases and worlds are drawn independently of each other (Owen 2007, Annals of Applied Statistics 1). The
    draws depend only on the numbers of cases and worlds. The result does not depend on the order of values.

    Args:
        values: One value per episode.
        clusters: Case of each value.
        worlds: World of each value; None for one world.
        draws: Number of bootstrap samples.

    Example:
        >>> cluster_mean([1.0, 3.0], ["a", "a"])
        Mean(value=2.0, low=None, high=None, n=2, clusters=1)
    """
    if not len(values):
        return Mean(None, None, None, 0, 0)
    rows = _places(values, clusters)
    columns = _places(values, worlds or [None] * len(values))
    sums = np.zeros((max(rows) + 1, max(columns) + 1))
    counts = np.zeros(sums.shape)
    for row, column, value in sorted(zip(rows, columns, values, strict=True)):
        sums[row, column] += value
        counts[row, column] += 1
    mean, k = float(sums.sum() / counts.sum()), len(sums)
    if sums.size == 1:
        return Mean(mean, None, None, len(values), 1)
    rng = np.random.default_rng(0)
    drawn = [rng.multinomial(size, np.full(size, 1.0 / size), size=draws) for size in sums.shape]
    totals, weights = (((drawn[0] @ table) * drawn[1]).sum(axis=1) for table in (sums, counts))
    filled = weights > 0  # with missing cells, a draw may contain none
    low, high = np.percentile(totals[filled] / weights[filled], (2.5, 97.5))
    return Mean(mean, float(low), float(high), len(values), k)


def _places(values: Sequence[float], labels: Sequence[Hashable]) -> list[int]:
    """Return the number of the label of each value; labels are ordered by their values."""
    groups: dict[Hashable, list[float]] = {}
    for value, label in zip(values, labels, strict=True):
        groups.setdefault(label, []).append(value)
    ordered = sorted(groups, key=lambda label: (sorted(groups[label]), str(label)))
    places = {label: place for place, label in enumerate(ordered)}
    return [places[label] for label in labels]


def _poisson_cdf(count: int, mean: float) -> float:
    """Return the probability of `count` events or fewer."""
    if mean <= 0.0:
        return 1.0
    numbers = np.arange(count + 1)
    log_factorials = np.concatenate(([0.0], np.cumsum(np.log(numbers[1:]))))
    return float(np.exp(numbers * np.log(mean) - mean - log_factorials).sum())


def _root(rising: Callable[[float], float], top: float) -> float:
    """Return the zero of a rising function in [0, top], by bisection."""
    low, high = 0.0, top
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (low, middle) if rising(middle) > 0.0 else (middle, high)
    return (low + high) / 2
