"""Watch clips and leave their traces, figures and overlays in a folder."""

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lgmd_gym.video import TruncatedVideoError
from lgmd_gym.video.clips.detection import Detection, detect
from lgmd_gym.video.clips.playback import COLUMNS, Choice, TraceWriter, Watch
from lgmd_gym.video.clips.summary import Summary
from lgmd_gym.video.probe import VideoInfo

Tick = Callable[[int, int], None]


class Order(NamedTuple):
    """One clip to watch.

    Attributes:
        clip: The file.
        info: What it holds.
        crash_frame: In the file's own frames; None for no crash, or none known.
        folder: Where its files go, which exists.
    """

    clip: Path
    info: VideoInfo
    crash_frame: int | None
    folder: Path

    @property
    def crash_s(self) -> float | None:
        """Time of the crash [s]."""
        return None if self.crash_frame is None else self.crash_frame / self.info.fps


@dataclass
class Watched:
    """What came of one clip.

    Attributes:
        clip: The file.
        summary: Its series and onsets.
        dropped: Near-duplicates that were not shown to the neuron.
        seconds: Time it took to decode and watch [s].
        trouble: What was wrong with the file; empty if nothing was.
    """

    clip: Path
    summary: Summary
    dropped: int
    seconds: float
    trouble: str = ""


def watch_clip(order: Order, choice: Choice, suffix: str, overlay: bool, figure: bool, tick: Tick) -> Watched:
    """Watch one clip; write trace.csv, and on demand trace.png and overlay.mp4.

    Args:
        order: The clip.
        choice: How it is watched.
        suffix: Put behind "trace" and "overlay" in the names of the files.
        overlay: Whether to write the overlay video.
        figure: Whether to draw the figure.
        tick: Called with the frames so far and the frames expected.
    """
    watch = Watch(order.clip, choice)
    reader = watch.reader
    mark = None if order.crash_s is None else round(order.crash_s * reader.fps)
    done = Watched(order.clip, Summary(reader.fps, mark), 0, 0.0)
    begun = time.perf_counter()
    with ExitStack() as stack:
        trace = stack.enter_context(TraceWriter(order.folder / f"trace{suffix}.csv"))
        painter = None
        if overlay:
            from lgmd_gym.video.clips.overlay import Overlay

            film = order.folder / f"overlay{suffix}.mp4"
            painter = stack.enter_context(Overlay(film, order.clip.name, reader.fps, choice, order.crash_s))
        try:
            for moment in watch:
                trace.write(moment)
                done.summary.add(moment)
                if painter is not None and watch.neuron is not None:
                    painter.write(moment, watch.neuron)
                tick(moment.frame + 1, reader.total)
        except TruncatedVideoError as error:
            done.trouble = str(error)
    done.dropped, done.seconds = watch.dropped, time.perf_counter() - begun
    if figure and done.summary.frames:
        from lgmd_gym.video.clips.plots import clip_figure

        picture = order.folder / f"trace{suffix}.png"
        clip_figure(picture, order.clip.name, done.summary, choice, order.crash_s)
    return done


def detection(order: Order, trace: Path, fps: float) -> Detection:
    """Return how a clip was answered, from its trace.

    Args:
        order: The clip.
        trace: The file that `watch_clip` left.
        fps: Frames per second of the trace.
    """
    names = [COLUMNS.index("spike_frequency"), COLUMNS.index("alert")]
    table = np.loadtxt(trace, delimiter=",", skiprows=1, usecols=names, ndmin=2)
    return detect(order.clip.stem, table[:, 0], table[:, 1] > 0.0, fps, order.crash_s)
