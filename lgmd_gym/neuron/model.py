"""LGMD: the stateful neuron."""

from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.neuron import general_kernel, kernels, state
from lgmd_gym.neuron.params import LGMDParams, NeuronSpec
from lgmd_gym.neuron.response import Response
from lgmd_gym.neuron.scalars import RESPONSE, initial_scalars, pack_constants
from lgmd_gym.neuron.threads import Threads
from lgmd_gym.neuron.validation import (
    checked_fps,
    checked_frames,
    checked_num,
    checked_region,
    checked_selection,
    checked_shape,
    checked_threads,
)

_UINT8 = np.dtype(np.uint8)


class LGMD:
    """One or N locust looming neurons, stepped frame by frame.

    The first frame has no predecessor, so it causes no change and no spikes. A step starts no thread unless
    `threads` is given.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz]. Outputs depend on it, because spikes per frame do not scale with the frame
            interval.
        params: Parameters of the model, or a mapping of them; None for the defaults, those of the paper.
        num: Number of neurons N, each with its own frames; None for a single neuron with scalar outputs.
        mask: Pixel weights in [0, 1], shape (height, width), for example from `danger_zone`. F and K are
            means over the pixels with a weight > 0. Other pixels have no effect.
        roi: Region of interest (top, left, height, width) [px]; equals a mask of 1 inside and 0 outside.
        threads: Number of threads that share the neurons of a step; None or 1 for the calling thread only.

    Attributes:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters of the model.
        num: Number of neurons; None for a single neuron.

    Raises:
        ValueError: For an argument out of range.
        TypeError: For an argument of another type.

    Example:
        >>> import numpy as np
        >>> neuron = LGMD((90, 160), fps=30.0)
        >>> neuron.step(np.zeros((90, 160), np.uint8)).spikes
        0
    """

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: NeuronSpec = None,
        num: int | None = None,
        *,
        mask: ArrayLike | None = None,
        roi: tuple[int, int, int, int] | None = None,
        threads: int | None = None,
    ) -> None:
        self.shape = checked_shape(shape)
        self.fps = checked_fps(fps)
        self.params = LGMDParams.make(params)
        self.num = checked_num(num, self.shape)
        self._threads = Threads(checked_threads(threads))
        self._count = 1 if self.num is None else self.num
        self._frames_shape = self.shape if self.num is None else (self.num, *self.shape)
        self._all_active = np.ones(self._count, np.bool_)

        # I and Ce reach one pixel beyond the mask. A signed S is not 0 there, so its Ce reaches two pixels.
        margin = 1 if self.params.on_off else 2
        region = checked_region(self.shape, mask, roi, margin)
        self._y0, self._x0, region_shape, self._weight, n_pixels = region
        self._const = pack_constants(self.params, self.fps, n_pixels)
        self._initial = initial_scalars(self.params)
        self._scalars = np.tile(self._initial, (self._count, 1))
        self._previous = np.zeros((self._count, *region_shape), np.uint8)
        self._fast = kernels.supports(self.params)
        if self._fast:
            self._maps: tuple[NDArray[Any], ...] = state.allocate(self._count, region_shape)
        else:
            paths = 2 if self.params.on_off else 1
            self._maps = general_kernel.allocate(self._count, region_shape, self.params.n_p, paths)

    def step(self, frame: ArrayLike, active: ArrayLike | None = None) -> Response:
        """Process one frame per neuron.

        Args:
            frame: Grey luminance in 0-255, uint8 or float, shape (H, W), or (N, H, W) for N neurons; row 0
                is the top. Any memory layout is accepted; contiguous uint8 arrays are not copied.
            active: Selection of the neurons to step, bool, shape (N,); None for all. The other neurons
                keep their state and their last outputs, and their frames are ignored.

        Returns:
            Python scalars for a single neuron, new arrays of shape (N,) for N neurons.

        Raises:
            ValueError: For a frame of another shape, or with values that are not luminance in 0-255.
            TypeError: For a frame of another dtype.
        """
        selected = self._all_active if active is None else checked_selection("active", active, self._count)
        if type(frame) is not np.ndarray or (
            frame.dtype is not _UINT8 or frame.shape != self._frames_shape or not frame.flags.c_contiguous
        ):
            frame = checked_frames(frame, self._frames_shape, None if active is None else selected)
        if frame.dtype != self._previous.dtype:
            frame = self._as_float(frame)
        frames = frame[None] if self.num is None else frame
        if self._threads.count == 1:
            self.step_range(0, self._count, frames, selected)
        else:
            self._threads.run(self.step_range, self._count, (frames, selected))
        return self._response()

    def step_range(self, first: int, last: int, frames: NDArray[Any], active: NDArray[np.bool_]) -> None:
        """Step the active neurons among first..last-1, without a check of the arguments.

        Threads may step disjoint ranges at once.

        Args:
            first: First neuron.
            last: Last neuron + 1.
            frames: Frames of all N neurons, contiguous uint8, shape (N, H, W).
            active: Selection of the neurons to step, bool, shape (N,).
        """
        kernel = cast(Any, kernels if self._fast else general_kernel).step
        kernel(
            first, last, frames, self._previous, self._y0, self._x0, self._weight, active, self._scalars,
            self._const, *self._maps,
        )  # fmt: skip

    @property
    def outputs(self) -> NDArray[np.float64]:
        """The scalar state; the first eight columns are the fields of `Response`, shape (N, at least 8)."""
        return self._scalars

    def reset(self, mask: ArrayLike | None = None) -> None:
        """Return to the state before the first frame.

        Args:
            mask: Selection of the neurons to reset, bool, shape (N,); None for all.
        """
        selected = self._all_active if mask is None else checked_selection("mask", mask, self._count)
        self._scalars[selected] = self._initial
        for values in self._maps:
            values[selected] = 0

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Maps P, E, I, S and G of the last frame; new arrays of shape (H, W), or (N, H, W) for N neurons.

        E is `|P|` by path, and I is that of the path which P excites (ON where P >= 0); see `LGMDParams` for
        the equations. All maps are 0 before the first change. Outside the mask, only I of adjacent pixels is
        not 0; without ON and OFF paths, their S and G are not 0 either.
        """
        read = cast(Any, state if self._fast else general_kernel).layers
        maps = read(self._scalars, self._const, *self._maps)
        h, w = self._previous.shape[1:]
        images: dict[str, NDArray[np.float32]] = {}
        for name, values in maps.items():
            image = np.zeros((self._count, *self.shape), np.float32)
            image[:, self._y0 : self._y0 + h, self._x0 : self._x0 + w] = values[..., :w]
            images[name] = image[0] if self.num is None else image
        return images

    def _response(self) -> Response:
        if self.num is None:
            frequency, spikes, k, k_hat, f, w, latency, alert = self._scalars[0, RESPONSE].tolist()
            return Response(frequency, int(spikes), k, k_hat, f, w, latency, alert > 0.0)
        frequency, spikes, k, k_hat, f, w, latency, alert = self._scalars[:, RESPONSE].T.copy()
        return Response(frequency, spikes.astype(np.int64), k, k_hat, f, w, latency, alert > 0.0)

    def _as_float(self, frame: NDArray[Any]) -> NDArray[np.float32]:
        """Return the frame as float32, and store luminance as float32 from now on."""
        self._previous = self._previous.astype(np.float32, copy=False)
        return frame.astype(np.float32, copy=False)

    def __repr__(self) -> str:
        return f"LGMD(shape={self.shape}, fps={self.fps:g}, num={self.num})"
