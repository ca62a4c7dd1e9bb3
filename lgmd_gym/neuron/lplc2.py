"""LPLC2: a looming detector of the fly, which compares motion along four directions."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.neuron import lplc2_kernels
from lgmd_gym.neuron.frame_neuron import Layer
from lgmd_gym.neuron.lplc2_params import LPLC2Params
from lgmd_gym.neuron.motion_neuron import MotionNeuron
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.registry import register


class LPLC2(MotionNeuron):
    """One or N arrays of radial motion detectors, stepped frame by frame.

    LPLC2 neurons of the fly respond to motion outwards along all four arms of their dendrites, and are
    inhibited by motion inwards (Klapoetke et al. 2017): an object that approaches on a constant bearing
    excites them, the flow of a background that moves one way does not. This model is a minimal one, after
    the product of four directions of Hua et al. (2022) and the shallow networks of Zhou et al. (2022):

    1. h(t) = L(t) - M(t-1), M(t) = M(t-1) + β h(t), β = dt / (dt + `tau_mean_ms`): change of the light L
       against its mean M.
    2. A = max(h, 0), B = max(-h, 0): ON and OFF.
    3. A'(t) = A'(t-1) + α (A(t) - A'(t-1)), α = dt / (dt + `tau_delay_ms`), and B' likewise: delayed.
    4. c = A'₁(t-1) A₂(t) - A₁(t) A'₂(t-1) + B'₁(t-1) B₂(t) - B₁(t) B'₂(t-1) for a pixel 1 and the next one 2,
       to the right or below: the correlator of Hassenstein and Reichardt. Motion m = sign(c) `√|c|`.
    5. For a unit: means of m over the 2 R × R pixels on its left, right, upper and lower side, R =
       `radius_px`, with the sign that makes motion outwards positive, rectified: l, r, u, d.
    6. Response (l r u d)^¼, or (l r)^½ without `vertical` arms. The output is that of the strongest unit.
    7. K = 1 / (1 + exp(-response / `sigma`)); adaptation, spikes and spike frequency are those of the LGMD
       (`LGMDParams`, eq. 11 and 12), so that both models have the same outputs.

    In `Response`, `ffi` is the mean of `|m|` to the left and right [grey levels]; `inhibition_weight` and
    `excitation_latency` are 0.

    Args:
        shape: (height, width) of the frames, at least 2 `radius_px` each [px].
        fps: Frame rate [Hz].
        params: Parameters of the model, or a mapping of them; None for the defaults.
        num: Number of arrays N, each with its own frames; None for a single one with scalar outputs.
        spikes: Parameters of the adaptation and the spikes; None for those of the paper.
        threads: Number of threads that share the arrays of a step; None or 1 for the calling thread only.

    Raises:
        ValueError: For an argument out of range.
        TypeError: For an argument of another type.

    Example:
        >>> import numpy as np
        >>> detector = LPLC2((32, 80), fps=30.0)
        >>> detector.step(np.zeros((32, 80), np.uint8)).membrane_potential
        0.5
    """

    _past = slice(3, 5)  # delayed ON and OFF
    _shown: ClassVar = {
        "right": Layer("motion to the right", 32.0, signed=True),
        "down": Layer("motion downwards", 32.0, signed=True),
        "units": Layer("responses of the units", 8.0),
    }

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: LPLC2Params | Mapping[str, Any] | None = None,
        num: int | None = None,
        *,
        spikes: NeuronSpec = None,
        threads: int | None = None,
    ) -> None:
        self.params = p = LPLC2Params.make(params)
        super().__init__(shape, fps, num, threads, p, spikes)
        if 2 * p.radius_px > min(self.shape):
            raise ValueError(
                f"radius_px must be at most half of the smaller side of the frame {self.shape}, got "
                f"{p.radius_px}; use a radius of {min(self.shape) // 2} or larger frames"
            )
        self._sizes = np.array([p.radius_px, p.stride_px, p.vertical], np.int64)
        height, width = self.shape
        grid = tuple((side - 2 * p.radius_px) // p.stride_px + 1 for side in self.shape)
        self._maps = (
            *(np.zeros((self._count, height, width), np.float32) for _ in range(7)),
            np.zeros((self._count, *grid), np.float32),
            np.zeros((self._count, 2, height + 1, width + 1)),
        )

    def step_range(self, first: int, last: int, frames: NDArray[Any], active: NDArray[np.bool_]) -> None:
        """Step the active arrays among first..last-1; see `FrameNeuron.step_range`."""
        lplc2_kernels.step(
            first, last, frames, active, self._scalars, self._const, self._gains, self._sizes, *self._maps
        )

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Maps of the last frame: `right` and `down`, the motion m [grey levels], and `units`, the responses.

        New arrays of shape (H, W), that of `units` (rows, columns), with N in front for N arrays.
        """
        maps = dict(zip(("right", "down", "units"), self._maps[5:8], strict=True))
        return {name: (values[0] if self.num is None else values).copy() for name, values in maps.items()}


def _make(shape: tuple[int, int], fps: float, num: int, params: LGMDParams) -> LPLC2:
    return LPLC2(shape, fps, num=num, spikes=params)


register("lplc2", _make, takes_params=True)
