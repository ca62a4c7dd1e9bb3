"""Clips that tests make, without loss or with whatever is wrong."""

import subprocess

import numpy as np
from imageio_ffmpeg import get_ffmpeg_exe


def ffmpeg(*arguments):
    subprocess.run([get_ffmpeg_exe(), "-v", "error", "-y", *map(str, arguments)], check=True, timeout=60)


def synthesize(path, *options, source="testsrc2=size=64x48:rate=30:duration=1"):
    """Make a tiny clip of ffmpeg's own test picture."""
    ffmpeg("-f", "lavfi", "-i", source, *options, path)
    return path


def store(path, pictures, fps=30.0, size=None):
    """Store grey pictures without loss."""
    height, width = pictures[0].shape
    raw = path.with_suffix(".raw")
    raw.write_bytes(b"".join(np.ascontiguousarray(picture).tobytes() for picture in pictures))
    ffmpeg("-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{width}x{height}", "-r", fps, "-i", raw,
           "-pix_fmt", "gray", "-c:v", "ffv1", path)  # fmt: skip
    raw.unlink()
    return path


def broken(path, keep):
    """Cut a file after a fraction of its bytes."""
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * keep)])
    return path
