"""Limits, colours and points of the protocols, compared with the tables of the documents."""

import csv
from types import SimpleNamespace

import pytest
from support.rows import suite_rows, threat_row

from lgmd_gym.benchmark.analysis.compare import compare_rows
from lgmd_gym.benchmark.analysis.tables import limit_results, limit_table, score_tables, verdict_text
from lgmd_gym.benchmark.protocols.car_to_car_2023 import points_2023, row_colour_2023
from lgmd_gym.benchmark.protocols.frontal_2026 import (
    check_green,
    colour_2026,
    points_2026,
    row_colour_2026,
)
from lgmd_gym.benchmark.protocols.regulations import (
    check_fmvss127,
    check_r152,
    meets_fmvss127,
    meets_r152,
    r152_limit,
)
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.benchmark.summary import write_summary
from lgmd_gym.envs.dynamics.units import KMH

R152 = SUITES["r152"]
# UN R152 Rev.2, 5.2.1.4, M1: relative speed, limits laden and unladen [km/h].
R152_TABLE = [
    (10, 0, 0),
    (40, 0, 0),
    (41, 10, 0),
    (42, 10, 0),
    (43, 15, 15),
    (45, 15, 15),
    (50, 25, 25),
    (60, 35, 35),
]
# 5.2.3: with a bicycle.
R152_BICYCLE_TABLE = [
    (20, 0, 0),
    (38, 0, 0),
    (39, 10, 0),
    (40, 10, 0),
    (41, 25, 25),
    (45, 25, 25),
    (50, 30, 30),
    (55, 35, 35),
    (60, 40, 40),
]


def impact_row(case, ego, target, impact, **values):
    """Return a row with speeds in km/h; an impact speed of 0 is no contact."""
    speeds = {"ego_speed": ego * KMH, "target_speed": target * KMH}
    speeds |= {"relative_impact_speed": impact * KMH if impact else None, "collision": bool(impact)}
    suite = "r152-vru" if case.startswith(("CP", "CB")) else "r152"
    return threat_row(case=f"{suite}/{case}", **(speeds | values))


def test_r152_limits_match_the_regulation():
    computed = [(speed, r152_limit(speed, "laden"), r152_limit(speed, "unladen")) for speed, *_ in R152_TABLE]
    assert computed == R152_TABLE


@pytest.mark.parametrize(("target", "table"), [("pedestrian", R152_TABLE), ("bicycle", R152_BICYCLE_TABLE)])
def test_r152_limits_of_vulnerable_road_users(target, table):
    computed = [(v, *(r152_limit(v, load, target) for load in ("laden", "unladen"))) for v, *_ in table]
    assert computed == table


def test_r152_has_no_limit_above_60_kmh():
    with pytest.raises(ValueError, match=r"at most 60, .* got 61"):
        r152_limit(61, "laden")


@pytest.mark.parametrize(
    ("case", "ego", "target", "impact", "met", "limit"),
    [
        ("CCRs/v40", 40, 0, 0, True, "≤ 0 km/h laden"),
        ("CCRs/v40", 40, 0, 1, False, "≤ 0 km/h laden"),
        ("CCRs/v42", 42, 0, 1, False, "≤ 0 km/h unladen"),
        ("CCRs/v60", 60, 0, 35, True, "≤ 35 km/h unladen"),
        ("CCRs/v60", 60, 0, 35.1, False, "≤ 35 km/h unladen"),
        ("CCRm/v60", 60, 20, 0.5, False, "≤ 0 km/h unladen"),  # 40 km/h relative speed
        ("CPNA/v40", 40, 5, 1, False, "≤ 0 km/h laden"),
        ("CPNA/v60", 60, 5, 35, True, "≤ 35 km/h unladen"),  # the target crosses: 60 km/h relative speed
        ("CBNA/v38", 38, 15, 0, True, "≤ 0 km/h laden"),
        ("CBNA/v40", 40, 15, 1, False, "≤ 0 km/h unladen"),
        ("CBNA/v60", 60, 15, 40, True, "≤ 40 km/h unladen"),
    ],
)
def test_check_r152_uses_relative_speed_and_load(case, ego, target, impact, met, limit):
    assert check_r152(impact_row(case, ego, target, impact)) == (met, limit)


def test_premature_braking_fails_r152():
    premature = impact_row("CCRs/v20", 20, 0, 0, premature_brake=True)
    assert not check_r152(premature)[0]
    assert not meets_r152([premature], "a")


@pytest.mark.parametrize(("failed", "met"), [(0, True), (1, True), (2, False)])
def test_r152_allows_a_tenth_of_the_runs_to_fail(failed, met):
    rows = [impact_row("CCRs/v20", 20, 0, 5 if seed < failed else 0, seed=seed) for seed in range(10)]
    assert meets_r152(rows, "a") is met
    (result,) = limit_results(rows, "a", R152)
    assert (result.case, result.met.k, result.met.n) == ("r152/CCRs/v20", 10 - failed, 10)
    assert result.worst == pytest.approx(5 * KMH if failed else 0)
    table = limit_table(rows, ["a"], R152)
    assert table.caption.endswith("UN R152: 10 runs per agent, 30 are needed")
    assert [list(column.cells) for column in table.columns] == [
        ["CCRs/v20"],
        ["≤ 0 km/h unladen"],
        [f"{10 - failed}/10 (5)" if failed else "10/10"],
    ]
    many = [row | {"seed": row["seed"] + 10 * number} for row in rows for number in range(3)]
    agents = "a" if met else "none"
    assert verdict_text(many, ["a", "b"], R152).endswith(
        f"in simulation, in the laboratory, 30 runs or more: {agents}"
    )


@pytest.mark.parametrize(("contacts", "met"), [(0, True), (1, False)])
def test_fmvss127_allows_no_contact(contacts, met):
    suite = SUITES["fmvss127"]
    rows = [
        impact_row("CCRs/v50", 50, 0, 5 if seed < contacts else 0, seed=seed, world=8000 + seed)
        for seed in range(30)
    ]
    assert meets_fmvss127(rows, "a") is met
    text = verdict_text(rows, ["a"], suite)
    assert text.startswith(
        "meets the requirement of FMVSS 127 of no contact (S5.1.3, S5.2.3) in simulation, in worlds"
    )
    assert text.endswith("30 runs or more: a" if met else "30 runs or more: none")
    assert not meets_fmvss127([], "a")
    assert verdict_text([], ["a"], suite) == verdict_text(rows, ["a"], SUITES["quick"]) == ""


def test_r152_allows_a_fifth_of_the_runs_with_bicycles_to_fail():
    def meets(pedestrians, bicycles):
        cases = [("CPNA/v20", pedestrians), ("CBNA/v20", bicycles)]
        rows = [
            impact_row(case, 20, 5, 5 if seed < failed else 0, seed=seed)
            for case, failed in cases
            for seed in range(10)
        ]
        return meets_r152(rows, "a")

    assert meets(1, 2)
    assert not meets(2, 2)
    assert not meets(1, 3)


def test_limit_results_leave_out_errors_and_non_threats():
    rows = [
        impact_row("CCRs/v20", 20, 0, 0),
        impact_row("CCRs/v20", 20, 0, 9, error="Traceback"),
        impact_row("CCRs/v20", 20, 0, 9, threat=False),
    ]
    (result,) = limit_results(rows, "a", R152)
    assert (result.met.k, result.met.n) == (1, 1)
    assert limit_results(rows, "other agent", R152) == []


def test_agent_without_runs_does_not_meet_r152():
    assert not meets_r152([], "a")


def test_suite_without_limits_has_no_limit_table():
    assert limit_table([impact_row("CCRs/v20", 20, 0, 0)], ["a"], SUITES["quick"]) is None


def test_contact_and_colour_checks():
    contact, avoided = impact_row("CCRs/v50", 50, 0, 5), impact_row("CCRs/v50", 50, 0, 0)
    assert (check_fmvss127(contact), check_fmvss127(avoided)) == (
        (False, "no contact"),
        (True, "no contact"),
    )
    assert (check_green(contact), check_green(avoided)) == ((False, "green"), (True, "green"))


def test_premature_braking_fails_fmvss127():
    """In 49 CFR 571.127 the brakes are applied when a collision is imminent (S5.1.3)."""
    premature = impact_row("CCRs/v50", 50, 0, 0, premature_brake=True)
    timely = impact_row("CCRs/v50", 50, 0, 0, premature_brake=False)
    assert [check_fmvss127(row) for row in (premature, timely)] == [
        (False, "no contact"),
        (True, "no contact"),
    ]


def test_premature_braking_is_not_green_and_earns_no_points():
    """The tests begin 4 s before contact (T0); `always-brake` stops before that."""
    premature = impact_row("CCRs/v50", 50, 0, 0, premature_brake=True)
    assert check_green(premature) == (False, "green")
    assert row_colour_2023(premature) == row_colour_2026(premature) == "premature"
    for suite, points in (("ncap2023", points_2023), ("ncap2026", points_2026)):
        rows = [row | {"premature_brake": True} for row in suite_rows(suite, lambda case, speed: False)]
        assert {item.earned for item in points(rows, "a")} == {0.0}


def test_colours_2026_match_the_published_bands():
    """Euro NCAP Frontal Collisions 2026, 5.3.1; an edge belongs to the worse colour."""
    expected = {
        10: "green red red red red red",
        30: "green brown red red red red",
        40: "green orange brown brown red red",
        50: "green yellow orange orange brown red",
        80: "green yellow orange orange brown red",
    }
    impacts = (0, 9.99, 10, 19.99, 20, 30)
    assert {ego: " ".join(colour_2026(ego, impact) for impact in impacts) for ego in expected} == expected


def test_colours_2026_match_the_official_calculator():
    processing = pytest.importorskip("euroncap_rating_2026.crash_avoidance.matrix_processing")
    for ego in (10, 20, 30, 40, 50, 60, 70, 80):
        for impact in (0.0, 0.1, 5.0, 9.99, 10.0, 15.0, 19.99, 20.0, 29.99, 30.0, 60.0):
            point = SimpleNamespace(
                attributes={"VUT speed": f"{ego} km/h"}, color=None, row=0, total_rows=0, internal={}
            )
            computed = processing.ComputedTestPoint(point, test_name="CCRs")
            computed.value = impact
            official = computed._compute_color_logic()
            assert getattr(official, "value", official).lower() == colour_2026(ego, impact), (ego, impact)


def test_colours_2023_are_known_for_50_kmh_only():
    def colour(case, ego, impact):
        speeds = {"ego_speed": ego * KMH, "impact_speed": impact * KMH, "collision": impact > 0}
        return row_colour_2023(threat_row(case=f"ncap2023/{case}", **speeds))

    impacts = (0, 4.9, 5, 15, 30, 40)
    assert [colour("CCRs/v50/overlap100", 50, impact) for impact in impacts] == [
        "green",
        "green",
        "yellow",
        "orange",
        "brown",
        "red",
    ]
    assert colour("CCRs/v40/overlap100", 40, 4.9) == "contact"
    assert colour("CCRm/v50/overlap100", 50, 4.9) == "contact"


def test_perfect_agent_earns_all_points():
    points = points_2023(suite_rows("ncap2023", lambda case, speed: False), "a")
    assert [(item.scenario, item.earned, item.maximum) for item in points] == [
        ("CCRs", 14, 14),
        ("CCRs, warned driver", 6, 6),
        ("CCRm", 15, 15),
        ("CCRb", 4, 4),
    ]
    points = points_2026(suite_rows("ncap2026", lambda case, speed: False), "a")
    assert sum(item.earned for item in points) == pytest.approx(1.2 + 2.4 + 1.6)


def test_contact_at_10_kmh_earns_no_points_in_ccrs():
    points = points_2023(suite_rows("ncap2023", lambda case, speed: speed == 10), "a")
    assert [item.earned for item in points] == [0.0, 0.0, 15.0, 4.0]
    assert "no points" in points[0].note


def test_one_contact_costs_the_weight_of_its_cell():
    # Overlap 100 % has the weight 2 of 6 in the row of 40 km/h, which has 1 point.
    points = points_2023(suite_rows("ncap2023", lambda case, _: case.endswith("CCRs/v40/overlap100")), "a")
    assert points[0].earned == pytest.approx(14 - 2 / 6)
    # One of the 40 cells of CCRs, which has 1.2 points.
    points = points_2026(suite_rows("ncap2026", lambda case, _: case.endswith("CCRs/v50/location50")), "a")
    assert points[0].earned == pytest.approx(1.2 * 39 / 40)


def test_totals_leave_out_cases_with_an_fcw_driver(tmp_path):
    def scored(case, fcw_driver, avoided):
        values = {"avoided": avoided, "premature_brake": False, "speed_reduction": 3.0}
        return threat_row(case=case, fcw_driver=fcw_driver, **values)

    rows = [scored("s/CCRs/v50", False, True), scored("s/CCRs/v60-warned", True, False)]
    automatic, warned = score_tables(rows, ["a"], "all")
    assert list(automatic.columns[1].cells) == ["1/1 [21–100]"]
    assert list(warned.columns[1].cells) == ["0/1 [0–79]"]
    assert len(score_tables(rows[:1], ["a"], "all")) == 1
    write_summary(rows, tmp_path / "summary.csv")
    lines = list(csv.DictReader((tmp_path / "summary.csv").open()))
    assert [(line["case"], line["threats"]) for line in lines][-1] == ("all", "1")
    assert compare_rows(rows, rows, ("A", "B")).pairs == 1
