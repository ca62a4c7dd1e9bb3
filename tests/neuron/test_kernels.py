"""The float32 kernels, fast and general, compared with the float64 reference."""

import math

import numpy as np
import pytest
from golden.sequences import KINDS, grating, looming, natural, random
from support.neurons import PRESETS

from lgmd_gym.neuron import LGMD, LGMDParams, kernels
from lgmd_gym.neuron.reference import ReferenceLGMD

CLOSE = 1e-4


class MarginReference(ReferenceLGMD):
    """A reference that records where float32 rounding may change a decision at a threshold.

    A pixel whose g is within rounding of the grouping threshold may pass in one model only. It changes K by
    up to g / (4 n sigma_3), which is below 1e-4 only for large frames. Similarly, a rise of K close to t_sfa
    may take the other branch of the adaptation.

    Attributes:
        slack: Accumulated tolerance of K.
        at_branch: Whether a rise of K has been close to t_sfa.
    """

    slack = 0.0
    at_branch = False

    def grouping(self, s):
        p, g = self.params, super().grouping(s)
        threshold = p.t_de / p.c_de
        below = np.where(g == 0, threshold - _g_before_threshold(s, p), np.inf)
        above = np.where(g > 0, g - threshold, np.inf)
        ambiguous = np.count_nonzero(np.minimum(below, above) < 1e-3)
        self.slack += ambiguous * threshold / (4 * self.n * p.sigma_3)
        return g

    def fire(self, k_sum, f, w):
        before = self.k
        response = super().fire(k_sum, f, w)
        rise = response.membrane_potential - before
        self.at_branch |= abs(rise - self.params.t_sfa) < 2 * CLOSE and math.isfinite(self.params.tau_s)
        return response


def _g_before_threshold(s, p):
    """Return g before its threshold, computed in a different way than in the reference."""
    padded = np.pad(s, 1, mode="edge")
    local = np.lib.stride_tricks.sliding_window_view(padded, (3, 3)).mean((2, 3))
    return s * local / (p.delta_c + abs(local).max() / p.c_w)


def spike_edge_distance(k_hat, params):
    """Return the distance of K_hat from the nearest change of the number of spikes."""
    level = math.exp(params.sigma_4 * (k_hat - params.t_sp))
    edges = [
        params.t_sp + math.log(m) / params.sigma_4 for m in (math.floor(level), math.ceil(level)) if m > 0
    ]
    return min(abs(k_hat - edge) for edge in edges)


def compare(frames, fps, params, mask=None):
    """Compare the neuron with the reference; return the spikes of the frames that can be compared."""
    shape = frames.shape[1:]
    neuron, reference = LGMD(shape, fps, params, mask=mask), MarginReference(shape, fps, params, mask)
    spikes = []
    for i, frame in enumerate(frames):
        got, expected = neuron.step(frame), reference.step(frame)
        assert got.ffi == pytest.approx(expected.ffi, rel=1e-5, abs=1e-5), i
        assert got.inhibition_weight == pytest.approx(expected.inhibition_weight, rel=1e-5)
        assert got.excitation_latency == pytest.approx(expected.excitation_latency, rel=1e-4, abs=1e-5)
        assert abs(got.membrane_potential - expected.membrane_potential) <= CLOSE + reference.slack, i
        if not reference.at_branch and reference.slack == 0:
            assert abs(got.adapted_potential - expected.adapted_potential) <= CLOSE, i
            if spike_edge_distance(expected.adapted_potential, params) > CLOSE:
                assert got.spikes == expected.spikes, i
                spikes.append(got.spikes)
    return spikes


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
@pytest.mark.parametrize("on_off", [False, True])
def test_masks_with_every_structure_of_the_paths(on_off, residue, delay, warm_start):
    """Without ON and OFF paths, S is negative beside the mask, and the residue has no effect."""
    rng = np.random.default_rng(0)
    params = LGMDParams(
        on_off=on_off, on_off_residue=residue, delay=delay, warm_start=warm_start, sigma_1=3.0, sigma_3=10.0
    )
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
