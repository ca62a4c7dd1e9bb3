"""Intervals against published values, and the cluster bootstrap."""

import numpy as np
import pytest

from lgmd_gym.statistics.intervals import Mean, Rate, binomial_tail, cluster_mean, poisson_interval, wilson


def test_wilson_interval_matches_newcombe_1998():
    # Table I: 81 of 263, and 0 of 20.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)
    assert Rate.of([True, False]) == (1, 2, *wilson(1, 2))


@pytest.mark.parametrize(
    ("count", "low", "high"),
    [(0, 0.0, 3.689), (1, 0.0253, 5.572), (5, 1.623, 11.668), (10, 4.795, 18.390), (100, 81.364, 121.627)],
)
def test_poisson_interval_matches_garwood(count, low, high):
    assert poisson_interval(count) == (pytest.approx(low, abs=6e-4), pytest.approx(high, abs=6e-4))


def test_poisson_interval_of_a_large_count_is_nearly_normal():
    low, high = poisson_interval(10_000)
    assert (low, high) == (pytest.approx(10_000 - 195, abs=2), pytest.approx(10_000 + 198, abs=2))


def test_poisson_interval_of_zero_is_the_one_sided_bound():
    assert poisson_interval(0, confidence=0.9)[1] == pytest.approx(-np.log(0.05))


@pytest.mark.parametrize(("count", "confidence"), [(-1, 0.95), (3, 1.0)])
def test_poisson_interval_rejects_invalid_arguments(count, confidence):
    with pytest.raises(ValueError, match=r"count must be >= 0 and confidence in \(0, 1\)"):
        poisson_interval(count, confidence)


def test_binomial_tail_sums_the_upper_probabilities():
    assert binomial_tail(0, 5, 0.3) == pytest.approx(1.0)
    assert binomial_tail(2, 3, 0.5) == pytest.approx(0.5)
    assert binomial_tail(4, 3, 0.5) == 0.0


def test_cluster_interval_does_not_depend_on_copies_within_a_cluster():
    values, clusters = [0.0, 1.0, 2.0, 9.0], list("abcd")
    once = cluster_mean(values, clusters)
    copies = cluster_mean(values * 10, clusters * 10)
    assert once.value == copies.value == 3.0
    assert (once.low, once.high) == pytest.approx((copies.low, copies.high))
    independent = cluster_mean(values * 10, range(40))
    assert independent.high - independent.low < 0.5 * (copies.high - copies.low)


def test_cluster_interval_does_not_depend_on_copies_within_a_world():
    """Worlds that differ widen the interval as cases do; a single world does not change it."""
    values, cases, worlds = [0.0, 1.0, 2.0, 9.0], list("aaaa"), [1, 2, 3, 4]
    by_world = cluster_mean(values * 10, cases * 10, worlds * 10)
    assert (by_world.n, by_world.clusters) == (40, 1)
    by_case = cluster_mean(values * 10, worlds * 10)
    assert by_world[:3] == pytest.approx(by_case[:3])
    assert cluster_mean(values, worlds, [7] * 4) == cluster_mean(values, worlds)


def test_cluster_mean_of_crossed_cases_and_worlds_is_wider_than_of_either():
    table = np.add.outer([0.0, 1.0, 5.0], [0.0, 2.0, 3.0, 7.0])
    cases, worlds = (part.ravel().tolist() for part in np.indices(table.shape))
    values = table.ravel().tolist()
    widths = [
        mean.high - mean.low
        for mean in (
            cluster_mean(values, cases, worlds),
            cluster_mean(values, cases),
            cluster_mean(values, worlds),
        )
    ]
    assert widths[0] > max(widths[1:])
    assert cluster_mean(values[::-1], cases[::-1], worlds[::-1]) == cluster_mean(values, cases, worlds)


def test_draws_without_any_value_are_left_out():
    """Of case a in world 1 and case b in world 2, a quarter of the draws contain neither."""
    mean = cluster_mean([1.0, 3.0], ["a", "b"], [1, 2])
    assert mean == (2.0, 1.0, 3.0, 2, 2)


def test_cluster_mean_does_not_depend_on_the_order():
    values, clusters = [0.0, 1.0, 2.0, 9.0], list("abac")
    assert cluster_mean(values[::-1], clusters[::-1]) == cluster_mean(values, clusters)


def test_cluster_interval_of_independent_values_is_nearly_normal():
    values = np.random.default_rng(1).normal(size=400)
    mean = cluster_mean(list(values), range(400))
    assert mean.high - mean.low == pytest.approx(2 * 1.96 * values.std() / 20, rel=0.05)


def test_cluster_mean_without_values():
    assert cluster_mean([], []) == Mean(None, None, None, 0, 0)
