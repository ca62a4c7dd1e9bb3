"""The float32 kernels, fast and general, against the float64 reference."""

import math

import numpy as np
import pytest
from golden.sequences import KINDS, grating, looming, natural, random

from lgmd_gym.neuron import LGMD, LGMDParams, kernels
from lgmd_gym.neuron.reference import ReferenceLGMD

PRESETS = {
    "default": LGMDParams(),
    "released": LGMDParams.released(),
    "fixed_inhibition": LGMDParams.fixed_inhibition(),
    "off_only": LGMDParams.off_only(),
    "yue_rind2006": LGMDParams.yue_rind2006(),
}
CLOSE = 1e-4


class Watched(ReferenceLGMD):
    """A reference that knows where float32 may rightly decide otherwise: at the edge of a threshold.

    A pixel whose g lies within rounding of the grouping threshold may survive here and not there. It
    then moves K by up to g / (4 n sigma_3), which only large frames keep below 1e-4; so may a rise of K
    at t_sfa take the other branch of the adaptation.
    """

    slack = 0.0
    at_branch = False

    def grouping(self, s):
        p, kept = self.params, super().grouping(s)
        threshold = p.t_de / p.c_de
        below = np.where(kept == 0, threshold - _ungrouped(s, p), np.inf)
        above = np.where(kept > 0, kept - threshold, np.inf)
        doubtful = np.count_nonzero(np.minimum(below, above) < 1e-3)
        self.slack += doubtful * threshold / (4 * self.n * p.sigma_3)
        return kept

    def fire(self, k_sum, f, w):
        before = self.k
        answer = super().fire(k_sum, f, w)
        rise = answer.membrane_potential - before
        self.at_branch |= abs(rise - self.params.t_sfa) < 2 * CLOSE and math.isfinite(self.params.tau_s)
        return answer


def _ungrouped(s, p):
    """G of the grouping layer ahead of its threshold, another way round than the reference."""
    padded = np.pad(s, 1, mode="edge")
    local = np.lib.stride_tricks.sliding_window_view(padded, (3, 3)).mean((2, 3))
    return s * local / (p.delta_c + abs(local).max() / p.c_w)


def spike_edge_distance(k_hat, params):
    """How far K_hat lies from where one spike more or less would fall."""
    level = math.exp(params.sigma_4 * (k_hat - params.t_sp))
    edges = [
        params.t_sp + math.log(m) / params.sigma_4 for m in (math.floor(level), math.ceil(level)) if m > 0
    ]
    return min(abs(k_hat - edge) for edge in edges)


def compare(frames, fps, params, mask=None):
    """Hold the neuron against the reference; return the spikes of the frames that could be compared."""
    shape = frames.shape[1:]
    neuron, reference = LGMD(shape, fps, params, mask=mask), Watched(shape, fps, params, mask)
    spikes = []
    for i, frame in enumerate(frames):
        ours, theirs = neuron.step(frame), reference.step(frame)
        assert ours.ffi == pytest.approx(theirs.ffi, rel=1e-5, abs=1e-5), i
        assert ours.inhibition_weight == pytest.approx(theirs.inhibition_weight, rel=1e-5)
        assert ours.excitation_latency == pytest.approx(theirs.excitation_latency, rel=1e-4, abs=1e-5)
        assert abs(ours.membrane_potential - theirs.membrane_potential) <= CLOSE + reference.slack, i
        if not reference.at_branch and reference.slack == 0:
            assert abs(ours.adapted_potential - theirs.adapted_potential) <= CLOSE, i
            if spike_edge_distance(theirs.adapted_potential, params) > CLOSE:
                assert ours.spikes == theirs.spikes, i
                spikes.append(ours.spikes)
    return spikes


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (7, 5), (33, 47), (16, 32)])
def test_small_frames_in_every_preset(preset, kind, shape):
    compare(KINDS[kind](shape, 30), 30.0, PRESETS[preset])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", [(334, 380), (270, 540)])
def test_large_odd_frames(kind, shape):
    compare(KINDS[kind](shape, 10), 30.0, LGMDParams())


@pytest.mark.parametrize("fps", [15.0, 18.0, 30.0, 60.0])
@pytest.mark.parametrize("preset", PRESETS)
def test_frame_rates_on_a_looming_object_that_fires(fps, preset):
    frames = looming((60, 80), int(fps * 1.5))
    frames = np.clip(frames.astype(int) + natural((60, 80), len(frames)) // 16, 0, 255).astype(np.uint8)
    spikes = compare(frames, fps, PRESETS[preset])
    assert len(spikes) > 0.9 * len(frames)
    assert max(spikes) > 0


@pytest.mark.parametrize("n_p", range(5))
def test_any_number_of_persistent_frames(n_p):
    params = LGMDParams(n_p=n_p, u=0.7)
    assert kernels.supports(params) == (n_p <= 2)
    compare(natural((20, 33), 12), 30.0, params)


def test_with_a_residue_both_paths_are_awake_and_their_product_counts():
    shape, frames = (20, 33), natural((20, 33), 15)
    product = LGMDParams(on_off_residue=0.4, t_f=math.inf)
    none = LGMDParams(on_off_residue=0.4, t_f=math.inf, theta_3=0)
    compare(frames, 30.0, product)
    a, b = LGMD(shape, params=product), LGMD(shape, params=none)
    for frame in frames:
        a.step(frame)
        b.step(frame)
    assert (a.layers["S"] - b.layers["S"]).max() > 1


@pytest.mark.parametrize("kind", KINDS)
def test_the_fast_and_the_general_kernel_agree(kind):
    # A residue of 1e-30 changes nothing but the kernel that is chosen.
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
def test_layers_are_the_references(preset, kind):
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


def test_the_sum_over_the_layer_g_is_what_k_says():
    neuron = LGMD((40, 50))
    for frame in looming((40, 50), 30):
        k = neuron.step(frame).membrane_potential
        assert 1 / (1 + np.exp(-neuron.layers["G"].mean())) == pytest.approx(k, abs=1e-4)


@pytest.mark.parametrize("preset", PRESETS)
def test_a_mask_equals_masked_frames_over_fewer_pixels(preset):
    shape, rng = (30, 41), np.random.default_rng(0)
    mask = np.zeros(shape)
    mask[4:22, 11:36] = rng.random((18, 25)).round(1)
    for frames in (looming(shape, 30), random(shape, 5), natural(shape, 10)):
        compare(frames, 30.0, PRESETS[preset], mask)


def test_a_region_at_the_edge_replicates_as_the_frame_does():
    mask = np.zeros((20, 30))
    mask[:9, 21:] = 1
    compare(grating((20, 30), 20, period_px=9), 30.0, LGMDParams(warm_start=False), mask)


def test_float_frames_answer_as_the_same_bytes():
    frames = natural((30, 45), 15)
    a, b, c = LGMD((30, 45)), LGMD((30, 45)), LGMD((30, 45))
    for i, frame in enumerate(frames):
        answer = a.step(frame)
        assert b.step(frame.astype(np.float64)) == answer
        assert c.step(frame.astype(np.float32) if i % 3 == 1 else frame) == answer


def test_what_decays_ends_at_zero_not_among_denormal_numbers():
    neuron = LGMD((20, 33))
    frames = random((20, 33), 3)
    for frame in frames:
        neuron.step(frame)
    for _ in range(1500):
        neuron.step(frames[-1])
    for maps in neuron._maps[:2]:
        assert not ((maps != 0) & (abs(maps) < np.finfo(np.float32).tiny)).any()
    assert not neuron.layers["I"].any()
