"""Figures are drawn, are not blank, and refuse what they cannot draw."""

import matplotlib as mpl
import numpy as np
import pytest

from lgmd_gym import LGMD
from lgmd_gym.benchmark.episode import SERIES
from lgmd_gym.plotting import figures as plots


def ink(path):
    """Share of pixels that are not the background."""
    picture = mpl.image.imread(path)[..., :3]
    return float((np.abs(picture - picture[0, 0]).max(axis=-1) > 0.1).mean())


def series(gap):
    n = 50
    values = {name: np.zeros(n) for name in SERIES}
    values["time"] = np.arange(n) / 30
    values["ego_speed"] = np.linspace(10, 0, n)
    values["gap"] = np.linspace(20, gap, n)
    values["spike_frequency"] = np.linspace(0, 100, n)
    return values


def test_layers(tmp_path):
    frames = np.random.default_rng(0).integers(0, 255, (3, 40, 60), np.uint8)
    neuron = LGMD((40, 60))
    for frame in frames:
        neuron.step(frame)
    plots.layers(tmp_path / "with.png", neuron, frames[-1])
    plots.layers(tmp_path / "without.png", neuron)
    assert ink(tmp_path / "with.png") > ink(tmp_path / "without.png") > 0.1
    with pytest.raises(ValueError, match="a single neuron, got a batch of 2"):
        plots.layers(tmp_path / "batch.png", LGMD((40, 60), num=2))


@pytest.mark.parametrize("gap", [0.0, 3.0, np.nan])
def test_episode_figure(tmp_path, gap):
    plots.episode_figure(tmp_path / "case.png", "a case", {"one": series(gap), "other": series(1.0)}, 30.0)
    assert ink(tmp_path / "case.png") > 0.01
