"""Read, check and write video files of any length with PyAV."""

import os
from array import array
from collections.abc import Iterable, Iterator
from contextlib import suppress
from fractions import Fraction
from functools import cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lgmd_gym.clips.decoding import decode, is_untimed, open_video, stamp_of, upright
from lgmd_gym.errors import check_finite, check_flag, check_path, check_size, check_within, shown
from lgmd_gym.processes.files import check_new_file

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer
    from av.filter import Graph
    from av.video.stream import VideoStream

# The rate is variable if an interval deviates from the median by more than one tick and this fraction.
_JITTER = 0.05
_DEFAULT_FPS = 25.0  # ffmpeg's, for a file with a single frame and no rate


class VideoInfo(NamedTuple):
    """Properties of a video file.

    Attributes:
        path: The file.
        fps: Frame rate; if variable, that of the median interval [Hz].
        frames: Number of frames in the file.
        variable: Whether the intervals between frames vary.
        missing: Part of the duration in the file's header for which the file has no data [s].
        times: Time of each frame of a variable rate since the first one [s]; empty for a constant rate.
    """

    path: Path
    fps: float
    frames: int
    variable: bool
    missing: float
    times: tuple[float, ...] = ()

    @property
    def duration(self) -> float:
        """Time from the first frame to the end of the last one [s]."""
        return self.times[-1] + 1.0 / self.fps if self.times else self.frames / self.fps

    def time_of(self, frame: int) -> float:
        """Return the time of a frame, 0-based, since the first one [s]; beyond the last one the end."""
        if not self.times:
            return frame / self.fps
        return self.times[frame] if frame < len(self.times) else self.duration

    def frame_at(self, time: float) -> int:
        """Return the frame nearest to a time since the first one [s]."""
        if not self.times:
            return round(time * self.fps)
        return int(np.argmin(np.abs(np.array([*self.times, self.duration]) - time)))


def probe(path: str | Path) -> VideoInfo:
    """Return the properties of a video file from one pass over its packets.

    Raises:
        ValueError: For a file that is missing, empty, not a video, or without a video stream.
    """
    path = check_path("clip", path)
    if not path.is_file():
        raise ValueError(f"clip {str(path)!r} {'is not a file' if path.exists() else 'does not exist'}")
    if path.stat().st_size == 0:
        raise ValueError(f"clip {str(path)!r} is empty (0 bytes)")
    if _is_playlist(path):
        raise ValueError(f"clip {str(path)!r} is a playlist, not a video; pass the video files that it lists")
    with open_video(path) as (container, stream):
        assert stream.time_base is not None
        frames, stamps, end, file_end = _scan(container, stream)
        if not frames:
            raise ValueError(f"clip {str(path)!r} is truncated before the end of its first frame")
        tick = float(stream.time_base)
        named = float(stream.average_rate or stream.base_rate or _DEFAULT_FPS)
        fps, variable = _rate(stamps, tick, named)
        times = tuple(((stamps - stamps[0]) * tick).tolist()) if variable else ()
        missing = 0.0
        if stream.duration and len(stamps):
            missing = stream.duration * tick - (end - stamps[0] * tick)
        elif container.duration:
            missing = container.duration / 1e6 - file_end
    return VideoInfo(path, fps, frames, variable, max(float(missing), 0.0), times)


def _is_playlist(path: Path) -> bool:
    """Return whether a file lists other files (HLS, DASH, ffconcat): ffmpeg waits for a live one for ever."""
    with path.open("rb") as file:
        head = file.read(4096)
    return head.startswith((b"#EXTM3U", b"ffconcat")) or b"<MPD" in head


def _scan(container: "InputContainer", stream: "VideoStream") -> tuple[int, np.ndarray, float, float]:
    """Return the frames and sorted time stamps [ticks] of a stream, its end and that of all streams [s]."""
    frames, stamps = 0, array("q")  # eight bytes per frame: 2 MB for two hours
    end = file_end = 0.0
    untimed = is_untimed(container)
    for packet in container.demux(container.streams.video + container.streams.audio):
        in_video = packet.stream is stream
        frames += in_video and packet.size > 0
        stamp = stamp_of(packet, untimed)
        if stamp is None:
            continue
        packet_end = float((stamp + (packet.duration or 0)) * packet.time_base)
        file_end = max(file_end, packet_end)
        if in_video:
            if packet.size > 0:  # an empty one holds the picture before it
                stamps.append(stamp)
            end = max(end, packet_end)
    return frames, np.sort(np.frombuffer(stamps, np.int64)), end, file_end


def _rate(stamps: np.ndarray, tick: float, named: float) -> tuple[float, bool]:
    """Return the frame rate [Hz] and whether it varies; `named` is the rate in the file's header [Hz]."""
    intervals = np.sort(np.diff(stamps))
    intervals = intervals[intervals > 0]
    if not len(intervals):
        return round(named, 4), False
    median = intervals[(len(intervals) - 1) // 2]
    # Stamps are rounded to ticks; where a tick is a frame, as in AVI, one tick more is a missing frame.
    rounding = min(1.0, 0.5 * median)
    regular = intervals[np.abs(intervals - median) <= max(rounding, _JITTER * median)]
    fps = len(regular) / (float(regular.sum()) * tick)
    # Stamps in whole milliseconds turn 30 Hz into 29.995 Hz in a short clip; the header is then more exact.
    return round(named if abs(fps - named) < 1e-3 * fps else fps, 4), len(regular) < len(intervals)


CLIP_SUFFIXES = (
    *(".mp4", ".mkv", ".mov", ".avi", ".gif", ".webm", ".m4v", ".mpg", ".mpeg", ".ts", ".mts", ".m2ts"),
    *(".3gp", ".wmv", ".asf", ".flv", ".vob", ".y4m"),
)
MAX_SIZE = 16384  # [px]
MIN_SIZE = 3  # width of the neuron's neighbourhood [px]
_MOST_MISSING = 2.0  # a file that ends up to this many frames early counts as complete


class TruncatedVideoError(ValueError):
    """Raised when a video file ends before the end that its header states."""


class VideoReader:
    """The pictures of a video file as RGB arrays; iterate over it any number of times.

    Each decoded frame gives one picture, uint8, shape (height, width, 3), turned and mirrored as the file's
    metadata requires. A file of variable frame rate is resampled to its median rate. Memory does not depend
    on the length of the file. `luma` converts pictures to grey.

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
        for frame in chain(decode(container, stream, self.info.fps), [None]):  # None ends the stream
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

        filters = [*upright(frame, self.info.path)]
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


def is_clip(file: Path) -> bool:
    """Return whether a file has the suffix of a video and is not hidden."""
    return file.suffix.lower() in CLIP_SUFFIXES and not file.name.startswith(".")


def _clips_below(folder: Path) -> Iterator[Path]:
    """Yield the video files in a folder and in the folders below it."""
    for root, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        yield from filter(is_clip, (Path(root) / name for name in files))


def find_clips(paths: Iterable[str | Path], recursive: bool = False) -> list[Path]:
    """Return the given files, with each folder replaced by its video files in the order of their names.

    Files and folders in a folder whose name begins with a dot are left out, such as the "._" files of macOS.

    Args:
        paths: Video files, and folders with video files.
        recursive: Whether the folders in a folder are searched, too; links to folders are not followed.

    Raises:
        ValueError: For a path that does not exist, or a folder without a video file.
    """
    if not isinstance(paths, list | tuple):
        raise TypeError(f"paths must be a list, got {shown(paths)}")
    found: list[Path] = []
    for path in (check_path("path", path) for path in paths):
        if path.is_dir():
            clips = sorted(_clips_below(path) if recursive else filter(is_clip, path.iterdir()))
            if not clips:
                raise ValueError(
                    f"folder {str(path)!r} contains no video file ({', '.join(CLIP_SUFFIXES)})"
                    f"{'' if recursive else '; for those in its folders, use --recursive'}"
                )
            found += clips
        elif not path.exists():
            raise ValueError(f"clip {str(path)!r} does not exist")
        else:
            found.append(path)
    return found


SUFFIXES = (".mp4", ".mkv", ".mov", ".avi", ".gif")
LOSSLESS_CODECS = {".mkv": "ffv1", ".y4m": "rawvideo"}  # by suffix


class VideoWriter:
    """Write pictures to a video file; use it in a `with` block.

    The codec is H.264, or GIF for the suffix .gif. A lossless video is grey: FFV1 for the suffix .mkv, or
    uncompressed for .y4m. `VideoReader` with `luma` returns exactly its pictures, and the same pictures give
    the same file.

    Args:
        path: Video file, which must not exist; the suffix selects the container.
        fps: Pictures per second [Hz].
        quality: Quality from 0 (small file) to 10 (hardly any loss); ignored for a GIF and a lossless video.
        lossless: Whether to write grey pictures without loss.

    Raises:
        ValueError: For an unknown suffix, a file that exists, or a folder that does not exist.
    """

    def __init__(self, path: str | Path, fps: float, quality: float = 7.0, *, lossless: bool = False) -> None:
        self.path = check_path("path", path)
        self.fps = check_within("fps", fps, 1e-3, 1000.0, "Hz")
        self.quality = check_within("quality", quality, 0.0, 10.0)
        self.lossless = check_flag("lossless", lossless)
        suffixes = tuple(LOSSLESS_CODECS) if lossless else SUFFIXES
        if self.path.suffix.lower() not in suffixes:
            kind = "lossless video" if lossless else "video"
            raise ValueError(f"{kind} must have a suffix among {', '.join(suffixes)}, got {shown(str(path))}")
        if not self.path.parent.is_dir():
            raise ValueError(f"folder {str(self.path.parent)!r} of the video does not exist; create it first")
        check_new_file(self.path, "video")
        self._container: Any = None
        self._stream: Any = None
        self._count = 0

    def write(self, picture: np.ndarray) -> None:
        """Append a picture.

        Args:
            picture: RGB, uint8, shape (height, width, 3) with even height and width; of a lossless video
                grey, uint8, shape (height, width) of any size. The same size for all.

        Raises:
            ValueError: For a picture of another kind, of odd size or of another size than the first.
        """
        from av import VideoFrame

        if picture.dtype != np.uint8 or picture.ndim != (2 if self.lossless else 3):
            shape = "(height, width)" if self.lossless else "(height, width, 3)"
            raise ValueError(f"picture must be uint8 of shape {shape}, got {picture.dtype} {picture.shape}")
        size = (picture.shape[1], picture.shape[0])
        self._stream = self._stream or self._open(size)
        if size != (self._stream.width, self._stream.height):
            raise ValueError(
                f"picture must have the size of the first, {self._stream.width}×{self._stream.height} px, "
                f"got {size[0]}×{size[1]}"
            )
        pixels = np.ascontiguousarray(picture)
        frame = VideoFrame.from_ndarray(pixels, format="gray" if self.lossless else "rgb24")
        if not self.lossless:
            frame = frame.reformat(format=self._stream.pix_fmt, interpolation="AREA")
        frame.pts = self._count
        self._count += 1
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """Finish the file."""
        container, self._container = self._container, None
        if container is not None:
            container.mux(self._stream.encode(None))
            container.close()

    def __enter__(self) -> "VideoWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Finish the file, also after Ctrl-C; after an error, for example a full disk, remove it."""
        failed = kind is not None and issubclass(kind, Exception)
        try:
            self.close()
        except OSError:
            failed = True
            raise
        finally:
            if failed:
                self.path.unlink(missing_ok=True)

    def _open(self, size: tuple[int, int]) -> Any:
        """Open the file and return its video stream."""
        import av
        from av.codec.context import Flags

        if not self.lossless and (size[0] % 2 or size[1] % 2):
            raise ValueError(f"width and height of a picture must be even, got {size[0]}×{size[1]} px")
        rate = Fraction(self.fps).limit_denominator(10_000)
        options = {"fflags": "+bitexact"} if self.lossless else {}  # no time and no version of ffmpeg
        self._container = av.open(str(self.path), "w", options=options)
        suffix = self.path.suffix.lower()
        if self.lossless:
            stream = self._container.add_stream(LOSSLESS_CODECS[suffix], rate=rate)
            stream.pix_fmt = "gray"
            stream.codec_context.flags |= Flags.bitexact
        elif suffix == ".gif":
            stream = self._container.add_stream("gif", rate=rate)
            stream.pix_fmt = "rgb8"
        else:
            # Slower presets of x264 reduce the file size of rendered pictures only slightly.
            options = {"crf": str(int(51 * (1.0 - self.quality / 10.0))), "preset": "veryfast"}
            stream = self._container.add_stream("libx264", rate=rate, options=options)
            stream.pix_fmt = "yuv420p"
        stream.width, stream.height = size
        stream.codec_context.time_base = 1 / rate
        return stream
