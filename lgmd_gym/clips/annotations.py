"""The CSV files with the crash frame of each clip, or with its event and the evaluated part."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from lgmd_gym.clips.probe import VideoInfo
from lgmd_gym.errors import unknown_name

_EMPTY = ("", "none", "-")
EVENT_COLUMNS = ("file", "event_s", "start_s", "end_s")


class ClipEvent(NamedTuple):
    """The event of a clip, and the part in which alarms are scored.

    Attributes:
        event_s: Time of the event from the first frame [s]; None without one.
        start_s: Start of the evaluated part [s].
        end_s: End of the evaluated part [s]; None for the event, or the end of the clip.
    """

    event_s: float | None
    start_s: float = 0.0
    end_s: float | None = None


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
    infos, events = {info.path: info for info in clips}, {}
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


def _clip(field: str | None, clips: Sequence[Path], listed: dict[Path, Any], where: str) -> Path:
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
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
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
        end = f"{info.duration:.2f} s ({info.frames} frames at {info.fps:g} Hz)"
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
