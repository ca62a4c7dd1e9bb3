"""Write video files with ffmpeg."""

from pathlib import Path
from types import TracebackType
from typing import Any, cast

import numpy as np

SUFFIXES = (".mp4", ".mkv", ".mov", ".avi", ".gif")


class VideoWriter:
    """A video file that takes RGB pictures one after the other; use it in a `with` block.

    Args:
        path: The file, which must not exist; the suffix chooses the container.
        fps: Pictures per second [Hz].
        quality: From 0, small, to 10, fine; a GIF has none.

    Raises:
        ValueError: For an unknown suffix, a file that exists, or a folder that does not.
    """

    def __init__(self, path: str | Path, fps: float, quality: float = 7.0) -> None:
        self.path = Path(path)
        self.fps, self.quality = fps, quality
        if self.path.suffix.lower() not in SUFFIXES:
            raise ValueError(f"video {str(path)!r} needs a suffix among {', '.join(SUFFIXES)}")
        if self.path.exists():
            raise ValueError(f"video {str(path)!r} exists and is kept; choose another name")
        if not self.path.parent.is_dir():
            raise ValueError(f"folder {str(self.path.parent)!r} of the video does not exist; make it first")
        self._size: tuple[int, int] | None = None
        self._sink = None

    def write(self, picture: np.ndarray) -> None:
        """Append a picture, uint8, shape (height, width, 3), even height and width; all of one size."""
        size = (picture.shape[1], picture.shape[0])
        if self._sink is None:
            self._open(size)
        if size != self._size:
            raise ValueError(f"picture of {size} px in a video of {self._size} px; keep one size")
        assert self._sink is not None
        self._sink.send(np.ascontiguousarray(picture))

    def close(self) -> None:
        """Finish the file."""
        if self._sink is not None:
            self._sink.close()
            self._sink = None

    def __enter__(self) -> "VideoWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _open(self, size: tuple[int, int]) -> None:
        from imageio_ffmpeg import write_frames

        options: dict[str, Any] = {"quality": self.quality, "macro_block_size": 2, "pix_fmt_out": "yuv420p"}
        # Drawn pictures gain little from x264's slower presets, which would hold up whoever draws.
        options["output_params"] = ["-preset", "veryfast"]
        if self.path.suffix.lower() == ".gif":
            options = {"codec": "gif", "pix_fmt_out": "pal8"}
        self._size = size
        self._sink = write_frames(
            str(self.path), size, fps=cast(int, self.fps), pix_fmt_in="rgb24", **options
        )
        self._sink.send(None)
