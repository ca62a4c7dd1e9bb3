"""FrameNeuron: base class of the neuron models, with steps of one or N neurons."""

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.errors import check_whole
from lgmd_gym.kernels.threads import Threads
from lgmd_gym.neuron.lgmd.params import LGMDParams
from lgmd_gym.neuron.maps import column_potentials
from lgmd_gym.neuron.scalars import RESPONSE
from lgmd_gym.neuron.validation import (
    Frames,
    checked_fps,
    checked_frames,
    checked_num,
    checked_selection,
    checked_shape,
    checked_threads,
    checked_turns,
)

_UINT8 = np.dtype(np.uint8)
_ROUNDING = 1.0001  # float32 sums may slightly exceed the bound of exact arithmetic


class Signal(NamedTuple):
    """Declaration of an output of a neuron.

    Attributes:
        low: Lower bound.
        high: Upper bound.
        unit: Unit; empty for none.
    """

    low: float
    high: float
    unit: str = ""


class Layer(NamedTuple):
    """Declaration of a map of a neuron in pictures.

    Attributes:
        label: Text below the picture.
        full: Value of full brightness.
        signed: Whether the sign is drawn.
    """

    label: str
    full: float
    signed: bool = False


Map: TypeAlias = NDArray[Any]  # float32 unless stated otherwise
Output: TypeAlias = Any  # Python scalar of a single neuron, array of shape (N,) of several


class Response(NamedTuple):
    """Outputs of a neuron for one frame: Python scalars, or arrays of shape (N,) for N neurons.

    Equation numbers are those of Fu et al. (AIAI 2019).

    Attributes:
        spike_frequency: Spikes of the last n_ts frames per second [spikes/s] (eq. 12); float or float64.
        spikes: Number of spikes of this frame (eq. 11); int or int64.
        membrane_potential: K in [0.5, 1] (eq. 10), k_0 before the first change; float or float64.
        adapted_potential: K̂, which is K after spike frequency adaptation; float or float64.
        ffi: Feed-forward inhibition F̂, low-passed mean of `|P|` [grey levels] (eq. 2); float or float64.
        inhibition_weight: w, the weight of I in S (eq. 9); float or float64.
        excitation_latency: τ̂_g, the time constant of G [ms] (eq. 9); float or float64.
        alert: Whether `spike_frequency` >= t_sf ("Coll" in eq. 12); bool.
    """

    spike_frequency: Output
    spikes: Output
    membrane_potential: Output
    adapted_potential: Output
    ffi: Output
    inhibition_weight: Output
    excitation_latency: Output
    alert: Output


class FrameNeuron:
    """One or N neurons of a model, stepped frame by frame.

    Subclasses set `_initial`, `_scalars` and `_maps`, implement `step_range`, `shift_range`, `layers` and
    `signals`, and set `_shown`; those with columns implement `column_map`.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        num: Number of neurons N, each with its own frames; None for a single neuron with scalar outputs.
        threads: Number of threads that share the neurons of a step; None or 1 for the calling thread only.
    """

    _shown: ClassVar[Mapping[str, Layer]] = {}  # `shown_layers`
    _initial: NDArray[np.float64]  # scalar state before the first frame
    _scalars: NDArray[np.float64]  # scalar state of each neuron
    _maps: tuple[Map, ...]  # state of each neuron that is 0 before the first frame

    def __init__(self, shape: tuple[int, int], fps: float, num: int | None, threads: int | None) -> None:
        self.shape = checked_shape(shape)
        self.fps = checked_fps(fps)
        self.num = checked_num(num, self.shape)
        self._threads = Threads(checked_threads(threads))
        self._count = 1 if self.num is None else self.num
        self._frames_shape = self.shape if self.num is None else (self.num, *self.shape)
        self._frames_dtype: np.dtype[np.uint8 | np.float32] = _UINT8
        self._all_active = np.ones(self._count, np.bool_)

    def step(
        self, frame: ArrayLike, active: ArrayLike | None = None, turn_px: ArrayLike | None = None
    ) -> Response:
        """Process one frame per neuron.

        Args:
            frame: Grey luminance in 0-255, uint8 or float, shape (H, W), or (N, H, W) for N neurons; row 0
                is the top. Any memory layout is accepted; contiguous uint8 arrays are not copied.
            active: Selection of the neurons to step, bool, shape (N,); None for all. The other neurons
                keep their state and their last outputs, and their frames are ignored.
            turn_px: Whole pixels by which the view has turned to the right since the last frame, int or
                shape (N,). The state is shifted to the left by as many, so that the turn causes no change.

        Returns:
            Python scalars for a single neuron, new arrays of shape (N,) for N neurons.

        Raises:
            ValueError: For a frame of another shape, with values that are not luminance in 0-255, or a turn
                that is not whole.
            TypeError: For a frame of another dtype.
        """
        selected = self._all_active if active is None else checked_selection("active", active, self._count)
        if type(frame) is not np.ndarray or (
            frame.dtype is not _UINT8 or frame.shape != self._frames_shape or not frame.flags.c_contiguous
        ):
            frame = checked_frames(frame, self._frames_shape, None if active is None else selected)
        if frame.dtype != self._frames_dtype:
            self._use_floats()
            frame = frame.astype(np.float32, copy=False)
        frames = frame[None] if self.num is None else frame
        if turn_px is not None:
            self.shift_range(0, self._count, frames, selected, checked_turns(turn_px, self._count))
        if self._threads.count == 1:
            self.step_range(0, self._count, frames, selected)
        else:
            self._threads.run(self.step_range, self._count, (frames, selected))
        return self._response()

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active neurons among first..last-1, without a check of the arguments.

        Threads may step disjoint ranges at once.

        Args:
            first: First neuron.
            last: Last neuron + 1.
            frames: Frames of all N neurons, contiguous uint8, shape (N, H, W).
            active: Selection of the neurons to step, bool, shape (N,).
        """
        raise NotImplementedError

    def shift_range(
        self,
        first: int,
        last: int,
        frames: Frames,
        active: NDArray[np.bool_],
        turns_px: NDArray[np.int64],
    ) -> None:
        """Shift the state of active neurons among first..last-1 before a step, without a check.

        Args:
            first: First neuron.
            last: Last neuron + 1.
            frames: Frames of the next step, see `step_range`.
            active: Selection of the neurons, bool, shape (N,).
            turns_px: Pixels by which each view has turned to the right, int64, shape (N,).
        """
        raise NotImplementedError

    def column_potentials(self, columns: int) -> NDArray[np.float64]:
        """Return the potentials of vertical strips of the last frame, `columns` of equal width.

        A column has the excitation of its own pixels only, as means over its pixels: G in an LGMD (eq. 9 and
        10), the motion m in a `DSN`. The mean excitation of all columns is that of the neuron.

        Args:
            columns: Number of columns; divides the width of the frames.

        Returns:
            K of each column in [0, 1], left to right; 0.5 before the first change. New array, shape
            (columns,), or (N, columns) for N neurons.

        Raises:
            ValueError: If the columns do not divide the width, or the model has none, or has a mask.
        """
        if self.shape[1] % check_whole("columns", columns, 1, self.shape[1]):
            raise ValueError(f"columns must divide the width of {self.shape[1]} px, got {columns}")
        out = np.empty((self._count, columns))
        self.read_columns(0, self._count, self._all_active, out)
        return out[0] if self.num is None else out

    def read_columns(
        self, first: int, last: int, active: NDArray[np.bool_], out: NDArray[np.float64]
    ) -> None:
        """Write `column_potentials` of the active neurons among first..last-1, without a check.

        Args:
            first: First neuron.
            last: Last neuron + 1.
            active: Selection of the neurons, bool, shape (N,).
            out: Output, float64, shape (N, columns).
        """
        maps, sigma = self.column_map()
        # No copy of the maps of this package; a model of your own may return a view.
        maps = np.ascontiguousarray(maps, np.float32)
        column_potentials(first, last, active, maps, self.shape[1], sigma, out)

    def column_map(self) -> tuple[NDArray[np.float32], float]:
        """Return the map of the columns, shape (N, H, at least W), and the mean at which K is 0.73.

        Raises:
            ValueError: If the model has no columns, or has a mask.
        """
        raise ValueError(f"{type(self).__name__} has no columns; use a model that has, such as lgmd")

    @property
    def signals(self) -> dict[str, Signal]:
        """Bounds and units of the outputs that observations have."""
        raise NotImplementedError

    @property
    def shown_layers(self) -> Mapping[str, Layer]:
        """Those of `layers` that pictures show, by name, in the order of display."""
        return self._shown

    def make_single(self) -> None:
        """Make a batch of one neuron a single neuron with scalar outputs."""
        self.num, self._frames_shape = None, self.shape

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
        """Maps of the last frame by name; new arrays of shape (H, W), or (N, H, W) for N neurons."""
        raise NotImplementedError

    def _response(self) -> Response:
        if self.num is None:
            frequency, spikes, k, k_hat, f, w, latency, alert = self._scalars[0, RESPONSE].tolist()
            spikes = int(spikes)
        else:
            frequency, spikes, k, k_hat, f, w, latency, alert = self._scalars[:, RESPONSE].T.copy()
            spikes = spikes.astype(np.int64)
        return Response(
            spike_frequency=frequency,
            spikes=spikes,
            membrane_potential=k,
            adapted_potential=k_hat,
            ffi=f,
            inhibition_weight=w,
            excitation_latency=latency,
            alert=alert > 0.0,
        )

    def _use_floats(self) -> None:
        """Process frames as float32 from now on: a frame of another dtype than uint8 was given."""
        self._frames_dtype = np.dtype(np.float32)

    def __repr__(self) -> str:
        return f"{type(self).__name__}(shape={self.shape}, fps={self.fps:g}, num={self.num})"


def spiking_signals(params: LGMDParams, fps: float, lowest: float, strongest: float) -> dict[str, Signal]:
    """Return the signals of a model with the spikes of the LGMD.

    Args:
        params: Parameters of the spikes.
        fps: Frame rate [Hz].
        lowest: Lower bound of K after the first change.
        strongest: Upper bound of `ffi` in exact arithmetic [grey levels].
    """
    return {
        "spike_frequency": Signal(0.0, params.max_spike_frequency(fps), "spikes/s"),
        "membrane_potential": Signal(min(params.k_0, lowest), 1.0),
        "ffi": Signal(0.0, strongest * _ROUNDING, "grey levels"),
    }
