"""The float32 kernels, fast and general, compared with the float64 reference."""

import math

import numpy as np
import pytest
from golden.sequences import KINDS, grating, looming, natural, random
from support.neurons import PRESETS, compare

from lgmd_gym.neuron import LGMD, LGMDParams
from lgmd_gym.neuron.lgmd import kernels
from lgmd_gym.neuron.lgmd.reference import ReferenceLGMD


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("kind", KINDS)
def test_small_frames_with_every_preset(preset, kind):
    for shape in [(1, 1), (1, 40), (40, 1), (7, 5), (33, 47), (16, 32)]:
        compare(KINDS[kind](shape, 30), 30.0, PRESETS[preset])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", [(334, 380), (270, 540)])
def test_large_odd_frames(kind, shape):
    compare(KINDS[kind](shape, 10), 30.0, LGMDParams())


@pytest.mark.parametrize("fps", [15.0, 18.0, 30.0, 60.0])
@pytest.mark.parametrize("preset", PRESETS)
def test_frame_rates_on_a_looming_object(fps, preset):
    frames = looming((60, 80), int(fps * 1.5))
    frames = np.clip(frames.astype(int) + natural((60, 80), len(frames)) // 16, 0, 255).astype(np.uint8)
    spikes = compare(frames, fps, PRESETS[preset])
    assert len(spikes) > 0.9 * len(frames)
    assert max(spikes) > 0


@pytest.mark.parametrize("n_p", range(5))
def test_numbers_of_persistent_frames(n_p):
    params = LGMDParams(n_p=n_p, u=0.7)
    assert kernels.supports(params) == (n_p <= 2)
    compare(natural((20, 33), 12), 30.0, params)


def test_residue_makes_the_product_of_the_paths_count():
    shape, frames = (20, 33), natural((20, 33), 15)
    product = LGMDParams(on_off_residue=0.4, t_f=math.inf)
    no_product = LGMDParams(on_off_residue=0.4, t_f=math.inf, theta_3=0)
    compare(frames, 30.0, product)
    a, b = LGMD(shape, params=product), LGMD(shape, params=no_product)
    for frame in frames:
        a.step(frame)
        b.step(frame)
    assert (a.layers["S"] - b.layers["S"]).max() > 1


@pytest.mark.parametrize("kind", KINDS)
def test_fast_and_general_kernel_agree(kind):
    # A residue of 1e-30 selects the general kernel without any other effect.
    fast, general = LGMDParams(), LGMDParams(on_off_residue=1e-30)
    assert kernels.supports(fast)
    assert not kernels.supports(general)
    frames = KINDS[kind]((37, 51), 20)
    a, b = LGMD((37, 51), params=fast), LGMD((37, 51), params=general)
    for frame in frames:
        np.testing.assert_allclose(np.array(a.step(frame), float), np.array(b.step(frame), float), atol=1e-4)
        for name, image in a.layers.items():
            np.testing.assert_allclose(image, b.layers[name], atol=2e-3, err_msg=name)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("kind", KINDS)
def test_layers_equal_those_of_the_reference(preset, kind):
    shape = (21, 37)
    neuron, reference = LGMD(shape, params=PRESETS[preset]), ReferenceLGMD(shape, params=PRESETS[preset])
    for frame in KINDS[kind](shape, 20):
        neuron.step(frame)
        reference.step(frame)
        layers = neuron.layers
        assert list(layers) == ["P", "E", "I", "S", "G"]
        for name, image in layers.items():
            assert image.dtype == np.float32
            assert image.shape == shape
            np.testing.assert_allclose(image, reference.layers[name], atol=2e-3, err_msg=name)


def test_k_follows_from_the_mean_of_layer_g():
    neuron = LGMD((40, 50))
    for frame in looming((40, 50), 30):
        k = neuron.step(frame).membrane_potential
        assert 1 / (1 + np.exp(-neuron.layers["G"].mean())) == pytest.approx(k, abs=1e-4)


@pytest.mark.parametrize("preset", PRESETS)
def test_mask_equals_masked_frames_over_fewer_pixels(preset):
    shape, rng = (30, 41), np.random.default_rng(0)
    mask = np.zeros(shape)
    mask[4:22, 11:36] = rng.random((18, 25)).round(1)
    for frames in (looming(shape, 30), random(shape, 5), natural(shape, 10)):
        compare(frames, 30.0, PRESETS[preset], mask)


@pytest.mark.parametrize("warm_start", [False, True])
@pytest.mark.parametrize("delay", ["recursive", "two-tap"])
@pytest.mark.parametrize("residue", [0.0, 0.5])
def test_masks_with_every_structure_of_the_paths(residue, delay, warm_start):
    rng = np.random.default_rng(0)
    params = LGMDParams(on_off_residue=residue, delay=delay, warm_start=warm_start, sigma_1=3.0, sigma_3=10.0)
    for top, left, height, width in [(0, 0, 9, 11), (3, 4, 1, 1), (2, 5, 4, 3), (0, 9, 9, 2), (1, 1, 7, 9)]:
        mask = np.zeros((9, 11))
        mask[top : top + height, left : left + width] = 1
        frames = rng.integers(0, 256, (8, 9, 11)).astype(np.uint8)
        frames[1::3] = rng.integers(0, 256, (3, 1, 1))
        compare(frames, 30.0, params, mask)
        neuron = LGMD((9, 11), params=params, roi=(top, left, height, width))
        reference = ReferenceLGMD((9, 11), params=params, mask=mask)
        for frame in frames:
            neuron.step(frame)
            reference.step(frame)
        for name, image in neuron.layers.items():
            np.testing.assert_allclose(image, reference.layers[name], rtol=1e-4, atol=1e-2, err_msg=name)


def test_region_at_the_edge_replicates_the_border_of_the_frame():
    mask = np.zeros((20, 30))
    mask[:9, 21:] = 1
    compare(grating((20, 30), 20, period_px=9), 30.0, LGMDParams(warm_start=False), mask)


def test_float_frames_equal_the_same_uint8_frames():
    frames = natural((30, 45), 15)
    a, b, c = LGMD((30, 45)), LGMD((30, 45)), LGMD((30, 45))
    for i, frame in enumerate(frames):
        expected = a.step(frame)
        assert b.step(frame.astype(np.float64)) == expected
        assert c.step(frame.astype(np.float32) if i % 3 == 1 else frame) == expected


def test_decaying_maps_reach_zero_without_denormal_numbers():
    neuron = LGMD((20, 33))
    frames = random((20, 33), 3)
    for frame in frames:
        neuron.step(frame)
    for _ in range(1500):
        neuron.step(frames[-1])
    for values in neuron._maps[:2]:
        assert not ((values != 0) & (abs(values) < np.finfo(np.float32).tiny)).any()
    assert not neuron.layers["I"].any()


@pytest.mark.parametrize("width", [33, 48])
def test_rows_without_change_are_left_out_to_the_same_bits(width):
    """Rows change at different times, at the borders and alone, decay, and change again."""
    rng, frame = np.random.default_rng(0), natural((20, width), 1)[0]
    neuron, every = LGMD((20, width)), LGMD((20, width))
    *_, rows = neuron._maps
    still = []
    for number in range(1200):
        frame = frame.copy()
        moving = rng.choice(20, 2) if number % 500 < 20 else []
        frame[moving] = rng.integers(0, 256, (len(moving), width))
        every._maps[-1][:, kernels._DELAYED] = 1  # leaves out a 16th of the rows at most
        assert neuron.step(frame) == every.step(frame)
        for name, image in neuron.layers.items():
            np.testing.assert_array_equal(image, every.layers[name], err_msg=name)
        still.append((rows[0, kernels._DELAYED] == 0).sum())
    assert still[0] == 20  # the first frame changes nothing
    assert 0 < still[5] < 20
    assert still[499] == still[999] == 20
    assert still[520] < 20


@pytest.mark.parametrize("change", [1.0, 1e-3])
def test_the_weakest_change_of_a_still_view_counts(change):
    still = np.full((9, 20), 100.0, np.float32)
    touched = still.copy()
    touched[4, 10] += change
    neuron = LGMD((9, 20))
    for _ in range(3):
        neuron.step(still)
    assert not neuron.layers["S"].any()
    neuron.step(touched)
    *_, rows = neuron._maps
    assert (rows[0, kernels._DELAYED] != 0).nonzero()[0].tolist() == [3, 4, 5]
    assert neuron.layers["S"][4, 10] == pytest.approx(change, rel=0.5)
