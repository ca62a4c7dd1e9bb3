"""Sweeps: the same worlds in all cells, and grids over two swept arguments, worked out by hand."""

import pytest
from support.rows import threat_row

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.plan import make_plan
from lgmd_gym.benchmark.suites import copy_suite, load_suite
from lgmd_gym.report.conclusion import conclusion
from lgmd_gym.report.sweep import band, sweep_grids, sweep_sentences, swept_arguments

SUITE = """
name = "mine"
[[cases]]
family = "CutIn"
sweep = { ego_speed = [10.0, 20.0], gap = [6.0, 8.0], shade = [40, 90] }
[[cases]]
family = "CCRs"
speeds_kmh = [30, 50]
"""


@pytest.fixture
def suite(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(SUITE)
    return load_suite(path)


def rows_of(suite, agent="a"):
    """Return two rows of each cell: contact at 20 m/s and 6 m, premature braking at 20 m/s and 8 m."""
    rows = []
    for case in suite.cases:
        fast, near = "v72" in case.variant, "gap6m" in case.variant
        for seed in range(2):
            values = {"collision": fast and near and seed == 0, "premature_brake": fast and not near}
            values["avoided"] = not (values["collision"] or values["premature_brake"])
            rows.append(threat_row(agent, case.name, seed, family=case.family, **values))
    return rows


def test_cells_of_a_sweep_have_their_arguments_and_the_same_worlds(suite, tmp_path):
    assert suite.cases[0].swept == (("ego_speed", "v36"), ("gap", "gap6m"), ("shade", "shade40"))
    assert suite.cases[-1].swept == ()  # a list of speeds alone is no sweep
    plan = make_plan(RunConfig(suite=str(tmp_path / "mine.toml"), seeds=2))
    worlds = [plan._first_task(index, 1, "clear").world for index in range(10)]
    assert worlds == [8001] * 8 + [8000 + (1 + 7 * 8) % 20, 8000 + (1 + 7 * 9) % 20]


def test_a_run_folder_keeps_the_swept_arguments(suite, tmp_path):
    copy_suite(tmp_path / "mine.toml", tmp_path / "copy.toml")
    assert load_suite(tmp_path / "copy.toml").cases == suite.cases


def test_the_grid_has_the_first_two_arguments_over_all_others(suite):
    (grid,) = sweep_grids(rows_of(suite), "a", suite.by_name)
    assert (grid.title, grid.axis) == ("CutIn: a", "gap [m] →   ego_speed [km/h] ↓")
    assert grid.columns == ["6", "8"]
    texts = [(head, [(cell.text, cell.colour) for cell in cells]) for head, cells in grid.lines]
    assert texts == [
        ("36", [("4/4", "green"), ("4/4", "green")]),
        ("72", [("2/4", "orange"), ("0/4", "red")]),
    ]
    contact = grid.lines[1][1][0]
    assert (contact.contacts, contact.premature, contact.runs, contact.letter) == (2, 0, 4, False)
    assert contact.tooltip.startswith("2 of 4 good; 4 threats, contact in 2, premature braking in 0")


def test_the_conclusion_names_the_argument_with_the_widest_spread(suite):
    """8 rows per value: good are 8 at 36 km/h, 2 at 72 km/h; 6 at a gap of 6 m, 4 at 8 m; 5 at each shade."""
    rows = rows_of(suite)
    sentence = "In CutIn, a varies most with ego_speed: good in 8 of 8 at 36 km/h, 2 of 8 at 72 km/h."
    assert sweep_sentences(rows, "a", suite.by_name) == [sentence]
    complete = [row | {"speed_reduction": 1.0} for row in reversed(rows)]
    assert sentence in conclusion(complete, ["no-brake", "a"], suite)[1]
    assert sweep_sentences(rows, "b", suite.by_name) == []
    good = [row | {"avoided": True} for row in rows]
    assert sweep_sentences(good, "a", suite.by_name) == []  # nothing varies
    failed = [row | {"error": "x"} for row in rows]
    assert sweep_sentences(failed, "a", suite.by_name) == []


def test_of_many_values_the_best_and_the_worst_are_named(tmp_path):
    path = tmp_path / "many.toml"
    path.write_text('name = "many"\n[[cases]]\nfamily = "CCRs"\nsweep.overlap = [0.2, 0.4, 0.6, 0.8, 1.0]\n')
    suite = load_suite(path)
    outcomes = [(True, True), (True, False), (False, False), (True, False), (True, False)]
    rows = [
        threat_row("a", case.name, seed, family="CCRs", avoided=avoided)
        for case, of_case in zip(suite.cases, outcomes, strict=True)
        for seed, avoided in enumerate(of_case)
    ]
    (sentence,) = sweep_sentences(rows, "a", suite.by_name)
    best, worst = (dict(suite.cases[index].swept)["overlap"] for index in (0, 2))
    assert (best, worst) == ("overlap0.2", "overlap0.6")
    assert sentence == "In CCRs, a varies most with overlap: good in 2 of 2 at 0.2, 0 of 2 at 0.6."


def test_arguments_have_the_meaning_of_the_docstring(suite):
    meanings = dict(swept_arguments(suite))
    assert list(meanings) == ["ego_speed", "gap", "shade"]
    assert meanings["gap"] == "Bumper-to-bumper distance at the start of the lane change"


def test_a_sweep_of_one_argument_is_one_line_and_a_word_has_no_unit(tmp_path):
    path = tmp_path / "one.toml"
    path.write_text('name = "one"\n[[cases]]\nfamily = "CPNA"\nsweep = { child = [true, false] }\n')
    suite = load_suite(path)
    rows = [threat_row("a", case.name, family="CPNA", threat=False) for case in suite.cases]
    rows = [row | {"false_activation": "not" in row["case"]} for row in rows]
    (grid,) = sweep_grids(rows, "a", suite.by_name)
    assert (grid.axis, grid.columns) == ("child", ["child", "not-child"])
    ((head, cells),) = grid.lines
    assert (head, [cell.text for cell in cells]) == ("", ["1/1", "0/1"])
    assert sweep_grids(rows, "b", suite.by_name) == []


def test_bands_are_fifths():
    assert [band(share) for share in (0.0, 0.19, 0.2, 0.5, 0.79, 0.8, 1.0)] == [
        *("red", "red", "brown", "orange", "yellow", "green", "green")
    ]
    assert band(None) == ""
