"""Own neuron models: one class and one registration, used like the models of the package."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from support.clips import write_lossless

from lgmd_gym import neuron
from lgmd_gym.benchmark.player import run_task
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.benchmark.task import Task
from lgmd_gym.clips.playback import ClipRun, PlaybackConfig
from lgmd_gym.neuron import LGMDParams, Signal


class Change:
    """Mean absolute change of each frame [grey levels] as a frequency and potential."""

    signals = {  # noqa: RUF012
        "spike_frequency": Signal(0.0, 255.0, "spikes/s"),
        "membrane_potential": Signal(0.5, 1.0),
    }

    def __init__(self, shape, fps, num):
        self.last, self.map = np.zeros((num, *shape)), np.zeros((num, *shape), np.float32)
        self.first = np.ones(num, bool)

    def step(self, frames, active):
        self.last[self.first] = frames[self.first]
        self.map[active] = np.abs(frames - self.last)[active]
        self.last[active], self.first[active] = frames[active], False
        change = self.map.mean((1, 2))
        return {"spike_frequency": change, "membrane_potential": 0.5 + change / 510.0}

    def reset(self, mask):
        self.first[mask], self.map[mask] = True, 0.0

    def column_map(self):
        return self.map, 10.0


if "change" not in neuron.names():
    neuron.register("change", Change)

CAMERAS = ["wide", {"name": "own", "camera": {"shape": (30, 40)}, "neuron": "change", "columns": 4}]


def test_an_own_model_in_environments_and_the_engine():
    names = "spike_frequency", "membrane_potential", "ffi", "column_potential"
    single = gym.make("LGMD/CCRs-v0", ego_speed=8.0, camera=CAMERAS, world="laboratory")
    batch = gym.make_vec("LGMD/CCRs-v0", 2, ego_speed=8.0, camera=CAMERAS, world="laboratory", threads=2)
    one, _ = single.reset(seed=1)
    many, _ = batch.reset(seed=[1, 2])
    assert one in single.observation_space
    changed = False
    for _ in range(12):
        assert all((one[name] == many[name][0]).all() for name in names)
        one, *_ = single.step(np.array([-0.5], np.float32))
        many, *_ = batch.step(np.full((2, 1), -0.5, np.float32))
        assert one in single.observation_space
        changed |= one["spike_frequency"][1] > 0.1
    assert changed
    assert one["ffi"][1] == 0.0
    assert one["column_potential"].max() > 0.5


def test_an_own_model_in_the_benchmark():
    case = SUITES["quick"].cases[0]
    result = run_task(Task("spike-threshold:threshold=2", case, 0, SensorConfig(camera=CAMERAS[1])))
    assert result.row["error"] is None
    assert result.series["spike_frequency"].max() > 0.0


def test_an_own_model_in_clips(tmp_path):
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 256, (6, 48, 64), np.uint8)
    path = write_lossless(tmp_path / "clip.mkv", list(frames))
    played = list(ClipRun(path, PlaybackConfig(neuron="change")))
    assert [frame.response.spike_frequency > 50.0 for frame in played] == [False] + [True] * 5
    with pytest.raises(ValueError, match="roi requires the neuron lgmd, got change"):
        PlaybackConfig(neuron="change", roi=(0, 0, 4, 4))


def test_a_model_of_a_module_is_imported(tmp_path, monkeypatch):
    source = "from lgmd_gym.neuron import DSN\n\n\ndef make(*a): return DSN(a[0], num=a[2])"
    (tmp_path / "my_neurons.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    assert neuron.make("my_neurons:make", (8, 8)).step(np.zeros((8, 8))).membrane_potential == 0.5
    with pytest.raises(ValueError, match="my_neurons has no function mak"):
        neuron.make("my_neurons:mak", (8, 8))


@pytest.mark.parametrize("twin", [copy.deepcopy, lambda neurons: pickle.loads(pickle.dumps(neurons))])
def test_an_own_model_by_itself(twin):
    neurons = neuron.make("change", (4, 8), 30.0, 2, LGMDParams(t_sf=5.0))
    frames = np.zeros((2, 4, 8), np.uint8)
    neurons.step(frames)
    frames[0] = 10
    response = twin(neurons).step(frames, np.array([True, False]))
    assert response.spike_frequency.tolist() == [10.0, 0.0]
    assert response.alert.tolist() == [True, False]
    single = neuron.make("change", (4, 8))
    assert single.step(frames[0]).membrane_potential == 0.5


class Wrong(Change):
    """A model with outputs beside its declaration."""

    outputs = {}  # noqa: RUF012

    def step(self, frames, active):
        return super().step(frames, active) | self.outputs


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        ({"spike_frequency": [np.nan, 0.0]}, r"must be in \[0, 255\], got nan"),
        ({"membrane_potential": [0.7, 1.5]}, r"must be in \[0.5, 1\], got 1.5"),
        ({"membrane_potential": 0.7}, r"must have the shape \(2,\), got \(\)"),
        ({"ffj": [0.0, 0.0]}, "unknown signal of neuron 'wrong' 'ffj'"),
    ],
)
def test_wrong_outputs_are_refused(outputs, message, monkeypatch):
    monkeypatch.delitem(neuron.registry._MODELS, "wrong", raising=False)
    neuron.register("wrong", Wrong)
    monkeypatch.setattr(Wrong, "outputs", outputs)
    neurons = neuron.make("wrong", (4, 8), 30.0, 2)
    with pytest.raises(ValueError, match=message):
        neurons.step(np.zeros((2, 4, 8), np.uint8))
    monkeypatch.delitem(neuron.registry._MODELS, "wrong")


def test_names_and_declarations_are_checked():
    with pytest.raises(ValueError, match="'lgmd' is registered already"):
        neuron.register("lgmd", Change)
    with pytest.raises(ValueError, match="must be a function or class, got 3"):
        neuron.register("three", 3)
    with pytest.raises(ValueError, match="unknown neuron 'lplc3'; did you mean 'lplc2'"):
        gym.make("LGMD/CCRs-v0", ego_speed=8.0, neuron="lplc3")
    with pytest.raises(ValueError, match="LPLC2 has no columns"):
        neuron.make("lplc2", (32, 40), columns=4)
    with pytest.raises(ValueError, match=r"must have shift\(active, turns_px\)"):
        neuron.make("change", (4, 8), derotated=True)


def test_outputs_of_inactive_neurons_are_ignored():
    class Sparse:
        """A model whose outputs are undefined where it has no new frame."""

        signals = {"spike_frequency": Signal(0.0, 255.0, "spikes/s")}  # noqa: RUF012

        def __init__(self, shape, fps, num):
            self.num = num

        def step(self, frames, active):
            values = np.full(self.num, np.nan)
            values[active] = frames[active].mean((1, 2))
            return {"spike_frequency": values}

        def reset(self, mask):
            pass

    neuron.register("sparse", Sparse)
    model = neuron.make("sparse", (4, 8), fps=30.0, num=2)
    response = model.step(np.full((2, 4, 8), 7, np.uint8), np.array([False, True]))
    assert response.spike_frequency.tolist() == [0.0, 7.0]
