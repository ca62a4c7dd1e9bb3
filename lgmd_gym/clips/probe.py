"""Frame rate, length and completeness of a video file, without decoding it."""

from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lgmd_gym.errors import check_path

if TYPE_CHECKING:
    from av.container import InputContainer
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
    """

    path: Path
    fps: float
    frames: int
    variable: bool
    missing: float

    @property
    def duration(self) -> float:
        """Number of frames divided by the frame rate [s]."""
        return self.frames / self.fps


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
        missing = 0.0
        if stream.duration and len(stamps):
            missing = stream.duration * tick - (end - stamps[0] * tick)
        elif container.duration:
            missing = container.duration / 1e6 - file_end
    return VideoInfo(path, fps, frames, variable, max(float(missing), 0.0))


def _is_playlist(path: Path) -> bool:
    """Return whether a file lists other files (HLS, DASH, ffconcat): ffmpeg waits for a live one for ever."""
    with path.open("rb") as file:
        head = file.read(4096)
    return head.startswith((b"#EXTM3U", b"ffconcat")) or b"<MPD" in head


@contextmanager
def open_video(path: Path) -> Iterator["tuple[InputContainer, VideoStream]"]:
    """Open a local file and yield its container and first video stream, cover pictures excepted.

    Only the file itself can be opened: a playlist cannot load anything from the network.

    Raises:
        ValueError: If the file is not a video or has no video stream.
    """
    import av
    from av.error import FFmpegError
    from av.stream import Disposition

    try:
        container = av.open(f"file:{path}", options={"protocol_whitelist": "file"})
    except FFmpegError as error:
        raise ValueError(f"clip {str(path)!r} is truncated or not a video: {error.strerror}") from None
    with container:
        for stream in container.streams.video:
            if not stream.disposition & Disposition.attached_pic:
                yield container, stream
                return
        raise ValueError(f"clip {str(path)!r} has no video stream")


def _scan(container: "InputContainer", stream: "VideoStream") -> tuple[int, np.ndarray, float, float]:
    """Return the frames and sorted time stamps [ticks] of a stream, its end and that of all streams [s]."""
    frames, stamps = 0, array("q")  # eight bytes per frame: 2 MB for two hours
    end = file_end = 0.0
    for packet in container.demux(container.streams.video + container.streams.audio):
        in_video = packet.stream is stream
        frames += in_video and packet.size > 0
        if packet.pts is None:
            continue
        packet_end = float((packet.pts + (packet.duration or 0)) * packet.time_base)
        file_end = max(file_end, packet_end)
        if in_video:
            stamps.append(packet.pts)
            end = max(end, packet_end)
    return frames, np.sort(np.frombuffer(stamps, np.int64)), end, file_end


def _rate(stamps: np.ndarray, tick: float, named: float) -> tuple[float, bool]:
    """Return the frame rate [Hz] and whether it varies; `named` is the rate in the file's header [Hz]."""
    intervals = np.sort(np.diff(stamps))
    intervals = intervals[intervals > 0]
    if not len(intervals):
        return round(named, 4), False
    median = intervals[(len(intervals) - 1) // 2]
    regular = intervals[np.abs(intervals - median) <= max(1.0, _JITTER * median)]
    fps = len(regular) / (float(regular.sum()) * tick)
    # Stamps in whole milliseconds turn 30 Hz into 29.995 Hz in a short clip; the header is then more exact.
    return round(named if abs(fps - named) < 1e-3 * fps else fps, 4), len(regular) < len(intervals)
