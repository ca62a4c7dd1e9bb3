"""Specifications of models: names, presets and options in one text, as of agents."""

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym import neuron
from lgmd_gym.neuron import LGMDParams, Signal
from lgmd_gym.paper.backgrounds import Screen
from lgmd_gym.paper.stimuli import Looming, stimulus_frames


class Gained:
    """Mean luminance times a gain."""

    signals = {"spike_frequency": Signal(0.0, 1e6)}  # noqa: RUF012

    def __init__(self, shape, fps, num, gain=1.0, *, offset=0.0):
        self.gain, self.offset = gain, offset

    def step(self, frames, active):
        return {"spike_frequency": self.gain * frames.mean((1, 2)) + self.offset}

    def reset(self, mask):
        pass


if "gained" not in neuron.names():
    neuron.register("gained", Gained)


@pytest.mark.parametrize(
    ("text", "params"),
    [
        ("lgmd", LGMDParams()),
        ("lgmd:t_sp=0.78,warm_start=false", LGMDParams(t_sp=0.78, warm_start=False)),
        ("literal", LGMDParams.literal()),
        ("released", LGMDParams.released()),
        ("fixed-inhibition", LGMDParams.fixed_inhibition()),
        ("off-only", LGMDParams.off_only()),
        ("off-only:delay=two-tap,n_p=3", LGMDParams(theta_1=0.0, delay="two-tap", n_p=3)),
    ],
)
def test_presets_and_options_of_the_lgmd(text, params):
    assert neuron.make(text, (8, 8)).params == params


def test_a_preset_changes_the_parameters_in_use_and_options_change_the_preset():
    params = neuron.make("released:t_sp=0.7", (8, 8), params=LGMDParams(t_sf=15.0, t_sp=0.9)).params
    assert (params.t_sf, params.t_sp, params.n_p) == (15.0, 0.7, 0)


def test_options_of_other_models_are_their_own_and_those_of_the_spikes():
    model = neuron.make("lplc2:radius_px=2,vertical=false,t_sf=7", (8, 8))
    assert (model.params.radius_px, model.params.vertical, model._stage.t_sf) == (2, False, 7.0)
    assert neuron.make("edges:sigma=3", (8, 8)).params.sigma == 3.0


def test_options_of_an_own_model_are_arguments_of_its_factory():
    frame = np.full((4, 4), 5, np.uint8)
    assert neuron.make("gained", (4, 4)).step(frame).spike_frequency == 5.0
    assert neuron.make("gained:gain=3,offset=0.5", (4, 4)).step(frame).spike_frequency == 15.5
    assert neuron.describe("gained") == ("Mean luminance times a gain.", ("gain", "offset"))


def test_a_model_of_a_module_takes_options(tmp_path, monkeypatch):
    (tmp_path / "mod_gained.py").write_text("from test_specifications import Gained as Mine\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.syspath_prepend(__file__.rpartition("/")[0])
    frame = np.full((4, 4), 5, np.uint8)
    assert neuron.make("mod_gained:Mine:gain=2", (4, 4)).step(frame).spike_frequency == 10.0
    assert neuron.base_name("mod_gained:Mine:gain=2") == "mod_gained:Mine"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lgmd:t_spp=1", "unknown option of neuron 'lgmd' 't_spp'; did you mean 't_sp'"),
        ("lgmd:t_sp", "neuron option 't_sp' in 'lgmd:t_sp' has no value; write t_sp=VALUE"),
        ("lgmd:t_sp=2", r"LGMD t_sp must be in \[0, 1\], got 2"),
        ("lgmd:warm_start=maybe", "warm_start must be .*got 'maybe'"),
        ("off:t_sp=1", "unknown neuron 'off'; did you mean 'off-only'"),
        ("gained:gian=1", "did you mean 'gain'"),
        ("no_such_module:F", "cannot be imported"),
    ],
)
def test_wrong_specifications_are_refused_in_one_line(text, message):
    with pytest.raises(ValueError, match=message) as error:
        neuron.make(text, (8, 8))
    assert "\n" not in str(error.value)


def test_a_name_has_no_colon():
    with pytest.raises(ValueError, match="must not contain a colon, got 'a:b'"):
        neuron.register("a:b", Gained)


def test_frame_change_by_hand():
    model = neuron.make("difference:sigma=2", (2, 3), 30.0)
    model.step(np.full((2, 3), 10, np.uint8))
    response = model.step(np.array([[10, 16, 10], [4, 10, 10]], np.uint8))
    assert response.ffi == 2.0  # |dL| = 6 in two of six pixels
    assert response.membrane_potential == pytest.approx(1.0 / (1.0 + np.exp(-1.0)))
    assert model.layers["change"].tolist() == [[0, 6, 0], [6, 0, 0]]
    assert model.column_potentials(3).tolist() == pytest.approx(
        [1.0 / (1.0 + np.exp(-1.5)), 1.0 / (1.0 + np.exp(-1.5)), 0.5]
    )
    shifted = neuron.make("difference", (2, 3), 30.0)
    frame = np.array([[1, 2, 3], [4, 5, 6]], np.uint8)
    shifted.step(frame)
    moved = np.roll(frame, -1, axis=1)
    assert shifted.step(moved, turn_px=1).ffi == 0.0


def test_the_adaptive_threshold_gates_the_spike_frequency_by_its_mean():
    """As the rule adaptive-threshold: f passes where it is at least gain times the mean before it."""
    shape = (48, 64)
    dark = stimulus_frames(Screen(shape=shape), 1.5, None, Looming(contact=1.6))
    light = stimulus_frames(Screen(shape=shape), 1.5, None, Looming(contact=1.5, luminance=250.0))
    plain = neuron.make("lgmd", shape, num=2)
    gated = neuron.make("adaptive-threshold:gain=1.2,memory=5,t_sf=20", shape, num=2)
    mean, passed = np.zeros(2), []
    for number, pictures in enumerate(map(np.stack, zip(dark, light, strict=True))):
        active = np.array([True, number % 3 > 0])
        frequency, response = plain.step(pictures, active).spike_frequency, gated.step(pictures, active)
        expected = np.where(frequency >= 1.2 * mean, frequency, 0.0)
        mean = np.where(active, mean + (frequency - mean) / 5.0, mean)
        assert response.spike_frequency[active].tolist() == expected[active].tolist()
        assert response.alert[active].tolist() == (expected >= 20.0)[active].tolist()
        passed += (expected[active] > 0.0).tolist()
    assert 5 < sum(passed) < len(passed) - 5
    gated.reset()
    assert gated._mean.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("model", ["events:noise_hz=5", "adaptive-threshold:gain=1.1", "difference:sigma=1"])
def test_a_single_environment_is_a_row_of_the_engine(model):
    options = {"ego_speed": 8.0, "world": "laboratory", "neuron": model, "camera": {"shape": (40, 60)}}
    single = gym.make("LGMD/CCRs-v0", **options)
    batch = gym.make_vec("LGMD/CCRs-v0", 3, threads=2, **options)
    one, many = single.reset(seed=2)[0], batch.reset(seed=[1, 2, 3])[0]
    excited = False
    for _ in range(15):
        for name in ("spike_frequency", "membrane_potential", "ffi"):
            assert (one[name] == many[name][1]).all()
        assert one in single.observation_space
        excited |= one["membrane_potential"][0] > 0.5
        one, *_ = single.step(np.array([-0.5], np.float32))
        many, *_ = batch.step(np.full((3, 1), -0.5, np.float32))
    assert excited
