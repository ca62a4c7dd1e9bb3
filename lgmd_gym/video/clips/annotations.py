"""The CSV file with the crash frame of each clip."""

import csv
from collections.abc import Sequence
from pathlib import Path


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
    crashes: dict[Path, int | None] = {}
    for number, row in enumerate(_rows(path), start=2):
        name = (row["clip"] or "").strip()
        matching = [clip for clip in clips if name in (clip.name, clip.stem)]
        if len(matching) != 1:
            problem = "matches several clips; add its suffix" if matching else "is not among the given clips"
            known = ", ".join(clip.name for clip in clips[:12])
            raise ValueError(f"{path} line {number}: clip {name!r} {problem} ({known})")
        if matching[0] in crashes:
            raise ValueError(f"{path} line {number}: clip {name!r} is listed twice")
        crashes[matching[0]] = _crash_frame(row["crash_frame"], f"{path} line {number}")
    return crashes


def _rows(path: Path) -> list[dict[str, str | None]]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            missing = {"clip", "crash_frame"} - set(reader.fieldnames or ())
            if missing:
                raise ValueError(f"{path} lacks the column {sorted(missing)[0]!r}; it needs clip,crash_frame")
            return list(reader)
    except OSError as error:
        raise ValueError(f"crash file {str(path)!r} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"crash file {str(path)!r} is not a CSV file: {error}") from None


def _crash_frame(text: str | None, where: str) -> int | None:
    """Return the frame number in a CSV field, or None for no crash."""
    value = (text or "").strip().lower()
    if value in ("", "none", "-"):
        return None
    if not value.isdecimal():
        raise ValueError(f"{where}: crash_frame must be a frame number, or empty for no crash, got {text!r}")
    return int(value)
