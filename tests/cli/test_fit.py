"""Tables in a terminal of 80 columns, and in files and pipes: nothing is cut off."""

import pytest
from rich.table import Table
from rich.text import Text
from support.rows import threat_row

from lgmd_gym.benchmark.analysis.arms import ArmResult, Estimate, arm_table
from lgmd_gym.benchmark.analysis.tables import case_table, score_tables
from lgmd_gym.benchmark.summary import Sample
from lgmd_gym.benchmark.traffic.rows import KEYS
from lgmd_gym.benchmark.traffic.summary import traffic_table
from lgmd_gym.cli import main as cli
from lgmd_gym.cli.console import fit, make_console

AGENTS = ["no-brake", "spike-threshold", "policy:runs/train-sac/policy.zip", "my_agents.rules:MyLongAgent",
          "stopping-zone", "danger-zone", "ttc-oracle", "adaptive-threshold"]  # fmt: skip


def scores():
    values = {
        "avoided": True,
        "premature_brake": False,
        "speed_reduction": 13.0,
        "fcw_driver": False,
        "false_activation": False,
    }
    values |= {"ttc_at_brake": 1.25}
    rows = [
        threat_row(agent=name, case=f"s/CCRs/v{v}", seed=v, threat=threat, **values)
        for name in AGENTS
        for v in range(9, 80)
        for threat in (True, False)
    ]
    headings = "avoided speed reduction TTC at braking premature false activation"
    return score_tables(rows, AGENTS, "title"), headings


def cases():
    values = {"avoided": True, "premature_brake": False, "speed_reduction": 13.0, "fcw_driver": False}
    rows = [threat_row(agent=name, case="s/CCRs/v50_overlap-0.5", **values) for name in AGENTS]
    return [case_table(rows, AGENTS)], "case"


def traffic():
    zeros = dict.fromkeys(KEYS, 0) | {"condition": "clear", "error": None, "side": "", "distance": 1e5}
    kinds = ("two-way", "roundabout", "intersection")
    rows = [
        zeros | {"agent": name, "kind": kind, "case": f"traffic/{kind}/s0"}
        for name in AGENTS
        for kind in kinds
    ]
    headings = "km needless activations per 100 km speed lost needed, avoided by contacts"
    tables = [traffic_table(rows, AGENTS, "title", by_kind) for by_kind in (False, True)]
    return tables, headings


def arms():
    estimate = Estimate(123.4, 120.1, 125.6, 100)
    shares = dict.fromkeys(("avoided", "premature_brake", "false_activation"), Estimate(0.5, 0.4, 0.61, 100))
    results = [
        ArmResult(name, "clear", Sample(100, 20), 5, estimate, (100.1, 140.2), estimate, shares)
        for name in AGENTS
    ]
    return [arm_table(results, "title")], "arm runs return difference avoided, premature, false,"


def listed(kind):
    def tables():
        from lgmd_gym.cli.list import TABLES

        return [TABLES[kind]()], ""

    return tables


def printed(tables, capsys):
    console = make_console()
    for table in tables:
        console.print(table)
    return capsys.readouterr().out


@pytest.mark.parametrize("columns", ["80", "60", None])
@pytest.mark.parametrize("make", [scores, cases, traffic, arms, *map(listed, ("suites", "agents", "envs"))])
def test_tables_fit_and_lose_nothing(make, columns, capsys, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    tables, headings = make()
    text = printed(tables, capsys)
    assert max(map(len, text.splitlines())) <= int(columns or 80)
    assert "…" not in text
    assert set(headings.split()) <= set(text.split())
    console = make_console()
    for part in (part for table in tables for part in fit(table, console) if isinstance(part, Table)):
        for column in part.columns:
            for cell in (column.header, *column.cells):
                lines = Text(str(cell)).wrap(console, column.width, overflow="fold")
                assert all(line.plain.strip() in text for line in lines)


def test_short_names_are_in_one_piece_at_80_columns(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    for make in (scores, traffic, arms):
        text = printed(make()[0], capsys)
        assert all(name in text for name in ("spike-threshold", "adaptive-threshold", "danger-zone"))


def test_a_table_with_many_columns_is_divided_below_its_names(capsys):
    table = Table("case", title="once", caption="last")
    for number in range(12):
        table.add_column(f"heading{number}", justify="right")
    table.add_row("CCRs/v20", *map(str, range(100, 112)))
    text = printed([table], capsys)
    assert text.count("CCRs/v20") == text.count("case") > 1
    assert text.index("once") < text.index("heading0") < text.index("heading11") < text.index("last")
    assert [text.split().count(f"heading{number}") for number in range(12)] == [1] * 12
    assert all(str(number) in text for number in range(100, 112))


def test_list_in_a_pipe_has_80_columns(capsys, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert cli.run(["list", "envs"]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    assert "LGMD/TurnBeforeOncoming-v0" in text
