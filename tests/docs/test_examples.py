"""The scripts in docs/examples run and print plausible results."""

import re
from pathlib import Path

import numpy as np
import pytest
from support.examples import EXAMPLES, EXPERIMENTS, load

from lgmd_gym.benchmark import get_suite
from lgmd_gym.envs.registration import RANDOM, RANDOM_TASKS, make_source
from lgmd_gym.neuron import LGMDParams


def test_every_script_has_a_test():
    tests = "".join(path.read_text() for path in Path(__file__).parent.glob("test_*.py"))
    scripts = [*EXAMPLES.glob("*.py"), *EXPERIMENTS.glob("*.py")]
    used = [path for path in scripts if f'load("{path.stem}")' in tests or f'"{path.name}"' in tests]
    assert sorted({*scripts} - {*used}) == []


@pytest.mark.slow
def test_braking_benchmark(tmp_path, capsys):
    load("braking_benchmark").main(tmp_path / "run", tmp_path / "picture.png")
    lines = capsys.readouterr().out.splitlines()
    oracle = next(line for line in lines if line.startswith("ttc-oracle"))
    assert "avoided 12/12" in oracle
    assert "false activations 0/7" in oracle
    assert (tmp_path / "picture.png").stat().st_size > 10_000


def test_scenario_evaluation(capsys, tmp_path):
    example = load("scenario_evaluation")
    example.main(tmp_path / "picture.png", cameras=("wide", "fovea"), speeds=(30,), seeds=1)
    wide, fovea, needed = [float(value) for value in re.findall(r"([\d.]+) s", capsys.readouterr().out)]
    assert 0.0 < wide < fovea < 4.0
    assert needed == pytest.approx(0.70, abs=0.01)  # 8.33 m/s / (2 · 9 m/s²) and 0.23 s
    assert (tmp_path / "picture.png").stat().st_size > 10_000


def test_vector_gymnasium(capsys):
    episodes, contacts = load("vector_gymnasium").main(num_envs=8, steps=300)
    assert f"2400 decisions: {episodes} episodes, contact in {contacts}" in capsys.readouterr().out
    assert 8 <= episodes < 100
    assert contacts < episodes


def test_vector_sb3(capsys):
    torch = pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    model = load("vector_sb3").main(steps=512, num_envs=4, episodes=4)
    assert model.num_timesteps == 512
    assert all(bool(torch.isfinite(weight).all()) for weight in model.policy.parameters())
    assert "512 steps: return " in capsys.readouterr().out


@pytest.mark.slow
def test_rl_training(capsys):
    """DQN updates its parameters, which stay finite, after its 640 first decisions."""
    torch = pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    model = load("rl_training").main(720, num_envs=4, episodes=4)
    assert model.num_timesteps == 720
    assert model._n_updates == 2 * (720 - 640) / 4
    assert all(bool(torch.isfinite(weight).all()) for weight in model.policy.parameters())
    assert "720 decisions: return" in capsys.readouterr().out


def test_easy_levels_are_those_of_the_easy_task():
    """Each case is one validation level, with the default arguments of the id, and is drawn as such."""
    cases = get_suite(str(EXAMPLES / "easy_levels.toml")).cases
    task = RANDOM_TASKS["RandomBrakingEasy"].arguments
    for number, case in enumerate(cases):
        level = {"split": "validation", "start_level": number, "num_levels": 1}
        expected = task | {name: list(task[name]) for name in ("families", "weathers")} | level
        given = dict(case.arguments)
        assert given | {name: list(given[name]) for name in ("families", "weathers")} == expected
        assert case.scenario == make_source(RANDOM, given).first
    assert {case.scenario.family for case in cases} == set(task["families"])
    assert len(cases) == 200


@pytest.mark.slow
def test_fit_neuron(tmp_path, capsys):
    """A few steps change the parameters, and the separation is that of counts by hand."""
    pytest.importorskip("torch")
    example = load("fit_neuron")
    counts = np.array([[1.0, 2.0, 4.0, 10.0], [2.0, 0.0, 4.0, 10.0]])
    assert example.separation(counts.sum(0)) == pytest.approx(3 / 8 - 2 / 20)
    assert example.paired(counts, counts) == (0.0, 0.0, 0.0)
    small = ["--levels", "6", "--steps", "2", "--validation", "3"]
    results = example.main([*small, "--out", str(tmp_path / "fitted.toml")])
    params = LGMDParams.from_toml(tmp_path / "fitted.toml")
    assert params != LGMDParams()
    assert {name: table.shape[1] for name, table in results.items()} == {"paper": 4, "fitted": 4}
    assert "fitted minus paper" in capsys.readouterr().out
