"""The model of the page "Own neuron model" goes all the way: environment, benchmark, clips, training."""

import csv
import importlib
import json
import re
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from support.clips import write_lossless

from lgmd_gym import neuron
from lgmd_gym.agents.policies.card import read_card
from lgmd_gym.benchmark import RunConfig
from lgmd_gym.cli import main as cli
from lgmd_gym.comparison import simulation, stimuli
from lgmd_gym.comparison.cost import SHAPE, measure, state_bytes
from lgmd_gym.comparison.simulation import Worlds
from lgmd_gym.engine import SB3VecEnv
from lgmd_gym.paper.backgrounds import Plain, Screen
from lgmd_gym.paper.stimuli import Looming, stimulus_frames
from lgmd_gym.training import TrainConfig

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "own_neuron.md"
SOURCE = re.search(r"Write `my_neuron.py`:\n\n```python\n(.*?)```", PAGE.read_text(), re.DOTALL)[1]
MINE = "my_neuron:Mine"
LABORATORY = {"ego_speed": 11.1, "world": "laboratory"}


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Write the page's module into the working directory, and forget its registrations afterwards."""
    (tmp_path / "my_neuron.py").write_text(SOURCE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(neuron.registry, "_MODELS", dict(neuron.registry._MODELS))
    sys.modules.pop("my_neuron", None)
    yield importlib.import_module("my_neuron")
    sys.modules.pop("my_neuron", None)


def test_the_page_has_at_most_30_lines():
    assert len(SOURCE.splitlines()) <= 30


def test_environment_engine_and_sb3(module):
    neuron.register("mine", module.Mine)
    camera = ["fovea", {"name": "columns", "camera": "wide", "neuron": "mine", "columns": 8}]
    single = gym.make("LGMD/CCRs-v0", camera=camera, neuron="mine:level=4", **LABORATORY)
    batch = gym.make_vec("LGMD/CCRs-v0", 2, camera=camera, neuron="mine:level=4", threads=2, **LABORATORY)
    one, many = single.reset(seed=3)[0], batch.reset(seed=[3, 4])[0]
    highest = 0.0
    for _ in range(40):
        assert all((one[name] == many[name][0]).all() for name in ("spike_frequency", "column_potential"))
        assert one in single.observation_space
        highest = max(highest, float(one["spike_frequency"][0]))
        one, *_ = single.step(np.array([0.0], np.float32))
        many, *_ = batch.step(np.zeros((2, 1), np.float32))
    assert highest > 0.0
    assert one["column_potential"].shape == (8,)
    training = SB3VecEnv("LGMD/CCRs-v0", num_envs=2, neuron="mine", **LABORATORY)
    training.seed(3)
    assert training.reset()["spike_frequency"].shape == (2, 1)
    assert training.step(np.zeros((2, 1), np.float32))[0]["spike_frequency"].min() >= 0.0


@pytest.mark.usefixtures("module")
def test_bench_plays_its_neuron_and_asks_for_trust_to_repeat(capsys):
    """The run equals that of an agent's camera with the same model, and its file needs --trust elsewhere."""
    command = ["bench", "--suite", "r152", "--seeds", "1", "--worlds", "0", "--jobs", "1", "--no-plots",
               "--no-report", "--agents", "spike-threshold:threshold=5"]  # fmt: skip
    assert cli.run([*command, "--neuron", f"{MINE}:level=4", "--out", "mine"]) == 0
    assert cli.run([*command, "--out", "lgmd"]) == 0
    capsys.readouterr()
    mine, lgmd = (
        [json.loads(line) for line in Path(name, "episodes.jsonl").read_text().splitlines()]
        for name in ("mine", "lgmd")
    )
    braked = [[row["ttc_at_brake"] for row in rows if row["agent"] != "no-brake"] for rows in (mine, lgmd)]
    assert all(row["error"] is None for row in mine)
    assert braked[0] != braked[1]
    assert f'neuron = "{MINE}:level=4"' in Path("mine/run.toml").read_text()
    assert RunConfig.load(Path("mine/run.toml")).neuron == f"{MINE}:level=4"
    del neuron.registry._MODELS[MINE]  # as in another process
    assert cli.run(["bench", "--config", "mine/run.toml", "--jobs", "1", "--out", "again"]) == 2
    assert (
        f"names neuron '{MINE}:level=4', which runs the code of module 'my_neuron'" in capsys.readouterr().err
    )


@pytest.mark.usefixtures("module")
def test_video_writes_its_trace():
    frames = list(stimulus_frames(Screen(shape=(48, 64)), 1.0, Plain(), Looming(contact=1.05)))
    write_lossless(Path("clip.mkv"), frames)
    assert cli.run(["video", "clip.mkv", "--neuron", MINE, "--no-plots", "--out", "video"]) == 0
    with Path("video/clip/trace.csv").open() as file:
        trace = [float(row["spike_frequency"]) for row in csv.DictReader(file)]
    changes = np.abs(np.diff(np.array(frames, np.float32), axis=0)) >= 15.0
    assert trace == pytest.approx([0.0, *(300.0 * changes.mean((1, 2)))], abs=1e-3)


@pytest.mark.usefixtures("module")
def test_stimuli_detection_curve_and_closed_loop():
    chosen = [item for item in stimuli.stimuli() if item.name.startswith("dark square")]
    results = {item.stimulus.name: item for item in stimuli.run_stimuli([MINE], chosen)}
    assert results["dark square approaches"].peak > 10.0
    worlds = Worlds(suites=("r152",), seeds=1, worlds=1)
    recordings = simulation.record(worlds, ["lgmd", MINE])
    operating = simulation.choose(simulation.curves(recordings))
    assert {item.model for item in operating} == {"lgmd", MINE}
    assert all(item.point.false_per_km <= item.cap for item in operating)
    assert [item.agent for item in simulation.closed_loop(operating, recordings, "fovea")] == ["lgmd", MINE]


def test_cost_and_memory(module):
    (cost,) = measure([MINE], rounds=1, frames=10)
    assert 1.0 < cost.single_us < 1e5
    assert 1.0 < cost.batch_us < 1e5
    maps = 2 * 4 * SHAPE[0] * SHAPE[1]  # two float32 maps, beside a few numbers of the adapter
    assert maps <= cost.state_bytes <= maps + 2000
    assert state_bytes(module.Mine((3, 5), 30.0, 2)) == 2 * 4 * 2 * 15 + 2


@pytest.mark.usefixtures("module")
def test_training_uses_it_and_its_options():
    config = TrainConfig.from_hyperparams("ppo").with_neuron(f"{MINE}:level=9")
    env = config.make_policy_env("train")
    assert {channel.neuron for channel in env.get_wrapper_attr("sensors").channels} == {f"{MINE}:level=9"}
    env.close()
    with pytest.raises(ValueError, match="unknown option of neuron 'my_neuron:Mine' 'levle'"):
        config.with_neuron(f"{MINE}:levle=9")


@pytest.mark.slow
@pytest.mark.usefixtures("module")
def test_train_command_and_the_trained_policy(capsys):
    text = (
        f"train --algo ppo --neuron {MINE} --camera fovea --inputs spike_frequency ego_speed "
        "--n-timesteps 256 --eval-freq 256 --eval-episodes 2 --out policy"
    )
    command = text.split()
    assert cli.run(command) == 0
    (channel,) = read_card(Path("policy/policy.zip"))["camera"]
    assert channel["neuron"] == MINE
    assert cli.run(["drive", "quick/CCRs/v20", "--agent", "policy:policy/policy.zip"]) == 0
    assert "contact" in capsys.readouterr().out


def test_a_torch_model_needs_nothing_else(monkeypatch):
    torch = pytest.importorskip("torch")

    class Net:
        """Mean change, as tensors."""

        signals = {"spike_frequency": neuron.Signal(0.0, 255.0, "spikes/s")}  # noqa: RUF012

        def __init__(self, shape, fps, num):
            self.last = torch.zeros((num, *shape))

        def step(self, frames, active):
            now, chosen = torch.from_numpy(frames).float(), torch.from_numpy(active)
            change = (now - self.last).abs().mean((1, 2))
            self.last[chosen] = now[chosen]
            return {"spike_frequency": change}

        def reset(self, mask):
            self.last[torch.from_numpy(mask)] = 0.0

    monkeypatch.setattr(neuron.registry, "_MODELS", dict(neuron.registry._MODELS))
    neuron.register("torch-net", Net)
    model = neuron.make("torch-net", (4, 6), num=2)
    frames = np.stack([np.full((4, 6), 7, np.uint8), np.full((4, 6), 9, np.uint8)])
    assert model.step(frames).spike_frequency.tolist() == [7.0, 9.0]
    assert model.step(frames, np.array([True, False])).spike_frequency.tolist() == [0.0, 9.0]
    assert state_bytes(model.model) == 2 * 4 * 24
