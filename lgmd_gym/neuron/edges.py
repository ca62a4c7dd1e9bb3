# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""SustainedEdges: a detector of edges that stand still in the frame."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.fields import number, record
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load_part, magnitude, splat, store_part, total
from lgmd_gym.neuron.base import Layer
from lgmd_gym.neuron.lgmd.params import NeuronSpec
from lgmd_gym.neuron.motion import ModelParams, MotionNeuron, register_model, start
from lgmd_gym.neuron.scalars import AGE, GAIN_G, LATENCY, F, W, fire
from lgmd_gym.neuron.validation import Frames


@record
class SustainedEdgesParams(ModelParams):
    """Parameters of `SustainedEdges`."""

    label = "SustainedEdges"
    tau_ms: float = number(200.0, "(0, inf)", "ms", "Time constant of the low-passed light.")
    sigma: float = number(2.0, "(0, inf)", "grey levels", "Mean edge strength at which K = 0.73.")

    def gains(self, fps: float) -> tuple[float]:
        """Return the gain dt / (dt + τ) of the low-passed light at a frame rate [Hz]."""
        dt = 1000.0 / fps
        return (dt / (dt + self.tau_ms),)


class SustainedEdges(MotionNeuron):
    """One or N detectors of edges that stand still in the frame, stepped frame by frame.

    An object on collision course keeps its bearing. Seen from a moving car, its edges therefore stand still
    while those of the background move and are blurred by a slow low-pass filter. The model is a minimal one
    of cells with a sustained (tonic) response:

    1. M(t) = M(t-1) + β (L(t) - M(t-1)), β = dt / (dt + `tau_ms`): low-passed light.
    2. e = abs(M(x + 1) - M(x)) of horizontal neighbours: vertical edges of the low-passed light.
    3. K = 1 / (1 + exp(-mean of e / `sigma`)), in [0.5, 1); adaptation, spikes and spike frequency are those
       of the LGMD (`LGMDParams`, eq. 11 and 12).

    In `Response`, `ffi` is the mean of e [grey levels]; `inhibition_weight` and `excitation_latency` are 0.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters of the model, or a mapping of them; None for the defaults.
        num: Number of detectors N, each with its own frames; None for a single one with scalar outputs.
        spikes: Parameters of the adaptation and the spikes; None for those of the paper.
        threads: Number of threads that share the detectors of a step; None or 1 for the calling thread only.

    Raises:
        ValueError: For an argument out of range.
        TypeError: For an argument of another type.

    Example:
        >>> import numpy as np
        >>> detector = SustainedEdges((32, 80), fps=30.0)
        >>> detector.step(np.zeros((32, 80), np.uint8)).membrane_potential
        0.5
    """

    _past = slice(0)  # none
    _shown: ClassVar = {
        "light": Layer("low-passed light", 255.0),
        "edges": Layer("sustained edges", 32.0),
    }

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: SustainedEdgesParams | Mapping[str, object] | None = None,
        num: int | None = None,
        *,
        spikes: NeuronSpec = None,
        threads: int | None = None,
    ) -> None:
        self.params = SustainedEdgesParams.make(params)
        super().__init__(shape, fps, num, threads, self.params, spikes)
        self._maps = tuple(np.zeros((self._count, *self.shape), np.float32) for _ in range(2))

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active detectors among first..last-1; see `FrameNeuron.step_range`."""
        _step(first, last, frames, active, self._scalars, self._const, self._gains[0], *self._maps)

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Maps `light`, M, and `edges`, e, of the last frame [grey levels]; new, (H, W) or (N, H, W)."""
        maps = dict(zip(("light", "edges"), self._maps, strict=True))
        return {name: (values[0] if self.num is None else values).copy() for name, values in maps.items()}

    def column_map(self) -> tuple[NDArray[np.float32], float]:
        """Return the map of the columns; see `FrameNeuron.column_map`."""
        return self._maps[1], self.params.sigma


@kernel(exact=True, arrays=True)
def _find_edges(frame, light, edges, gain):
    """Update the light and write the edges; return their sum."""
    height, width = light.shape
    rate, sums = splat(gain), 0.0
    for y in range(height):
        first, strength = y * width, splat(np.float32(0.0))
        for x in range(0, width, LANES):
            past = load_part(light, first + x, width - x)
            change = rate * (load_part(frame, first + x, width - x) - past)
            store_part(light, first + x, width - x, past + change)
        for x in range(0, width - 1, LANES):
            at, count = first + x, width - 1 - x
            edge = magnitude(load_part(light, at + 1, count) - load_part(light, at, count))
            store_part(edges, at, count, edge)
            strength = strength + edge
        sums += total(strength)
    return sums


@kernel(exact=True, arrays=True)
def _step(first, last, frames, active, scalars, const, gain, light, edges) -> None:
    """Step the active detectors among first..last-1.

    Args:
        first: First detector.
        last: Last detector + 1.
        frames: Frames, (N, H, W).
        active: Detectors to step, bool, (N,).
        scalars: Scalar state, see `scalars`, (N, ...).
        const: Constants of the stage of spikes, see `scalars.pack_constants`.
        gain: Gain of the low-passed light, float32.
        light: Low-passed light, float32, (N, H, W).
        edges: Edge strength, float32, (N, H, W); 0 in the last column.
    """
    height, width = frames.shape[1], frames.shape[2]
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[AGE] == 0.0:
            start(frames[n], light[n])
            row[AGE] = 1.0
            continue
        mean = _find_edges(frames[n], light[n], edges[n], gain) / (height * width)
        row[F], row[W], row[LATENCY], row[GAIN_G] = mean, 0.0, 0.0, 1.0
        fire(row, const, mean)


register_model(
    "edges", SustainedEdges, SustainedEdgesParams, "Detector of edges that stand still in the frame."
)
