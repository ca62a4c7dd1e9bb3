"""Memory layout of the maps of the fast kernel."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.neuron import scalars as sc
from lgmd_gym.neuron.simd import LANES


class Maps(NamedTuple):
    """Maps of N neurons over H rows of `blocks` blocks of 16 pixels; float32 unless stated otherwise.

    Attributes:
        p: P of the current and the last frame in turn, with borders, (N, 2, size).
        memory: Delayed rings; each block holds 16 lanes of |P| and of P per ring, (N, H * blocks * 6 * 16).
        s: The last three rows of S, and their column sums with a border, (N, 4 * blocks * 16 + 32).
        products: S * Ce of the rows that can pass the grouping threshold, (N, H * blocks * 16).
        g: G, (N, H * blocks * 16).
        slots: Per row, the index of its S * Ce or -1, and whether its G is not 0, (N, 2, H) int32.
    """

    p: NDArray[np.float32]
    memory: NDArray[np.float32]
    s: NDArray[np.float32]
    products: NDArray[np.float32]
    g: NDArray[np.float32]
    slots: NDArray[np.int32]


def allocate(num: int, shape: tuple[int, int]) -> Maps:
    """Return the maps of `num` neurons over `shape` pixels, filled with 0."""
    h, w = shape
    blocks = -(-w // LANES)
    columns = blocks * LANES
    return Maps(
        p=_aligned_zeros(num, 2, LANES + (h + 2) * (columns + LANES)),
        memory=_aligned_zeros(num, h * columns * 6),
        s=_aligned_zeros(num, 4 * columns + 2 * LANES),
        products=_aligned_zeros(num, h * columns),
        g=_aligned_zeros(num, h * columns),
        slots=np.zeros((num, 2, h), np.int32),
    )


def _aligned_zeros(*shape: int) -> NDArray[np.float32]:
    """Return zeros that start at a multiple of a vector's size: loads across cache lines cost twice."""
    size = math.prod(shape)
    buffer = np.zeros(size + LANES, np.float32)
    skip = -buffer.ctypes.data // buffer.itemsize % LANES
    return buffer[skip : skip + size].reshape(shape)


def layers(scalars, const, p, memory, s, products, g, slots) -> dict[str, NDArray[np.float32]]:
    """Return P, E, I, S and G of the last frame, each of shape (N, H, blocks * 16)."""
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
