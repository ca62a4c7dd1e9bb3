"""Effective sample size of a rate whose trials share cases and worlds.

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
"""

from collections.abc import Hashable, Sequence

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
