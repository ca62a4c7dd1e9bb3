"""The detector of sustained edges: equations, and objects on collision course against a moving background."""

import math

import numpy as np
import pytest

from lgmd_gym.neuron import SustainedEdges, SustainedEdgesParams

SHAPE = (24, 48)


def test_outputs_equal_the_equations():
    frames = np.random.default_rng(1).integers(0, 256, (8, *SHAPE)).astype(np.uint8)
    params = {"tau_ms": 100.0, "sigma": 3.0}
    detector = SustainedEdges(SHAPE, fps=30.0, params=params)
    assert detector.step(frames[0]).membrane_potential == 0.5
    light, gain = frames[0].astype(float), (1000.0 / 30.0) / (1000.0 / 30.0 + 100.0)
    for frame in frames[1:]:
        light += gain * (frame - light)
        edges = np.abs(np.diff(light, axis=1)).sum() / light.size
        response = detector.step(frame)
        assert response.ffi == pytest.approx(edges, rel=1e-5)
        assert response.membrane_potential == pytest.approx(1.0 / (1.0 + math.exp(-edges / 3.0)), abs=1e-6)
        assert detector.layers["light"] == pytest.approx(light, abs=1e-2)


def test_a_still_object_is_stronger_than_the_same_object_in_motion():
    rng = np.random.default_rng(0)
    texture = rng.integers(60, 160, (SHAPE[0], 400)).astype(np.uint8)

    def mean_edges(speed):
        detector = SustainedEdges(SHAPE)
        for t in range(40):
            response = detector.step(texture[:, speed * t : speed * t + SHAPE[1]])
        return response.ffi

    assert mean_edges(0) > 2.0 * mean_edges(3)


@pytest.mark.parametrize("values", [{"tau_ms": 0.0}, {"sigma": -1.0}, {"tau": 1.0}, 3])
def test_invalid_parameters_are_rejected(values):
    with pytest.raises((ValueError, TypeError)):
        SustainedEdgesParams.make(values)
