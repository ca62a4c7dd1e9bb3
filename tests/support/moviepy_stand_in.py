"""A stand-in for moviepy, with which Gymnasium's `RecordVideo` writes files.

moviepy requires an old version of pillow with known vulnerabilities, so it is not installed for tests.
"""

import sys
from types import ModuleType

from lgmd_gym.clips.video import VideoWriter

MODULES = ("moviepy", "moviepy.video", "moviepy.video.io", "moviepy.video.io.ImageSequenceClip")


class ImageSequenceClip:
    """The part of moviepy's class that `RecordVideo` uses."""

    def __init__(self, frames, fps):
        self._frames, self._fps = frames, fps

    def write_videofile(self, path, logger=None):
        with VideoWriter(path, self._fps) as writer:
            for frame in self._frames:
                writer.write(frame)


def install(monkeypatch):
    """Make `import moviepy` find the stand-in until the end of a test."""
    for name in MODULES:
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    sys.modules[MODULES[-1]].ImageSequenceClip = ImageSequenceClip
