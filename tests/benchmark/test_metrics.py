"""Rows, metrics and summaries of episodes of suites of cases."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.rows import threat_row

from lgmd_gym.benchmark.analysis.tables import case_table, limit_table, score_tables
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import Episode
from lgmd_gym.benchmark.metrics import KEYS, METRICS, Counterfactual, brake_onsets, make_row, metric
from lgmd_gym.benchmark.recorder import SERIES
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.benchmark.summary import (
    COLUMNS,
    Sample,
    by_condition,
    summaries,
    summarise,
    write_summary,
)
from lgmd_gym.statistics.intervals import wilson

SLOW_APPROACH = Case("test", "CCRs", "v20", (("ego_speed", 5.556),))
THREAT = Counterfactual(True, 5.0, 10.0)
NO_THREAT = Counterfactual(False, float("inf"), float("inf"))


def episode(deceleration, collision=False, relative=float("inf"), alert=None):
    """Return an episode at 10 Hz and 10 m/s with a time to contact from 5 to 1 s."""
    n = len(deceleration)
    series = {name: np.zeros(n) for name in SERIES}
    series["time"] = np.arange(n) / 10
    series["ego_speed"] = np.full(n, 10.0)
    series["ttc"] = np.linspace(5, 1, n)
    series["gap"] = 10 * series["ttc"]
    series["deceleration"] = np.asarray(deceleration, float)
    if alert is not None:
        series["alert"][alert:] = 1.0
    return Episode(series, collision, relative, relative, 1.712, 30.0)


def test_brake_onset_is_traced_back_to_0_3():
    assert brake_onsets(np.zeros(5)) == []
    assert brake_onsets(np.array([0, 0.2, 0.5, 0.9, 1.1, 9.0])) == [1]
    assert brake_onsets(np.array([2.0, 3.0])) == [0]
    assert brake_onsets(np.array([0, 0.9, 0.9, 0])) == []
    assert brake_onsets(np.array([0, 2.0, 0.5, 2.0, 0.2, 0.1, 0.4, 2.0])) == [0, 5]  # 0.5 is no release


def test_row_of_an_avoided_threat():
    row = make_row("a", SLOW_APPROACH, 3, episode([0] * 20 + [9] * 21, alert=18), THREAT)
    assert tuple(row) == KEYS
    assert (row["threat"], row["collision"], row["avoided"], row["premature_brake"]) == (
        True,
        False,
        True,
        False,
    )
    assert row["speed_reduction"] == 10.0
    assert row["impact_speed"] is None
    assert row["ttc_at_brake"] == pytest.approx(np.linspace(5, 1, 41)[19])
    assert row["ttc_at_alert"] == pytest.approx(np.linspace(5, 1, 41)[18])
    gap = 10 * row["ttc_at_alert"]
    assert row["theta_at_alert_deg"] == pytest.approx(np.degrees(2 * np.arctan(0.856 / gap)))
    assert row["l_over_v_ms"] == pytest.approx(85.6)
    assert row["error"] is None
    assert json.loads(json.dumps(row, allow_nan=False)) == row


def test_premature_braking_does_not_count_as_avoided():
    early = make_row("a", SLOW_APPROACH, 0, episode([0] * 5 + [9] * 36), THREAT)
    assert early["premature_brake"]
    assert early["avoided"] is False
    assert early["speed_reduction"] == 10.0


def test_contact_after_braking_reduces_the_speed():
    row = make_row("a", SLOW_APPROACH, 0, episode([0] * 40 + [9], collision=True, relative=4.0), THREAT)
    assert row["avoided"] is False
    assert row["speed_reduction"] == 6.0


@pytest.mark.parametrize(("peak", "false"), [(2.4, False), (2.5, True)])
def test_false_activation_exceeds_a_quarter_g_without_a_threat(peak, false):
    row = make_row("a", SLOW_APPROACH, 0, episode([0, peak, 0]), NO_THREAT)
    assert row["false_activation"] is false
    assert row["avoided"] is None
    assert row["speed_reduction"] is None
    assert not make_row("a", SLOW_APPROACH, 0, episode([0, peak, 0]), THREAT)["false_activation"]


def test_metrics_of_an_avoided_threat():
    braked = episode([0] * 20 + [2, 4, 6] + [9] * 18, alert=18)
    braked.series["drac"][:] = np.linspace(1, 5, 41)
    row = make_row("a", SLOW_APPROACH, 0, braked, THREAT)
    assert row["warning_lead_time"] == pytest.approx(0.4)  # alert at 1.8 s, 5 m/s² at 2.2 s
    assert row["distance_at_alert"] == pytest.approx(10 * row["ttc_at_alert"])
    assert row["distance_at_brake"] == pytest.approx(10 * row["ttc_at_brake"])
    assert (row["min_ttc"], row["stopping_margin"], row["max_drac"]) == pytest.approx((1.0, 10.0, 5.0))
    assert row["drac_at_brake"] == pytest.approx(np.linspace(1, 5, 41)[19])


def test_contact_leaves_some_metrics_undefined():
    row = make_row("a", SLOW_APPROACH, 0, episode([0, 9, 9], collision=True, relative=3.0), THREAT)
    assert (row["min_ttc"], row["max_drac"], row["stopping_margin"]) == (0.0, None, None)
    assert row["warning_lead_time"] is None


def test_metric_names_are_unique():
    with pytest.raises(ValueError, match="'distance' is defined twice"):

        @metric
        def distance(pair):
            return 0.0, True

    assert set(METRICS) <= set(KEYS)


def test_summary_separates_threats_from_non_threats():
    good = make_row("a", SLOW_APPROACH, 0, episode([0] * 20 + [9] * 21), THREAT)
    false = make_row("a", SLOW_APPROACH, 1, episode([0, 9, 0]), NO_THREAT)
    failed = dict.fromkeys(KEYS) | {"agent": "a", "case": SLOW_APPROACH.name, "error": "Traceback"}
    item = summarise("a", "", [good, false, failed])
    assert (item.avoided.k, item.avoided.n) == (1, 1)
    assert (item.false_activations.k, item.false_activations.n) == (1, 1)
    assert item.errors == 1


def test_summary_orders_cases_by_number(tmp_path):
    rows = [
        make_row("a", replace(SLOW_APPROACH, suite="t", variant=f"v{speed}"), 0, episode([0, 0]), THREAT)
        for speed in (50, 5, 10)
    ]
    cases = ["t/CCRs/v5", "t/CCRs/v10", "t/CCRs/v50"]
    assert [item.group for item in summaries(rows, lambda row: row["case"])] == cases
    write_summary(rows, tmp_path / "summary.csv")
    lines = [line.split(",") for line in (tmp_path / "summary.csv").read_text().splitlines()]
    assert tuple(lines[0]) == COLUMNS
    assert [line[:7] for line in lines[1:]] == [
        *(["a", "clear", case, "1", "1", "1", "1"] for case in cases),
        ["a", "clear", "all", "3", "1", "3", "3"],
    ]


@pytest.mark.parametrize(
    ("worlds", "trials", "text"), [(1, 2, "2 cases in 1 world"), (4, 8, "2 cases in 4 worlds")]
)
def test_rates_cluster_by_case_and_world(worlds, trials, text):
    """Repeats of a case in a world are one trial."""
    values = {"avoided": True, "premature_brake": False, "speed_reduction": 3.0}
    rows = [
        threat_row(case=f"s/F/v{case}", seed=seed, world=seed % worlds, **values)
        for case in range(2)
        for seed in range(8)
    ]
    item = summarise("a", "", rows)
    assert item.avoided == (16, 16, *wilson(trials, trials))
    assert item.premature == (0, 16, *wilson(0, trials))
    assert str(item.sample) == text
    (table,) = score_tables(rows, ["a"], "title")
    assert table.caption.startswith(f"{text}; k/n [95 % interval, clustered by case and world, in %]")
    assert case_table(rows, ["a"]).caption == text
    assert limit_table([row | impact() for row in rows], ["a"], SUITES["fmvss127"]).caption.startswith(
        f"{text}; "
    )


def impact():
    """Return the values of a run without contact that the limits read."""
    return {"collision": False, "relative_impact_speed": None}


def test_sample_has_singular_and_plural():
    rows = [threat_row(case="a", world=1), threat_row(case="a", world=2)]
    assert [str(Sample.of(part)) for part in (rows, rows[:1], [])] == [
        "1 case in 2 worlds",
        "1 case in 1 world",
        "0 cases in 0 worlds",
    ]
    without = {key: value for key, value in rows[0].items() if key != "world"}  # rows of an earlier version
    assert Sample.of([without, without | {"case": "b"}]) == (2, 1, True)


def test_a_sample_names_the_laboratory():
    laboratory, first, second = (threat_row(case="a", world=world) for world in (None, 1, 2))
    assert str(Sample.of([laboratory])) == "1 case in the laboratory"
    assert str(Sample.of([laboratory, first, second])) == "1 case in the laboratory and 2 worlds"
    failed = threat_row(case="b", world=None, error="x")  # its world is unknown
    assert str(Sample.of([first, failed])) == "2 cases in 1 world"


def test_the_laboratory_and_worlds_are_separate_parts():
    laboratory, world = threat_row(case="a", world=None), threat_row(case="b", world=3)
    night = world | {"condition": "night"}
    assert list(by_condition([laboratory])) == list(by_condition([world])) == ["clear"]
    assert by_condition([laboratory, world]) == {"laboratory": [laboratory], "worlds": [world]}
    assert list(by_condition([laboratory, world, night])) == [
        "clear-laboratory",
        "clear-worlds",
        "night-worlds",
    ]
