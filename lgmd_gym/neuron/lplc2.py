# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""LPLC2: a looming detector of the fly, which compares motion along four directions."""

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.fields import flag, record, whole
from lgmd_gym.kernels import kernel
from lgmd_gym.neuron.base import Layer
from lgmd_gym.neuron.lgmd.params import NeuronSpec
from lgmd_gym.neuron.motion import (
    MotionNeuron,
    MotionParams,
    detect_motion_down,
    detect_motion_right,
    filter_light,
    register_model,
    start,
    update_delay,
)
from lgmd_gym.neuron.scalars import AGE, GAIN_G, LATENCY, F, W, fire
from lgmd_gym.neuron.validation import Frames


@record
class LPLC2Params(MotionParams):
    """Parameters of the LPLC2 model; see `LPLC2` for the equations."""

    label = "LPLC2"
    radius_px: int = whole(
        8, "[1, inf)", "px", "Length of the four arms of a unit, at most half of the smaller side of a frame."
    )
    stride_px: int = whole(4, "[1, inf)", "px", "Distance of neighbouring units.")
    vertical: bool = flag(
        True, "Whether a unit requires motion along all four arms; if False, it has the left and right one."
    )


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
        params: LPLC2Params | Mapping[str, object] | None = None,
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

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active arrays among first..last-1; see `FrameNeuron.step_range`."""
        _step(first, last, frames, active, self._scalars, self._const, self._gains, self._sizes, *self._maps)

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Maps of the last frame: `right` and `down`, the motion m [grey levels], and `units`, the responses.

        New arrays of shape (H, W), that of `units` (rows, columns), with N in front for N arrays.
        """
        maps = dict(zip(("right", "down", "units"), self._maps[5:8], strict=True))
        return {name: (values[0] if self.num is None else values).copy() for name, values in maps.items()}


@kernel(exact=True, arrays=True)
def _integrate(image, table):
    """Write the sums of all rectangles from the top left corner, shape (height + 1, width + 1)."""
    for y in range(image.shape[0]):
        row = 0.0
        for x in range(image.shape[1]):
            row += image[y, x]
            table[y + 1, x + 1] = table[y, x + 1] + row


@kernel(exact=True, inline=True, arrays=True)
def _box(table, y0, x0, y1, x1):
    """Return the sum over rows y0..y1-1 and columns x0..x1-1."""
    return table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0]


@kernel(exact=True, arrays=True)
def _strongest_unit(across, along, radius, stride, vertical, units):
    """Write the response of every unit (eq. 5 and 6) and return the largest one."""
    area, best = 2.0 * radius * radius, 0.0
    for i in range(units.shape[0]):
        y = radius + i * stride
        for j in range(units.shape[1]):
            x = radius + j * stride
            low, high, left, right = y - radius, y + radius, x - radius, x + radius
            response = max(-_box(across, low, left, high, x) / area, 0.0)
            response *= max(_box(across, low, x, high, right) / area, 0.0)
            if vertical:
                response *= max(-_box(along, low, left, y, right) / area, 0.0)
                response *= max(_box(along, y, left, high, right) / area, 0.0)
                response = math.sqrt(response)
            units[i, j] = math.sqrt(response)
            best = max(best, units[i, j])
    return best


@kernel(exact=True, arrays=True)
def _step(
    first, last, frames, active, scalars, const, gains, sizes, mean, on, off, late_on, late_off, right, down,
    units, tables,
) -> None:  # fmt: skip
    """Step the active neurons among first..last-1.

    Args:
        first: First neuron.
        last: Last neuron + 1.
        frames: Frames, (N, H, W).
        active: Neurons to step, bool, (N,).
        scalars: Scalar state, see `scalars`, (N, ...).
        const: Constants of the stage of spikes, see `scalars.pack_constants`.
        gains: Gains of the mean light and of the delay, float32, (2,).
        sizes: Radius, stride, and whether units have vertical arms, int64, (3,).
        mean: Mean light; this and the next six are float32, (N, H, W).
        on: ON of the last frame.
        off: OFF of the last frame.
        late_on: Delayed ON.
        late_off: Delayed OFF.
        right: Motion to the right.
        down: Motion downwards.
        units: Responses of the units, float32, (N, rows, columns).
        tables: Sums of both motions, float64, (N, 2, H + 1, W + 1); the first row and column are 0.
    """
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[AGE] == 0.0:
            start(frames[n], mean[n])
            row[AGE] = 1.0
            continue
        filter_light(frames[n], mean[n], on[n], off[n], gains[0])
        _, total = detect_motion_right(on[n], off[n], late_on[n], late_off[n], right[n])
        detect_motion_down(on[n], off[n], late_on[n], late_off[n], down[n])
        update_delay(on[n], off[n], late_on[n], late_off[n], gains[1])
        across, along = tables[n, 0], tables[n, 1]
        _integrate(right[n], across)
        if sizes[2] != 0:
            _integrate(down[n], along)
        response = _strongest_unit(across, along, sizes[0], sizes[1], sizes[2] != 0, units[n])
        row[F], row[W], row[LATENCY], row[GAIN_G] = total / (mean.shape[1] * mean.shape[2]), 0.0, 0.0, 1.0
        fire(row, const, response)


register_model("lplc2", LPLC2, LPLC2Params, "Looming detector of the fly, radial motion along four arms.")
