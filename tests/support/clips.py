"""Video clips for tests, made with the ffmpeg program of imageio-ffmpeg; a stand-in for moviepy.

moviepy requires an old version of pillow with known vulnerabilities, so it is not installed for tests.
"""

import subprocess
import sys
from types import ModuleType

import numpy as np
from imageio_ffmpeg import get_ffmpeg_exe

from lgmd_gym.clips.video import VideoWriter


def ffmpeg(*arguments):
    subprocess.run([get_ffmpeg_exe(), "-v", "error", "-y", *map(str, arguments)], check=True, timeout=60)


def make_test_clip(path, *options, source="testsrc2=size=64x48:rate=30:duration=1"):
    """Write a clip of one of ffmpeg's test sources."""
    ffmpeg("-f", "lavfi", "-i", source, *options, path)
    return path


def write_lossless(path, pictures, fps=30.0):
    """Write grey pictures with a lossless codec."""
    height, width = pictures[0].shape
    raw = path.with_suffix(".raw")
    raw.write_bytes(b"".join(np.ascontiguousarray(picture).tobytes() for picture in pictures))
    ffmpeg("-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{width}x{height}", "-r", fps, "-i", raw,
           "-pix_fmt", "gray", "-c:v", "ffv1", path)  # fmt: skip
    raw.unlink()
    return path


def truncate(path, fraction):
    """Cut a file after a fraction of its bytes."""
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * fraction)])
    return path


MODULES = ("moviepy", "moviepy.video", "moviepy.video.io", "moviepy.video.io.ImageSequenceClip")


class ImageSequenceClip:
    """The part of moviepy's class that `RecordVideo` uses."""

    def __init__(self, frames, fps):
        self._frames, self._fps = frames, fps

    def write_videofile(self, path, logger=None):
        with VideoWriter(path, self._fps) as writer:
            for frame in self._frames:
                writer.write(frame)


def install_moviepy(monkeypatch):
    """Make `import moviepy` find a stand-in until the end of a test."""
    for name in MODULES:
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    sys.modules[MODULES[-1]].ImageSequenceClip = ImageSequenceClip
