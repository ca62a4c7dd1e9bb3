"""Write video files with PyAV."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.errors import check_path, check_within, shown
from lgmd_gym.processes.files import check_new_file

SUFFIXES = (".mp4", ".mkv", ".mov", ".avi", ".gif")


class VideoWriter:
    """Write RGB pictures to a video file; use it in a `with` block.

    The codec is H.264, or GIF for the suffix .gif.

    Args:
        path: Video file, which must not exist; the suffix selects the container.
        fps: Pictures per second [Hz].
        quality: Quality from 0 (small file) to 10 (lossless); ignored for a GIF.

    Raises:
        ValueError: For an unknown suffix, a file that exists, or a folder that does not exist.
    """

    def __init__(self, path: str | Path, fps: float, quality: float = 7.0) -> None:
        self.path = check_path("path", path)
        self.fps = check_within("fps", fps, 1e-3, 1000.0, "Hz")
        self.quality = check_within("quality", quality, 0.0, 10.0)
        if self.path.suffix.lower() not in SUFFIXES:
            raise ValueError(f"video must have a suffix among {', '.join(SUFFIXES)}, got {shown(str(path))}")
        if not self.path.parent.is_dir():
            raise ValueError(f"folder {str(self.path.parent)!r} of the video does not exist; create it first")
        check_new_file(self.path, "video")
        self._container: Any = None
        self._stream: Any = None
        self._count = 0

    def write(self, picture: np.ndarray) -> None:
        """Append a picture.

        Args:
            picture: RGB, uint8, shape (height, width, 3) with even height and width, the same for all.

        Raises:
            ValueError: For a picture of odd size or of another size than the first.
        """
        from av import VideoFrame

        size = (picture.shape[1], picture.shape[0])
        self._stream = self._stream or self._open(size)
        if size != (self._stream.width, self._stream.height):
            raise ValueError(
                f"picture must have the size of the first, {self._stream.width}×{self._stream.height} px, "
                f"got {size[0]}×{size[1]}"
            )
        rgb = VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        frame = rgb.reformat(format=self._stream.pix_fmt, interpolation="AREA")
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

        if size[0] % 2 or size[1] % 2:
            raise ValueError(f"width and height of a picture must be even, got {size[0]}×{size[1]} px")
        rate = Fraction(self.fps).limit_denominator(10_000)
        self._container = av.open(str(self.path), "w")
        if self.path.suffix.lower() == ".gif":
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
