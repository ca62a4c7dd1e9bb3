"""The direction-selective neuron: equations, direction, and the interface it shares with the LGMD."""

import copy
import math
import pickle

import numpy as np
import pytest
from support.neurons import motion_maps, square

from lgmd_gym.neuron import DSN, DSNParams, LGMDParams

SHAPE = (40, 64)
RIGHTWARD = [square(8.0, (8.0 + t, 20.0)) for t in range(40)]
LEFTWARD = RIGHTWARD[::-1]


def responses(frames, **arguments):
    neuron = DSN(SHAPE, **arguments)
    return [neuron.step(frame) for frame in frames]


@pytest.mark.parametrize("params", [{}, {"sigma": 4.0}, {"tau_mean_ms": 30.0, "tau_delay_ms": 80.0}])
def test_outputs_equal_the_equations(params):
    noise = np.random.default_rng(3).integers(0, 256, (12, *SHAPE)).astype(np.uint8)
    p = DSNParams(**params)
    for frames in (noise, RIGHTWARD[:12]):
        neuron = DSN(SHAPE, params=params)
        assert neuron.step(frames[0]).membrane_potential == 0.5
        for frame, (right, _) in zip(frames[1:], motion_maps(frames, p), strict=True):
            response = neuron.step(frame)
            expected = 1.0 / (1.0 + math.exp(-right.mean() / p.sigma))
            assert response.membrane_potential == pytest.approx(expected, abs=1e-6)
            assert response.ffi == pytest.approx(np.abs(right).mean(), rel=1e-5)
            assert neuron.layers["right"] == pytest.approx(right, abs=1e-3)


def test_motion_to_the_right_excites_and_motion_to_the_left_inhibits():
    params = {"sigma": 0.2}
    right, left = responses(RIGHTWARD, params=params)[5:], responses(LEFTWARD, params=params)[5:]
    assert min(item.membrane_potential for item in right) > 0.75
    assert max(item.membrane_potential for item in left) < 0.25
    assert max(item.spikes for item in right) > 0
    assert max(item.spikes for item in left) == 0


def test_mirrored_frames_have_the_opposite_response():
    straight = responses(RIGHTWARD)
    mirrored = responses([frame[:, ::-1] for frame in RIGHTWARD])
    for one, other in zip(straight, mirrored, strict=True):
        assert other.membrane_potential == pytest.approx(1.0 - one.membrane_potential, abs=1e-6)
        assert other.ffi == pytest.approx(one.ffi, rel=1e-5, abs=1e-9)


def test_several_neurons_equal_single_ones():
    frames = np.random.default_rng(0).integers(0, 256, (10, 3, *SHAPE)).astype(np.uint8)
    batch, singles = DSN(SHAPE, num=3, threads=2), [DSN(SHAPE) for _ in range(3)]
    for t, group in enumerate(frames):
        active = np.array([True, t != 4, True])
        response = batch.step(group, active)
        for n in np.flatnonzero(active):
            assert [field[n] for field in response] == list(singles[n].step(group[n]))
    assert batch.layers["right"].shape == (3, *SHAPE)


def test_reset_copies_and_pickles():
    neuron = DSN(SHAPE)
    first = [neuron.step(frame) for frame in RIGHTWARD]
    neuron.reset()
    assert [neuron.step(frame) for frame in RIGHTWARD[:30]] == first[:30]
    for twin in (copy.deepcopy(neuron), pickle.loads(pickle.dumps(neuron))):
        assert [twin.step(frame) for frame in RIGHTWARD[30:]] == first[30:]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"params": {"sigm": 0.4}}, "unknown DSN field 'sigm'; did you mean 'sigma'"),
        ({"params": {"sigma": -1.0}}, r"DSN sigma must be in \(0, inf\) grey levels, got -1"),
        ({"params": LGMDParams()}, "DSN must be DSNParams or Mapping"),
    ],
)
def test_invalid_arguments(arguments, message):
    with pytest.raises(ValueError, match=message):
        DSN(**{"shape": SHAPE, **arguments})
