"""What a video file holds, from one pass over its packets that decodes nothing."""

import heapq
import re
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, NamedTuple

# Time stamps come in decoding order; this many packets put them back in the order of display.
_REORDER = 32
# Intervals that stray from their mean by more than this fraction and by more than a tick: variable rate.
_JITTER = 0.05


class VideoInfo(NamedTuple):
    """What a video file holds.

    Attributes:
        path: The file.
        fps: Frames per second; of a variable rate, that of the usual interval.
        frames: Number of frames in the file, as far as its packets go.
        variable: Whether the intervals between frames vary.
        promised: Duration that the file's header promises [s]; None if it promises none.
    """

    path: Path
    fps: float
    frames: int
    variable: bool
    promised: float | None

    @property
    def duration(self) -> float:
        """Frames over rate [s]."""
        return self.frames / self.fps


def probe(path: str | Path) -> VideoInfo:
    """Return what a video file holds.

    Raises:
        ValueError: For a file that is missing, empty, no video, or sound alone.
    """
    path = Path(path)
    if not path.exists():
        raise ValueError(f"clip {str(path)!r} does not exist")
    if not path.is_file():
        raise ValueError(f"clip {str(path)!r} is not a file")
    if path.stat().st_size == 0:
        raise ValueError(f"clip {str(path)!r} is empty (0 bytes)")
    with tempfile.TemporaryFile() as log:
        listing = ["-map", "0:V:0", "-c", "copy", "-f", "framecrc", "-"]
        with ffmpeg_reads(path, listing, log) as process:
            assert process.stdout is not None
            frames, intervals, tick = _intervals(process.stdout)
        said = messages(log)
    if not frames:
        raise ValueError(f"clip {str(path)!r} {_trouble(said)}")
    fps, variable = _rate(intervals, tick, said)
    return VideoInfo(path, fps, frames, variable, _promised(said))


def ffmpeg_reads(path: Path, output: list[str], log: IO[bytes]) -> subprocess.Popen[bytes]:
    """Start ffmpeg on a local file, its answer on a pipe, what it says in `log`.

    The file is named as one and nothing else may be opened: a playlist cannot reach out to the network.
    """
    from imageio_ffmpeg import get_ffmpeg_exe

    source = ["-protocol_whitelist", "file", "-i", f"file:{path}"]
    command = [get_ffmpeg_exe(), "-nostdin", "-hide_banner", "-nostats", *source, *output]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log)


def messages(log: IO[bytes]) -> str:
    """Return the start and the end of what ffmpeg said; a broken file can make it say megabytes."""
    size = log.seek(0, 2)
    log.seek(0)
    text = log.read(20_000)
    if size > 40_000:
        log.seek(size - 20_000)
    return (text + log.read(20_000)).decode("utf-8", "replace")


def _intervals(lines: IO[bytes]) -> tuple[int, dict[int, int], float]:
    """Return the number of packets, how often each interval [ticks] occurs, and the length of a tick [s]."""
    tick, packets, counts = 1.0, 0, {}
    last: int | None = None

    def shown() -> Iterator[int]:
        nonlocal tick, packets
        waiting: list[int] = []
        for line in lines:
            if line.startswith(b"#tb 0:"):
                above, below = line.split(b":")[1].split(b"/")
                tick = int(above) / int(below)
            if line.startswith(b"#"):
                continue
            packets += 1
            stamp = line.split(b",")[2].strip()
            if stamp.lstrip(b"-").isdigit():
                heapq.heappush(waiting, int(stamp))
            if len(waiting) > _REORDER:
                yield heapq.heappop(waiting)
        while waiting:
            yield heapq.heappop(waiting)

    for stamp in shown():
        # A few thousand different intervals tell the rate as well as more, and take no more room.
        if last is not None and stamp > last and (len(counts) < 4096 or stamp - last in counts):
            counts[stamp - last] = counts.get(stamp - last, 0) + 1
        last = stamp
    return packets, counts, tick


def _rate(counts: dict[int, int], tick: float, said: str) -> tuple[float, bool]:
    """Return the rate [Hz] and whether it varies."""
    found = re.search(r"Video:.*?([\d.]+) (?:fps|tbr)", said)
    named = float(found[1]) if found else 0.0
    if not counts:
        return named or 25.0, False
    total = sum(counts.values())
    middle, seen = 0, 0
    for interval in sorted(counts):
        middle, seen = interval, seen + counts[interval]
        if 2 * seen >= total:
            break
    near = {i: n for i, n in counts.items() if abs(i - middle) <= max(1, _JITTER * middle)}
    fps = sum(near.values()) / (sum(i * n for i, n in near.items()) * tick)
    # Stamps in whole milliseconds make a short clip's 30 Hz 29.995: then what the file says is better.
    return (named if abs(fps - named) < 1e-3 * fps else round(fps, 4)), len(near) < len(counts)


def _promised(said: str) -> float | None:
    """Return the duration in the header [s]."""
    found = re.search(r"Duration: (\d+):(\d\d):(\d\d\.\d+)", said)
    return None if found is None else 3600.0 * int(found[1]) + 60.0 * int(found[2]) + float(found[3])


def _trouble(said: str) -> str:
    """Say why no packet came, from ffmpeg's messages."""
    if "Audio:" in said and not re.search(r"Video: (?!.*attached pic)", said):
        return "holds no picture: it is sound alone"
    if "moov atom not found" in said:
        return "is truncated, or no video: its index is missing, and no frame can be read without it"
    if "partial file" in said or "ended prematurely" in said:
        return "is truncated ahead of the end of its first frame"
    if "Invalid data found" in said:
        return "is no video that ffmpeg can read"
    return "holds no frame that ffmpeg can read"
