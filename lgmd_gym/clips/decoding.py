"""Opening and decoding of video files: frames with time stamps, and their display matrix."""

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from heapq import heapify, heappop, heappush
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from av import Packet, VideoFrame
    from av.container import InputContainer
    from av.video.stream import VideoStream

# Filters of a display matrix (a, b, c, d): the pixel (x, y), y down, is at (a x + c y, b x + d y).
_UPRIGHT = {
    (1, 0, 0, 1): (),
    (-1, 0, 0, 1): ("hflip",),
    (1, 0, 0, -1): ("vflip",),
    (-1, 0, 0, -1): ("hflip", "vflip"),
    (0, 1, -1, 0): ("transpose=clock",),
    (0, -1, 1, 0): ("transpose=cclock",),
    (0, 1, 1, 0): ("transpose=cclock_flip",),
    (0, -1, -1, 0): ("transpose=clock_flip",),
}
_SKEW = 0.02  # largest deviation of an entry of the scaled matrix, about 1 degree


@contextmanager
def open_video(path: Path) -> Generator["tuple[InputContainer, VideoStream]", None, None]:
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


def is_untimed(container: "InputContainer") -> bool:
    """Return whether a format numbers its packets in the order of decoding and has no times of display.

    Around a gap, the times of pictures that were stored out of order are then up to some frames early.
    """
    return container.format.name == "avi"


def stamp_of(packet: "Packet[Any]", untimed: bool) -> int | None:
    """Return the time stamp of a packet [ticks], or None; sorted, those of a stream are its display times."""
    return packet.dts if untimed else packet.pts


def decode(container: "InputContainer", stream: "VideoStream", fps: float) -> Iterator["VideoFrame"]:
    """Yield the frames of a stream, each with a time stamp; packets that cannot be decoded are skipped.

    A frame without a time stamp follows the one before it at the frame rate.
    """
    from av.error import InvalidDataError

    assert stream.time_base is not None
    base, since, interval = 0, 0, 1.0 / (fps * float(stream.time_base))
    untimed, waiting = is_untimed(container), list[int]()
    for packet in container.demux(stream):
        stamp = stamp_of(packet, True) if untimed and packet.size > 0 else None
        if stamp is not None:
            heappush(waiting, stamp)
        try:
            frames = packet.decode()
        except InvalidDataError:
            if stamp is not None:
                waiting.remove(stamp)
                heapify(waiting)
            continue
        for frame in frames:
            if untimed:
                frame.pts = heappop(waiting) if waiting else None
            if frame.pts is None:
                frame.pts = base + round(since * interval)
            else:
                base, since = frame.pts, 0
            since += 1
            yield frame


def upright(frame: "VideoFrame", path: Path) -> tuple[str, ...]:
    """Return the filters that apply the display matrix of a frame.

    Raises:
        ValueError: If the matrix is no combination of quarter turns and mirrors.
    """
    side_data: Any = frame.side_data  # PyAV states the type of its items as str
    data = next((item for item in side_data if item.type.name == "DISPLAYMATRIX"), None)
    if data is None:
        return ()
    entries = np.frombuffer(bytes(data)[:36], np.int32).reshape(3, 3)[:2, :2] / 65536.0
    scale = float(np.hypot(*entries).max())
    unit = entries / scale if scale > 0.0 else entries
    whole = np.round(unit).astype(int)
    key = (int(whole[0, 0]), int(whole[0, 1]), int(whole[1, 0]), int(whole[1, 1]))
    if np.abs(unit - whole).max() > _SKEW or key not in _UPRIGHT:
        raise ValueError(
            f"clip {str(path)!r} has a display matrix {entries.round(3).tolist()} that is no combination of "
            "quarter turns and mirrors; write it anew with ffmpeg -i"
        )
    return _UPRIGHT[key]
