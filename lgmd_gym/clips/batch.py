"""Process clips and write their traces, figures and overlay videos to a folder."""

import csv
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.clips import TruncatedVideoError, find_clips
from lgmd_gym.clips.annotations import ClipEvent, read_crashes, read_events
from lgmd_gym.clips.detection import ClipDetection, detect
from lgmd_gym.clips.playback import TRACE_COLUMNS, ClipRun, PlaybackConfig
from lgmd_gym.clips.probe import VideoInfo, probe
from lgmd_gym.clips.scored_clip import ScoredClip
from lgmd_gym.clips.summary import ClipSummary


class ClipJob(NamedTuple):
    """One clip to process.

    Attributes:
        clip: Video file.
        info: Properties of the file.
        annotated: Whether it is known if and when the clip has a crash.
        crash_frame: Frame of the crash, at the frame rate of the file; None without one.
        event: Event and evaluated part, for the scores of anticipation; None if the clip is not scored.
    """

    clip: Path
    info: VideoInfo
    annotated: bool
    crash_frame: int | None
    event: ClipEvent | None = None

    @property
    def crash_s(self) -> float | None:
        """Time of the crash [s]."""
        return None if self.crash_frame is None else self.crash_frame / self.info.fps


@dataclass
class ClipResult:
    """Result of one clip.

    Attributes:
        clip: Video file.
        trace: CSV file with one row per frame.
        summary: Time series and onsets.
        duplicates: Number of frames skipped as duplicates.
        seconds: Processing time, decoding included [s].
        error: Message if the clip is truncated, else empty.
    """

    clip: Path
    trace: Path
    summary: ClipSummary
    duplicates: int = 0
    seconds: float = 0.0
    error: str = ""


def make_jobs(
    paths: Sequence[str | Path], crashes: Path | None = None, crash_frame: int | None = None,
    events: Path | None = None,
) -> list[ClipJob]:  # fmt: skip
    """Return one job per clip.

    Args:
        paths: Video files, and folders with video files.
        crashes: CSV file for `read_crashes`; None for no annotations.
        crash_frame: Crash frame of a single clip, instead of `crashes`.
        events: CSV file for `read_events`, instead of `crashes`; events count as crashes in the figures.

    Raises:
        ValueError: For a file that is not a readable video, or an invalid annotation.
    """
    clips = list(dict.fromkeys(find_clips(paths)))
    if crash_frame is not None and (len(clips) > 1 or crashes is not None):
        raise ValueError(
            f"--crash-frame {crash_frame} applies to a single clip; use --crashes FILE for several"
        )
    if events is not None and (crashes is not None or crash_frame is not None):
        raise ValueError("--events and --crashes annotate the same clips; remove one of them")
    annotations: dict[Path, int | None] = {}
    if crashes is not None:
        annotations = read_crashes(crashes, clips)
    elif crash_frame is not None:
        annotations = {clips[0]: crash_frame}
    infos = [probe(clip) for clip in clips]
    of_clip = {} if events is None else read_events(events, infos)
    return [_job(info, info.path in annotations, annotations.get(info.path), of_clip.get(info.path))
            for info in infos]  # fmt: skip


def _job(info: VideoInfo, annotated: bool, crash: int | None, event: ClipEvent | None) -> ClipJob:
    if crash is not None and not 0 <= crash < info.frames:
        raise ValueError(f"crash frame of {info.path.name} must be in 0 to {info.frames - 1}, got {crash}")
    if event is not None and event.event_s is not None:
        crash = round(event.event_s * info.fps)
    return ClipJob(info.path, info, annotated, crash, event)


def process_clip(
    job: ClipJob, config: PlaybackConfig, folder: Path, *, suffix: str = "", overlay: bool = False,
    mcap: bool = False, figure: bool = True, on_progress: Callable[[float], object] | None = None,
) -> ClipResult:  # fmt: skip
    """Run the neuron on one clip and write trace.csv, and optionally trace.png, overlay.mp4 and clip.mcap.

    Args:
        job: The clip.
        config: Neuron parameters and frame processing.
        folder: Existing folder for the files.
        suffix: Text after "trace", "overlay" and "clip" in the file names.
        overlay: Whether to write the overlay video.
        mcap: Whether to write the MCAP file.
        figure: Whether to draw the figure.
        on_progress: Function called after each frame with the completed fraction.
    """
    run = ClipRun(job.clip, config)
    reader = run.reader
    crash_frame = None if job.crash_s is None else round(job.crash_s * reader.fps)
    result = ClipResult(job.clip, folder / f"trace{suffix}.csv", ClipSummary(reader.fps, crash_frame))
    start = time.perf_counter()
    with ExitStack() as stack:
        trace = csv.writer(stack.enter_context(result.trace.open("w", newline="", encoding="utf-8")))
        trace.writerow(TRACE_COLUMNS)
        writers: list[Any] = []
        if overlay:
            from lgmd_gym.clips.overlay import OverlayWriter

            path = folder / f"overlay{suffix}.mp4"
            writers.append(OverlayWriter(path, job.clip.name, reader.fps, config, job.crash_s))
        if mcap:
            from lgmd_gym.clips.mcap_file import McapWriter

            writers.append(McapWriter(folder / f"clip{suffix}.mcap", job.clip.name, job.crash_s))
        for writer in writers:
            stack.enter_context(writer)
        try:
            for frame in run:
                trace.writerow(frame.row())
                result.summary.add(frame)
                for writer in writers if run.neuron is not None else ():
                    writer.write(frame, run.neuron)
                if on_progress is not None:
                    on_progress(min((frame.frame + 1) / reader.total, 1.0))
        except TruncatedVideoError as error:
            result.error = str(error)
    result.duplicates, result.seconds = run.duplicates, time.perf_counter() - start
    if figure and result.summary.frames:
        from lgmd_gym.clips.plots import clip_figure

        clip_figure(folder / f"trace{suffix}.png", job.clip.name, result.summary, config, job.crash_s)
    return result


def detect_from_trace(job: ClipJob, result: ClipResult) -> ClipDetection:
    """Return the alarms of a processed clip relative to its crash, from its trace file."""
    table = _trace(result, "spike_frequency", "alert")
    return detect(job.clip.stem, table[:, 0], table[:, 1] > 0.0, result.summary.fps, job.crash_s)


def scored_from_trace(job: ClipJob, event: ClipEvent, result: ClipResult) -> ScoredClip:
    """Return the spike frequency of a processed clip up to its event, from its trace file."""
    frequency = _trace(result, "spike_frequency")[:, 0]
    return ScoredClip.of(job.clip.name, frequency, result.summary.fps, *event)


def _trace(result: ClipResult, *columns: str) -> np.ndarray:
    """Return columns of a trace file, shape (frames, columns)."""
    numbers = [TRACE_COLUMNS.index(name) for name in columns]
    return np.loadtxt(result.trace, delimiter=",", skiprows=1, usecols=numbers, ndmin=2)
