"""Presets, runs, references and moving frames that the tests of neurons share."""

import math

import numpy as np
import pytest

from lgmd_gym.neuron import LGMD, LGMDParams
from lgmd_gym.neuron.lgmd.reference import ReferenceLGMD

PRESETS = {
    "default": LGMDParams(),
    "literal": LGMDParams.literal(),
    "released": LGMDParams.released(),
    "fixed_inhibition": LGMDParams.fixed_inhibition(),
    "off_only": LGMDParams.off_only(),
}


def responses(frames, **options):
    """Return the responses of a new neuron to a sequence of frames, (count, H, W)."""
    neuron = LGMD(frames.shape[1:], **options)
    return [neuron.step(frame) for frame in frames]


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


def compare(frames, fps, params, mask=None, roi=None):
    """Compare the neuron with the reference; return the spikes of the frames that can be compared.

    With `roi`, the neuron gets the region of interest instead of the mask, which must equal it.
    """
    shape = frames.shape[1:]
    neuron = LGMD(shape, fps, params, mask=None if roi else mask, roi=roi)
    reference = MarginReference(shape, fps, params, mask)
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


def motion_maps(frames, params, fps=30.0):
    """Yield the motion to the right and downwards of each frame after the first one (eq. 1 to 4)."""
    frames = np.asarray(frames, float)
    dt = 1000.0 / fps
    beta, alpha = dt / (dt + params.tau_mean_ms), dt / (dt + params.tau_delay_ms)
    mean, late = frames[0].copy(), np.zeros((2, *frames[0].shape))
    for frame in frames[1:]:
        change = frame - mean
        mean += beta * change
        now = np.stack([np.maximum(change, 0.0), np.maximum(-change, 0.0)])
        right, down = np.zeros(frame.shape), np.zeros(frame.shape)
        right[:, :-1] = _correlation(late[:, :, :-1], now[:, :, 1:], now[:, :, :-1], late[:, :, 1:])
        down[:-1] = _correlation(late[:, :-1], now[:, 1:], now[:, :-1], late[:, 1:])
        late += alpha * (now - late)
        yield right, down


def _correlation(late_1, now_2, now_1, late_2):
    c = (late_1 * now_2 - now_1 * late_2).sum(0)
    return np.sign(c) * np.sqrt(np.abs(c))


def square(half, centre=(32.0, 20.0), shape=(40, 64), grey=40, background=180):
    """Return a frame with a square: half of its side and its centre (x, y) [px], with soft edges."""
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    inside = np.minimum(half - np.abs(x - centre[0]), half - np.abs(y - centre[1]))
    share = np.clip(inside + 0.5, 0.0, 1.0)
    return np.round(background + share * (grey - background)).astype(np.uint8)
