"""Read video files of any length, picture by picture, with the ffmpeg that imageio-ffmpeg carries."""

import re
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from lgmd_gym.video.probe import ffmpeg_reads, messages, probe

CLIP_SUFFIXES = (".mp4", ".mkv", ".mov", ".avi", ".gif", ".webm", ".m4v", ".mpg", ".ts")
SMALLEST = 3  # the neuron's neighbourhood [px]
# What ffmpeg says of a file that ends in the middle.
_BREAKS = re.compile(r"partial file|ended prematurely|[Tt]runcat|Packet corrupt|End of file|incomplete")


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How a video file is read.

    Attributes:
        fps: Rate to resample to [Hz]; None keeps the file's.
        size: (width, height) to scale to [px]; None keeps the file's.
    """

    fps: float | None = None
    size: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if self.fps is not None and not 0.0 < self.fps <= 1000.0:
            raise ValueError(f"fps = {self.fps:g} must lie in (0, 1000] frames per second")
        if self.size is not None and min(self.size) < SMALLEST:
            raise ValueError(
                f"size = {self.size} must be at least {SMALLEST} {SMALLEST} px, width then height"
            )


class VideoReader:
    """The pictures of a video file as it is decoded, whatever its length; iterate over it, once or again.

    Every decoded frame comes once, turned upright as the file asks; a file of variable rate is resampled
    to its usual one. Pictures are RGB, uint8, shape (height, width, 3); `luma` makes them grey.

    Args:
        path: Any file that ffmpeg reads.
        reading: Rate and size to read it in.

    Attributes:
        info: What the file holds.
        fps: Pictures per second as they come [Hz].
        total: Expected number of pictures.

    Raises:
        ValueError: For a file that is missing, empty, no video, or sound alone; while iterating, for
            pictures smaller than 3×3.
        TruncatedVideoError: While iterating, after the last picture of a file that breaks off.
    """

    def __init__(self, path: str | Path, reading: Reading | None = None) -> None:
        self.reading = reading or Reading()
        self.info = probe(path)
        self.fps = self.reading.fps or self.info.fps
        self.total = max(round(self.info.duration * self.fps), 1)

    def __iter__(self) -> Iterator[np.ndarray]:
        """Yield the pictures in order."""
        count = 0
        with tempfile.TemporaryFile() as log:
            with ffmpeg_reads(self.info.path, self._output(), log) as process:
                assert process.stdout is not None
                try:
                    for picture in _pictures(cast(IO[bytes], process.stdout)):
                        if min(picture.shape[:2]) < SMALLEST:
                            raise ValueError(self._too_small(picture))
                        count += 1
                        yield picture
                finally:
                    process.kill()  # does nothing to one that has ended
            said = messages(log)
        self._check_end(count, said)

    def _output(self) -> list[str]:
        """Return ffmpeg's options for what comes out."""
        filters = []
        if self.reading.fps is not None or self.info.variable:
            filters.append(f"fps={self.fps:.6f}")
        if self.reading.size is not None:
            filters.append("scale={}:{}:flags=area".format(*self.reading.size))
        chain = ["-vf", ",".join(filters)] if filters else []
        # PPM says its size ahead of each picture: after rotation and cropping, only ffmpeg knows it.
        raw = ["-f", "image2pipe", "-c:v", "ppm", "-pix_fmt", "rgb24", "-"]
        return ["-map", "0:V:0", *chain, "-fps_mode", "passthrough", *raw]

    def _too_small(self, picture: np.ndarray) -> str:
        height, width = picture.shape[:2]
        return (
            f"clip {str(self.info.path)!r} is {width}×{height} px; it must be at least {SMALLEST}×{SMALLEST}"
        )

    def _check_end(self, count: int, said: str) -> None:
        """Refuse the end of a file that came too early, or of one that never began."""
        name = f"clip {str(self.info.path)!r}"
        if count == 0:
            raise ValueError(f"{name} holds no frame that ffmpeg can decode")
        due = count if self.info.promised is None else self.info.promised * self.fps
        if due - count > 2.0 and _BREAKS.search(said):
            raise TruncatedVideoError(f"{name} is truncated: it breaks off after {count} of {due:.0f} frames")


class TruncatedVideoError(ValueError):
    """A video file breaks off before the end that its header promises."""


@cache
def _luma_kernel() -> Any:
    """Compile the conversion on first use: numba takes half a second to load."""
    from numba import njit

    @njit(cache=True, nogil=True)
    def convert(pixels: np.ndarray, grey: np.ndarray) -> None:
        for i in range(grey.size):
            r, g, b = pixels[3 * i], pixels[3 * i + 1], pixels[3 * i + 2]
            grey[i] = (np.int32(299) * r + np.int32(587) * g + np.int32(114) * b + np.int32(500)) // np.int32(
                1000
            )

    return convert


def luma(picture: np.ndarray) -> np.ndarray:
    """Return the BT.601 luma of an RGB picture: uint8, shape (height, width), 0 black to 255 white.

    Example:
        >>> luma(np.full((1, 1, 3), 200, np.uint8))
        array([[200]], dtype=uint8)
    """
    grey = np.empty(picture.shape[:2], np.uint8)
    _luma_kernel()(np.ascontiguousarray(picture).reshape(-1), grey.reshape(-1))
    return grey


def find_clips(paths: Iterable[str | Path]) -> list[Path]:
    """Return the files named and, for a folder, the video files in it by name.

    Raises:
        ValueError: For a path that does not exist, or a folder without a video file.
    """
    found: list[Path] = []
    for path in map(Path, paths):
        if path.is_dir():
            inside = sorted(file for file in path.iterdir() if file.suffix.lower() in CLIP_SUFFIXES)
            if not inside:
                raise ValueError(f"folder {str(path)!r} holds no video file ({', '.join(CLIP_SUFFIXES)})")
            found += inside
        elif not path.exists():
            raise ValueError(f"clip {str(path)!r} does not exist")
        else:
            found.append(path)
    return found


def _pictures(stream: IO[bytes]) -> Iterator[np.ndarray]:
    """Yield the whole pictures of a stream of PPM images; a last one that is cut short is left out."""
    while stream.readline() == b"P6\n":
        width, height = map(int, stream.readline().split())
        stream.readline()  # the largest value, 255
        picture = np.empty((height, width, 3), np.uint8)
        if cast(Any, stream).readinto(picture.reshape(-1).data) < picture.size:
            return
        yield picture
