"""LGMD: the public stateful stepper on the kernels."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.neuron import general_kernel as general
from lgmd_gym.neuron import kernels
from lgmd_gym.neuron import state as layout
from lgmd_gym.neuron.params import LGMDParams
from lgmd_gym.neuron.response import Response
from lgmd_gym.neuron.scalars import RESPONSE, constants, resting
from lgmd_gym.neuron.threads import Threads
from lgmd_gym.neuron.validation import (
    checked_fps,
    checked_frames,
    checked_num,
    checked_params,
    checked_region,
    checked_shape,
    checked_threads,
)

_UINT8 = np.dtype(np.uint8)


class LGMD:
    """One locust looming neuron, or N of them, that answers frame by frame.

    The first frame has no predecessor: it changes nothing and fires nothing. A step starts no thread
    unless `threads` asks for it.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frames per second; the answer depends on it (spikes a frame are not scaled by dt).
        params: The model's parameters; None takes the paper's.
        num: Number of neurons N, each with a frame of its own; None for a single one with plain answers.
        mask: Weight of each pixel in [0, 1], shape (height, width), such as from `danger_zone`; F and K
            are means over the pixels of weight above 0. The neuron sees nothing else.
        roi: (top, left, height, width) [px], the same as a mask of 1 in that rectangle and 0 elsewhere.
        threads: Threads that share the neurons of one step; None or 1 runs in the calling thread.

    Attributes:
        shape: (height, width) of the frames [px].
        fps: Frames per second.
        params: The model's parameters.
        num: Number of neurons, None for a single one.

    Raises:
        ValueError: For a value out of bounds, naming it and the mend.

    Example:
        >>> neuron = LGMD((90, 160))
        >>> neuron.step(np.zeros((90, 160), np.uint8)).spikes
        0
    """

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: LGMDParams | None = None,
        num: int | None = None,
        *,
        mask: ArrayLike | None = None,
        roi: tuple[int, int, int, int] | None = None,
        threads: int | None = None,
    ) -> None:
        self.shape = checked_shape(shape)
        self.fps = checked_fps(fps)
        self.params = checked_params(params)
        self.num = checked_num(num)
        self._threads = Threads(checked_threads(threads))
        self._count = 1 if self.num is None else self.num
        self._frames_shape = self.shape if self.num is None else (self.num, *self.shape)
        self._all_active = np.ones(self._count, np.bool_)

        self._y0, self._x0, region, self._weight, n_pixels = checked_region(self.shape, mask, roi)
        self._par = constants(self.params, self.fps, n_pixels)
        self._rest = resting(self.params)
        self._rows = np.tile(self._rest, (self._count, 1))
        self._prev = np.zeros((self._count, *region), np.uint8)
        self._fast = kernels.supports(self.params)
        if self._fast:
            self._maps = layout.allocate(self._count, region)
        else:
            self._maps = general.allocate(
                self._count, region, self.params.n_p, 2 if self.params.on_off else 1
            )

    def step(self, frame: ArrayLike, active: ArrayLike | None = None) -> Response:
        """Answer one frame.

        Args:
            frame: Grey luminance in 0-255, uint8 or float, shape (H, W), or (N, H, W) from N neurons. Row
                0 is the top. It is not kept; any memory layout works, contiguous uint8 is not copied.
            active: Which of the N neurons see their frame, shape (N,), bool. The others keep their state,
                answer as before, and their frames are not looked at. None steps all.

        Returns:
            The answer: plain numbers from a single neuron, fresh arrays of shape (N,) from N.

        Raises:
            ValueError: For a frame of another shape, with NaN or infinite pixels, or scaled to 0-1.
            TypeError: For a frame of another dtype.
        """
        chosen = self._all_active if active is None else self._checked_active(active, "active")
        if type(frame) is not np.ndarray or (
            frame.dtype is not _UINT8 or frame.shape != self._frames_shape or not frame.flags.c_contiguous
        ):
            frame = checked_frames(frame, self._frames_shape, None if active is None else chosen)
        if frame.dtype != self._prev.dtype:
            frame = self._as_float(frame)
        frames = frame[None] if self.num is None else frame
        state = (self._prev, self._y0, self._x0, self._weight, chosen, self._rows, self._par, *self._maps)
        kernel = kernels.step if self._fast else general.step
        if self._threads.count == 1:
            kernel(0, self._count, frames, *state)
        else:
            self._threads.run(kernel, self._count, (frames, *state))
        return self._response()

    def reset(self, mask: ArrayLike | None = None) -> None:
        """Forget every frame.

        Args:
            mask: Which of the N neurons forget, shape (N,), bool; None for all.
        """
        chosen = self._all_active if mask is None else self._checked_active(mask, "mask")
        self._rows[chosen] = self._rest
        for maps in self._maps:
            maps[chosen] = 0

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """The maps of the last frame, float32, shape (H, W), or (N, H, W) from N neurons; fresh copies.

        P, E (`|P|` by path), I (of the path that P excites: ON where P >= 0), S and G as in the
        equations of `LGMDParams`; all 0 before the first change and outside the mask.
        """
        read = layout.layers if self._fast else general.layers
        maps = read(self._rows, self._par, *self._maps)
        h, w = self._prev.shape[1:]
        whole = {}
        for name, region in maps.items():
            image = np.zeros((self._count, *self.shape), np.float32)
            image[:, self._y0 : self._y0 + h, self._x0 : self._x0 + w] = region[..., :w]
            whole[name] = image[0] if self.num is None else image
        return whole

    def _response(self) -> Response:
        """Read the answer out of the scalars."""
        if self.num is None:
            frequency, spikes, k, k_hat, f, w, latency, alert = self._rows[0, RESPONSE].tolist()
            return Response(frequency, int(spikes), k, k_hat, f, w, latency, alert > 0.0)
        frequency, spikes, k, k_hat, f, w, latency, alert = self._rows[:, RESPONSE].T.copy()
        return Response(frequency, spikes.astype(np.int64), k, k_hat, f, w, latency, alert > 0.0)

    def _as_float(self, frame: NDArray) -> NDArray[np.float32]:
        """Go over to float frames for good: from the first one on, luminance is held as float32."""
        self._prev = self._prev.astype(np.float32, copy=False)
        return frame.astype(np.float32, copy=False)

    def _checked_active(self, which: ArrayLike, name: str) -> NDArray[np.bool_]:
        """Return a choice of neurons as a bool array of shape (N,)."""
        chosen = np.asarray(which)
        if chosen.dtype != np.bool_ or chosen.shape != (self._count,):
            given = f"{name} of dtype {chosen.dtype} and shape {chosen.shape}"
            raise ValueError(f"{given} must be bool of shape ({self._count},)")
        return np.ascontiguousarray(chosen)

    def __repr__(self) -> str:
        return f"LGMD(shape={self.shape}, fps={self.fps:g}, num={self.num})"
