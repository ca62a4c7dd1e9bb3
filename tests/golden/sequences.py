"""Deterministic grey frame sequences for tests of the neuron: uint8, shape (frames, height, width)."""

import numpy as np
from numpy.typing import NDArray

Frames = NDArray[np.uint8]


def random(shape: tuple[int, int], count: int, seed: int = 0) -> Frames:
    """Return independent white noise in every frame."""
    return np.random.default_rng(seed).integers(0, 256, (count, *shape), dtype=np.uint8)


def natural(shape: tuple[int, int], count: int, seed: int = 0) -> Frames:
    """Return a 1/f texture that drifts by one row and two columns per frame."""
    rng = np.random.default_rng(seed)
    h, w = shape[0] + count, shape[1] + 2 * count
    frequency = np.hypot(np.fft.fftfreq(h)[:, None], np.fft.fftfreq(w))
    frequency[0, 0] = 1.0
    image = np.fft.ifft2(np.exp(2j * np.pi * rng.random((h, w))) / frequency).real
    image = np.clip(128 + 45 * (image - image.mean()) / max(image.std(), 1e-9), 0, 255).astype(np.uint8)
    return np.stack([image[i : i + shape[0], 2 * i : 2 * i + shape[1]] for i in range(count)])


def grating(
    shape: tuple[int, int], count: int, *, period_px: float = 24.0, hz: float = 2.0, fps: float = 30.0
) -> Frames:
    """Return a full-contrast sine grating that drifts to the right."""
    x, t = np.arange(shape[1]), np.arange(count)[:, None] / fps
    rows = np.rint(127.5 + 127.5 * np.sin(2 * np.pi * (x / period_px - hz * t))).astype(np.uint8)
    return np.broadcast_to(rows[:, None, :], (count, *shape)).copy()


def looming(
    shape: tuple[int, int], count: int, *, target: int = 40, background: int = 150, receding: bool = False
) -> Frames:
    """Return a square on a uniform background that grows like an approaching object at constant speed."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    distance = np.maximum(abs(y - (shape[0] - 1) / 2), abs(x - (shape[1] - 1) / 2))
    frames = np.full((count, *shape), background, np.uint8)
    for i in range(count):
        frames[i][distance < 0.5 * max(shape) / (count - i)] = target
    return frames[::-1].copy() if receding else frames


KINDS = {"random": random, "natural": natural, "grating": grating, "looming": looming}
