"""Potentials of the columns of a frame: equations, sums, and errors."""

import numpy as np
import pytest
from support.neurons import square

from lgmd_gym import LGMD
from lgmd_gym.neuron import DSN, LPLC2, SustainedEdges

SHAPE = (40, 80)
GROWING = [square(4.0 + t, (24.0, 20.0), SHAPE) for t in range(16)]


def response(potential):
    return np.log(potential / (1.0 - potential))


@pytest.mark.parametrize("params", [None, {"n_p": 4}])  # the fast and the general kernel
def test_columns_of_an_lgmd_are_means_of_g(params):
    neuron = LGMD(SHAPE, params=params)
    for frame in GROWING:
        potential = neuron.step(frame).membrane_potential
    columns = neuron.column_potentials(5)
    g = neuron.layers["G"]
    assert g.max() > 0.0
    expected = [g[:, 16 * c : 16 * (c + 1)].mean() for c in range(5)]
    assert response(columns) == pytest.approx(expected, abs=1e-4)
    assert response(columns).mean() == pytest.approx(response(potential), abs=1e-3)
    assert columns[0] > 0.6
    assert columns[4] == 0.5


@pytest.mark.parametrize(("model", "layer"), [(DSN, "right"), (SustainedEdges, "edges")])
def test_columns_of_other_models_are_means_of_their_maps(model, layer):
    frames = [square(8.0, (20.0 + t, 20.0), SHAPE) for t in range(12)]
    neuron = model(SHAPE, num=2)
    for frame in frames:
        potential = neuron.step(np.stack([frame, frame[:, ::-1]])).membrane_potential
    columns, maps = neuron.column_potentials(10), neuron.layers[layer]
    expected = maps.reshape(2, 40, 10, 8).mean(axis=(1, 3)) / neuron.params.sigma
    assert response(columns) == pytest.approx(expected, abs=1e-4)
    assert response(columns).mean(axis=1) == pytest.approx(response(potential), abs=1e-5)


def test_columns_are_one_half_before_the_first_change_and_after_a_reset():
    neuron = LGMD(SHAPE)
    neuron.step(GROWING[0])
    assert np.all(neuron.column_potentials(2) == 0.5)
    for frame in GROWING:
        neuron.step(frame)
    assert neuron.column_potentials(2).max() > 0.5
    neuron.reset()
    assert np.all(neuron.column_potentials(2) == 0.5)


def test_invalid_columns_are_rejected():
    with pytest.raises(ValueError, match="columns must divide the width of 80 px, got 3"):
        LGMD(SHAPE).column_potentials(3)
    with pytest.raises(ValueError, match="LPLC2 has no columns; use a model that has, such as lgmd"):
        LPLC2(SHAPE).column_potentials(2)
    with pytest.raises(ValueError, match="columns require a neuron without mask and roi"):
        LGMD(SHAPE, roi=(0, 0, 20, 40)).column_potentials(2)


@pytest.mark.parametrize("view", [np.asfortranarray, lambda maps: np.repeat(maps, 2, axis=2)[:, :, ::2]])
def test_columns_of_a_map_that_is_not_contiguous(view, monkeypatch):
    neuron = DSN(SHAPE, num=2)
    for frames in np.random.default_rng(0).integers(0, 256, (5, 2, *SHAPE), np.uint8):
        neuron.step(frames)
    expected = neuron.column_potentials(5)
    maps, sigma = neuron.column_map()
    monkeypatch.setattr(neuron, "column_map", lambda: (view(maps), sigma))
    assert np.array_equal(neuron.column_potentials(5), expected)
    assert np.ptp(expected) > 0.0
