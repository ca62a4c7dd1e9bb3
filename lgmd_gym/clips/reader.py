"""Read video files of any length frame by frame with PyAV."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.clips.probe import open_video, probe
from lgmd_gym.errors import check_finite, check_path, check_size, shown

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer
    from av.filter import Graph
    from av.video.stream import VideoStream

CLIP_SUFFIXES = (".mp4", ".mkv", ".mov", ".avi", ".gif", ".webm", ".m4v", ".mpg", ".ts")
MAX_SIZE = 16384  # [px]
MIN_SIZE = 3  # width of the neuron's neighbourhood [px]
_MOST_MISSING = 2.0  # a file that ends up to this many frames early counts as complete
# Rotation in the file's metadata [deg, counterclockwise] to the filters that undo it.
_UPRIGHT = {
    90: ("transpose=cclock",), -90: ("transpose=clock",), 180: ("hflip", "vflip"), -180: ("hflip", "vflip")
}  # fmt: skip


class TruncatedVideoError(ValueError):
    """Raised when a video file ends before the end that its header states."""


class VideoReader:
    """The pictures of a video file as RGB arrays; iterate over it any number of times.

    Each decoded frame gives one picture, uint8, shape (height, width, 3), rotated as the file's metadata
    requires. A file of variable frame rate is resampled to its median rate. Memory does not depend on the
    length of the file. `luma` converts pictures to grey.

    Args:
        path: Any video file that ffmpeg can read.
        fps: Rate to resample to [Hz]; None for the file's.
        size: (width, height) to scale to [px]; None for the file's.

    Attributes:
        info: Properties of the file.
        fps: Rate of the pictures [Hz].
        total: Expected number of pictures.

    Raises:
        ValueError: For a file that is missing, empty, not a video, or without a video stream, and for an
            invalid `fps` or `size`; while iterating, for pictures smaller than 3×3.
        TruncatedVideoError: While iterating, after the last picture of a truncated file.
    """

    def __init__(
        self, path: str | Path, fps: float | None = None, size: tuple[int, int] | None = None
    ) -> None:
        if fps is not None and not 0.0 < check_finite("fps", fps) <= 1000.0:
            raise ValueError(f"fps must be in (0, 1000], got {shown(fps)}")
        if size is not None:
            check_size("size", size, MIN_SIZE, MAX_SIZE, "(width, height)")
        self.info = probe(path)
        self.fps = fps or self.info.fps
        self.total = max(round(self.info.duration * self.fps), 1)
        self._size = size
        self._resample = fps is not None or self.info.variable

    def __iter__(self) -> Iterator[np.ndarray]:
        """Yield the pictures in order."""
        name, count = f"clip {str(self.info.path)!r}", 0
        with open_video(self.info.path) as (container, stream):
            for picture in self._pictures(container, stream):
                height, width = picture.shape[:2]
                if min(height, width) < MIN_SIZE:
                    raise ValueError(
                        f"{name} is {width}×{height} px; it must be at least {MIN_SIZE}×{MIN_SIZE}"
                    )
                count += 1
                yield picture
        if not count:
            raise ValueError(f"{name} contains no frame that can be decoded")
        missing = self.info.missing * self.fps
        if missing > _MOST_MISSING:
            raise TruncatedVideoError(
                f"{name} is truncated: it ends after {count} of {count + missing:.0f} frames"
            )

    def _pictures(self, container: "InputContainer", stream: "VideoStream") -> Iterator[np.ndarray]:
        """Yield the decoded, rotated, resampled and scaled pictures."""
        graph = None
        for frame in chain(_decode(container, stream, self.info.fps), [None]):  # None ends the stream
            if graph is None:
                if frame is None:
                    return
                graph = self._filter_graph(frame, stream, (container.start_time or 0) / 1e6)
            graph.push(frame)
            with suppress(BlockingIOError, EOFError):
                while True:
                    yield graph.vpull().to_ndarray()

    def _filter_graph(self, frame: "VideoFrame", stream: "VideoStream", start: float) -> "Graph":
        """Return the filters from decoded frames like `frame` to pictures; the file starts at `start` [s]."""
        from av.filter import Graph

        filters = [*_UPRIGHT.get(frame.rotation, ())]
        if self._resample:
            filters += [f"setpts=PTS-{start:.6f}/TB", f"fps={self.fps:.6f}"]
        if self._size is not None:
            filters.append("scale={}:{}:flags=area".format(*self._size))
        graph = Graph()
        height, width = frame.height, frame.width
        nodes = [graph.add_buffer(None, width, height, frame.format, time_base=stream.time_base)]
        for item in (*filters, "format=rgb24", "buffersink"):
            name, _, arguments = item.partition("=")
            nodes.append(graph.add(name, arguments or None))
        graph.link_nodes(*nodes).configure()
        return graph


def _decode(container: "InputContainer", stream: "VideoStream", fps: float) -> Iterator["VideoFrame"]:
    """Yield the frames of a stream, each with a time stamp; packets that cannot be decoded are skipped."""
    from av.error import InvalidDataError

    assert stream.time_base is not None
    count, interval = 0, 1.0 / (fps * float(stream.time_base))
    untimed = container.format.name == "avi"  # the format has a constant rate and no time stamps
    for packet in container.demux(stream):
        try:
            frames = packet.decode()
        except InvalidDataError:
            continue
        for frame in frames:
            if untimed or frame.pts is None:
                frame.pts = round(count * interval)
            count += 1
            yield frame


@cache
def _luma_kernel() -> Any:
    """Compile the conversion on first use; importing numba takes half a second."""
    from numba import njit

    red, green, blue, half, total = (np.int32(weight) for weight in (299, 587, 114, 500, 1000))

    @njit(cache=True, nogil=True)
    def convert(pixels: np.ndarray, grey: np.ndarray) -> None:
        for i in range(grey.size):
            r, g, b = pixels[3 * i], pixels[3 * i + 1], pixels[3 * i + 2]
            grey[i] = (red * r + green * g + blue * b + half) // total

    return convert


def luma(picture: np.ndarray) -> np.ndarray:
    """Return the BT.601 luma of an RGB picture: uint8, shape (height, width), 0 black to 255 white.

    Example:
        >>> luma(np.full((1, 1, 3), 200, np.uint8))
        array([[200]], dtype=uint8)
    """
    if getattr(picture, "dtype", None) != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3:
        raise ValueError(f"picture must be uint8 of shape (height, width, 3), got {shown(picture)}")
    grey = np.empty(picture.shape[:2], np.uint8)
    _luma_kernel()(np.ascontiguousarray(picture).reshape(-1), grey.reshape(-1))
    return grey


def find_clips(paths: Iterable[str | Path]) -> list[Path]:
    """Return the given files, with each folder replaced by its video files in the order of their names.

    Raises:
        ValueError: For a path that does not exist, or a folder without a video file.
    """
    if not isinstance(paths, list | tuple):
        raise TypeError(f"paths must be a list, got {shown(paths)}")
    found: list[Path] = []
    for path in (check_path("path", path) for path in paths):
        if path.is_dir():
            clips = sorted(file for file in path.iterdir() if file.suffix.lower() in CLIP_SUFFIXES)
            if not clips:
                raise ValueError(f"folder {str(path)!r} contains no video file ({', '.join(CLIP_SUFFIXES)})")
            found += clips
        elif not path.exists():
            raise ValueError(f"clip {str(path)!r} does not exist")
        else:
            found.append(path)
    return found
