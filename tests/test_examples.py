"""The examples, and README's blocks, run."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "docs" / "examples"


def load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_braking_benchmark(tmp_path, capsys):
    load("braking_benchmark").main(tmp_path / "run")
    lines = capsys.readouterr().out.splitlines()
    oracle = next(line for line in lines if line.startswith("ttc-oracle"))
    assert "avoided 12/12" in oracle
    assert "false braking 0/7" in oracle


def test_scenario_evaluation(capsys):
    load("scenario_evaluation").main(cameras=("wide", "fovea"), speeds=(30,), seeds=1)
    values = [float(value) for value in re.findall(r"([\d.]+) s", capsys.readouterr().out)]
    assert len(values) == 2
    assert 0.0 < values[0] < values[1] < 4.0


def test_rl_training(capsys):
    """PPO with MultiInputPolicy learns 2,000 steps: parameters move and stay finite."""
    torch = pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    model = load("rl_training").main(2000)
    assert model.num_timesteps >= 2000
    assert model._n_updates > 0
    assert all(bool(torch.isfinite(weight).all()) for weight in model.policy.parameters())
    assert "2000 steps:" in capsys.readouterr().out


def test_contact_sheet(tmp_path):
    sheet = load("contact_sheet").main(tmp_path / "sheet.png", quick=True)
    assert [list(row) for row in sheet.values()] == [["clear", "night"]] * 2
    assert all(row["night"].mean() < 0.5 * row["clear"].mean() for row in sheet.values())
    assert 10_000 < (tmp_path / "sheet.png").stat().st_size < 200_000


def test_every_example_is_run_here():
    tested = Path(__file__).read_text()
    assert all(f'load("{path.stem}")' in tested for path in EXAMPLES.glob("*.py"))


def test_readme_python_blocks_run(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, "README.md", "exec"), {})


def test_picture(tmp_path):
    from PIL import Image

    load("picture").main(tmp_path / "view.png", ego_speed=5.0, after=2)
    assert Image.open(tmp_path / "view.png").size == (1280, 720)
