"""Event camera: simulated events of frames, recorded events, and the LGMD that processes them.

A pixel of an event camera (Lichtsteiner et al. 2008) sends an event when its log intensity differs from that
at its last event by a threshold C:

1. l = ln((L + `dark`) / (255 + `dark`)): log intensity of the light L; `dark` is the light below which the
   response becomes linear.
2. n = sign(l - m) min(⌊|l - m| / C⌋, max(⌊dt / `refractory_ms`⌋, 1)): events between two frames, + for
   brightening (ON). The refractory time limits their number; further crossings are lost.
3. m ← m + C sign(l - m) ⌊|l - m| / C⌋: memory of the pixel. It starts at the first light.
4. Noise: in addition, each pixel sends events of random polarity, as a Poisson process of `noise_hz`.

The photoreceptor layer of `EventLGMD` is driven by events: P(t) = `gain` n(t) + Σ a_i P(t-i), in place of the
change of light in equation 1 of `LGMDParams`. All further layers are those of the LGMD.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.aliases import Values
from lgmd_gym.errors import check_path, check_positive, check_size, check_whole
from lgmd_gym.fields import Record, number, record, whole
from lgmd_gym.neuron.lgmd.model import LGMD, register_variant
from lgmd_gym.neuron.lgmd.params import NeuronSpec
from lgmd_gym.neuron.validation import MAX_SIDE, Frames

Counts = NDArray[np.int32]  # signed numbers of events, shape (..., height, width)
_REST = 128  # light at which the kernel of the LGMD is fed; its change is that of the events


@record
class EventParams(Record):
    """Parameters of an event camera, and of the photoreceptors that it drives."""

    label = "events"
    threshold: float = number(0.2, "(0, inf)", "", "Change of log intensity per event, C.")
    dark: float = number(10.0, "(0, inf)", "grey levels", "Light below which the response becomes linear.")
    refractory_ms: float = number(1.0, "(0, inf)", "ms", "Least time between two events of a pixel.")
    noise_hz: float = number(0.0, "[0, 1000]", "1/s", "Noise events per pixel and second.")
    gain: float = number(20.0, "(0, 127]", "grey levels", "Excitation of P by one event.")
    seed: int = whole(0, "[0, 1000000000]", "", "Seed of the noise, which starts anew at every reset.")


class EventCamera:
    """Event cameras of N views: signed numbers of events between successive grey frames.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters, or a mapping of them; None for the defaults.
        num: Number of views N.

    Example:
        >>> camera = EventCamera((1, 2), fps=30.0)
        >>> camera.step(np.array([[[100, 100]]], np.uint8)).tolist()
        [[[0, 0]]]
        >>> camera.step(np.array([[[100, 180]]], np.uint8)).tolist()  # ln(190 / 110) = 0.55
        [[[0, 2]]]
    """

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: EventParams | Mapping[str, object] | None = None,
        num: int = 1,
    ) -> None:
        self.shape, self.params = check_size("shape", shape, 1, MAX_SIDE), EventParams.make(params)
        self.num = check_whole("num", num, 1)
        self._interval_s = 1.0 / check_positive("fps", fps)
        self._most = max(math.floor(1000.0 * self._interval_s / self.params.refractory_ms), 1)
        dark = self.params.dark
        self._log = np.log((np.arange(256) + dark) / (255.0 + dark)).astype(np.float32)
        self._memory = np.zeros((self.num, *self.shape), np.float32)
        self._first = np.ones(self.num, np.bool_)
        self._noise = [self._generator() for _ in range(self.num)]

    def step(
        self, frames: Frames, active: NDArray[np.bool_] | None = None, out: Counts | None = None
    ) -> Counts:
        """Return the events since the last frame of each active view; those of the others are 0.

        Args:
            frames: Grey luminance in 0-255, shape (N, height, width).
            active: Views with a new frame, shape (N,); None for all.
            out: Array for the events, of which those of other views stay; a new one if None.

        Returns:
            Events, + for ON, int32, shape (N, height, width); 0 for the first frame.
        """
        events = np.zeros((self.num, *self.shape), np.int32) if out is None else out
        for n in range(self.num) if active is None else np.flatnonzero(active).tolist():
            light = frames[n]
            log = self._log[light] if light.dtype == np.uint8 else self._log_of(light)
            if self._first[n]:
                self._memory[n], self._first[n], events[n] = log, False, 0
                continue
            steps = np.trunc((log - self._memory[n]) / np.float32(self.params.threshold))
            self._memory[n] += np.float32(self.params.threshold) * steps
            events[n] = np.clip(steps, -self._most, self._most)
            if self.params.noise_hz > 0.0:
                events[n] += self._noise_events(self._noise[n])
        return events

    def reset(self, mask: ArrayLike | None = None) -> None:
        """Forget the light of selected views, bool, shape (N,); of all for None."""
        for n in range(self.num) if mask is None else np.flatnonzero(np.asarray(mask)).tolist():
            self._first[n], self._noise[n] = True, self._generator()

    def _generator(self) -> np.random.Generator:
        return np.random.default_rng(self.params.seed)

    def _log_of(self, light: NDArray[np.float32]) -> NDArray[np.float32]:
        dark = np.float32(self.params.dark)
        return np.log((light + dark) / (np.float32(255.0) + dark))

    def _noise_events(self, rng: np.random.Generator) -> Counts:
        counts = rng.poisson(self.params.noise_hz * self._interval_s, self.shape)
        on = rng.binomial(counts, 0.5)
        return (2 * on - counts).astype(np.int32)


class EventLGMD(LGMD):
    """One or N LGMDs behind event cameras: frames are converted to events, or recorded events are given.

    The module describes the events. Derotation is not available.

    Args:
        shape: (height, width) of the frames [px].
        fps: Rate of the frames, or of the intervals in which events are counted [Hz].
        params: Parameters of the LGMD, or a mapping of them; None for the defaults.
        num: Number of neurons N, each with its own view; None for a single one with scalar outputs.
        events: Parameters of the event cameras, or a mapping of them; None for the defaults.

    Raises:
        ValueError: For an argument out of range.
        TypeError: For an argument of another type.

    Example:
        >>> neuron = EventLGMD((90, 160), fps=30.0)
        >>> neuron.step(np.zeros((90, 160), np.uint8)).membrane_potential
        0.5
    """

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: NeuronSpec = None,
        num: int | None = None,
        *,
        events: EventParams | Mapping[str, object] | None = None,
    ) -> None:
        super().__init__(shape, fps, params, num)
        self.camera = EventCamera(self.shape, self.fps, events, self._count)
        self._counts = np.zeros((self._count, *self.shape), np.int32)
        self._light = np.full(self._counts.shape, _REST, np.uint8)
        self._given: Counts | None = None

    def step_events(self, counts: ArrayLike) -> Values:
        """Process the events of one interval, and return the outputs by name.

        Args:
            counts: Signed numbers of events, shape (height, width), or (N, height, width) for N neurons.

        Raises:
            ValueError: For counts of another shape.
        """
        array = np.asarray(counts, np.int32)
        if array.shape != self._frames_shape:
            raise ValueError(f"counts must have the shape {self._frames_shape}, got {array.shape}")
        self._given = array.reshape(self._count, *self.shape)
        try:
            return self.step(np.zeros(self._frames_shape, np.uint8))._asdict()
        finally:
            self._given = None

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active neurons among first..last-1; see `FrameNeuron.step_range`."""
        chosen = np.zeros(self._count, np.bool_)
        chosen[first:last] = active[first:last]
        counts = self._given
        if counts is None:
            counts = self.camera.step(frames, chosen, self._counts)
        # The kernel computes the change of light against the last frame: rest against rest plus events.
        self._previous[chosen] = _REST
        gain = np.float32(self.camera.params.gain)
        for n in np.flatnonzero(chosen).tolist():
            light = _REST + gain * counts[n]
            self._light[n] = np.clip(np.rint(light, out=light), 0.0, 255.0, out=light)
        super().step_range(first, last, self._light, active)

    def _use_floats(self) -> None:
        super()._use_floats()
        self._light = self._light.astype(np.float32)  # the kernel takes both frames of one type

    def shift_range(
        self,
        first: int,
        last: int,
        frames: Frames,
        active: NDArray[np.bool_],
        turns_px: NDArray[np.int64],
    ) -> None:
        """Refuse a shift: the memory of an event camera cannot move."""
        raise ValueError("neuron 'events' has no derotation; use a gaze without derotated, or neuron 'lgmd'")

    def reset(self, mask: ArrayLike | None = None) -> None:
        """Return to the state before the first frame; see `FrameNeuron.reset`."""
        super().reset(mask)
        self.camera.reset(mask)


class EventRecording(NamedTuple):
    """Recorded events in the order of time.

    Attributes:
        x: Column of each event [px], shape (events,).
        y: Row, 0 at the top [px].
        t: Time since the start [s].
        p: Polarity: +1 for ON, -1 for OFF.
        shape: (height, width) of the sensor [px].
    """

    x: NDArray[np.int64]
    y: NDArray[np.int64]
    t: NDArray[np.float64]
    p: NDArray[np.int64]
    shape: tuple[int, int]

    @classmethod
    def read(cls, path: str | Path) -> "EventRecording":
        """Read a `.npz` file with the arrays x, y, t [s] and p, and optionally shape (height, width).

        Polarities may be 0 and 1, or -1 and 1. Times start at that of the first event. Without shape, the
        sensor ends at the last row and column with an event.

        Raises:
            ValueError: For a file that cannot be read, lacks an array, or has arrays of different lengths,
                coordinates outside the sensor, times that decrease, or another polarity.
        """
        file = check_path("path", path)
        try:
            with np.load(file, allow_pickle=False) as data:
                for name in "xytp":
                    if name not in data.files:
                        raise ValueError(f"it lacks the array {name!r}")
                arrays = {name: np.asarray(data[name]) for name in (*"xytp", *({"shape"} & set(data.files)))}
        except (OSError, ValueError, EOFError, BadZipFile) as error:
            raise ValueError(f"event file {str(file)!r} cannot be read as .npz: {error}") from None
        return cls._checked(arrays, f"event file {str(file)!r}")

    @classmethod
    def _checked(cls, arrays: dict[str, NDArray[np.generic]], name: str) -> "EventRecording":
        x, y = (np.asarray(arrays[key], np.int64) for key in "xy")
        t, p = np.asarray(arrays["t"], np.float64), np.asarray(arrays["p"], np.int64)
        if not len(x) or len({x.shape, y.shape, t.shape, p.shape}) > 1 or x.ndim != 1:
            raise ValueError(
                f"{name} must have x, y, t and p of one length > 0, got {x.shape}, {y.shape}, {t.shape} and "
                f"{p.shape}"
            )
        given = arrays.get("shape", np.array([y.max() + 1, x.max() + 1]))
        shape = check_size(f"shape of {name}", tuple(int(side) for side in np.asarray(given)), 1, MAX_SIDE)
        if min(x.min(), y.min()) < 0 or x.max() >= shape[1] or y.max() >= shape[0]:
            raise ValueError(f"{name} has coordinates outside its sensor of {shape[1]}×{shape[0]} px")
        if not np.isfinite(t).all() or (np.diff(t) < 0.0).any():
            raise ValueError(f"{name} must have finite times that do not decrease; sort its events by t")
        polarities = set(np.unique(p).tolist())
        if not (polarities <= {0, 1} or polarities <= {-1, 1}):
            raise ValueError(f"{name} must have polarities 0 and 1, or -1 and 1, got {sorted(polarities)}")
        return cls(x, y, t - t[0], np.where(p > 0, 1, -1), shape)

    def counts(self, fps: float) -> Iterator[Counts]:
        """Yield the signed numbers of events of successive intervals, int32, shape (height, width).

        Args:
            fps: Intervals per second [Hz].
        """
        places = np.floor(self.t * check_positive("fps", fps) + 1e-9).astype(np.int64)
        bounds: list[int] = np.searchsorted(places, np.arange(int(places[-1]) + 2)).tolist()
        for start, stop in pairwise(bounds):
            counts = np.zeros(self.shape, np.int32)
            np.add.at(counts, (self.y[start:stop], self.x[start:stop]), self.p[start:stop])
            yield counts


register_variant("events", EventLGMD, EventParams, "events", "LGMD behind a simulated event camera.")
