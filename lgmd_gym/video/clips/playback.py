"""Watch real video with the neuron, frame by frame: what is seen, what is answered, when it alarms."""

import csv
import dataclasses
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from lgmd_gym.errors import unknown_name
from lgmd_gym.neuron import LGMD, LGMDParams, Response
from lgmd_gym.video import Reading, VideoReader, luma
from lgmd_gym.video.clips.detection import QUIET_S

COLUMNS = (
    "frame", "time_s", "duplicate", "spike_frequency", "spikes", "membrane_potential", "adapted_potential",
    "ffi", "inhibition_weight", "excitation_latency_ms", "alert", "onset",
)  # fmt: skip
# Near-duplicates come singly or in pairs; more in a row is a scene that stands still.
_MOST_DROPPED = 2
_TYPICAL = 15  # changes that tell what is typical


@dataclass(frozen=True, kw_only=True)
class Choice:
    """How a clip is watched.

    Attributes:
        params: The neuron's parameters.
        reading: Rate and size.
        drop_duplicates: A frame that differs from the last by less than this fraction of the typical
            difference is not shown to the neuron, whose answer holds; 0 shows all. Conversions such as
            25 to 30 Hz leave one in six.
        roi: (top, left, height, width) of what the neuron sees [px]; None for all.
    """

    params: LGMDParams = field(default_factory=LGMDParams)
    reading: Reading = field(default_factory=Reading)
    drop_duplicates: float = 0.0
    roi: tuple[int, int, int, int] | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.drop_duplicates < 1.0:
            raise ValueError(f"drop_duplicates = {self.drop_duplicates:g} must lie in [0, 1); 0.25 is usual")

    def describe(self, fps: float | None = None) -> str:
        """Return T_sf and the rate [Hz], which belong together, and what else differs from the default."""
        rate = fps or self.reading.fps
        at = f"at {rate:g} Hz" if rate else "at the clip's rate"
        plain = LGMDParams().to_dict()
        other = {n: v for n, v in self.params.to_dict().items() if v != plain[n] and n != "t_sf"}
        listed = [f"{n} = {v}" for n, v in other.items()] if len(other) <= 2 else ["other parameters"]
        extra = [f"near-duplicates below {self.drop_duplicates:g} dropped"] if self.drop_duplicates else []
        return ", ".join([f"T_sf = {self.params.t_sf:g} spikes/s {at}", *listed, *extra])


# Named ways to watch: the paper's, a calmer one, and what came before or was taken away.
CHOICES = {
    "paper": Choice(),
    "calm": Choice(params=LGMDParams(sigma_3=1.5), drop_duplicates=0.25),
    "paper-18hz": Choice(params=LGMDParams(t_sf=15.0), reading=Reading(fps=18.0)),
    "t_sf-60": Choice(params=LGMDParams(t_sf=60.0)),
    "t_sp-0.78": Choice(params=LGMDParams(t_sp=0.78, t_sf=15.0)),
    "released": Choice(params=LGMDParams.released()),
    "off-only": Choice(params=LGMDParams.off_only()),
    "fixed-inhibition": Choice(params=LGMDParams.fixed_inhibition()),
    "yue-rind-2006": Choice(params=LGMDParams.yue_rind2006(), reading=Reading(fps=25.0)),
}


def named_choice(name: str) -> Choice:
    """Return one of `CHOICES`, or raise ValueError naming the nearest."""
    if name not in CHOICES:
        raise unknown_name("choice", name, CHOICES)
    return CHOICES[name]


class Moment(NamedTuple):
    """One frame of a clip and the neuron's answer.

    Attributes:
        frame: Its number, from 0, at the rate watched.
        time: Since the first frame [s].
        picture: RGB, uint8, shape (height, width, 3).
        duplicate: Whether it was not shown to the neuron.
        response: The neuron's answer; of a duplicate, the one before.
        onset: Whether an alarm begins here, after a third of a second of quiet.
    """

    frame: int
    time: float
    picture: np.ndarray
    duplicate: bool
    response: Response
    onset: bool

    def row(self) -> list[str]:
        """Return the values of `COLUMNS`."""
        r = self.response
        numbers = (r.spike_frequency, r.spikes, r.membrane_potential, r.adapted_potential, r.ffi)
        numbers = (*numbers, r.inhibition_weight, r.excitation_latency)
        head = [str(self.frame), f"{self.time:.4f}", str(int(self.duplicate))]
        return [*head, *(f"{value:.6g}" for value in numbers), str(int(r.alert)), str(int(self.onset))]


class Watch:
    """A clip watched by one neuron; iterate once over its moments. Memory does not grow with its length.

    Args:
        path: The video file.
        choice: How it is watched.

    Attributes:
        reader: The open clip, with `fps`, `total` and `info`.
        neuron: The neuron; None until the first frame tells the size.
        dropped: Frames not shown so far.
    """

    def __init__(self, path: str | Path, choice: Choice) -> None:
        self.choice = choice
        self.reader = VideoReader(path, choice.reading)
        self.neuron: LGMD | None = None
        self.dropped = 0

    def __iter__(self) -> Iterator[Moment]:
        """Yield the moments in order; see `VideoReader` for what may be raised."""
        fps = self.reader.fps
        quiet, need = 0, max(round(QUIET_S * fps), 1)
        sieve = Sieve(self.choice.drop_duplicates)
        response: Response | None = None
        for frame, picture in enumerate(self.reader):
            grey = luma(picture)
            if self.neuron is None:
                self.neuron = LGMD(grey.shape, fps, self.choice.params, roi=self.choice.roi)
            duplicate = sieve.drops(grey)
            if response is None or not duplicate:
                response = self.neuron.step(grey)
            self.dropped += duplicate
            onset = bool(response.alert) and quiet >= need
            quiet = 0 if response.alert else quiet + 1
            yield Moment(frame, frame / fps, picture, duplicate, response, onset)


class Sieve:
    """Tells near-duplicate frames: those which differ far less from the last one than is typical.

    Args:
        fraction: Of the median of the last differences, below which a frame is a duplicate; 0 for none.
    """

    def __init__(self, fraction: float) -> None:
        self.fraction = fraction
        self._last: np.ndarray | None = None
        self._typical: deque[float] = deque(maxlen=_TYPICAL)
        self._dropped = 0

    def drops(self, grey: np.ndarray) -> bool:
        """Whether this frame, uint8, shape (H, W), is a near-duplicate of the last that was not."""
        if self.fraction == 0.0:
            return False
        if self._last is None:
            self._last = grey
            return False
        change = float(np.abs(np.subtract(grey, self._last, dtype=np.int16)).mean())
        usual = float(np.median(self._typical)) if len(self._typical) >= 3 else 0.0
        if self._dropped < _MOST_DROPPED and change < self.fraction * usual:
            self._dropped += 1
            return True
        self._dropped = 0
        self._last = grey
        self._typical.append(change)
        return False


class TraceWriter:
    """A CSV file of moments, on disk as far as it goes; use it in a `with` block."""

    def __init__(self, path: Path) -> None:
        self._file: IO[str] = path.open("w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        self._writer.writerow(COLUMNS)

    def write(self, moment: Moment) -> None:
        """Append one row."""
        self._writer.writerow(moment.row())

    def __enter__(self) -> "TraceWriter":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def changed(choice: Choice, **values: object) -> Choice:
    """Return a choice with those of `params`, `t_sf`, `fps`, `size`, `drop_duplicates`, `roi` not None."""
    given = {name: value for name, value in values.items() if value is not None}
    params = given.pop("params", choice.params)
    if "t_sf" in given:
        params = dataclasses.replace(params, t_sf=given.pop("t_sf"))  # type: ignore[type-var]
    reading = {name: given.pop(name) for name in ("fps", "size") if name in given}
    read = dataclasses.replace(choice.reading, **reading)  # type: ignore[arg-type]
    return dataclasses.replace(choice, params=params, reading=read, **given)  # type: ignore[arg-type]
