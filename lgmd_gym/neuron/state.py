"""The maps of the fast kernel: how they lie in memory, and how to read them as pictures."""

import math

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.neuron import scalars as sc
from lgmd_gym.neuron.simd import LANES


def allocate(num: int, shape: tuple[int, int]) -> tuple[NDArray, ...]:
    """The maps of `num` neurons over `shape` pixels, all zero.

    Returns:
        P of this and the last frame in turn, bordered, (N, 2, size); the delayed rings, per 16 pixels the
        lanes of |P| and P of each ring, (N, H * blocks * 6 * 16); the last three rows of S and the sums of
        their columns, the sums bordered, (N, 4 * columns + 32); S * Ce of the rows that may survive,
        (N, H * columns); G, (N, H * columns); for each row the index of its S * Ce or -1, and whether G
        is not 0 there, (N, 2, H) int32.
    """
    h, w = shape
    blocks = -(-w // LANES)
    columns = blocks * LANES
    sizes = (
        (num, 2, LANES + (h + 2) * (columns + LANES)), (num, h * columns * 6), (num, 4 * columns + 2 * LANES),
        (num, h * columns), (num, h * columns),
    )  # fmt: skip
    return *map(_aligned, sizes), np.zeros((num, 2, h), np.int32)


def _aligned(size: tuple[int, ...]) -> NDArray[np.float32]:
    """Zeros that start at a multiple of a vector's bytes: loads across cache lines cost twice."""
    length = math.prod(size)
    room = np.zeros(length + LANES, np.float32)
    skip = -room.ctypes.data // room.itemsize % LANES
    return room[skip : skip + length].reshape(size)


def layers(rows, par, p, memory, s, products, g, slots) -> dict[str, NDArray[np.float32]]:
    """P, E, I, S and G of the last frame, each (N, H, columns of whole vectors)."""
    num, h = len(rows), slots.shape[2]
    turn = (rows[:, sc.AGE].astype(int) - 1) % 2
    bordered = p[np.arange(num), turn, LANES:].reshape(num, h + 2, -1)
    photo = bordered[:, 1:-1, :-LANES]
    rings = memory.reshape(num, h, -1, 3, 2, LANES).transpose(3, 4, 0, 1, 2, 5).reshape(3, 2, *photo.shape)
    both, side = (sum(par[sc.WEIGHT + i] * rings[i, j] for i in range(3)) for j in range(2))
    inhibited = 0.5 * (both + np.where(photo >= 0, side, -side))
    excess = np.maximum(0, np.abs(photo) - rows[:, sc.W, None, None] * inhibited)
    theta = np.where(photo >= 0, par[sc.THETA_1], par[sc.THETA_2])
    maps = {"P": photo, "E": np.abs(photo), "I": inhibited, "S": theta * excess, "G": g.reshape(photo.shape)}
    return {name: values.astype(np.float32, copy=False) for name, values in maps.items()}
