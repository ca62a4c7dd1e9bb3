"""Process annotated clips and write their traces, figures and overlay videos to a folder."""

import csv
import time
from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lgmd_gym.clips.detection import ClipDetection, detect
from lgmd_gym.clips.playback import TRACE_COLUMNS, ClipRun, ClipSummary, PlaybackConfig
from lgmd_gym.clips.scores import ScoredClip
from lgmd_gym.clips.video import TruncatedVideoError, VideoInfo, find_clips, probe
from lgmd_gym.errors import unknown_name
from lgmd_gym.processes.inputs import read_text

_EMPTY = ("", "none", "-")
EVENT_COLUMNS = ("file", "event_s", "start_s", "end_s")


class ClipEvent(NamedTuple):
    """The event of a clip, and the part in which alarms are scored."""

    event_s: float | None  # time of the event from the first frame [s]; None without one
    start_s: float = 0.0  # start of the evaluated part [s]
    end_s: float | None = None  # end of the evaluated part [s]; None for the event, or the end of the clip


def read_crashes(path: Path, clips: Sequence[Path]) -> dict[Path, int | None]:
    """Return the crash frame of each clip in a CSV file, None for a clip without a crash.

    The file has the columns `clip` (file name, with or without suffix) and `crash_frame` (0-based, at the
    frame rate of the clip's file; empty or `none` for no crash). Other columns are ignored.

    Args:
        path: The CSV file.
        clips: Clips that the file may list; those that it does not list are not in the result.

    Raises:
        ValueError: If the file cannot be read, lacks a column, lists an unknown clip or the same clip twice,
            or contains an invalid crash frame.
    """
    rows = _rows(path, "crash file", ("clip", "crash_frame"))
    crashes: dict[Path, int | None] = {}
    for number, row in enumerate(rows, start=2):
        clip = _clip(row["clip"], clips, crashes, f"{path} line {number}")
        crashes[clip] = _crash_frame(row["crash_frame"], f"{path} line {number}")
    return crashes


def read_events(path: Path, clips: Sequence[VideoInfo]) -> dict[Path, ClipEvent]:
    """Return the event of each clip in a CSV file.

    The file has the columns `file` (file name, with or without suffix) and `event_s` (time of the event from
    the first frame in seconds; empty or `none` for a clip without an event), and optionally `start_s` and
    `end_s` (the evaluated part in seconds; empty for the whole clip).

    Args:
        path: The CSV file.
        clips: Clips that the file may list; those that it does not list are not in the result.

    Raises:
        ValueError: If the file cannot be read, lacks a column, has an unknown one, lists an unknown clip or
            the same clip twice, or contains a time outside the clip, or an event outside the evaluated part.
    """
    rows = _rows(path, "event file", EVENT_COLUMNS[:2], EVENT_COLUMNS)
    infos = {info.path: info for info in clips}
    events: dict[Path, ClipEvent] = {}
    for number, row in enumerate(rows, start=2):
        where = f"{path} line {number}"
        clip = _clip(row["file"], list(infos), events, where)
        values = {name: _seconds(name, row.get(name), infos[clip], where) for name in EVENT_COLUMNS[1:]}
        event = ClipEvent(values["event_s"], values["start_s"] or 0.0, values["end_s"])
        end = event.end_s if event.end_s is not None else infos[clip].duration
        if event.start_s >= end:
            raise ValueError(f"{where}: start_s must be before end_s, got {event.start_s:g} and {end:g}")
        if event.event_s is not None and not event.start_s < event.event_s <= end:
            part = f"{event.start_s:g} to {end:g} s"
            raise ValueError(f"{where}: event_s {event.event_s:g} is outside the evaluated part, {part}")
        events[clip] = event
    return events


def _clip(field: str | None, clips: Sequence[Path], listed: Collection[Path], where: str) -> Path:
    """Return the clip that a CSV field names; `listed` has the clips of the rows before."""
    name = (field or "").strip()
    matching = [clip for clip in clips if name in (clip.name, clip.stem)]
    if not matching:
        raise ValueError(f"{where}: {unknown_name('clip', name, [clip.name for clip in clips])}")
    if len(matching) > 1:
        both = ", ".join(clip.name for clip in matching)
        raise ValueError(f"{where}: clip {name!r} matches several clips; add its suffix ({both})")
    if matching[0] in listed:
        raise ValueError(f"{where}: clip {name!r} is listed twice")
    return matching[0]


def _rows(
    path: Path, kind: str, needed: Sequence[str], known: Sequence[str] | None = None
) -> list[dict[str, str | None]]:
    """Return the rows of a CSV file that has at least the needed columns, and only `known` ones if given."""
    try:
        text = read_text(path)
        if ";" in text.partition("\n")[0]:
            raise ValueError(f"{path}: the columns are separated by semicolons; separate them with commas")
        reader = csv.DictReader(StringIO(text, newline=""), skipinitialspace=True)
        columns = [str(name) for name in reader.fieldnames or ()]
        if unknown := [name for name in columns if known and name not in known]:
            raise ValueError(f"{path}: {unknown_name('column', unknown[0], known or ())}")
        if missing := [name for name in needed if name not in columns]:
            raise ValueError(f"{path} lacks the column {missing[0]!r}; it needs {','.join(needed)}")
        return list(reader)
    except OSError as error:
        raise ValueError(f"{kind} {str(path)!r} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{kind} {str(path)!r} is not a CSV file: {error}") from None


def _seconds(name: str, text: str | None, info: VideoInfo, where: str) -> float | None:
    """Return the time in a CSV field, or None for an empty one."""
    value = (text or "").strip().lower()
    if value in _EMPTY:
        return None
    try:
        seconds = float(value)
    except ValueError:
        raise ValueError(f"{where}: {name} must be a time in seconds, or empty, got {text!r}") from None
    if not 0.0 <= seconds <= info.duration:
        rate = "of a variable rate" if info.variable else f"at {info.fps:g} Hz"
        end = f"{info.duration:.2f} s ({info.frames} frames {rate})"
        raise ValueError(f"{where}: {name} must be in the clip, 0 to {end}, got {text!r}")
    return seconds


def _crash_frame(text: str | None, where: str) -> int | None:
    """Return the frame number in a CSV field, or None for no crash."""
    value = (text or "").strip().lower()
    if value in _EMPTY:
        return None
    if not value.isdecimal():
        raise ValueError(f"{where}: crash_frame must be a frame number, or empty for no crash, got {text!r}")
    return int(value)


class ClipJob(NamedTuple):
    """One clip to process."""

    clip: Path  # video file
    info: VideoInfo  # properties of the file
    annotated: bool  # whether it is known if and when the clip has a crash
    crash_frame: int | None  # frame of the crash, at the frame rate of the file; None without one
    # event and evaluated part, for the scores of anticipation; None if the clip is not scored
    event: ClipEvent | None = None
    title: str = ""  # name of the clip in tables; empty for that of the file

    @property
    def name(self) -> str:
        """Name of the clip in tables."""
        return self.title or self.clip.stem

    @property
    def crash_s(self) -> float | None:
        """Time of the crash [s]."""
        return None if self.crash_frame is None else self.info.time_of(self.crash_frame)


@dataclass
class ClipResult:
    """Result of one clip."""

    clip: Path  # video file
    trace: Path  # CSV file with one row per frame
    summary: ClipSummary  # time series and onsets
    duplicates: int = 0  # number of frames skipped as duplicates
    seconds: float = 0.0  # processing time, decoding included [s]
    error: str = ""  # message if the clip is truncated, else empty


def make_jobs(
    paths: Sequence[str | Path],
    crashes: Path | None = None,
    crash_frame: int | None = None,
    events: Path | None = None,
    on_unreadable: Callable[[str], object] | None = None,
    recursive: bool = False,
) -> list[ClipJob]:
    """Return one job per clip.

    Args:
        paths: Video files, and folders with video files.
        crashes: CSV file for `read_crashes`; None for no annotations.
        crash_frame: Crash frame of a single clip, instead of `crashes`.
        events: CSV file for `read_events`, instead of `crashes`; events count as crashes in the figures.
        on_unreadable: Function called with the error of each unreadable file of a folder, which is left out;
            None to raise it. A file that is given by itself, and the only one left, raise theirs.
        recursive: Whether the folders in a folder are searched, too.

    Raises:
        ValueError: For a file that is not a readable video, or an invalid annotation.
    """
    clips = list(dict.fromkeys(find_clips(paths, recursive)))
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
    infos, errors = list[VideoInfo](), list[ValueError]()
    given = {Path(path) for path in paths}
    for clip in clips:
        try:
            infos.append(probe(clip))
        except ValueError as error:
            if on_unreadable is None or clip in given:
                raise
            errors.append(error)
    if errors and not infos:
        raise errors[0]
    for error in errors:
        assert on_unreadable is not None
        on_unreadable(str(error))
    of_clip = {} if events is None else read_events(events, infos)
    return [
        _job(info, info.path in annotations, annotations.get(info.path), of_clip.get(info.path))
        for info in infos
    ]


def _job(info: VideoInfo, annotated: bool, crash: int | None, event: ClipEvent | None) -> ClipJob:
    if crash is not None and not 0 <= crash < info.frames:
        raise ValueError(f"crash frame of {info.path.name} must be in 0 to {info.frames - 1}, got {crash}")
    if event is not None and event.event_s is not None:
        crash = info.frame_at(event.event_s)
    return ClipJob(info.path, info, annotated, crash, event)


def process_clip(
    job: ClipJob,
    config: PlaybackConfig,
    folder: Path,
    *,
    suffix: str = "",
    overlay: bool = False,
    figure: bool = True,
    on_progress: Callable[[float], object] | None = None,
) -> ClipResult:
    """Run the neuron on one clip and write trace.csv, and optionally trace.png and overlay.mp4.

    Args:
        job: The clip.
        config: Neuron parameters and frame processing.
        folder: Existing folder for the files.
        suffix: Text after "trace" and "overlay" in the file names.
        overlay: Whether to write the overlay video.
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
        writer = None
        if overlay:
            from lgmd_gym.clips.pictures import OverlayWriter

            path = folder / f"overlay{suffix}.mp4"
            writer = OverlayWriter(path, job.clip.name, reader.fps, config, job.crash_s)
            stack.enter_context(writer)
        try:
            for frame in run:
                trace.writerow(frame.row())
                result.summary.add(frame)
                if writer is not None and run.neuron is not None:
                    writer.write(frame, run.neuron)
                if on_progress is not None:
                    on_progress(min((frame.frame + 1) / reader.total, 1.0))
        except TruncatedVideoError as error:
            result.error = str(error)
    result.duplicates, result.seconds = run.duplicates, time.perf_counter() - start
    if figure and result.summary.frames:
        from lgmd_gym.clips.pictures import clip_figure

        clip_figure(folder / f"trace{suffix}.png", job.clip.name, result.summary, config, job.crash_s)
    return result


def detect_from_trace(job: ClipJob, result: ClipResult) -> ClipDetection:
    """Return the alarms of a processed clip relative to its crash, from its trace file."""
    table = read_trace(result, "spike_frequency", "alert")
    return detect(job.name, table[:, 0], table[:, 1] > 0.0, result.summary.fps, job.crash_s)


def scored_from_trace(job: ClipJob, event: ClipEvent, result: ClipResult) -> ScoredClip:
    """Return the spike frequency of a processed clip up to its event, from its trace file."""
    frequency = read_trace(result, "spike_frequency")[:, 0]
    return ScoredClip.of(job.clip.name, frequency, result.summary.fps, *event)


def read_trace(result: ClipResult, *columns: str) -> np.ndarray:
    """Return columns of a trace file, shape (frames, columns)."""
    numbers = [TRACE_COLUMNS.index(name) for name in columns]
    return np.loadtxt(result.trace, delimiter=",", skiprows=1, usecols=numbers, ndmin=2)
