"""Write the set of stimuli as lossless videos with their ground truth, and check such a folder."""

import csv
import hashlib
import io
import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, is_dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Literal

from lgmd_gym.aliases import Values
from lgmd_gym.clips.video import VideoReader, VideoWriter, luma
from lgmd_gym.errors import check_mapping, check_path, check_text, unknown_name
from lgmd_gym.paper.backgrounds import SHAPES, Panorama, Screen
from lgmd_gym.paper.stimuli import SET_VERSION, Stimulus, Truth, stimulus_set
from lgmd_gym.processes.inputs import read_json

MANIFEST = "manifest.json"
SET_NAME = "lgmd-gym stimuli"
VideoSuffix = Literal["mkv", "y4m"]
TRUTH_COLUMNS = ("frame", *Truth._fields)


def set_screen(fps: float = 30.0, size: tuple[int, int] | None = None) -> Screen:
    """Return the screen of the set; its horizontal field is 84° for every size.

    Args:
        fps: Frame rate [Hz].
        size: (width, height) of the frames [px]; None for the published (540, 270).
    """
    if size is None:
        return Screen(fps=fps)
    return Screen(fps=fps, shape=(size[1], size[0]), px_per_m=1000.0 * size[0] / SHAPES["looming"][1])


def choose_stimuli(names: Iterable[str], picture: str | Path | None = None) -> list[Stimulus]:
    """Return the stimuli of the set whose names match, all of them for no name.

    Args:
        names: Names, or patterns with `*`, for example "looming-disc-*".
        picture: Image file for the panorama, see `stimulus_set`.

    Raises:
        ValueError: For a name that matches no stimulus, or an image that cannot be read.
    """
    known = stimulus_set(picture)
    chosen: dict[str, Stimulus] = {} if (names := tuple(names)) else known
    for pattern in names:
        matching = {name: item for name, item in known.items() if fnmatchcase(name, pattern)}
        if not matching:
            raise unknown_name("stimulus", pattern, known, "a pattern such as 'looming-*' selects several")
        chosen |= matching
    return list(chosen.values())


def write_stimuli(
    folder: Path,
    stimuli: Iterable[Stimulus],
    screen: Screen,
    *,
    suffix: VideoSuffix = "mkv",
    picture: str | Path | None = None,
    on_step: Callable[[], object] = lambda: None,
) -> Values:
    """Write a video and a CSV file with the ground truth of each stimulus, and manifest.json.

    Args:
        folder: Existing folder.
        stimuli: The stimuli.
        screen: Size, frame rate and scale.
        suffix: "mkv" for FFV1, "y4m" for uncompressed frames.
        picture: Image file of the panorama, whose hash is written; None without one.
        on_step: Function called after each stimulus.

    Returns:
        The contents of the manifest.
    """
    entries: Values = {}
    for stimulus in stimuli:
        entries[stimulus.name] = _write_stimulus(folder, stimulus, screen, suffix)
        on_step()
    source = None if picture is None else {"file": Path(picture).name, "sha256": _file_hash(Path(picture))}
    manifest: Values = {"set": SET_NAME, "version": SET_VERSION, "screen": asdict(screen)}
    manifest |= {"picture": source, "sha256": _set_hash(entries), "stimuli": entries}
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
    return manifest


def check_stimuli(folder: str | Path) -> Values:
    """Decode the videos of a folder, compare frames and ground truth with its manifest, and return that.

    Args:
        folder: Folder of `write_stimuli`.

    Raises:
        ValueError: For a folder without a valid manifest, a missing file, or one with other contents.
    """
    folder = check_path("folder", folder)
    try:
        manifest = check_mapping(MANIFEST, read_json(folder / MANIFEST))
        entries = {name: check_mapping(name, entry) for name, entry in manifest["stimuli"].items()}
        files = [
            (folder / check_text("video", entry["video"]), folder / check_text("truth", entry["truth"]))
            for entry in entries.values()
        ]
        hashes = [(entry["frames_sha256"], entry["truth_sha256"]) for entry in entries.values()]
    except OSError as error:
        raise ValueError(f"{str(folder / MANIFEST)!r} cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, AttributeError):
        raise ValueError(f"{str(folder / MANIFEST)!r} is not a manifest of lgmd-gym stimuli") from None
    for (video, truth), expected in zip(files, hashes, strict=True):
        digest = hashlib.sha256()
        for picture in VideoReader(video):
            digest.update(luma(picture).tobytes())
        for path, found, wanted in zip(
            (video, truth), (digest.hexdigest(), _file_hash(truth)), expected, strict=True
        ):
            if found != wanted:
                raise ValueError(f"{str(path)!r} differs from the manifest: SHA-256 {found}, not {wanted}")
    if _set_hash(entries) != manifest.get("sha256"):
        raise ValueError(f"{str(folder / MANIFEST)!r} has been changed: the hash of the set differs")
    return manifest


def _write_stimulus(folder: Path, stimulus: Stimulus, screen: Screen, suffix: str) -> Values:
    """Write one video and its ground truth, and return its entry of the manifest."""
    video, truth = f"{stimulus.name}.{suffix}", f"{stimulus.name}.csv"
    digest, frames = hashlib.sha256(), 0
    with VideoWriter(folder / video, screen.fps, lossless=True) as writer:
        for frame in stimulus.frames(screen):
            writer.write(frame)
            digest.update(frame.tobytes())
            frames += 1
    rows = io.StringIO()
    table = csv.writer(rows, lineterminator="\n")
    table.writerow(TRUTH_COLUMNS)
    table.writerows((number, *map(_cell, row)) for number, row in enumerate(stimulus.truth(screen)))
    (folder / truth).write_text(rows.getvalue(), encoding="utf-8", newline="")
    return {
        "video": video,
        "truth": truth,
        "frames": frames,
        "background": _described(stimulus.background),
        "object": None if stimulus.foreground is None else _described(stimulus.foreground),
        "frames_sha256": digest.hexdigest(),
        "video_sha256": _file_hash(folder / video),
        "truth_sha256": _file_hash(folder / truth),
    }


def _cell(value: float | str | None) -> str:
    """Return a value of the ground truth as text; undefined values are empty."""
    if value is None or isinstance(value, str):
        return value or ""
    return f"{round(value, 6) + 0.0:.6f}"  # no negative zero


def _described(item: object) -> Values:
    """Return the type and parameters of a background or object."""
    kind: Values = {"type": type(item).__name__}
    if is_dataclass(item) and not isinstance(item, type):
        return kind | asdict(item)
    if isinstance(item, Panorama):
        random = {} if item.picture is not None else {"contrast": item.contrast, "seed": item.seed}
        return kind | {"speed": item.speed, **random}
    return kind


def _set_hash(entries: Values) -> str:
    """Return the SHA-256 of lines with the hash of the frames and the name of each stimulus, by name."""
    lines = [f"{entries[name]['frames_sha256']}  {name}\n" for name in sorted(entries)]
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def _file_hash(path: Path) -> str:
    """Return the SHA-256 of a file.

    Raises:
        ValueError: If it cannot be read.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise ValueError(f"{str(path)!r} cannot be read: {error.strerror}") from None
