"""Intervals of counts of events that come in clusters.

Garwood's interval holds for a Poisson process. False activations vary more: one intersection, or one world,
causes several. The interval is therefore stretched on a logarithmic scale by sqrt(φ) t / z, where φ is
Pearson's dispersion of the counts per drive or per world, the larger of both and at least 1 (quasi-Poisson:
McCullagh and Nelder 1989, Generalized Linear Models, 4.5), t the quantile for its number of groups and z that
of the normal distribution. Without an event there is no estimate of φ, and the interval is Garwood's: it then
holds if the drives are independent.
"""

from collections.abc import Hashable, Sequence

import numpy as np

from lgmd_gym.statistics.effective_size import Z95, numbered, t_quantile
from lgmd_gym.statistics.intervals import poisson_interval


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
