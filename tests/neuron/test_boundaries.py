"""Scalar part of a step at its thresholds: every expected value is computed by hand."""

from math import exp, inf

import numpy as np
import pytest

from lgmd_gym.neuron import LGMDParams, Response
from lgmd_gym.neuron import scalars as sc
from lgmd_gym.neuron.lgmd.reference import ReferenceLGMD

FPS = 40.0  # 25 ms per frame
PIXELS = 10


def neuron(**fields):
    """Return the state and the constants of a neuron of ten pixels."""
    params = LGMDParams(**fields)
    return sc.initial_scalars(params), sc.pack_constants(params, FPS, PIXELS)


def sum_for(k, sigma_3=1.0):
    """Return the sum of g at which the membrane potential is k, without latency."""
    return -PIXELS * sigma_3 * np.log(1 / k - 1)


def test_constants_by_hand():
    params = LGMDParams(
        n_p=1, u=0.5, tau_1=15.0, tau_2=(25.0, 75.0, 100.0), weights=(1.5, 0.5, 0.25), theta_1=2.0,
        theta_2=3.0, theta_3=4.0, c_w=5.0, delta_c=0.5, c_de=0.25, t_de=10.0, t_f=30.0, sigma_1=0.75,
        sigma_2=0.125, tau_g=35.0, sigma_3=1.25, tau_s=100.0, t_sfa=0.0625, sigma_4=6.0, t_sp=0.625, n_ts=4,
        t_sf=45.0, t_ffi=55.0, on_off_residue=0.375, delay="two-tap", latency="jump",
        spikes_from="membrane", extra_frame=True,
    )  # fmt: skip
    const = sc.pack_constants(params, FPS, PIXELS)
    expected = {
        "N_PIXELS": 10, "GAIN_F": 25 / 40, "T_F": 30, "SIGMA_1": 0.75, "SIGMA_2": 0.125, "TAU_G": 35,
        "DT": 25, "SIGMA_3": 1.25, "KEEP": 0.8, "T_SFA": 0.0625, "SIGMA_4": 6, "T_SP": 0.625, "N_TS": 4,
        "RATE": 40, "T_SF": 45, "T_FFI": 55, "LATENCY_JUMPS": 1, "WARM_START": 1,
        "DELTA_C": 0.5, "C_W": 5, "T_G": 40, "THETA_1": 2, "THETA_2": 3, "THETA_3": 4,
        "RESIDUE": 0.375, "TWO_TAP": 1, "N_P": 1, "FROM_K": 1, "WINDOW": 5, "GAIN_2": 0.5, "WEIGHT": 1.5,
        "TAP": 1 / (1 + exp(0.5)),
    }  # fmt: skip
    assert {name: const[getattr(sc, name)] for name in expected} == pytest.approx(expected)
    assert const[sc.GAIN_2 : sc.GAIN_2 + 3] == pytest.approx([0.5, 0.25, 0.2])
    assert const[sc.WEIGHT : sc.WEIGHT + 3].tolist() == [1.5, 0.5, 0.25]
    assert len(const) == sc.TAP + 1


def test_constants_of_other_options():
    _, const = neuron(delay="recursive", latency="clamp", warm_start=False, tau_s=0.0)
    assert const[[sc.TWO_TAP, sc.LATENCY_JUMPS, sc.WARM_START, sc.KEEP]].tolist() == [0.0] * 4
    assert neuron(tau_s=inf)[1][sc.KEEP] == 1.0
    # Whole milliseconds: 23 ms at 42 Hz.
    const = sc.pack_constants(LGMDParams(whole_ms=True), 42.0, PIXELS)
    assert (const[sc.DT], const[sc.RATE]) == (23.0, pytest.approx(1000 / 23))


def test_state_before_the_first_frame():
    assert slice(0, len(Response._fields)) == sc.RESPONSE
    row, _ = neuron(k_0=0.25, sigma_1=0.75, tau_g=35.0, n_ts=4)
    assert row.tolist() == [0, 0, 0.25, 0.25, 0, 0.75, 35.0, *[0] * 10]


def feed(row, const, *means):
    """Feed means of |P| and return F, w and the latency after the last one."""
    for mean in means:
        sc.feed_forward(row, const, float(mean * PIXELS))
        row[sc.AGE] += 1
    return row[sc.F], row[sc.W], row[sc.LATENCY]


def test_feed_forward_inhibition_is_a_low_pass_that_starts_at_its_first_input():
    gain = 25 / (25 + 15)
    row, const = neuron(tau_1=15.0)
    row[sc.AGE] = 1.0  # the first difference is in the second frame
    assert feed(row, const, 8.0)[0] == 8.0
    assert feed(row, const, 16.0)[0] == pytest.approx(8 + gain * 8)
    row, const = neuron(tau_1=15.0, warm_start=False)
    row[sc.AGE] = 1.0
    assert feed(row, const, 8.0)[0] == pytest.approx(gain * 8)
    row, const = neuron(tau_1=15.0)
    assert feed(row, const, 8.0)[0] == pytest.approx(gain * 8)  # the frame before


def test_feed_forward_inhibition_without_a_filter():
    row, const = neuron(tau_1=0.0)
    assert feed(row, const, 8.0, 16.0)[0] == 16.0


@pytest.mark.parametrize(
    ("rule", "f", "weight", "latency"),
    [
        # t_f = 20, sigma_1 = 0.5, sigma_2 = 0.25, tau_g = 40 ms.
        ("clamp", 0.0, 0.5, 40.0),
        ("clamp", 5.0, 0.5, 30.0),
        ("clamp", 10.0, 0.5, 20.0),
        ("clamp", 12.0, 0.6, 16.0),
        ("clamp", 15.0, 0.75, 10.0),
        ("clamp", 16.0, 0.8, 10.0),  # limited to sigma_2
        ("clamp", 40.0, 2.0, 10.0),
        ("jump", 16.0, 0.8, 8.0),
        ("jump", 20.0, 1.0, 0.0),
        ("jump", 20.5, 1.025, 10.0),
    ],
)
def test_inhibition_weight_and_latency(rule, f, weight, latency):
    row, const = neuron(tau_1=0.0, sigma_2=0.25, tau_g=40.0, latency=rule)
    assert feed(row, const, f) == pytest.approx((f, weight, latency))
    assert row[sc.GAIN_G] == pytest.approx(25 / (25 + latency))


def excite(row, const, total, gain=1.0, f=0.0):
    row[sc.GAIN_G], row[sc.F] = gain, f
    sc.fire(row, const, float(total))


def test_membrane_potential_is_a_logistic_function_of_the_low_pass():
    row, const = neuron(sigma_3=2.0, tau_s=inf)
    excite(row, const, 40.0, gain=0.5)
    assert row[sc.K] == pytest.approx(1 / (1 + exp(-20 / 20)))
    excite(row, const, 40.0, gain=0.5)
    assert row[sc.K] == pytest.approx(1 / (1 + exp(-30 / 20)))


@pytest.mark.parametrize(("f", "silent"), [(9.999, False), (10.0, True), (10.001, True)])
def test_feed_forward_inhibition_silences_the_cell_from_its_threshold_on(f, silent):
    row, const = neuron(t_ffi=10.0)
    excite(row, const, 10.0, f=f)
    assert row[sc.K] == (0.5 if silent else pytest.approx(1 / (1 + exp(-1))))


@pytest.mark.parametrize(("f", "silent"), [(9.0, False), (10.0, True)])
def test_reference_is_silenced_at_the_same_threshold(f, silent):
    frames = np.zeros((2, 4, 4))
    frames[1] = f
    reference = ReferenceLGMD((4, 4), 30.0, LGMDParams(t_ffi=10.0, t_de=0.0, weights=(0.0, 0.0, 0.0)))
    potential = [reference.step(frame).membrane_potential for frame in frames][1]
    assert (potential == 0.5) is silent


@pytest.mark.parametrize(
    ("rise", "adapts"), [(0.03125 - 1e-9, True), (0.03125 + 1e-9, False), (0.25, False), (-0.125, True)]
)
def test_adaptation_ends_above_its_threshold(rise, adapts):
    """K before is 0.5625 and its adapted value 0.75; KEEP is 1/(1 + 25/75)."""
    row, const = neuron(t_sfa=0.03125, tau_s=75.0)
    row[sc.K], row[sc.K_HAT] = 0.5625, 0.75
    assert const[sc.KEEP] == 0.75
    excite(row, const, sum_for(0.5625 + rise))
    k = row[sc.K]
    assert k == pytest.approx(0.5625 + rise)
    adapted = 0.75 * (0.75 + (k - 0.5625)) if adapts else 0.75 * k
    assert row[sc.K_HAT] == pytest.approx(max(0.5, adapted), abs=1e-12)


def test_adaptation_at_exactly_its_threshold():
    """The silenced cell has K = 0.5 exactly; from 0.46875 this is a rise of t_sfa."""
    for before, adapted in (
        (0.46875, 0.75 * (0.875 + 0.03125)),
        (0.4687, 0.5),
        (0.469, 0.75 * (0.875 + 0.031)),
    ):
        row, const = neuron(t_sfa=0.03125, tau_s=75.0, t_ffi=1.0)
        row[sc.K], row[sc.K_HAT] = before, 0.875
        excite(row, const, 0.0, f=1.0)
        assert (row[sc.K], row[sc.K_HAT]) == (0.5, pytest.approx(adapted))


def test_adapted_potential_is_at_least_one_half():
    row, const = neuron(tau_s=75.0, t_ffi=1.0)
    row[sc.K_HAT] = 0.625
    excite(row, const, 0.0, f=1.0)
    assert row[sc.K_HAT] == 0.5  # 0.75 · 0.625 is less


@pytest.mark.parametrize(("t_sp", "spikes"), [(0.5001, 0), (0.5, 1), (0.25, 12), (0.0, 148)])
def test_spikes_of_a_frame(t_sp, spikes):
    row, const = neuron(t_sp=t_sp, sigma_4=10.0)
    excite(row, const, 0.0)
    assert row[sc.SPIKES] == spikes


def test_spike_frequency_counts_the_last_frames():
    row, const = neuron(n_ts=3, t_sf=40.0, t_sp=0.5, t_ffi=1.0)
    seen = []
    for spikes in (1, 1, 0, 1, 0, 0, 0):
        const[sc.T_SP] = 0.5 if spikes else 0.6
        excite(row, const, 0.0, f=1.0)
        seen.append((row[sc.SPIKES], row[sc.FREQUENCY], row[sc.ALERT]))
    counts = (1, 2, 2, 2, 1, 1, 0)  # of three frames; each spike is 40/3 per second
    assert [frequency for _, frequency, _ in seen] == pytest.approx([40 * count / 3 for count in counts])
    assert [spikes for spikes, _, _ in seen] == [1, 1, 0, 1, 0, 0, 0]
    assert row[sc.AGE] == 7


def test_an_extra_frame_counts_with_the_divisor_of_the_others():
    row, const = neuron(n_ts=3, extra_frame=True, t_sp=0.5, t_ffi=1.0)
    seen = []
    for _ in range(5):
        excite(row, const, 0.0, f=1.0)
        seen.append(row[sc.FREQUENCY])
    assert seen == pytest.approx([40 * count / 3 for count in (1, 2, 3, 4, 4)])


@pytest.mark.parametrize(("source", "spikes"), [("adapted", 0.0), ("membrane", 3.0)])
def test_spikes_follow_from_the_adapted_or_the_membrane_potential(source, spikes):
    row, const = neuron(spikes_from=source, t_sp=0.68, sigma_4=10.0, tau_s=25.0, t_sfa=0.0)  # K is halved
    excite(row, const, sum_for(0.8))
    assert (row[sc.K], row[sc.SPIKES]) == (pytest.approx(0.8), spikes)


@pytest.mark.parametrize(("t_sf", "alert"), [(39.999, 1.0), (40.0, 1.0), (40.001, 0.0)])
def test_alert_at_its_threshold(t_sf, alert):
    row, const = neuron(n_ts=1, t_sf=t_sf, t_sp=0.5)
    excite(row, const, 0.0)
    assert (row[sc.FREQUENCY], row[sc.ALERT]) == (40.0, alert)
