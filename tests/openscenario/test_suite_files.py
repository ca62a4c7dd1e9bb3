"""Suites of several OpenSCENARIO files, own scenarios in suite files, and runs."""

import tomllib

import pytest
from support.openscenario import (
    START,
    SUN,
    scenario,
    values,
    varied,
    weather,
    write,
)

from lgmd_gym.benchmark import Executor, RunConfig, run
from lgmd_gym.benchmark.suites import copy_suite, get_suite
from lgmd_gym.envs import Actor, Scenario
from lgmd_gym.envs.families.data import scenario_to_data
from lgmd_gym.openscenario import read, read_all


def test_several_files_and_folders_are_one_suite(tmp_path):
    folder = tmp_path / "set"
    (folder / "a").mkdir(parents=True)
    (folder / "b").mkdir()
    one = varied(folder / "a", values("Ego_speed_kph", 30, 50))
    two = varied(folder / "b", values("Ego_speed_kph", 40))
    expected = ["set/case/a/vary/v30", "set/case/a/vary/v50", "set/case/b/vary/v40"]
    for paths in ([one, two], [folder], [folder / "a", folder / "b"], [one, folder]):
        assert [case.name for case in read_all(paths).cases] == expected
    assert [case.name for case in read_all([one]).cases] == ["vary/case/v30", "vary/case/v50"]
    assert [case.name for case in get_suite(str(folder)).cases] == expected
    assert [case.name for case in get_suite((str(one), str(two))).cases] == expected
    with pytest.raises(ValueError, match=r"each must be a file .*, a folder or a Scenario, got 'quick'"):
        get_suite((str(one), "quick"))


@pytest.mark.parametrize(
    ("suite", "message"),
    [
        ((3.5,), "suite must be a string, got 3.5"),
        (3.5, "suite must be a string, got 3.5"),
        ((), "suite must contain at least one file or folder, got none"),
        ("x" * 5000, "unknown suite 'xxx"),
        ("", "unknown suite ''"),
    ],
)
def test_suites_that_are_no_names_or_paths(suite, message):
    with pytest.raises(ValueError, match=message):
        get_suite(suite)


def test_suite_files_hold_scenarios(tmp_path):
    night = weather(SUN.format(0))
    suite = read(write(tmp_path, scenario(START, globals_=night), "dark_FCW.xosc"))
    copy_suite(str(tmp_path / "dark_FCW.xosc"), tmp_path / "suite.toml")
    table = tomllib.loads((tmp_path / "suite.toml").read_text())["cases"][0]
    assert table["scenario"] == scenario_to_data(suite.cases[0].scenario)
    assert get_suite(str(tmp_path / "suite.toml")).cases == suite.cases


OWN = """name = "mine"
[[cases]]
family = "parked"
name = "v30"
arguments = { weather = "night" }
[cases.scenario]
ego_speed = 8.33
duration = 9.0
actors = [{ gap = 40.0, lateral_offset = 1.0 }]
"""


def test_own_scenarios_in_suite_files(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(OWN)
    (case,) = get_suite(str(path)).cases
    assert case.name == "mine/parked/v30"
    assert case.scenario == Scenario(
        family="parked", ego_speed=8.33, duration=9.0, actors=(Actor(gap=40.0, lateral_offset=1.0),)
    )
    assert dict(case.arguments)["weather"] == "night"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("gap", "gaps"), r"unknown key of scenario.actors\[0\] 'gaps'; did you mean 'gap'"),
        (
            ("weather =", "weathers ="),
            "unknown argument of a case with a scenario 'weathers'; did you mean",
        ),
        (
            ("duration = 9.0", 'duration = 9.0\nfamily = "x"'),
            "family 'parked' and scenario.family 'x' differ",
        ),
        (('name = "v30"', 'name = "v30"\nspeeds_kmh = [30]'), "speeds_kmh and scenario exclude each other"),
    ],
)
def test_invalid_own_scenarios(tmp_path, change, message):
    path = tmp_path / "mine.toml"
    path.write_text(OWN.replace(*change))
    with pytest.raises(ValueError, match=rf"suite file '.*mine\.toml': {message}"):
        get_suite(str(path))


def test_runs_play_and_resume_cells(tmp_path):
    path = varied(tmp_path, values("Ego_speed_kph", 30, 50))
    config = RunConfig(suite=str(path), agents=("ttc-oracle",), seeds=1, worlds=0)
    table = run(config, tmp_path / "run", Executor(jobs=1), plots=False, report=True)
    assert sorted(set(table["case"])) == ["vary/case/v30", "vary/case/v50"]
    assert table[table["agent"] == "no-brake"]["threat"].all()
    assert table[table["agent"] == "ttc-oracle"]["avoided"].all()
    path.unlink()  # the run folder holds the scenarios
    again = RunConfig.load(tmp_path / "run" / "run.toml")
    assert len(get_suite(again.suite).cases) == 2


def test_several_suites_in_a_configuration(tmp_path):
    one = str(varied(tmp_path, values("Ego_speed_kph", 30), name="one"))
    two = str(varied(tmp_path, values("Ego_speed_kph", 50), name="two"))
    config = RunConfig(suite=(one, two), agents=("no-brake",))
    assert config.suite == (one, two)
    assert RunConfig(suite=(one,)).suite == one
    (tmp_path / "run").mkdir()
    loaded = RunConfig.load(config.save(tmp_path / "run"))
    assert [case.name.split("/", 1)[1] for case in get_suite(loaded.suite).cases] == [
        "case/one/v30", "case/two/v50"
    ]  # fmt: skip
    with pytest.raises(ValueError, match="suite must contain at least one name or path"):
        RunConfig(suite=())
