"""Intervals of rates, counts and means.

Rates have Wilson's interval for an effective sample size, see `effective_size`; counts have Garwood's exact
Poisson interval (for counts in clusters see `event_counts`), and means a bootstrap that draws whole cases and
whole worlds: runs of one case or of one world are correlated, so drawing single episodes would give an
interval that is too narrow.


Effective sample size

Runs of one case are correlated, and so are runs in one world (a camera world; in the laboratory there is only
one). Wilson's interval for n independent trials is then too narrow. The interval of a rate p is therefore
Wilson's for the effective sample size of Korn and Graubard (1998, Survey Methodology 24),

    n_eff = p (1 - p) / V * (z / t)²,

where V is the variance of p with two-way clustering, V = V_case + V_world - V_cell (Cameron, Gelbach and
Miller 2011, J. Business & Economic Statistics 29), with the factor G / (G - 1) for G clusters, and t is the
quantile with min(cases, worlds) - 1 degrees of freedom, as that paper advises for few clusters. V is at least
each of V_case and V_world, because the difference can be too small or negative by chance (MacKinnon, Nielsen
and Webb 2024, "Jackknife inference with two-way clustering"). A dimension with one cluster is left out: the
result then holds for that case or that world.

n_eff has two bounds. Repeats of one cell, a case in a world, are never counted as independent, so n_eff is at
most the number of cells. If all trials of a cluster agree, n_eff is the number of clusters, n² / Σ n_g² for
unequal ones (Kish 1965), so n_eff is at least the lower of both numbers. If all outcomes are equal, V is 0
and n_eff is the number of cells: the data then contain no estimate of a correlation between cells, and the
interval of a rate of 0 or 1 holds if the cells are independent. In the laboratory, n_eff is the number of
cases (Kish's for unequal numbers of runs).

This was chosen over a bootstrap of cases and worlds, which has no width for rates of 0 and 1, and over a
generalised linear mixed model, which does not converge for them. A test simulates the coverage.


Counts in clusters

Garwood's interval holds for a Poisson process. False activations vary more: one intersection, or one world,
causes several. The interval is therefore stretched on a logarithmic scale by sqrt(φ) t / z, where φ is
Pearson's dispersion of the counts per drive or per world, the larger of both and at least 1 (quasi-Poisson:
McCullagh and Nelder 1989, Generalized Linear Models, 4.5), t the quantile for its number of groups and z that
of the normal distribution. Without an event there is no estimate of φ, and the interval is Garwood's: it then
holds if the drives are independent.
"""

import math
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

Z95 = 1.959964  # standard normal quantile of a two-sided 95 % interval


def effective_size(
    flags: Sequence[bool], cases: Sequence[Hashable], worlds: Sequence[Hashable] | None = None
) -> float:
    """Return the number of independent trials that give a rate the same variance.

    Args:
        flags: Outcome of each trial.
        cases: Case of each trial.
        worlds: World of each trial; None for one world.

    Returns:
        A number in [1, number of distinct cells]; 0 without trials.

    Example:
        >>> effective_size([True, True, False, False], ["a", "a", "b", "b"])
        2.0
    """
    outcomes = np.asarray(flags, float)
    if outcomes.size == 0:
        return 0.0
    by_case, by_world = numbered(cases), numbered(worlds or [None] * len(outcomes))
    by_cell = numbered(list(zip(by_case.tolist(), by_world.tolist(), strict=True)))
    cells = float(by_cell.max() + 1)
    ways = [groups for groups in (by_case, by_world) if groups.max() > 0]
    share = outcomes.mean()
    if not ways or share in (0.0, 1.0):
        return cells
    single = [_variance(outcomes - share, groups) for groups in ways]
    variance = (
        max(*single, sum(single) - _variance(outcomes - share, by_cell)) if len(ways) == 2 else single[0]
    )
    lowest = min(float(len(groups) ** 2 / np.sum(np.bincount(groups) ** 2.0)) for groups in ways)
    if variance == 0.0:  # every case, or every world, has the same rate
        return cells
    factor = (Z95 / t_quantile(min(int(groups.max()) for groups in ways))) ** 2
    return float(min(max(share * (1.0 - share) / variance * factor, lowest), cells))


def t_quantile(degrees: int) -> float:
    """Return the 97.5 % quantile of Student's t, to 0.8 % from 2 degrees of freedom on.

    Source: Abramowitz and Stegun (1964), 26.7.5.
    """
    z = np.array([Z95**power for power in (1, 3, 5, 7, 9)])
    terms = (
        z[0],
        z[:2] @ (1, 1) / 4,
        z[:3] @ (3, 16, 5) / 96,
        z[:4] @ (-15, 17, 19, 3) / 384,
        z @ (-945, -1920, 1482, 776, 79) / 92160,
    )
    return float(sum(term / degrees**power for power, term in enumerate(terms)))


def numbered(labels: Sequence[Hashable]) -> np.ndarray:
    """Return the labels as whole numbers from 0 on, in order of appearance."""
    numbers: dict[Hashable, int] = {}
    return np.array([numbers.setdefault(label, len(numbers)) for label in labels])


def _variance(residuals: np.ndarray, groups: np.ndarray) -> float:
    """Return the variance of a mean with one-way clustering."""
    sums, count = np.bincount(groups, weights=residuals), groups.max() + 1
    return float(count / (count - 1) * (sums @ sums) / len(residuals) ** 2)


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


def exact_sign_test(gained: int, lost: int) -> float:
    """Return the two-sided p of a paired comparison of outcomes (McNemar's exact test).

    Args:
        gained: Number of pairs in which only the second succeeded.
        lost: Number of pairs in which only the first succeeded.

    Example:
        >>> exact_sign_test(5, 0)
        0.0625
    """
    return min(1.0, 2.0 * binomial_tail(max(gained, lost), gained + lost, 0.5))


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


def count_interval(
    counts: Sequence[int],
    exposures: Sequence[float],
    cases: Sequence[Hashable],
    worlds: Sequence[Hashable],
) -> tuple[float, float]:
    """Return the 95 % interval of the expected total number of events.

    Args:
        counts: Number of events in each drive.
        exposures: Exposure of each drive, for example its distance, >= 0.
        cases: Case of each drive.
        worlds: World of each drive.

    Example:
        >>> [round(bound, 1) for bound in count_interval([0, 0], [1.0, 1.0], ["a", "b"], [1, 2])]
        [0.0, 3.7]
    """
    total = sum(counts)
    low, high = poisson_interval(total)
    if total == 0:
        return low, high
    stretch = max(_stretch(counts, exposures, labels) for labels in (cases, worlds))
    return total * (low / total) ** stretch, total * (high / total) ** stretch


def _stretch(counts: Sequence[int], exposures: Sequence[float], labels: Sequence[Hashable]) -> float:
    """Return sqrt(φ) t / z of groups of drives; 1 if φ is not above 1, or for one group."""
    groups = numbered(labels)
    events, exposed = (np.bincount(groups, weights=values) for values in (counts, exposures))
    events, exposed = events[exposed > 0.0], exposed[exposed > 0.0]
    degrees = len(events) - 1
    if degrees < 1:
        return 1.0
    expected = exposed * events.sum() / exposed.sum()
    dispersion = float((((events - expected) ** 2) / expected).sum() / degrees)
    return dispersion**0.5 * t_quantile(degrees) / Z95 if dispersion > 1.0 else 1.0
