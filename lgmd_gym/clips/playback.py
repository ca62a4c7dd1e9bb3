"""Run the neuron on a video frame by frame, and summarise its response in constant memory."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lgmd_gym.clips.detection import SILENCE_S
from lgmd_gym.clips.video import VideoReader, luma
from lgmd_gym.errors import check_known
from lgmd_gym.neuron import LGMD, FrameNeuron, LGMDParams, Response, make

RESPONSE_SIGNALS = [
    "spike_frequency",
    "spikes",
    "membrane_potential",
    "adapted_potential",
    "ffi",
    "inhibition_weight",
]
TRACE_COLUMNS = (
    *("frame", "time_s", "duplicate"),
    *RESPONSE_SIGNALS,
    *("excitation_latency_ms", "alert", "onset"),
)
LGMD_MODEL = "lgmd"  # its name in the registry


@dataclass(frozen=True, kw_only=True)
class PlaybackConfig:
    """Neuron parameters and frame processing of a clip.

    Attributes:
        params: Neuron parameters.
        neuron: Name of the neuron model, see `lgmd_gym.neuron.register`.
        fps: Rate to resample to [Hz]; None for the clip's.
        size: (width, height) to scale to [px]; None for the clip's.
        drop_duplicates: Threshold of the duplicate filter, a fraction of the typical difference between
            frames; 0 disables it. The neuron skips duplicates and holds its last response. A conversion from
            25 to 30 Hz makes every sixth frame a duplicate.
        roi: (top, left, height, width) of the neuron's region of interest [px]; None for the whole frame.
            Only for the LGMD.
    """

    params: LGMDParams = field(default_factory=LGMDParams)
    neuron: str = LGMD_MODEL
    fps: float | None = None
    size: tuple[int, int] | None = None
    drop_duplicates: float = 0.0
    roi: tuple[int, int, int, int] | None = None

    def __post_init__(self) -> None:
        if self.roi is not None and self.neuron != LGMD_MODEL:
            raise ValueError(f"roi requires the neuron {LGMD_MODEL}, got {self.neuron}; leave it out")
        if not 0.0 <= self.drop_duplicates < 1.0:
            raise ValueError(
                f"drop_duplicates must be in [0, 1), got {self.drop_duplicates:g}; 0.25 is typical"
            )

    def describe(self, fps: float | None = None) -> str:
        """Describe T_sf with its frame rate, and all values that differ from the defaults.

        Args:
            fps: Frame rate of a clip [Hz]; None if unknown.
        """
        rate = fps or self.fps
        at = f"at {rate:g} Hz" if rate else "at the clip's rate"
        defaults = LGMDParams().to_dict()
        other = {n: v for n, v in self.params.to_dict().items() if v != defaults[n] and n != "t_sf"}
        listed = [f"{n} = {v}" for n, v in other.items()] if len(other) <= 2 else ["other parameters"]
        model = [f"neuron {self.neuron}"] if self.neuron != LGMD_MODEL else []
        extra = [f"near-duplicates below {self.drop_duplicates:g} dropped"] if self.drop_duplicates else []
        return ", ".join([f"T_sf = {self.params.t_sf:g} spikes/s {at}", *model, *listed, *extra])


# The paper's model at the clip's rate and at that of the paper (T_sf of 15 and 30, the ends of its range),
# variants with fewer false alarms, and the presets of `LGMDParams`.
PLAYBACK_CONFIGS = {
    "paper": PlaybackConfig(),
    "conservative": PlaybackConfig(params=LGMDParams(sigma_3=1.5), drop_duplicates=0.25),
    "paper-18hz": PlaybackConfig(params=LGMDParams(t_sf=15.0), fps=18.0),
    "paper-18hz-30": PlaybackConfig(fps=18.0),
    "t_sf-60": PlaybackConfig(params=LGMDParams(t_sf=60.0)),
    "t_sp-0.78": PlaybackConfig(params=LGMDParams(t_sp=0.78, t_sf=15.0)),
    "literal": PlaybackConfig(params=LGMDParams.literal()),
    "released": PlaybackConfig(params=LGMDParams.released()),
    "off-only": PlaybackConfig(params=LGMDParams.off_only()),
    "fixed-inhibition": PlaybackConfig(params=LGMDParams.fixed_inhibition()),
}


def named_config(name: str) -> PlaybackConfig:
    """Return one of `PLAYBACK_CONFIGS`.

    Raises:
        ValueError: For an unknown name, with the nearest known one.
    """
    check_known("configuration", name, PLAYBACK_CONFIGS)
    return PLAYBACK_CONFIGS[name]


class ClipFrame(NamedTuple):
    """One frame of a clip and the neuron's response."""

    frame: int  # frame number from 0, at the rate of the run
    time: float  # time since the first frame [s]
    picture: np.ndarray  # RGB picture, uint8, shape (height, width, 3)
    duplicate: bool  # whether the neuron skipped the frame as a duplicate
    response: Response  # the neuron's response; for a duplicate, the last one
    onset: bool  # whether an alarm begins here after `SILENCE_S` without alarm

    def row(self) -> list[str]:
        """Return the values of `TRACE_COLUMNS`."""
        r = self.response
        numbers = [*(getattr(r, name) for name in RESPONSE_SIGNALS), r.excitation_latency]
        head = [str(self.frame), f"{self.time:.4f}", str(int(self.duplicate))]
        return [*head, *(f"{value:.6g}" for value in numbers), str(int(r.alert)), str(int(self.onset))]


class ClipRun:
    """A run of one neuron on a clip; iterate over its frames once. Memory does not depend on its length.

    Attributes:
        reader: Reader of the clip.
        neuron: The neuron; None before the first frame.
        duplicates: Number of duplicates so far.
    """

    def __init__(self, path: str | Path, config: PlaybackConfig) -> None:
        self.config = config
        self.reader = VideoReader(path, config.fps, config.size)
        self.neuron: FrameNeuron | None = None
        self.duplicates = 0

    def __iter__(self) -> Iterator[ClipFrame]:
        """Yield the frames in order; `VideoReader` documents the exceptions."""
        fps = self.reader.fps
        silence, min_silence = 0, max(round(SILENCE_S * fps), 1)  # [frames]
        duplicates = DuplicateFilter(self.config.drop_duplicates)
        response: Response | None = None
        for frame, picture in enumerate(self.reader):
            grey = luma(picture)
            if self.neuron is None:
                self.neuron = self._make_neuron(grey.shape, fps)
            duplicate = duplicates.is_duplicate(grey)
            if response is None or not duplicate:
                response = self.neuron.step(grey)
            self.duplicates += duplicate
            onset = bool(response.alert) and silence >= min_silence
            silence = 0 if response.alert else silence + 1
            yield ClipFrame(frame, frame / fps, picture, duplicate, response, onset)

    def _make_neuron(self, shape: tuple[int, int], fps: float) -> FrameNeuron:
        config = self.config
        if config.neuron == LGMD_MODEL:
            return LGMD(shape, fps, config.params, roi=config.roi)
        return make(config.neuron, shape, fps, params=config.params)


class DuplicateFilter:
    """Detect frames that differ far less than is typical from the last frame that is not a duplicate.

    Args:
        threshold: Fraction of the median of the last differences below which a frame is a duplicate; 0
            disables the filter.
    """

    MAX_IN_A_ROW = 2  # duplicates come singly or in pairs; a longer row is a static scene
    WINDOW = 15  # number of differences in the median

    def __init__(self, threshold: float) -> None:
        self.threshold = threshold
        self._last: np.ndarray | None = None
        self._differences: deque[float] = deque(maxlen=self.WINDOW)
        self._in_a_row = 0

    def is_duplicate(self, grey: np.ndarray) -> bool:
        """Return whether the next frame, uint8, shape (H, W), is a duplicate."""
        if self.threshold == 0.0:
            return False
        if self._last is None:
            self._last = grey
            return False
        difference = float(np.abs(np.subtract(grey, self._last, dtype=np.int16)).mean())
        typical = float(np.median(self._differences)) if len(self._differences) >= 3 else 0.0
        if self._in_a_row < self.MAX_IN_A_ROW and difference < self.threshold * typical:
            self._in_a_row += 1
            return True
        self._in_a_row = 0
        self._last = grey
        self._differences.append(difference)
        return False


BINS = 4096
SERIES = ("time", "spike_frequency", "spikes", "membrane_potential", "adapted_potential", "ffi")
_PICTURE_WIDTH = 240  # of the stored pictures, approximate [px]
Snapshot = tuple[float, np.ndarray]  # time [s], RGB picture


class ClipSummary:
    """Time series of a clip in at most `BINS` bins, its alarm onsets, and pictures at some of them.

    Each bin holds the maximum over its frames. When all bins are full, they are merged in pairs.

    Args:
        fps: Frame rate [Hz].
        crash_frame: Frame of the crash, of which a picture is stored; None for none.

    Attributes:
        frames: Number of frames.
        alarms: Number of alarm frames.
        onsets: Number of alarm onsets.
        first_alarm: Time of the first alarm frame [s]; None without one.
        peak: Highest spike frequency [spikes/s].
    """

    def __init__(self, fps: float, crash_frame: int | None = None) -> None:
        self.fps = fps
        self.crash_frame = crash_frame
        self.frames = self.alarms = self.onsets = 0
        self.first_alarm: float | None = None
        self.peak = 0.0
        self._bins = np.full((len(SERIES), BINS), -np.inf)
        self._frames_per_bin = 1
        self._first_onset: list[Snapshot] = []
        self._onset_before_crash: list[Snapshot] = []
        self._last_onsets: list[Snapshot] = []
        self._peak: Snapshot | None = None
        self._crash: Snapshot | None = None

    def add(self, frame: ClipFrame) -> None:
        """Add the next frame."""
        r = frame.response
        if self.frames >= BINS * self._frames_per_bin:
            self._merge_bins()
        slot = self.frames // self._frames_per_bin
        values = (frame.time, r.spike_frequency, r.spikes, r.membrane_potential, r.adapted_potential, r.ffi)
        self._bins[:, slot] = np.maximum(self._bins[:, slot], values)
        self.frames += 1
        self.alarms += bool(r.alert)
        if r.alert and self.first_alarm is None:
            self.first_alarm = frame.time
        if r.spike_frequency > self.peak or self._peak is None:
            self.peak, self._peak = r.spike_frequency, _snapshot(frame)
        if frame.onset:
            self.onsets += 1
            self._store_onset(frame.frame, _snapshot(frame))
        if frame.frame == self.crash_frame:
            self._crash = _snapshot(frame)

    def series(self) -> dict[str, np.ndarray]:
        """Return the time series by name, shape (bins in use,)."""
        used = -(-self.frames // self._frames_per_bin)
        return dict(zip(SERIES, self._bins[:, :used], strict=True))

    def pictures(self) -> list[tuple[str, float, np.ndarray]]:
        """Return (label, time [s], RGB picture) of selected frames, in the order of time.

        These are the first and the last two onsets, or the peak of a clip without onsets; with a crash frame
        also that frame and the last onset before it.
        """
        onsets = {
            item[0]: item for item in (*self._first_onset, *self._onset_before_crash, *self._last_onsets)
        }
        chosen = [("alarm begins", *item) for item in onsets.values()]
        if not chosen and self._peak is not None:
            chosen = [("highest frequency", *self._peak)]
        if self._crash is not None:
            chosen.append(("crash", *self._crash))
        return sorted(chosen, key=lambda item: item[1])

    def _store_onset(self, frame: int, item: Snapshot) -> None:
        """Store the picture of an onset as the first, the last before the crash, or one of the last two."""
        if not self._first_onset:
            self._first_onset = [item]
        elif self.crash_frame is not None and frame <= self.crash_frame:
            self._onset_before_crash = [item]
        else:
            self._last_onsets = [*self._last_onsets, item][-2:]

    def _merge_bins(self) -> None:
        half = np.maximum(self._bins[:, ::2], self._bins[:, 1::2])
        self._bins[:, : BINS // 2], self._bins[:, BINS // 2 :] = half, -np.inf
        self._frames_per_bin *= 2


def _snapshot(frame: ClipFrame) -> Snapshot:
    """Return the time and a reduced copy of the picture of a frame."""
    step = max(round(frame.picture.shape[1] / _PICTURE_WIDTH), 1)
    return frame.time, frame.picture[::step, ::step].copy()
