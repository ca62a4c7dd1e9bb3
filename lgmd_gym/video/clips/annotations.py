"""The CSV file that says in which frame each clip's crash is."""

import csv
from collections.abc import Sequence
from pathlib import Path


def read_crashes(path: Path, clips: Sequence[Path]) -> dict[Path, int | None]:
    """Return the crash frame of each clip that the file names; None for one without a crash.

    The file has the columns `clip` (file name, with or without suffix) and `crash_frame` (0-based, in the
    file's own frames; empty or `none` for no crash). Other columns are not looked at.

    Args:
        path: The CSV file.
        clips: The clips at hand; those that the file does not name are missing from the answer.

    Raises:
        ValueError: For a file that cannot be read, lacks a column, names a clip that is not at hand or
            twice, or holds a crash frame that is no frame number.
    """
    crashes: dict[Path, int | None] = {}
    for number, row in enumerate(_rows(path), start=2):
        name = (row["clip"] or "").strip()
        matching = [clip for clip in clips if name in (clip.name, clip.stem)]
        if len(matching) != 1:
            trouble = "is not among the clips given" if not matching else "fits several clips; add its suffix"
            known = ", ".join(clip.name for clip in clips[:12])
            raise ValueError(f"{path} line {number}: clip {name!r} {trouble} ({known})")
        if matching[0] in crashes:
            raise ValueError(f"{path} line {number}: clip {name!r} comes twice")
        crashes[matching[0]] = _frame(row["crash_frame"], f"{path} line {number}")
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
        raise ValueError(f"crash file {str(path)!r} is no CSV file: {error}") from None


def _frame(text: str | None, where: str) -> int | None:
    """Return a frame number; None for no crash."""
    value = (text or "").strip().lower()
    if value in ("", "none", "-"):
        return None
    if not value.isdecimal():
        raise ValueError(f"{where}: crash_frame {text!r} must be a frame number, or empty for no crash")
    return int(value)
