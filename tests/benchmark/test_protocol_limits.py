"""Protocol-derived scores against the documents' tables, and against the official calculator if installed."""

import csv

import pytest

from lgmd_gym.benchmark.analysis.compare import compare_rows
from lgmd_gym.benchmark.analysis.protocol_limits import (
    colour_2026,
    judge_r152,
    meets_r152,
    r152_limit,
    verdicts,
)
from lgmd_gym.benchmark.analysis.tables import score_tables, verdict_table
from lgmd_gym.benchmark.rows import KEYS
from lgmd_gym.benchmark.summary import write_summary
from lgmd_gym.envs.dynamics.units import KMH


def row(case, ego, target, impact, agent="a"):
    values = {"agent": agent, "case": f"r152/{case}", "ego_speed": ego * KMH, "target_speed": target * KMH}
    values |= {"relative_impact_speed": impact * KMH if impact else None, "collision": bool(impact)}
    return dict.fromkeys(KEYS) | values | {"threat": True}


@pytest.mark.parametrize(
    ("relative", "laden", "unladen"),
    [
        (10, 0, 0),
        (40, 0, 0),
        (41, 10, 0),
        (42, 10, 0),
        (43, 15, 15),
        (45, 15, 15),
        (50, 25, 25),
        (60, 35, 35),
    ],
)
def test_r152_limits_are_the_regulations(relative, laden, unladen):
    assert (r152_limit(relative, "laden"), r152_limit(relative, "unladen")) == (laden, unladen)


def test_r152_ends_at_sixty():
    with pytest.raises(ValueError, match="no limit at 61 km/h"):
        r152_limit(61, "laden")


@pytest.mark.parametrize(
    ("case", "ego", "target", "impact", "met"),
    [
        ("CCRs/v40", 40, 0, 0, True),
        ("CCRs/v40", 40, 0, 1, False),
        ("CCRs/v42", 42, 0, 1, False),
        ("CCRs/v60", 60, 0, 35, True),
        ("CCRs/v60", 60, 0, 35.1, False),
        ("CCRm/v60", 60, 20, 0.5, False),  # 40 km/h relative: no contact allowed
    ],
)
def test_r152_rows(case, ego, target, impact, met):
    assert judge_r152(row(case, ego, target, impact))[0] is met


def test_braking_before_the_test_begins_meets_nothing():
    early = row("CCRs/v20", 20, 0, 0) | {"premature_brake": True}
    assert judge_r152(early)[0] is False
    assert not meets_r152([early], "a")


@pytest.mark.parametrize(("failed", "met"), [(0, True), (1, True), (2, False)])
def test_a_tenth_of_the_runs_may_fail(failed, met):
    rows = [row("CCRs/v20", 20, 0, 5 if number < failed else 0) for number in range(10)]
    assert meets_r152(rows, "a") is met
    (item,) = verdicts(rows, "a", judge_r152)
    assert (item.met.k, item.met.n) == (10 - failed, 10)
    assert item.worst == pytest.approx(5 * KMH if failed else 0)
    assert ("simulation: a" in verdict_table(rows, ["a"], "r152").caption) is met


def test_no_run_meets_nothing():
    assert not meets_r152([], "a")
    assert verdict_table([], ["a"], "quick") is None


def test_colours_against_the_official_calculator():
    """Every band and edge, through the calculator's own logic."""
    processing = pytest.importorskip("euroncap_rating_2026.crash_avoidance.matrix_processing")
    from types import SimpleNamespace

    for ego in (10, 20, 30, 40, 50, 60, 70, 80):
        for impact in (0.0, 0.1, 5.0, 9.99, 10.0, 15.0, 19.99, 20.0, 29.99, 30.0, 60.0):
            point = SimpleNamespace(
                attributes={"VUT speed": f"{ego} km/h"}, color=None, row=0, total_rows=0, internal={}
            )
            computed = processing.ComputedTestPoint(point, test_name="CCRs")
            computed.value = impact
            official = computed._compute_color_logic()
            assert getattr(official, "value", official).lower() == colour_2026(ego, impact), (ego, impact)


def test_a_warned_driver_is_no_part_of_the_totals(tmp_path):
    def told(case, warned, avoided):
        given = {"agent": "a", "case": case, "fcw_driver": warned, "threat": True, "avoided": avoided}
        return dict.fromkeys(KEYS) | given | {"premature_brake": False, "speed_reduction": 3.0}

    rows = [told("s/CCRs/v50", False, True), told("s/CCRs/v60-warned", True, False)]
    automatic, warned = score_tables(rows, ["a"], "all")
    assert [list(table.columns[1].cells) for table in (automatic, warned)] == [
        ["1/1 [21–100]"],
        ["0/1 [0–79]"],
    ]
    assert len(score_tables(rows[:1], ["a"], "all")) == 1
    write_summary([item | {"condition": "clear"} for item in rows], tmp_path / "summary.csv")
    lines = list(csv.DictReader((tmp_path / "summary.csv").open()))
    assert [(line["case"], line["threats"]) for line in lines][-1] == ("all", "1")
    paired = [item | {"agent": "b", "seed": 0, "condition": "clear"} for item in rows]
    assert compare_rows(paired, paired, ("b", "b")).pairs == 1
