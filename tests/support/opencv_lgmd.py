"""The LGMD equations with OpenCV filters on float32 maps, for comparison in the benchmark of the neuron.

`OpenCVLGMD` is a straightforward implementation with OpenCV filters and NumPy arithmetic. `TunedOpenCVLGMD`
allocates every map once and uses in-place OpenCV calls only. Both omit the product of the paths, which has no
effect, as the kernels do. OpenCV runs on one thread.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from lgmd_gym.neuron import LGMDParams

_NEAREST = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], np.float32)
_DIAGONAL = np.array([[1, 0, 1], [0, 0, 0], [1, 0, 1]], np.float32)
_BORDER = cv2.BORDER_REPLICATE


class OpenCVLGMD:
    """One neuron with the structure of the paper; `step` returns (K, spikes)."""

    def __init__(self, shape: tuple[int, int], fps: float = 30.0) -> None:
        cv2.setNumThreads(1)
        self.params, self.dt, self.n = LGMDParams(), 1000.0 / fps, shape[0] * shape[1]
        _, nearest, diagonal = self.params.weights
        self.kernels = [nearest * _NEAREST, diagonal * _DIAGONAL]
        self.last: NDArray | None = None
        self.p = self.p_1 = self.p_2 = self.filtered = np.zeros(shape, np.float32)
        self.delayed = np.zeros((2, 3, *shape), np.float32)
        self.f_hat, self.k, self.k_hat, self.warm = 0.0, 0.5, 0.5, True

    def gain(self, tau: float) -> float:
        """Return the gain of a first-order low-pass filter."""
        return self.dt / (self.dt + tau)

    def step(self, frame: NDArray[np.uint8]) -> tuple[float, int]:
        """Process one frame, uint8, shape (H, W)."""
        if self.last is None:
            self.last = frame.copy()
            return self.k, 0
        f = self._photoreceptors(frame)
        self.f_hat = f if self.warm else self.f_hat + self.gain(self.params.tau_1) * (f - self.f_hat)
        sum_g = self._summation(max(self.params.sigma_1, self.f_hat / self.params.t_f))
        self.warm = False
        return self._fire(sum_g)

    def _photoreceptors(self, frame: NDArray[np.uint8]) -> float:
        """Compute P and return the mean of |P|."""
        a_1, a_2 = self.params.persistence
        self.p_1, self.p_2 = self.p, self.p_1
        self.p = np.subtract(frame, self.last, dtype=np.float32) + a_1 * self.p_1 + a_2 * self.p_2
        self.last = frame.copy()
        return float(np.abs(self.p).mean())

    def _summation(self, w: float) -> float:
        """Compute S and G from P, and return the sum of G."""
        par, s = self.params, np.float32(0)
        on = np.maximum(self.p, 0)
        for e, delayed in zip((on, on - self.p), self.delayed, strict=True):
            for ring, tau in enumerate(par.tau_2):
                delayed[ring] += (1.0 if self.warm else self.gain(tau)) * (e - delayed[ring])
            nearest = cv2.filter2D(delayed[1], -1, self.kernels[0], borderType=_BORDER)
            diagonal = cv2.filter2D(delayed[2], -1, self.kernels[1], borderType=_BORDER)
            s = s + np.maximum(e - w * (delayed[0] + nearest + diagonal), 0)
        local = cv2.blur(s, (3, 3), borderType=_BORDER)
        g = s * local / (par.delta_c + float(local.max()) / par.c_w)
        g = np.where(g * par.c_de >= par.t_de, g, np.float32(0))
        self.filtered = self.filtered + self.latency_gain() * (g - self.filtered)
        return float(self.filtered.sum(dtype=np.float64))

    def latency_gain(self) -> float:
        """Return the gain of the latency filter of G."""
        return self.gain(self.params.tau_g * max(self.params.sigma_2, 1.0 - self.f_hat / self.params.t_f))

    def _fire(self, sum_g: float) -> tuple[float, int]:
        """Return K and the number of spikes."""
        par, keep = self.params, self.params.tau_s / (self.params.tau_s + self.dt)
        k = 1.0 / (1.0 + math.exp(-sum_g / (self.n * par.sigma_3)))
        rise = k - self.k
        self.k_hat = max(0.5, keep * (self.k_hat + rise if rise <= par.t_sfa else k))
        self.k = k
        return k, math.floor(math.exp(par.sigma_4 * (self.k_hat - par.t_sp)))


class TunedOpenCVLGMD(OpenCVLGMD):
    """`OpenCVLGMD` with in-place OpenCV calls and without allocations."""

    def __init__(self, shape: tuple[int, int], fps: float = 30.0) -> None:
        super().__init__(shape, fps)
        (
            self.p, self.p_1, self.p_2, self.on, self.off, self.i, self.ring, self.s, self.s_off, self.local,
            self.g, self.filtered, self.zero,
        ) = np.zeros((13, *shape), np.float32)  # fmt: skip

    def _photoreceptors(self, frame: NDArray[np.uint8]) -> float:
        a_1, a_2 = self.params.persistence
        self.p, self.p_1, self.p_2 = self.p_2, self.p, self.p_1
        # self.p holds the P of three frames ago, which is no longer needed.
        cv2.subtract(frame, self.last, dst=self.p, dtype=cv2.CV_32F)
        cv2.scaleAdd(self.p_1, a_1, self.p, dst=self.p)
        cv2.scaleAdd(self.p_2, a_2, self.p, dst=self.p)
        np.copyto(self.last, frame)
        return cv2.norm(self.p, cv2.NORM_L1) / self.n

    def _summation(self, w: float) -> float:
        par = self.params
        cv2.max(self.p, self.zero, dst=self.on)
        cv2.subtract(self.on, self.p, dst=self.off)
        self._path(self.on, self.delayed[0], self.s, w)
        self._path(self.off, self.delayed[1], self.s_off, w)
        cv2.add(self.s, self.s_off, dst=self.s)
        cv2.blur(self.s, (3, 3), dst=self.local, borderType=_BORDER)
        omega = par.delta_c + cv2.minMaxLoc(self.local)[1] / par.c_w
        cv2.multiply(self.s, self.local, dst=self.g, scale=1.0 / omega)
        cv2.threshold(self.g, par.t_de / par.c_de, 0.0, cv2.THRESH_TOZERO, dst=self.g)
        cv2.accumulateWeighted(self.g, self.filtered, self.latency_gain())
        return cv2.sumElems(self.filtered)[0]

    def _path(self, e: NDArray, delayed: NDArray, s: NDArray, w: float) -> None:
        """Compute S of one path."""
        for ring, tau in enumerate(self.params.tau_2):
            cv2.accumulateWeighted(e, delayed[ring], 1.0 if self.warm else self.gain(tau))
        cv2.filter2D(delayed[1], -1, self.kernels[0], dst=self.i, borderType=_BORDER)
        cv2.filter2D(delayed[2], -1, self.kernels[1], dst=self.ring, borderType=_BORDER)
        cv2.add(self.i, self.ring, dst=self.i)
        cv2.add(self.i, delayed[0], dst=self.i)
        cv2.scaleAdd(self.i, -w, e, dst=s)
        cv2.max(s, self.zero, dst=s)
