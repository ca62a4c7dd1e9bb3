"""Scenario objects, scenario files and OpenSCENARIO files are read by one loader, driven and benchmarked."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import tomli_w
from support.own_families import MODULE, forget_families
from support.runs import new_run, read_rows

from lgmd_gym import benchmark
from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark import RunConfig, get_suite
from lgmd_gym.benchmark.suites import copy_suite, find_case, find_own_case
from lgmd_gym.cli import main as cli
from lgmd_gym.envs import Actor, Scenario, make_scenario
from lgmd_gym.openscenario.export import export_case
from lgmd_gym.rendering.playback import play_episode

FAMILY = {"family": "CutIn", "arguments": {"ego_speed": 19.44, "gap": 8.0, "excess": -5.56}}
ACTORS = {"scenario": {"ego_speed": 8.0, "duration": 2.0, "actors": [{"gap": 40.0, "lateral_offset": 3.5}]}}
PARKED = Scenario(family="parked", ego_speed=8.0, duration=2.0, actors=(Actor(gap=40.0, lateral_offset=3.5),))
CUT_IN = make_scenario("CutIn", **FAMILY["arguments"])


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "near.toml").write_text(tomli_w.dumps(FAMILY))
    (tmp_path / "parked.json").write_text(json.dumps(ACTORS))
    return tmp_path


def names(source, *modules):
    return [case.name for case in get_suite(source, modules).cases]


def scenarios(source):
    return [case.scenario for case in get_suite(source).cases]


def test_scenario_files():
    assert (names("near.toml"), scenarios("near.toml")) == (["near/CutIn/v70"], [CUT_IN])
    assert (names("parked.json"), scenarios("parked.json")) == (["parked/parked/v28.8"], [PARKED])
    Path("near.toml").write_text(tomli_w.dumps(FAMILY | {"name": "close", "fcw_driver": True}))
    (case,) = get_suite("near.toml").cases
    assert (case.name, case.fcw_driver) == ("near/CutIn/close", True)
    for family in ({"family": "lot"}, {}):
        data = ACTORS | family if family else {"scenario": ACTORS["scenario"] | {"family": "lot"}}
        Path("parked.json").write_text(json.dumps(data))
        assert names("parked.json") == ["parked/lot/v28.8"]


@pytest.mark.parametrize("suite", ["quick", "traffic"])
def test_a_shipped_suite_takes_precedence_over_a_folder_of_its_name(folder, suite):
    (folder / suite).mkdir()
    config = RunConfig(suite=suite, agents=("no-brake",), seeds=1)
    assert not config.own_suite
    config.save(folder / suite)
    assert RunConfig.load(folder / suite / "run.toml").suite == suite


def test_objects_and_files_are_one_suite(folder):
    assert (names(PARKED), scenarios(PARKED)) == (["scenarios/parked/v28.8"], [PARKED])
    export_case(find_case("quick/CCRs/v30"), folder / "approach.xosc")
    sources = ("near.toml", PARKED, "parked.json", "approach.xosc", CUT_IN)
    assert names(sources) == [
        "scenarios/CutIn/v70", "scenarios/parked/v28.8", "scenarios/parked/v28.8/2", "scenarios/CCRs/v30",
        "scenarios/CutIn/v70/2",
    ]  # fmt: skip
    assert scenarios(sources)[:3] == [CUT_IN, PARKED, PARKED]
    copy_suite(sources, folder / "copy.toml")
    assert names("copy.toml") == names(sources)
    assert scenarios("copy.toml") == scenarios(sources)


def test_numbers_of_numpy_are_stored(folder):
    made = Scenario(
        family="x", ego_speed=np.float64(8.1), duration=np.int64(2), actors=(Actor(gap=np.float32(4)),)
    )
    copy_suite(made, folder / "copy.toml")
    assert scenarios("copy.toml") == [made]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (FAMILY | {"argument": {}}, "unknown key of a scenario file 'argument'; did you mean 'arguments'?"),
        (
            FAMILY | {"sweep": {"gap": [6]}},
            "a scenario file has one scenario; write sweep in a [[cases]] table",
        ),
        (
            FAMILY | {"arguments": {"ego_speed": 70}},
            "ego_speed: 70 m/s = 252 km/h, beyond 40 m/s; for 70 km/h pass",
        ),
        ({"family": "CutInn"}, "unknown scenario 'CutInn'; did you mean 'CutIn'?"),
        (
            {"scenario": {"ego_speed": 8.0, "durations": 9.0}},
            "unknown key of scenario 'durations'; did you mean",
        ),
        ({"scenario": {"ego_speed": 8.0}}, "scenario must have the key 'duration'; add it"),
        (
            FAMILY | {"gap": 8},
            "gap is an argument of CutIn, not a key of a scenario file; write arguments = { gap = ... }",
        ),
        ({"scenario": 3}, "scenario must be dict, got 3"),
    ],
)
def test_invalid_scenario_file_is_refused(values, message):
    Path("near.toml").write_text(tomli_w.dumps(values))
    with pytest.raises(ValueError) as caught:
        get_suite("near.toml")
    assert str(caught.value).startswith("scenario file 'near.toml': ")
    assert message in str(caught.value)


def test_case_of_a_file_is_found():
    assert find_own_case("near.toml").name == "near/CutIn/v70"
    sources = (PARKED, CUT_IN)
    for name in ("CutIn/v70", "scenarios/CutIn/v70"):
        assert find_own_case(sources, name).scenario == CUT_IN
    with pytest.raises(
        ValueError, match="unknown case 'scenarios/CutIn/v7'; did you mean 'scenarios/CutIn/v70'"
    ):
        find_own_case(sources, "CutIn/v7")
    message = (
        "'scenarios' has 2 cases; choose one with --case NAME: scenarios/parked/v28.8, scenarios/CutIn/v70$"
    )
    with pytest.raises(ValueError, match=message):
        find_own_case(sources)
    with pytest.raises(ValueError, match=r"CutIn/v70/10, \.\.\.$"):
        find_own_case((CUT_IN,) * 11)


def test_python_runs_scenarios():
    config = RunConfig(suite=[PARKED, "near.toml"], agents=("always-brake",), seeds=1, worlds=0)
    table = benchmark.run(config, "run", plots=False, report=False)
    assert isinstance(table, pd.DataFrame)
    cases = ["scenarios/parked/v28.8", "scenarios/CutIn/v70"]
    assert sorted(zip(table["agent"], table["case"], strict=True)) == sorted(
        (agent, case) for agent in ("always-brake", "no-brake") for case in cases
    )
    rows = {row["case"]: row for row in read_rows(Path("run")) if row["agent"] == "no-brake"}
    assert [rows[case]["threat"] for case in cases] == [False, True]
    assert get_suite("run/suite.toml").name == "scenarios"


def test_run_accepts_scenarios_and_refuses_agents_in_the_place_of_the_folder(monkeypatch):
    with pytest.raises(
        TypeError, match=r"folder must be a path, got \['no-brake'\]; agents are in RunConfig"
    ):
        benchmark.run(PARKED, ["no-brake"])
    chosen = []

    def stop(config, *_):
        chosen.append(config)
        raise KeyboardInterrupt

    monkeypatch.setattr("lgmd_gym.benchmark.runner.Run.new", stop)
    for source in (PARKED, [PARKED, CUT_IN]):
        with pytest.raises(KeyboardInterrupt):
            benchmark.run(source)
    assert chosen == [RunConfig(suite=PARKED), RunConfig(suite=(PARKED, CUT_IN))]
    assert [config.label for config in chosen] == ["scenarios", "scenarios"]
    assert RunConfig(suite=[PARKED, Path("near.toml")]).suite == (PARKED, "near.toml")
    assert RunConfig(suite=Path("near.toml")).suite == "near.toml"
    for suite in ([], [3], {}):
        with pytest.raises(ValueError, match="suite must"):
            RunConfig(suite=suite)


@pytest.mark.slow
def test_worker_processes_play_scenarios():
    run = new_run(Path("run"), jobs=2, suite=[PARKED, CUT_IN, "parked.json"], agents=["ttc-oracle"], seeds=1)
    assert run.play()
    assert [row["error"] for row in run.rows] == [None] * 6


def test_files_are_driven(folder, capsys):
    export_case(find_case("quick/CCRs/v30"), folder / "approach.xosc")
    for file, output in (
        ("near.toml", "contact at"),
        ("parked.json", "no contact"),
        ("approach.xosc", "contact"),
    ):
        assert cli.run(["drive", file, "--agent", "no-brake"]) == 0
        assert output in capsys.readouterr().out
    assert cli.run(["drive", "near.toml", "--agent", "no-brake", "--set", "excess=1"]) == 0
    assert "no contact" in capsys.readouterr().out
    for command, message in (
        (["drive", "missing.toml"], "suite or scenario file 'missing.toml' cannot be read: No such file"),
        (["drive", "parked.json", "--set", "gap=3"], "unknown argument of Scenario 'gap'"),
        (["drive", "LGMD/CCRs-v0", "--case", "x"], "--case 'x' needs a file with several cases"),
    ):
        assert cli.run(command) == 2
        printed = capsys.readouterr().err
        assert message in printed
        assert printed.count("\n") == 1


def test_scenario_file_with_a_module(folder, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(folder))
    (folder / "my_scenarios.py").write_text(MODULE)
    (folder / "own.toml").write_text('family = "Squeeze"\nmodule = "my_scenarios"\n')
    try:
        assert cli.run(["drive", "own.toml", "--agent", "no-brake"]) == 2
        assert "add --module my_scenarios or --trust" in capsys.readouterr().err
        assert cli.run(["drive", "own.toml", "--agent", "no-brake", "--trust"]) == 0
        assert names("own.toml", "my_scenarios") == ["own/Squeeze/v70"]
        result = play_episode(
            find_own_case("own.toml", None, ("my_scenarios",)), make_agent("no-brake"), 0, {"gap": 6.0}
        )
        assert result.collision
    finally:
        forget_families()


def test_figures_name_the_family_of_a_scenario(folder):
    suite = (replace(CUT_IN, family="squeeze"),)
    config = RunConfig(suite=suite, agents=("always-brake",), seeds=1, worlds=0)
    benchmark.run(config, folder / "run", plots=False)
    table = pd.read_csv(folder / "run" / "figures" / "impact-speed-clear.csv")
    assert set(table["family"]) == {"squeeze"}
