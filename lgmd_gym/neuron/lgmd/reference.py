"""Reference model: the LGMD equations in float64 NumPy, one after the other, for tests."""

import math

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.neuron.base import Response
from lgmd_gym.neuron.lgmd.params import LGMDParams

Map = NDArray[np.float64]


def neighbourhood(image: Map) -> tuple[Map, Map, Map]:
    """Return the centre, the sum of the 4 nearest and the sum of the 4 diagonal pixels of every pixel.

    Args:
        image: Map of shape (H, W); its edges are replicated.
    """
    p = np.pad(image, 1, mode="edge")
    nearest = p[:-2, 1:-1] + p[2:, 1:-1] + p[1:-1, :-2] + p[1:-1, 2:]
    diagonal = p[:-2, :-2] + p[:-2, 2:] + p[2:, :-2] + p[2:, 2:]
    return image, nearest, diagonal


class ReferenceLGMD:
    """One neuron that evaluates the equations of the paper in their order.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters of the model; None for the defaults.
        mask: Pixel weights in [0, 1], shape (H, W); None for 1.

    Attributes:
        layers: Maps P, E, I, S and G of the last frame, float64, shape (H, W); I is that of the path
            which P excites (ON where P >= 0, else OFF).
        g: Output of the grouping layer before the latency filter, shape (H, W).
    """

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: LGMDParams | None = None,
        mask: Map | None = None,
    ) -> None:
        self.params = LGMDParams() if params is None else params
        self.fps = fps
        self.dt = self.params.frame_interval_ms(fps)
        self.mask = np.ones(shape) if mask is None else np.asarray(mask, float)
        self.n = np.count_nonzero(self.mask)
        self.reset()

    def reset(self) -> None:
        """Return to the state before the first frame."""
        p, zeros = self.params, np.zeros(self.mask.shape)
        self.luminance: Map | None = None
        self.past_p = [zeros] * p.n_p
        self.paths = [zeros, zeros]
        self.delayed = [[zeros] * 3 for _ in self.paths]
        self.f_hat = 0.0
        self.first_change = True
        self.k = self.k_hat = p.k_0
        self.window = [0] * p.window
        self.g = zeros
        self.layers = dict.fromkeys("PEISG", zeros)

    def gain(self, tau: float) -> float:
        """Return the discrete gain of a first-order low-pass filter, dt / (dt + tau)."""
        return self.dt / (self.dt + tau)

    def step(self, frame: np.ndarray) -> Response:
        """Process one frame of luminance in 0-255, shape (H, W)."""
        p = self.params
        luminance = np.asarray(frame, float) * self.mask
        if self.luminance is None:
            self.luminance = luminance
            return self.response(0.0, 0, 0.0, p.sigma_1)
        photo = luminance - self.luminance  # eq. 1
        for a, past in zip(p.persistence, self.past_p, strict=True):
            photo = photo + a * past
        self.luminance = luminance
        self.past_p = [photo, *self.past_p][: p.n_p]

        f = self.feed_forward(photo)
        w = max(p.sigma_1, f / p.t_f)  # eq. 9
        s = self.summation(photo, w)
        self.g = self.grouping(s)
        gain_g = self.gain(self.latency(f))
        potential = self.layers["G"] + gain_g * (self.g - self.layers["G"])  # eq. 9
        self.layers |= {"P": photo, "S": s, "G": potential}
        self.first_change = False
        return self.fire(potential.sum(), f, w)

    def feed_forward(self, photo: Map) -> float:
        """Return F (eq. 2)."""
        p = self.params
        f = np.abs(photo).sum() / self.n
        start = p.warm_start and self.first_change
        self.f_hat = f if start else self.f_hat + self.gain(p.tau_1) * (f - self.f_hat)
        return self.f_hat

    def latency(self, f: float) -> float:
        """Return the time constant of G [ms] (eq. 9)."""
        p = self.params
        fraction = 1.0 - f / p.t_f
        if p.latency == "jump":
            return p.tau_g * (fraction if fraction >= 0.0 else p.sigma_2)
        return p.tau_g * max(p.sigma_2, fraction)

    def summation(self, photo: Map, w: float) -> Map:
        """Return S (eq. 3 to 8)."""
        p = self.params
        half_waves = np.maximum(photo, 0), np.maximum(-photo, 0)  # eq. 3
        last = self.paths
        self.paths = [now + p.on_off_residue * old for now, old in zip(half_waves, last, strict=True)]
        inhibition = [self.inhibition(i, last[i]) for i in range(2)]
        s_on, s_off = (np.maximum(0, e - w * i) for e, i in zip(self.paths, inhibition, strict=True))  # eq. 7
        self.layers |= {"E": sum(self.paths), "I": np.where(photo >= 0, *inhibition)}
        return p.theta_1 * s_on + p.theta_2 * s_off + p.theta_3 * s_on * s_off  # eq. 8

    def inhibition(self, path: int, last: Map) -> Map:
        """Return I of one path (eq. 4 to 6); `last` is E of that path in the last frame."""
        p = self.params
        now, total = self.paths[path], np.zeros_like(last)
        for ring, (tau, weight) in enumerate(zip(p.tau_2, p.weights, strict=True)):
            gain = self.gain(tau)
            old = last if p.delay == "two-tap" else self.delayed[path][ring]
            delayed = now if p.warm_start and self.first_change else old + gain * (now - old)
            self.delayed[path][ring] = delayed
            total = total + weight * neighbourhood(delayed)[ring]
        return total

    def grouping(self, s: Map) -> Map:
        """Return g, the output of the grouping layer of Yue & Rind (2006)."""
        p = self.params
        local = sum(neighbourhood(s)) / 9.0
        omega = p.delta_c + np.abs(local).max() / p.c_w
        g = s * local / omega
        return np.where(g * p.c_de >= p.t_de, g, 0.0)

    def fire(self, k_sum: float, f: float, w: float) -> Response:
        """Update K, its adaptation, spikes and frequency (eq. 10 to 12)."""
        p = self.params
        k = 1.0 / (1.0 + math.exp(-k_sum / (self.n * p.sigma_3)))
        if f >= p.t_ffi:
            k = 0.5
        rise, keep = k - self.k, 1.0 / (1.0 + self.dt / p.tau_s) if p.tau_s > 0 else 0.0
        self.k_hat = max(0.5, keep * (self.k_hat + rise if rise <= p.t_sfa else k))
        self.k = k
        potential = self.k_hat if p.spikes_from == "adapted" else self.k
        spikes = math.floor(math.exp(p.sigma_4 * (potential - p.t_sp)))
        self.window = [*self.window[1:], spikes]
        rate = 1000.0 / self.dt if p.whole_ms else self.fps
        return self.response(sum(self.window) * rate / p.n_ts, spikes, f, w)

    def response(self, frequency: float, spikes: int, f: float, w: float) -> Response:
        """Return the outputs of a frame."""
        return Response(
            spike_frequency=frequency,
            spikes=spikes,
            membrane_potential=self.k,
            adapted_potential=self.k_hat,
            ffi=f,
            inhibition_weight=w,
            excitation_latency=self.latency(f),
            alert=frequency >= self.params.t_sf,
        )
