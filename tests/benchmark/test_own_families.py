"""Scenario families of the user's modules, in the registry, suite files, runs and commands."""

import json
import pickle
import sys

import gymnasium as gym
import pytest
from support.own_families import MODULE, SUITE, forget_families
from support.runs import interrupt, new_run, read_rows

from lgmd_gym.benchmark.plan import CasePlan
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.suites import get_suite
from lgmd_gym.cli import main as cli
from lgmd_gym.envs import FAMILIES, import_families, make_scenario, register_family

NAMES = ["own/Squeeze/gap6.5m/dusk", "own/Squeeze/gap8m/dusk", "own/Parked/v30"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """The working directory, with a module, a suite and no other family than those of this package."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "my_scenarios.py").write_text(MODULE)
    (tmp_path / "own.toml").write_text(SUITE)
    yield tmp_path
    forget_families()


def test_module_and_single_family_are_registered():
    import_families(["my_scenarios"])
    assert make_scenario("Squeeze", gap=6.0).actors[0].gap == pytest.approx(6 + 5.56 * (5 - 6 / 5.56))
    assert "LGMD/Squeeze-v0" in gym.registry
    assert "Parked" not in FAMILIES
    for _ in range(2):
        import_families(["my_scenarios:Parked", "my_scenarios:Squeeze", "my_scenarios:squeeze"])
    assert make_scenario("Parked", gap=50.0).actors[0].gap == 50.0
    assert "squeeze" not in FAMILIES
    env = gym.make("LGMD/Parked-v0", camera=None, gap=50.0)
    assert env.reset(seed=0)[1]["gap"] == pytest.approx(50.0)


@pytest.mark.parametrize(
    ("module", "message"),
    [
        ("my_scenario", "'my_scenario' cannot be imported .*; run the command in the folder of the module"),
        ("my_scenarios:Park", "unknown family of module my_scenarios 'Park'; did you mean 'Parked'?"),
        ("empty", "'empty' registers no scenario family; decorate a function with"),
        ("broken", r"cannot be imported \(NameError: name 'oops' is not defined, broken.py line 2\)"),
        ("invalid", r"cannot be imported \(SyntaxError: .*\(invalid.py, line 1\)\)"),
        ("lacking", r"'lacking' cannot be imported \(No module named 'no_such_package'\)$"),
        ("my_scenarios:MODULE", "unknown family"),
        ("my_scenarios:__file__", "family '__file__' must be a function or class, got"),
    ],
)
def test_invalid_module_is_refused_in_one_line(folder, module, message):
    (folder / "empty.py").write_text("x = 1\n")
    (folder / "broken.py").write_text("x = 1\noops\n")
    (folder / "invalid.py").write_text("x = = 1\n")
    (folder / "lacking.py").write_text("import no_such_package\n")
    with pytest.raises(ValueError, match=message) as caught:
        import_families([module])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("misnamed", "family 'misnamed' returned a Scenario with family='other'; write family='misnamed'"),
        ("nothing", "family 'nothing' must return a Scenario, got None"),
    ],
)
def test_family_must_return_a_scenario_of_its_name(name, message):
    import_families([f"my_scenarios:{name}"])
    with pytest.raises(ValueError, match=message):
        make_scenario(name)


def test_names_are_unique_but_a_notebook_may_define_a_family_again():
    def define(gap):
        def own(ego_speed: float = 10.0):
            return make_scenario("CCRs", ego_speed=ego_speed + gap)

        return own

    register_family("Own")(define(1.0))
    assert "LGMD/Own-v0" in gym.registry
    second = register_family("Own")(define(2.0))
    assert FAMILIES["Own"] is second
    with pytest.raises(ValueError, match="scenario family 'Own' is defined twice"):
        register_family("Own")(lambda: None)
    with pytest.raises(ValueError, match="scenario family 'CCRs' is defined twice"):
        register_family("CCRs")(second)
    for name in ("own family", "a/b", "", 3):
        with pytest.raises(ValueError, match="family must consist of letters, digits"):
            register_family(name)


def test_suite_file_loads_only_named_modules(folder):
    with pytest.raises(ValueError, match=r"'own\.toml' names module 'my_scenarios', whose code would run"):
        get_suite("own.toml")
    assert not (folder / "loaded").exists()
    suite = get_suite("own.toml", ("my_scenarios",))
    assert [case.name for case in suite.cases] == NAMES
    (folder / "own.toml").write_text(SUITE.replace('"my_scenarios:Parked"', "3"))
    with pytest.raises(ValueError, match="module must be a list of strings, got 3"):
        get_suite("own.toml", ("my_scenarios",))


def test_run_folder_and_tasks_do_not_need_the_module(folder):
    config = {"suite": "own.toml", "agents": ["ttc-oracle"], "seeds": 1, "modules": ["my_scenarios"]}
    run = new_run(folder / "run", **config)
    forget_families()
    (folder / "my_scenarios.py").unlink()
    assert isinstance(run.plan, CasePlan)
    assert "my_scenarios" not in str(pickle.dumps(run.plan.suite))
    assert not run.play(interrupt)
    again = Run.resume(folder / "run")
    assert again.play()
    rows = read_rows(folder / "run")
    assert sorted({row["case"] for row in rows}) == sorted(NAMES)
    assert [row["error"] for row in rows] == [None] * 6
    assert json.loads((folder / "run" / "run.json").read_text())["suite"] == "suite.toml"


@pytest.mark.slow
def test_worker_processes_play_own_families(folder):
    config = {"suite": "own.toml", "agents": ["ttc-oracle"], "seeds": 1, "modules": ["my_scenarios"]}
    run = new_run(folder / "run", jobs=2, **config)
    assert run.play()
    assert [row["error"] for row in run.rows] == [None] * 6


@pytest.mark.parametrize("option", [["--trust"], ["--module", "my_scenarios"]])
def test_bench_loads_the_module_if_it_is_named_or_trusted(folder, option, capsys):
    command = ["bench", "--suite", "own.toml", "--agents", "no-brake", "--seeds", "1", "--jobs", "1"]
    command += ["--out", "run", "--no-plots", "--no-report", "--worlds", "0"]
    assert cli.run(command) == 2
    assert "if you trust it, add --module my_scenarios or --trust" in capsys.readouterr().err
    assert not (folder / "run").exists()
    assert cli.run([*command, *option]) == 0
    printed = "loading module 'my_scenarios:Parked', named in 'own.toml'" in capsys.readouterr().err
    assert printed is (option == ["--trust"])
    assert len(read_rows(folder / "run")) == 3


def test_config_file_cannot_name_modules(folder, capsys):
    (folder / "run.toml").write_text('suite = "own.toml"\nagents = []\nseeds = 1\nmodules = ["my_scenarios"]')
    assert cli.run(["bench", "--config", "run.toml"]) == 2
    assert "unknown key 'modules'" in capsys.readouterr().err
    assert not (folder / "loaded").exists()


def test_drive_plays_an_own_family(folder, capsys):
    assert cli.run(["drive", "LGMD/Squeeze-v0", "--agent", "no-brake"]) == 2
    assert "unknown environment or case 'LGMD/Squeeze-v0'" in capsys.readouterr().err
    options = ["--agent", "no-brake", "--module", "my_scenarios", "--set", "gap=6"]
    assert cli.run(["drive", "LGMD/Squeeze-v0", *options]) == 0
    assert "contact at" in capsys.readouterr().out


def test_list_shows_own_families(capsys):
    for command, own in ((["list", "envs"], False), (["list", "envs", "--module", "my_scenarios"], True)):
        assert cli.run(command) == 0
        out = capsys.readouterr().out
        assert ("LGMD/Squeeze-v0" in out and "A slower car cuts in behind a truck." in out) == own
        assert "LGMD/CCRs-v0" in out
