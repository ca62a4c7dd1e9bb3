"""Intervals for means of continuous values: a bootstrap that draws whole cases, not episodes.

Seeds of one case are near-copies of each other; drawing them one by one would make an interval that is too
narrow. Rates take Wilson's interval instead: a bootstrap of 0 of N says [0, 0].
"""

from collections.abc import Hashable, Sequence
from typing import NamedTuple

import numpy as np

DRAWS = 4000


class Mean(NamedTuple):
    """A mean with its 95 % interval; None for bounds that a single cluster cannot give, or for no value."""

    value: float | None
    low: float | None
    high: float | None
    n: int
    clusters: int


def cluster_mean(values: Sequence[float], clusters: Sequence[Hashable], draws: int = DRAWS) -> Mean:
    """Return the mean over all values, and a percentile bootstrap interval over clusters.

    The draws are the same for the same number of clusters, and neither the mean nor the interval depends on
    the order of the values.

    Args:
        values: One per episode.
        clusters: Each value's cluster, such as its case.
        draws: Number of bootstrap samples.

    Example:
        >>> cluster_mean([1.0, 3.0], ["a", "a"])
        Mean(value=2.0, low=None, high=None, n=2, clusters=1)
    """
    groups: dict[Hashable, list[float]] = {}
    for value, cluster in zip(values, clusters, strict=True):
        groups.setdefault(cluster, []).append(value)
    if not groups:
        return Mean(None, None, None, 0, 0)
    # Sorted, so that the order in which episodes finished does not matter.
    ordered = sorted(sorted(group) for group in groups.values())
    sums, counts = np.array([sum(group) for group in ordered]), np.array([len(group) for group in ordered])
    mean, k = float(sums.sum() / counts.sum()), len(ordered)
    if k == 1:
        return Mean(mean, None, None, len(values), 1)
    weights = np.random.default_rng(0).multinomial(k, np.full(k, 1.0 / k), size=draws)
    low, high = np.percentile((weights @ sums) / (weights @ counts), (2.5, 97.5))
    return Mean(mean, float(low), float(high), len(values), k)
