"""The default of `bench`: its agents, and the table of the laboratory and of worlds."""

import io

from rich.console import Console
from support.rows import threat_row

from lgmd_gym.agents import AGENTS
from lgmd_gym.benchmark.analysis.tables import place_table
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.cli import overview


def rows_of(agent, avoided):
    """Return three threats and a false activation in the laboratory, and one threat in a world."""
    values = {"speed_reduction": 1.0, "premature_brake": False}
    rows = [threat_row(agent, "s/F/a", seed, avoided=seed < avoided, **values) for seed in range(3)]
    rows.append(threat_row(agent, "s/F/b", 0, threat=False, false_activation=True))
    return [*rows, threat_row(agent, "s/F/c", 0, avoided=False, world=8000, **values)]


def test_the_table_has_the_laboratory_and_worlds():
    table = place_table([*rows_of("no-brake", 0), *rows_of("rule", 2)], ["no-brake", "rule", "absent"])
    assert [column.header for column in table.columns] == [
        "agent",
        "laboratory\navoided",
        "laboratory\nneedless",
        "worlds\navoided",
        "worlds\nneedless",
    ]
    lines = list(zip(*(column.cells for column in table.columns), strict=True))
    assert lines == [
        ("no-brake", "0/3", "1/1", "0/1", "–"),
        ("rule", "2/3", "1/1", "0/1", "–"),
        ("absent", "–", "–", "–", "–"),
    ]
    assert table.caption.startswith("3 cases in the laboratory and 1 world; k/n episodes; avoided: ")


def test_each_agent_of_the_default_run_has_a_sentence():
    assert [name for name in overview.IDEAS if name in AGENTS] == [
        *("no-brake", "spike-threshold", "stopping-zone", "last-moment-oracle")
    ]
    out = io.StringIO()
    overview.print_overview(rows_of("no-brake", 0), ["no-brake", "ttc-oracle"], Console(file=out, width=200))
    printed = out.getvalue()
    assert "no-brake – never brakes; its contacts are the threats.\n" in printed
    assert "ttc-oracle – " in printed  # with the first sentence of its docstring
    assert printed.endswith(
        "next: lgmd-gym bench --suite r152 --seeds 20 --conditions mixed --agents ttc-oracle\n"
    )


def test_the_next_command_has_the_neuron_of_the_run():
    out = io.StringIO()
    agents = ["no-brake", "spike-threshold"]
    overview.print_overview(rows_of("no-brake", 0), agents, Console(file=out, width=200), "mine:Mine")
    start = "next: lgmd-gym bench --suite r152 --seeds 20 --conditions mixed"
    assert out.getvalue().endswith(f"{start} --neuron mine:Mine\n")


def test_the_suite_has_the_same_cases_in_both_places():
    worlds = {case.name: case.argument("world") for case in SUITES["overview"].cases}
    plain = [name.removesuffix("/laboratory") for name, world in worlds.items() if world == "laboratory"]
    assert plain == [name.removesuffix("/worlds") for name, world in worlds.items() if world is None]
    assert len(plain) == 11
