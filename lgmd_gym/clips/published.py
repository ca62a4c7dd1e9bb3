"""The published dash-camera clips: our annotation of their crashes, and the files of a user with them.

The clips are in public repositories of their authors and state no licence; the package has neither them nor
any of their frames. `crashes.csv` beside this module names each file by its SHA-256, so that its name in a
user's folder does not matter.
"""

import csv
import hashlib
from functools import cache
from pathlib import Path
from typing import NamedTuple

from lgmd_gym.clips.batch import ClipJob
from lgmd_gym.clips.video import find_clips, probe
from lgmd_gym.errors import check_path

USED, NEW = "used", "new"
CRASH_FILE = Path(__file__).with_name("crashes.csv")
FILE_FPS = 30.0  # frame rate of all files [Hz]


class PublishedClip(NamedTuple):
    """Annotation of one published clip."""

    name: str  # name in tables
    crash_frame: int | None  # first frame of the contact, 0-based, estimated by eye; None without a crash
    tolerance_frames: int  # uncertainty of the crash frame
    group: str  # `USED` for earlier choices of parameters here, or `NEW`
    sha256: str  # SHA-256 of the file
    source: str  # repository of the authors, and the path of the file there
    note: str  # what is special about the clip

    @property
    def crash_s(self) -> float | None:
        """Time of the crash [s]."""
        return None if self.crash_frame is None else self.crash_frame / FILE_FPS


@cache
def published_clips() -> tuple[PublishedClip, ...]:
    """Return the annotation of every published clip, those used for choices first."""
    with CRASH_FILE.open(newline="", encoding="utf-8") as file:
        return tuple(
            PublishedClip(
                row["clip"],
                int(row["crash_frame"]) if row["crash_frame"] else None,
                int(row["tolerance_frames"] or 0),
                row["group"],
                row["sha256"],
                row["source"],
                row["note"],
            )
            for row in csv.DictReader(file)
        )


class PublishedFiles(NamedTuple):
    """Published clips in a folder."""

    jobs: list[ClipJob]  # the clips that were found, in the order of the annotation
    missing: list[PublishedClip]  # the clips that were not found
    unknown: list[Path]  # videos that are none of the clips


def find_published(folder: str | Path) -> PublishedFiles:
    """Return the published clips among the videos of a folder, by the SHA-256 of the files.

    Args:
        folder: Folder with video files of any name.

    Raises:
        ValueError: If the folder does not exist, or none of its videos is a published clip.
    """
    folder = check_path("folder", folder)
    files: dict[str, Path] = {}
    for path in find_clips([folder]):
        with path.open("rb") as file:
            files.setdefault(hashlib.file_digest(file, "sha256").hexdigest(), path)
    known = {clip.sha256: clip for clip in published_clips()}
    unknown = [path for digest, path in files.items() if digest not in known]
    if len(unknown) == len(files):
        raise ValueError(
            f"{str(folder)!r} has none of the {len(known)} published clips (by SHA-256); for other clips, "
            "add --crashes with a CSV file of the columns clip,crash_frame"
        )
    jobs = [
        ClipJob(files[clip.sha256], probe(files[clip.sha256]), True, clip.crash_frame, None, clip.name)
        for clip in known.values()
        if clip.sha256 in files
    ]
    return PublishedFiles(jobs, [clip for clip in known.values() if clip.sha256 not in files], unknown)
