"""The float64 reference: equations evaluated by hand, and properties of the model."""

import math

import numpy as np
import pytest
from golden.sequences import grating, looming, natural

from lgmd_gym.neuron import LGMDParams
from lgmd_gym.neuron.lgmd.reference import ReferenceLGMD

GRATINGS = [(period, hz) for period in (12, 24, 48, 96, 190) for hz in (0.5, 1, 2, 4, 8, 14)]


def run(frames, params=None, fps=30.0):
    neuron = ReferenceLGMD(frames.shape[1:], fps, params)
    return [neuron.step(frame) for frame in frames], neuron


def pixels(*levels):
    return np.array(levels, float).reshape(-1, 1, 1)


def test_photoreceptor_by_hand():
    neuron = ReferenceLGMD((1, 1))
    p = []
    for frame in pixels(10, 110, 110, 60):
        neuron.step(frame)
        p.append(neuron.layers["P"][0, 0])
    a_1, a_2 = 1 / (1 + math.e), 1 / (1 + math.e**2)
    second = a_1 * 100
    assert p == pytest.approx([0, 100, second, -50 + a_1 * second + a_2 * 100])


def test_feed_forward_inhibition_by_hand():
    warm, _ = run(pixels(0, 100, 200), LGMDParams(n_p=0))
    gain = (1000 / 30) / (1000 / 30 + 10)
    assert warm[1].ffi == 100  # the filter starts at its first input
    cold, _ = run(pixels(0, 100, 200), LGMDParams(n_p=0, warm_start=False))
    assert [r.ffi for r in cold] == pytest.approx([0, 100 * gain, 100 * gain + gain * (100 - 100 * gain)])
    assert warm[1].inhibition_weight == 5.0
    assert warm[1].excitation_latency == pytest.approx(0.1)


def test_spread_of_inhibition_by_hand_with_replicated_edges():
    frame = np.zeros((5, 5))
    frame[2, 2], frame[0, 0] = 80, 16
    _, neuron = run(np.stack([0 * frame, frame]))
    spread = 80 * np.array([[0.125, 0.25, 0.125], [0.25, 1, 0.25], [0.125, 0.25, 0.125]])
    inhibition = neuron.layers["I"]
    assert inhibition[1:4, 1:4].ravel()[1:] == pytest.approx(spread.ravel()[1:])
    # Replication makes the corner its own upper, left and upper left neighbour.
    assert inhibition[0, 0] == pytest.approx(16 * (1 + 2 * 0.25 + 0.125))
    assert inhibition[1, 1] == pytest.approx(80 * 0.125 + 16 * 0.125)


def test_delays_by_hand():
    _, neuron = run(pixels(0, 90, 180), LGMDParams(n_p=0, warm_start=False, weights=(1, 0, 0)))
    gain = (1000 / 30) / (1000 / 30 + 60)
    assert neuron.layers["I"][0, 0] == pytest.approx(90 * gain + gain * (90 - 90 * gain))
    _, neuron = run(
        pixels(0, 90, 240), LGMDParams(n_p=0, warm_start=False, weights=(1, 0, 0), delay="two-tap")
    )
    assert neuron.layers["I"][0, 0] == pytest.approx(gain * 150 + (1 - gain) * 90)


def test_grouping_to_spikes_by_hand():
    # Only the centre inhibits and nothing adapts: S = 100 - 0.5 * 100 everywhere, Ce = 50.
    params = LGMDParams(n_p=0, weights=(1, 0, 0), t_f=math.inf, sigma_3=100)
    frames = np.zeros((2, 3, 4)) + np.array([0, 100])[:, None, None]
    (_, response), neuron = run(frames, params)
    g = 50 * 50 / (0.01 + 50 / 4)
    assert neuron.g == pytest.approx(np.full((3, 4), g))
    filtered = g * (1000 / 30) / (1000 / 30 + 10)
    k = 1 / (1 + math.exp(-filtered / 100))
    assert response.membrane_potential == pytest.approx(k)
    assert response.adapted_potential == pytest.approx(k * 500 / (500 + 1000 / 30))
    assert response.spikes == math.floor(math.exp(10 * (response.adapted_potential - 0.7))) == 2
    assert response.spike_frequency == 2 * 30 / 6


def test_adaptation_by_hand():
    neuron = ReferenceLGMD((1, 1), params=LGMDParams(t_sp=0.5))
    keep = 500 / (500 + 1000 / 30)

    def sum_for(k):
        return -math.log(1 / k - 1)

    neuron.fire(sum_for(0.9), 0, 0.5)  # a large rise: K_hat = s K
    assert neuron.k_hat == pytest.approx(keep * 0.9)
    neuron.fire(sum_for(0.902), 0, 0.5)  # a small rise adapts
    assert neuron.k_hat == pytest.approx(keep * (keep * 0.9 + 0.002))
    neuron.fire(sum_for(0.6), 0, 0.5)  # a fall lowers K_hat to its minimum
    assert neuron.k_hat == 0.5


def test_spikes_are_counted_over_six_frames():
    neuron = ReferenceLGMD((1, 1))
    frequencies = [neuron.fire(k, 0, 0.5).spike_frequency for k in (50, 0, 0, 0, 0, 0, 0)]
    assert frequencies == [50, 50, 50, 50, 50, 50, 0]


@pytest.mark.parametrize("tau", [10.0, 60.0])
def test_filters_reach_63_percent_at_their_time_constant(tau):
    # A ramp of luminance keeps P at 1; a time constant is 100 frames.
    frames = np.arange(102.0).reshape(-1, 1, 1)
    params = LGMDParams(n_p=0, warm_start=False, tau_1=tau, tau_2=(tau, 1, 1), weights=(1, 0, 0))
    outputs, neuron = run(frames, params, fps=1000 * 100 / tau)
    assert outputs[100].ffi == pytest.approx(1 - math.exp(-1), abs=0.005)
    assert neuron.layers["I"][0, 0] == pytest.approx(1 - math.exp(-1.01), abs=0.005)


def test_product_of_the_paths_has_no_effect():
    frames = natural((20, 30), 8)
    with_product, a = run(frames, LGMDParams(theta_3=1e6))
    without, b = run(frames, LGMDParams(theta_3=0))
    assert with_product == without
    assert a.layers["S"].max() > 1
    assert np.array_equal(a.layers["S"], b.layers["S"])


@pytest.mark.parametrize("flip", [lambda f: 255.0 - f, lambda f: f[..., ::-1], lambda f: f[:, ::-1]])
def test_polarity_and_mirror_symmetry(flip):
    frames = looming((30, 40), 25).astype(float) + natural((30, 40), 25) / 16
    original, flipped = run(frames)[0], run(flip(frames))[0]
    assert max(r.spikes for r in original) > 0
    np.testing.assert_allclose(np.array(original, float), np.array(flipped, float), rtol=1e-12, atol=1e-12)


def test_luminance_scaled_to_0_1_causes_no_excitation():
    frames = looming((30, 40), 25)
    assert max(r.membrane_potential for r in run(frames)[0]) > 0.7
    assert {r.membrane_potential for r in run(frames / 255)[0]} == {0.5}


def test_outlier_suppresses_weaker_regions():
    neuron, s = ReferenceLGMD((20, 20)), np.zeros((20, 20))
    s[2:8, 2:8] = 20
    alone = neuron.grouping(s)
    assert np.count_nonzero(alone) > 30
    assert alone[alone > 0].min() >= 30
    s[14:17, 14:17] = 200
    with_outlier = neuron.grouping(s)
    assert not with_outlier[:10, :10].any()
    assert with_outlier[15, 15] > 0


def test_fraction_of_pixels_needed_for_the_first_spike():
    assert 1 / (1 + math.exp(-0.847)) == pytest.approx(0.7, abs=1e-4)
    neuron = ReferenceLGMD((100, 100))
    assert neuron.fire(0.0283 * 100 * 100 * 30, 0, 0.5).membrane_potential >= 0.7


@pytest.mark.parametrize(
    ("fps", "spikes", "max_frequency"), [(5, 1, 5), (15, 6, 90), (18, 7, 126), (30, 10, 300), (60, 14, 840)]
)
def test_upper_bounds_of_spikes_and_frequency(fps, spikes, max_frequency):
    neuron = ReferenceLGMD((1, 1), fps)
    first = neuron.fire(100, 0, 0.5)
    assert first.adapted_potential == pytest.approx(500 / (500 + 1000 / fps))
    assert first.spikes == spikes
    for _ in range(5):
        neuron.k = 0.5  # a new rise in every frame keeps K_hat at its maximum
        last = neuron.fire(100, 0, 0.5)
    assert last.spike_frequency == max_frequency
    if fps == 30:
        assert first.spike_frequency == 50


def highest_potential_on_grating(period, hz, params=None):
    return max(r.membrane_potential for r in run(grating((4, 380), 30, period_px=period, hz=hz), params)[0])


def test_gratings_cause_no_excitation():
    assert [pair for pair in GRATINGS if highest_potential_on_grating(*pair) > 0.5] == []


def test_gratings_cause_excitation_without_adaptive_inhibition_or_without_warm_start():
    def highest(params):
        return max(highest_potential_on_grating(*pair, params) for pair in GRATINGS[::3])

    assert highest(LGMDParams(t_f=math.inf)) > 0.99
    assert highest(LGMDParams(warm_start=False)) > 0.5


def test_feed_forward_inhibition_silences_the_cell():
    frames = looming((30, 40), 25)
    without = run(frames, LGMDParams(t_f=math.inf))[0]
    silenced = run(frames, LGMDParams(t_f=math.inf, t_ffi=5.0))[0]
    above = [i for i, r in enumerate(without) if r.ffi >= 5.0 and r.membrane_potential > 0.5]
    assert above
    assert {silenced[i].membrane_potential for i in above} == {0.5}


def test_off_only_responds_to_dark_objects_only():
    def total(target):
        return sum(r.spikes for r in run(looming((30, 40), 25, target=target), LGMDParams.off_only())[0])

    assert total(40) > 0 == total(255)
