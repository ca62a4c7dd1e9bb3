"""Effective sample size of clustered rates: values by hand, and simulated coverage."""

from math import sqrt

import numpy as np
import pytest

from lgmd_gym.statistics.intervals import Rate, effective_size, t_quantile, wilson


def grid(cases, worlds, repeats=1):
    """Return the case and the world of each trial of a complete design."""
    cells = [(case, world) for case in range(cases) for world in range(worlds) for _ in range(repeats)]
    return [case for case, _ in cells], [world for _, world in cells]


def test_repeats_of_a_case_in_the_laboratory_are_one_trial():
    """CCRs/v40 stops at the same distance with every seed: 60 runs of 6 cases are 6 trials."""
    cases, _ = grid(6, 1, 10)
    always = [case < 5 for case in cases]
    assert effective_size(always, cases) == 6.0
    assert effective_size([True] * 60, cases) == 6.0
    sometimes = [case % 2 == 0 or trial % 3 == 0 for trial, case in enumerate(cases)]
    assert effective_size(sometimes, cases) == 6.0
    assert Rate.clustered(always, cases) == (50, 60, *wilson(5, 6))


def test_equal_outcomes_have_one_trial_per_cell():
    cases, worlds = grid(4, 5, 3)
    assert effective_size([False] * 60, cases, worlds) == 20.0
    assert Rate.clustered([True] * 60, cases, worlds)[2:] == wilson(20, 20)


def test_outcomes_that_depend_on_the_case_or_world_alone_count_as_its_number():
    cases, worlds = grid(8, 12)
    assert effective_size([case < 4 for case in cases], cases, worlds) == 8.0
    assert effective_size([world < 6 for world in worlds], cases, worlds) == 8.0  # the lower bound of both
    wide, many = grid(40, 12)
    by_world = effective_size([world < 6 for world in many], wide, many)
    assert by_world == pytest.approx(12.0)


def test_variance_and_degrees_of_freedom_by_hand():
    """Three cases in two worlds; the only success is in case 0 and world 0."""
    cases, worlds = grid(3, 2)
    flags = [True, False, False, False, False, False]
    # residuals 5/6 and -1/6: sums by case 4/6, -2/6, -2/6, by world 3/6 and -3/6
    case = 3 / 2 * (16 + 4 + 4) / 36 / 36
    world = 2 / 1 * (9 + 9) / 36 / 36
    cell = 6 / 5 * (25 + 5) / 36 / 36
    two_way = max(case, world, case + world - cell)
    assert two_way == pytest.approx(case)
    expected = 5 / 36 / two_way * (1.959964 / t_quantile(1)) ** 2
    assert expected < 2.0
    assert effective_size(flags, cases, worlds) == 2.0  # of two worlds
    long, many = grid(30, 20)
    flags = [(7 * case + 3 * world) % 10 == 0 for case, world in zip(long, many, strict=True)]
    residual = np.array(flags) - 0.1
    table = residual.reshape(30, 20)
    by_case, by_world = table.sum(axis=1), table.sum(axis=0)
    parts = [(len(x) / (len(x) - 1)) * (x @ x) / 600**2 for x in (by_case, by_world, residual)]
    two_way = max(parts[0], parts[1], parts[0] + parts[1] - parts[2])
    expected = min(0.09 / two_way * (1.959964 / t_quantile(19)) ** 2 if two_way > 0 else np.inf, 600.0)
    assert effective_size(flags, long, many) == pytest.approx(expected)


def test_unequal_clusters_have_the_size_of_kish():
    cases = ["a"] * 8 + ["b"] * 1 + ["c"] * 1
    assert effective_size([case == "a" for case in cases], cases) == pytest.approx(100 / 66)


def test_size_without_trials_and_of_a_single_cell():
    assert effective_size([], []) == 0.0
    assert Rate.clustered([], []) == (0, 0, 0.0, 1.0)
    assert effective_size([True, False], ["a", "a"]) == 1.0


def test_equal_rates_of_all_cases_count_as_cells():
    assert effective_size([True, False] * 5, [case for case in "abcde" for _ in range(2)]) == 5.0


def test_worlds_of_one_case_are_its_trials():
    worlds = list(range(10))
    assert effective_size([world < 3 for world in worlds], ["a"] * 10, worlds) == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("degrees", "quantile"), [(2, 4.303), (3, 3.182), (5, 2.571), (9, 2.262), (30, 2.042)]
)
def test_t_quantile_matches_tables(degrees, quantile):
    assert t_quantile(degrees) == pytest.approx(quantile, rel=0.008 if degrees == 2 else 0.0015)


def simulated_coverage(share_case, share_world, size, rate=0.3, draws=400):
    """Return the coverage of the pooled and of the clustered interval.

    Outcomes are a threshold on a normal variable, of whose variance the case has `share_case` and the world
    `share_world`.
    """
    rng = np.random.default_rng(7)
    cases, worlds = (np.array(labels) for labels in grid(*size))
    threshold = {0.3: -0.5244005, 0.1: -1.2815516}[rate]
    hits = np.zeros(2)
    for _ in range(draws):
        latent = sqrt(share_case) * rng.normal(size=size[0])[cases]
        latent += sqrt(share_world) * rng.normal(size=size[1])[worlds]
        latent += sqrt(1.0 - share_case - share_world) * rng.normal(size=len(cases))
        flags = (latent < threshold).tolist()
        found = Rate.of(flags), Rate.clustered(flags, cases.tolist(), worlds.tolist())
        hits += [interval.low <= rate <= interval.high for interval in found]
    return hits / draws


@pytest.mark.parametrize(
    ("share_case", "share_world", "size", "rate"),
    [
        (0.5, 0.0, (21, 10), 0.3),
        (0.0, 0.3, (21, 10), 0.3),
        (0.4, 0.2, (21, 10), 0.3),
        (0.4, 0.2, (30, 20), 0.1),
        (0.5, 0.0, (21, 1, 5), 0.3),
    ],
)
def test_coverage_with_correlated_outcomes(share_case, share_world, size, rate):
    pooled, clustered = simulated_coverage(share_case, share_world, size, rate)
    assert clustered > 0.93
    assert pooled < 0.85


def test_independent_outcomes_keep_most_of_their_number():
    rng = np.random.default_rng(3)
    cases, worlds = grid(21, 10)
    sizes = [effective_size((rng.random(210) < 0.3).tolist(), cases, worlds) for _ in range(50)]
    assert 100.0 < np.median(sizes) <= 210.0
