"""The LPLC2 model: equations by hand, selectivity, and the interface it shares with the LGMD."""

import copy
import math
import pickle

import numpy as np
import pytest
from support.neurons import motion_maps, square

from lgmd_gym.neuron import LPLC2, LGMDParams, LPLC2Params

SHAPE = (40, 64)


def reference(frames, params=None):
    """Return K without adaptation, the mean |m| to the right and the units of each frame, in plain NumPy."""
    p = LPLC2Params.make(params)
    results = [(0.5, 0.0, None)]
    for right, down in motion_maps(frames, p):
        units = _units(right, down, p)
        k = 1.0 / (1.0 + math.exp(-units.max() / p.sigma))
        results.append((k, np.abs(right).mean(), units))
    return results


def _units(right, down, p):
    r = p.radius_px
    rows = range(r, right.shape[0] - r + 1, p.stride_px)
    columns = range(r, right.shape[1] - r + 1, p.stride_px)
    units = np.zeros((len(rows), len(columns)))
    for i, y in enumerate(rows):
        for j, x in enumerate(columns):
            arms = [-right[y - r : y + r, x - r : x].mean(), right[y - r : y + r, x : x + r].mean()]
            if p.vertical:
                arms += [-down[y - r : y, x - r : x + r].mean(), down[y : y + r, x - r : x + r].mean()]
            units[i, j] = np.prod(np.maximum(arms, 0.0)) ** (1.0 / len(arms))
    return units


def potentials(frames, **params):
    detector = LPLC2(frames[0].shape, params=params)
    return np.array([detector.step(frame).membrane_potential for frame in frames])


@pytest.mark.parametrize(
    "params",
    [
        {},
        {"vertical": False},
        {"radius_px": 5, "stride_px": 3},
        {"radius_px": 20, "sigma": 4.0},
        {"tau_mean_ms": 30.0, "tau_delay_ms": 80.0},
    ],
)
def test_outputs_equal_the_equations(params):
    rng = np.random.default_rng(3)
    noise = rng.integers(0, 256, (12, *SHAPE))
    looming = [square(40.0 / (14 - t), (30.3, 19.1)) for t in range(12)]
    for frames in (noise.astype(np.uint8), np.array(looming)):
        detector = LPLC2(SHAPE, params=params)
        for frame, (k, ffi, units) in zip(frames, reference(frames, params), strict=True):
            response = detector.step(frame)
            assert response.membrane_potential == pytest.approx(k, abs=1e-5)
            assert response.ffi == pytest.approx(ffi, rel=1e-5)
            if units is not None:
                # A product of four arms amplifies the rounding of one that is nearly 0.
                assert detector.layers["units"] == pytest.approx(units, abs=0.02)


def test_motion_of_one_edge_by_hand():
    """One column turns from 100 to 160, then the next one: the correlator gives 60 · sqrt(gain)."""
    frames = np.full((3, 16, 16), 100, np.uint8)
    frames[1:, :, 7], frames[2:, :, 8] = 160, 160
    detector = LPLC2((16, 16), params={"tau_mean_ms": 1e12})
    for frame in frames:
        detector.step(frame)
    gain = (1000.0 / 30.0) / (1000.0 / 30.0 + 30.0)
    expected = np.zeros((16, 16))
    expected[:, 7] = 60.0 * math.sqrt(gain)  # column 7 was late_on = gain * 60, and column 8 is on = 60
    assert detector.layers["right"] == pytest.approx(expected, rel=1e-5)
    assert not detector.layers["down"].any()


def test_an_approaching_square_excites_it_and_other_motion_does_not():
    steps = range(50)
    looming = potentials([square(60.0 / (54 - t)) for t in steps])
    assert looming.max() > 0.9
    assert looming[:20].max() < 0.6
    for other in (
        [square(60.0 / (4 + t)) for t in steps],  # recedes
        [square(8.0, (8.0 + t, 20.0)) for t in steps],  # passes
        [np.roll(square(6.0), 2 * t, axis=1) for t in steps],  # the whole image moves
        [square(8.0)] * 50,
    ):
        assert potentials(other).max() < 0.55


def test_light_and_dark_objects_have_the_same_response():
    frames = [square(60.0 / (54 - t)) for t in range(50)]
    inverse = [255 - frame for frame in frames]
    assert potentials(frames) == pytest.approx(potentials(inverse), abs=1e-5)


def test_spikes_follow_from_the_potential_as_in_the_lgmd():
    frames = [square(60.0 / (54 - t)) for t in range(50)]
    detector, spikes = LPLC2(SHAPE, spikes={"n_ts": 4, "t_sf": 60.0}), []
    p = LGMDParams()
    for frame in frames:
        response = detector.step(frame)
        assert response.spikes == math.floor(math.exp(p.sigma_4 * (response.adapted_potential - p.t_sp)))
        spikes.append(response.spikes)
        frequency = sum(spikes[-4:]) * 30.0 / 4
        assert response.spike_frequency == pytest.approx(frequency)
        assert response.alert == (frequency >= 60.0)
    assert max(spikes) > 3


def test_several_detectors_equal_single_ones():
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 256, (10, 3, *SHAPE)).astype(np.uint8)
    batch, threaded = LPLC2(SHAPE, num=3), LPLC2(SHAPE, num=3, threads=2)
    singles = [LPLC2(SHAPE) for _ in range(3)]
    for t, group in enumerate(frames):
        active = np.array([True, t != 4, True])
        response, other = batch.step(group, active), threaded.step(group, active)
        for n in range(3):
            if active[n]:
                expected = singles[n].step(group[n])
            else:
                continue
            assert [field[n] for field in response] == list(expected)
            assert [field[n] for field in other] == list(expected)
    assert batch.layers["units"].shape[0] == 3


def test_reset_copies_and_pickles():
    frames = [square(60.0 / (54 - t)) for t in range(50)]
    detector = LPLC2(SHAPE)
    first = [detector.step(frame) for frame in frames]
    detector.reset()
    assert [detector.step(frame) for frame in frames[:40]] == first[:40]
    for twin in (copy.deepcopy(detector), pickle.loads(pickle.dumps(detector))):
        assert [twin.step(frame) for frame in frames[40:]] == first[40:]


def test_float_frames_equal_bytes():
    frames = [square(60.0 / (54 - t)) for t in range(50)]
    assert np.array_equal(potentials(frames), potentials([frame.astype(np.float64) for frame in frames]))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"shape": (10, 64)}, "radius_px must be at most half of the smaller side"),
        ({"params": {"radius": 4}}, "radius_px"),
        ({"params": {"sigma": 0.0}}, r"LPLC2 sigma must be in \(0, inf\) grey levels, got 0"),
        ({"params": {"tau_delay_ms": math.inf}}, "tau_delay_ms must be .*finite"),
        ({"params": {"stride_px": 0}}, "stride_px"),
        ({"params": {"vertical": 2}}, "vertical"),
        ({"params": LGMDParams()}, "LPLC2 must be LPLC2Params or Mapping"),
        ({"spikes": {"n_tss": 4}}, "n_ts"),
    ],
)
def test_invalid_arguments(arguments, message):
    with pytest.raises((ValueError, TypeError), match=message):
        LPLC2(**{"shape": SHAPE, **arguments})
