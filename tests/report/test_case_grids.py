"""Grids of cases and the choice of episodes in the report."""

from support.rows import suite_rows, threat_row

from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.report.figures import case_grids
from lgmd_gym.report.sections import extreme_episodes, hardest_false_activations, illustrated_agent


def test_case_grids_of_ncap2023():
    rows = suite_rows(
        "ncap2023", lambda case, _: case.endswith(("CCRs/v50/overlap75", "CCRs/v40/overlap100"))
    )
    rows = [row | {"premature_brake": row["case"].endswith("CCRs/v10/overlap-50")} for row in rows]
    crossing, turning, moving, standing = case_grids(rows, "a", SUITES["ncap2023"])
    titles = [grid.title for grid in (crossing, turning, moving, standing)]
    assert titles == ["CCCscp: a", "CCFtap: a", "CCRm: a", "CCRs: a"]
    assert (turning.columns, [head for head, _ in turning.lines]) == ([30, 45, 60], ["10", "15", "20"])
    assert standing.columns == [-50, -75, 100, 75, 50]
    assert standing.axis == "overlap [%]"
    assert crossing.lines[0][0] == "from stop"
    cells = dict(standing.lines)
    assert [(cell.colour, cell.text) for cell in cells["40"]] == [
        ("green", "0"),
        ("green", "0"),
        ("contact", "40"),
        ("green", "0"),
        ("green", "0"),
    ]
    assert (cells["50"][3].colour, cells["50"][3].text) == ("red", "50")
    assert (cells["10"][0].colour, cells["10"][0].text) == ("premature", "0*")
    assert case_grids(rows, "a", SUITES["quick"]) == []


def test_case_grids_of_ncap2026_have_lights_and_sides():
    rows = suite_rows("ncap2026", lambda case, _: case.endswith("CPNA/v30/location75-night"))
    grids = {grid.title: grid for grid in case_grids(rows, "a", SUITES["ncap2026"])}
    assert {"CPNA: a", "CPNA at night: a", "CCCscp from the left: a", "CMCscp from the right: a"} <= set(
        grids
    )
    night = dict(grids["CPNA at night: a"].lines)
    assert [(cell.colour, cell.text) for cell in night["30"]] == [
        ("green", "0"),
        ("green", "0"),
        ("contact", "30"),
    ]
    assert all(cell.colour == "green" for cells in dict(grids["CPNA: a"].lines).values() for cell in cells)
    assert grids["CMCscp from the right: a"].columns == [20, 30, 40, 50, 60]


def test_a_cell_has_the_highest_impact_speed_and_the_colour_of_the_seed_that_earns_least():
    values = {"case": "ncap2023/CCRs/v50/overlap100", "ego_speed": 50 / 3.6, "target_speed": 0.0}
    speed = 5.0 / 3.6  # yellow at 50 km/h
    contact = {"collision": True, "impact_speed": speed, "relative_impact_speed": speed}
    rows = [
        threat_row(seed=0, **values, **contact, premature_brake=False),
        threat_row(seed=1, **values, collision=False, premature_brake=True),
    ]
    for order in (rows, rows[::-1]):
        ((_, (cell,)),) = case_grids(order, "a", SUITES["ncap2023"])[0].lines
        assert (cell.colour, cell.text) == ("premature", "5")


def test_illustrated_agent_is_the_first_with_a_neuron():
    assert (
        illustrated_agent(["no-brake", "ttc-oracle", "spike-threshold:threshold=9"])
        == "spike-threshold:threshold=9"
    )
    assert illustrated_agent(["no-brake", "ttc-oracle"]) == "ttc-oracle"
    assert illustrated_agent(["no-brake"]) == "no-brake"


def test_extreme_episodes_are_of_one_agent_and_seed():
    rows = [
        threat_row(case="s/F/v1", avoided=True, stopping_margin=1.0, ego_speed=5.0),
        threat_row(case="s/F/v2", avoided=True, stopping_margin=2.0, ego_speed=9.0),
        threat_row(case="s/F/v3", collision=True, relative_impact_speed=3.0),
        threat_row(case="s/F/v4", collision=True, relative_impact_speed=4.0),
        threat_row(case="s/F/v5", threat=False, ego_speed=7.0),
        threat_row(case="s/F/v6", seed=1, collision=True, relative_impact_speed=9.0),
        threat_row("b", case="s/F/v7", collision=True, relative_impact_speed=9.0),
        threat_row(case="s/F/v8", error="Traceback", collision=True, relative_impact_speed=9.0),
    ]
    cases = {name: row["case"] for name, row in extreme_episodes(rows, "a", seed=0).items()}
    assert cases == {
        "smallest stopping margin": "s/F/v1",
        "fastest avoided threat": "s/F/v2",
        "hardest contact": "s/F/v4",
        "fastest non-threat without false activation": "s/F/v5",
    }


def test_false_activations_are_ordered_by_deceleration():
    rows = [
        threat_row(agent, f"s/F/v{peak}", seed, threat=False, false_activation=True, peak_deceleration=peak)
        for agent, seed, peak in (("rule", 0, 4), ("rule", 0, 6), ("rule", 1, 8), ("always-brake", 0, 9))
    ]
    hardest = hardest_false_activations(rows, ["no-brake", "rule", "always-brake"], seed=0)
    assert [row["peak_deceleration"] for row in hardest] == [6, 4]
    assert len(hardest_false_activations(rows * 10, ["rule"], seed=0)) == 12
