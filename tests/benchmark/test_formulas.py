"""Metrics, intervals and comparisons: every expected value is computed by hand."""

from math import atan, comb, degrees, exp, inf, nan, sqrt

import numpy as np
import pytest
from support.rows import threat_row

from lgmd_gym.benchmark.analysis.compare import QUANTITIES, compare_rows
from lgmd_gym.benchmark.episode import Episode
from lgmd_gym.benchmark.metrics import (
    BRAKING,
    EMERGENCY,
    METRICS,
    ONSET,
    PREMATURE,
    Counterfactual,
    PairedEpisode,
    brake_onsets,
    measure,
)
from lgmd_gym.benchmark.recorder import SERIES
from lgmd_gym.statistics.bootstrap import StratifiedBootstrap, interquartile_mean
from lgmd_gym.statistics.intervals import (
    Mean,
    Rate,
    binomial_tail,
    cluster_mean,
    poisson_interval,
    wilson,
)

THREAT, NO_THREAT = Counterfactual(True, 6.0, 12.0), Counterfactual(False, inf, inf)
STEPS = 13  # decisions at 2 Hz, from 0 to 6 s


def episode(collision=False, relative=inf, width=2.0, **series):
    """Return an episode with constant series unless stated otherwise."""
    values = {name: np.zeros(STEPS) for name in SERIES}
    values["time"] = np.arange(STEPS) / 2
    values["ego_speed"] = np.full(STEPS, 10.0)
    for name, value in series.items():
        values[name] = np.broadcast_to(np.asarray(value, float), STEPS).copy()
    return Episode(values, collision, relative + 3.0, relative, width, 30.0, 50.0, -2.5)


def measured(counterfactual=THREAT, premature=4.0, **arguments):
    return measure(PairedEpisode.of(episode(**arguments), counterfactual, premature))


def pulse(value, *steps):
    """Return a series that is 0 except at these decisions."""
    series = np.zeros(STEPS)
    series[list(steps)] = value
    return series


def test_limits_of_the_protocols():
    assert (PREMATURE, EMERGENCY, BRAKING, ONSET) == (4.0, 5.0, 1.0, 0.3)
    braking = np.where(np.arange(STEPS) > 3, 5.0, 0.0)
    assert measure(PairedEpisode.of(episode(deceleration=braking), THREAT))["premature_brake"]
    braking = np.where(np.arange(STEPS) > 4, 5.0, 0.0)
    assert not measure(PairedEpisode.of(episode(deceleration=braking), THREAT))["premature_brake"]


def test_counterfactual_of_an_episode_and_of_its_row():
    contact = Counterfactual.of(episode(collision=True, relative=7.0))
    assert contact == Counterfactual(True, 6.0, 7.0)
    assert Counterfactual.of(episode()) == NO_THREAT
    row = {"collision": True, "duration": 6.0, "relative_impact_speed": 7.0}
    assert Counterfactual.of_row(row) == contact
    assert Counterfactual.of_row(row | {"collision": False}) == NO_THREAT


@pytest.mark.parametrize(
    ("values", "onsets"),
    [
        ([0.0, 1.0, 1.0], []),  # braking exceeds 1 m/s²
        ([0.0, 1.001, 0.0], [0]),
        ([0.0, 0.299, 0.3, 1.001], [1]),  # traced back to the last value below 0.3 m/s²
        ([0.0, 0.3, 0.3, 1.001], [0]),
        ([0.3, 0.9, 1.001, 0.0], [0]),
        ([0.0, 2.0, 0.0, 0.0, 2.0], [0, 3]),
        ([0.0, 2.0, 0.3, 2.0], [0]),  # no release
    ],
)
def test_brake_onsets(values, onsets):
    assert brake_onsets(np.array(values)) == onsets


@pytest.mark.parametrize(
    ("step", "premature"),
    # The counterfactual contact is at 6 s: braking before 2 s, which is decision 4, is premature.
    [(3, True), (4, False), (5, False)],
)
def test_premature_braking_at_its_boundary(step, premature):
    deceleration = np.where(np.arange(STEPS) > step, 5.0, 0.0)  # its onset is the last 0
    row = measured(deceleration=deceleration)
    assert (row["premature_brake"], row["avoided"]) == (premature, not premature)
    held = measured(standstill_hold=pulse(1.0, step, 9))
    assert (held["premature_brake"], held["avoided"]) == (premature, not premature)
    assert measured(NO_THREAT, deceleration=deceleration)["premature_brake"] is False


def test_premature_braking_depends_on_the_earlier_of_braking_and_hold():
    late, early = np.where(np.arange(STEPS) > 8, 5.0, 0.0), np.where(np.arange(STEPS) > 1, 5.0, 0.0)
    assert measured(deceleration=late, standstill_hold=pulse(1.0, 2))["premature_brake"]
    assert measured(deceleration=early, standstill_hold=pulse(1.0, 9))["premature_brake"]
    assert not measured(deceleration=late, standstill_hold=pulse(1.0, 9))["premature_brake"]
    assert not measured()["premature_brake"]
    assert measured(deceleration=late, premature=1.5)["premature_brake"]  # 4 s < 6 s - 1.5 s
    assert not measured(deceleration=late, premature=2.0)["premature_brake"]


@pytest.mark.parametrize(("peak", "false"), [(0.25 * 9.80665, False), (0.25 * 9.80665 + 1e-9, True)])
def test_false_activation_at_its_boundary(peak, false):
    row = measured(NO_THREAT, deceleration=pulse(peak, 3))
    assert (row["false_activation"], row["peak_deceleration"]) == (false, peak)
    assert measured(THREAT, deceleration=pulse(peak, 3))["false_activation"] is False


def test_outcome_of_threats_and_non_threats():
    row = measured(collision=True, relative=7.0)
    assert (row["threat"], row["collision"], row["avoided"]) == (True, True, False)
    assert (row["impact_speed"], row["relative_impact_speed"], row["speed_reduction"]) == (10.0, 7.0, 5.0)
    assert measured()["speed_reduction"] == 12.0
    row = measured(NO_THREAT, collision=True, relative=7.0)
    assert (row["threat"], row["avoided"], row["speed_reduction"]) == (False, None, None)


@pytest.mark.parametrize(("level", "lead"), [(4.999, None), (5.0, 2.5), (9.0, 2.5)])
def test_warning_lead_time(level, lead):
    braking = pulse(level, 8, 9)
    assert measured(alert=pulse(1.0, 3, 5), deceleration=braking)["warning_lead_time"] == lead
    assert measured(deceleration=braking)["warning_lead_time"] is None
    late = measured(alert=pulse(1.0, 10), deceleration=braking)["warning_lead_time"]
    assert late == (None if lead is None else -1.0)


def test_values_at_the_first_alert():
    series = {"ttc": np.arange(20.0, 20 + STEPS), "gap": np.arange(40.0, 40 + STEPS)}
    row = measured(alert=pulse(1.0, 2, 4), target_speed=6.0, width=1.5, **series)
    assert (row["ttc_at_alert"], row["distance_at_alert"]) == (22.0, 42.0)
    assert row["theta_at_alert_deg"] == pytest.approx(degrees(2 * atan(0.75 / 42)))
    assert row["l_over_v_ms"] == pytest.approx(1000 * 0.75 / (10 - 6))
    for speed in (10.0, 11.0):
        assert measured(alert=pulse(1.0, 2), target_speed=speed, **series)["l_over_v_ms"] is None
    assert measured(alert=pulse(1.0, 2), gap=0.0)["theta_at_alert_deg"] is None
    small = measured(alert=pulse(1.0, 2), gap=0.5)["theta_at_alert_deg"]
    assert small == pytest.approx(degrees(2 * atan(2)))
    row = measured(**series)
    keys = ("ttc_at_alert", "distance_at_alert", "theta_at_alert_deg", "l_over_v_ms")
    assert [row[key] for key in keys] == [None] * 4


def test_values_when_braking_begins():
    ramp = np.arange(20.0, 20 + STEPS)
    row = measured(deceleration=pulse(9.0, 5), ttc=ramp, gap=ramp + 20, drac=ramp + 40)
    assert (row["ttc_at_brake"], row["distance_at_brake"], row["drac_at_brake"]) == (24.0, 44.0, 64.0)
    assert measured(deceleration=pulse(9.0, 5), ttc=inf)["ttc_at_brake"] is None
    assert measured(ttc=ramp)["ttc_at_brake"] is None


def test_extreme_values():
    ramp = np.arange(20.0, 20 + STEPS)
    drac = np.where(np.arange(STEPS) == 4, inf, ramp)
    row = measured(deceleration=pulse(9.0, 5), ttc=ramp, gap=ramp + 20, drac=drac)
    assert (row["max_drac"], row["min_ttc"], row["stopping_margin"]) == (32.0, 20.0, 40.0)
    assert measured(gap=ramp)["stopping_margin"] is None  # without braking
    assert measured(NO_THREAT, gap=ramp, deceleration=pulse(9.0, 5))["stopping_margin"] is None
    assert measured(drac=inf, ttc=inf)["max_drac"] is None
    assert measured(drac=inf, ttc=inf)["min_ttc"] is None
    row = measured(collision=True, relative=2.0, ttc=ramp, gap=ramp, drac=ramp, deceleration=pulse(9.0, 5))
    assert (row["max_drac"], row["min_ttc"], row["stopping_margin"]) == (None, 0.0, None)


def test_values_of_the_whole_episode():
    speed = np.arange(STEPS) * 2.0
    row = measured(ego_speed=speed, target_speed=speed + 3.0)
    assert (row["ego_speed"], row["target_speed"]) == (0.0, 3.0)
    assert row["distance"] == pytest.approx(24 * 6 / 2)  # a ramp from 0 to 24 m/s in 6 s
    assert (row["duration"], row["fps"], row["target_shade"], row["episode_return"]) == (
        6.0,
        30.0,
        50.0,
        -2.5,
    )
    assert set(row) == set(METRICS)


# Intervals


def test_wilson_interval_by_hand():
    # z = 2: centre (0.25 + 4/16)/(1 + 4/8), half width 2·√(0.25·0.75/8 + 4/256)/(1 + 4/8).
    half = 2 * sqrt(0.1875 / 8 + 4 / 256) / 1.5
    assert wilson(2, 8, z=2.0) == pytest.approx((0.5 / 1.5 - half, 0.5 / 1.5 + half))
    assert wilson(8, 8, z=2.0) == pytest.approx((1 / 1.5, 1.0))
    assert wilson(0, 8, z=2.0) == pytest.approx((0.0, 0.5 / 1.5))
    assert max(wilson(1, 1)) <= 1.0
    assert Rate.of([True, False, True]) == (2, 3, *wilson(2, 3))
    assert wilson(5, 10)[1] == pytest.approx(0.7634, abs=5e-5)  # 95 %


def test_poisson_interval_by_its_definition():
    """The bounds are the means with which the observed count or a more extreme one has probability 2.5 %."""
    low, high = poisson_interval(2)
    assert exp(-high) * (1 + high + high**2 / 2) == pytest.approx(0.025)
    assert 1 - exp(-low) * (1 + low) == pytest.approx(0.025)
    low, high = poisson_interval(1, confidence=0.5)
    assert (1 - exp(-low), exp(-high) * (1 + high)) == pytest.approx((0.25, 0.25))
    assert poisson_interval(0) == (0.0, pytest.approx(-np.log(0.025)))
    for confidence in (0.0, 1.0):
        with pytest.raises(ValueError, match="confidence"):
            poisson_interval(1, confidence)


def test_binomial_tail_by_hand():
    expected = comb(4, 3) * 0.2**3 * 0.8 + 0.2**4
    assert binomial_tail(3, 4, 0.2) == pytest.approx(expected)
    assert binomial_tail(4, 4, 0.2) == pytest.approx(0.2**4)
    assert binomial_tail(0, 4, 0.2) == pytest.approx(1.0)


def test_bootstrap_divides_by_the_number_of_drawn_values():
    """Clusters of 1 and 3 values: the three possible samples have the means 0, 3/4 and 1."""
    mean = cluster_mean([0.0, 1.0, 1.0, 1.0], ["a", "b", "b", "b"])
    assert mean == Mean(0.75, 0.0, 1.0, 4, 2)
    assert cluster_mean([0.0, 1.0], ["a", "a"]) == Mean(0.5, None, None, 2, 1)
    # Four clusters, 0 to 3: 2.5 % of the samples have a mean up to 0.5 (11 of 256), and 4.3 % from 2.5 on.
    assert cluster_mean([0.0, 1.0, 2.0, 3.0], range(4))[:3] == (1.5, 0.5, 2.5)


def test_stratified_bootstrap_draws_each_kind_of_cases_as_often_as_it_occurs():
    threat = {"a": True, "b": True, "c": False, "d": False, "e": False}
    bootstrap = StratifiedBootstrap(threat)
    assert bootstrap.cases == ["a", "b", "c", "d", "e"]
    kinds = np.array([[1.0, 1.0, 0.0, 0.0, 0.0]])
    assert bootstrap.means(kinds, 0) == pytest.approx(2 / 5)
    # The mean of the threats alone is one of 0, 1/2, 1, and all three occur.
    means = bootstrap.means(np.array([[0.0, 1.0, nan, nan, nan]]), 0)
    assert means.shape == (4000, 1)
    assert sorted(set(means[:, 0])) == [0.0, 0.5, 1.0]
    # Cases without a value do not count: a sample of "c", "d", "e" has the values of "c" and "d" alone.
    with np.errstate(invalid="ignore"):
        means = bootstrap.means(np.array([[nan, nan, 3.0, 6.0, nan]]), 0)
    assert set(np.round(means[np.isfinite(means)], 9)) == {3.0, 4.0, 4.5, 5.0, 6.0}


def test_stratified_bootstrap_draws_training_runs():
    bootstrap = StratifiedBootstrap({"a": True})
    means = bootstrap.means(np.array([[1.0], [5.0]]), seed=3)
    assert means.shape == (4000, 2)
    assert set(means.ravel()) == {1.0, 5.0}
    assert means.mean() == pytest.approx(3.0, abs=0.1)
    assert not np.array_equal(means, bootstrap.means(np.array([[1.0], [5.0]]), seed=4))


@pytest.mark.parametrize(
    ("values", "mean"),
    [([7.0], 7.0), ([1.0, 2.0, 6.0], 3.0), ([9.0, 1.0, 3.0, 5.0], 4.0), ([0, 0, 1, 2, 3, 4, 50, 90], 2.5)],
)
def test_interquartile_mean(values, mean):
    assert interquartile_mean(values) == mean


# Comparisons


def differences(a, b):
    comparison = compare_rows(a, b, ("a", "b"))
    return comparison, {item.name: item for item in comparison.differences}


def test_pairs_of_unequal_threat_are_not_compared():
    a = [threat_row("a", f"s/F/v{n}", avoided=False, threat=n != 2, false_activation=False) for n in range(4)]
    b = [threat_row("b", f"s/F/v{n}", avoided=n == 1, threat=n != 3, false_activation=True) for n in range(4)]
    comparison, by_name = differences(a, b)
    # Cases 0 and 1 are threats for both, 2 only for b, and 3 only for a.
    assert (comparison.pairs, comparison.unpaired) == (2, 2)
    avoided = by_name["avoided"]
    assert (avoided.mean_a, avoided.mean_b, avoided.change.n) == (0.0, 50.0, 2)
    assert (avoided.higher, avoided.lower) == (1, 0)
    assert "false activation" not in by_name


def test_signs_units_and_interval_of_a_difference():
    a = [threat_row("a", f"s/F/v{n}", speed_reduction=4.0, ttc_at_brake=None) for n in range(3)]
    b = [threat_row("b", f"s/F/v{n}", speed_reduction=value) for n, value in enumerate((3.0, 4.0, 9.0))]
    _, by_name = differences(a, b)
    speed = by_name["speed reduction"]
    assert (speed.unit, speed.mean_a, speed.mean_b) == ("km/h", pytest.approx(14.4), pytest.approx(19.2))
    assert speed.change == pytest.approx(cluster_mean([-3.6, 0.0, 18.0], "abc"))
    assert (speed.higher, speed.lower, speed.deviating_high) == (1, 1, None)
    _, by_name = differences(b, a)
    assert by_name["speed reduction"].change.value == pytest.approx(-4.8)
    _, by_name = differences(a, a)
    assert by_name["speed reduction"].deviating_high == pytest.approx(wilson(0, 3)[1])


def test_quantities_have_the_scale_of_their_unit():
    assert {item.key: (item.unit, item.scale, item.threats) for item in QUANTITIES} == {
        "avoided": ("% of threats", 100.0, True),
        "speed_reduction": ("km/h", 3.6, True),
        "premature_brake": ("% of threats", 100.0, True),
        "false_activation": ("% of non-threats", 100.0, False),
        "false_alert": ("% of non-threats", 100.0, False),
        "ttc_at_brake": ("s", 1.0, True),
        "stopping_margin": ("m", 1.0, True),
    }


def test_false_activation_is_compared_over_non_threats():
    a = [threat_row("a", f"s/F/v{n}", threat=n == 0, false_activation=n == 1) for n in range(3)]
    b = [threat_row("b", f"s/F/v{n}", threat=n == 0, false_activation=True) for n in range(3)]
    _, by_name = differences(a, b)
    item = by_name["false activation"]
    assert (item.mean_a, item.mean_b, item.change.n, item.higher) == (50.0, 100.0, 2, 1)


def test_failed_episodes_and_cases_with_a_driver_are_not_compared():
    a = [threat_row("a", f"s/F/v{n}", avoided=True) for n in range(3)]
    b = [threat_row("b", "s/F/v0", avoided=True, error="E"), threat_row("b", "s/F/v1", avoided=True)]
    driver = [threat_row(agent, "s/F/v9", avoided=True, fcw_driver=True) for agent in "ab"]
    comparison, _ = differences(a + driver[:1], b + driver[1:])
    assert (comparison.pairs, comparison.unpaired) == (1, 2)
