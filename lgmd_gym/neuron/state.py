"""Memory layout of the maps of the fast kernel."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.kernels.simd import LANES
from lgmd_gym.neuron import scalars as sc


def allocate(num: int, shape: tuple[int, int]) -> tuple[NDArray[Any], ...]:
    """Return the maps of `num` neurons over `shape` pixels, filled with 0.

    Rows are padded to `columns`, a multiple of 16 pixels. Maps are float32 unless stated otherwise.

    Returns:
        p: P of the current and the last frame in turn, with borders, (N, 2, size).
        memory: Delayed rings; each block of 16 pixels holds 16 lanes of |P| and of P per ring,
            (N, H * columns * 6).
        s: The last three rows of S, and their column sums with a border, (N, 4 * columns + 32).
        products: S * Ce of the rows that can pass the grouping threshold, (N, H * columns).
        g: G, (N, H * columns).
        slots: Per row, the index of its S * Ce or -1, and whether its G is not 0, (N, 2, H) int32.
    """
    h, w = shape
    columns = -(-w // LANES) * LANES
    sizes = (
        (num, 2, LANES + (h + 2) * (columns + LANES)), (num, h * columns * 6), (num, 4 * columns + 2 * LANES),
        (num, h * columns), (num, h * columns),
    )  # fmt: skip
    return *(_aligned_zeros(size) for size in sizes), np.zeros((num, 2, h), np.int32)


def shifted_views(maps: tuple[NDArray[Any], ...], height: int) -> tuple[NDArray[np.float32], ...]:
    """Return views of the maps that the next frame depends on.

    Args:
        maps: Maps of `allocate`.
        height: Height of the frames [px].

    Returns:
        p: (N, 2, H + 2, columns + 16), with the borders above and below.
        memory: (N, H, blocks of 16 pixels, 6, 16).
        g: (N, H, columns).
    """
    p, memory, _, _, g, _ = maps
    num = len(p)
    bordered = p[:, :, LANES:].reshape(num, 2, height + 2, -1)
    return bordered, memory.reshape(num, height, -1, 6, LANES), g.reshape(num, height, -1)


def _aligned_zeros(shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return zeros that start at a multiple of a vector's size: loads across cache lines cost twice."""
    size = math.prod(shape)
    buffer = np.zeros(size + LANES, np.float32)
    skip = -buffer.ctypes.data // buffer.itemsize % LANES
    return buffer[skip : skip + size].reshape(shape)


def layers(scalars, const, p, memory, s, products, g, slots) -> dict[str, NDArray[np.float32]]:
    """Return P, E, I, S and G of the last frame, each of shape (N, H, columns)."""
    num, h = len(scalars), slots.shape[2]
    current = (scalars[:, sc.AGE].astype(int) - 1) % 2
    bordered = p[np.arange(num), current, LANES:].reshape(num, h + 2, -1)
    photo = bordered[:, 1:-1, :-LANES]
    rings = memory.reshape(num, h, -1, 3, 2, LANES).transpose(3, 4, 0, 1, 2, 5).reshape(3, 2, *photo.shape)
    magnitude, signed = (sum(const[sc.WEIGHT + i] * rings[i, j] for i in range(3)) for j in range(2))
    inhibition = 0.5 * (magnitude + np.where(photo >= 0, signed, -signed))
    excess = np.maximum(0, np.abs(photo) - scalars[:, sc.W, None, None] * inhibition)
    theta = np.where(photo >= 0, const[sc.THETA_1], const[sc.THETA_2])
    maps = {"P": photo, "E": np.abs(photo), "I": inhibition, "S": theta * excess, "G": g.reshape(photo.shape)}
    return {name: values.astype(np.float32, copy=False) for name, values in maps.items()}
