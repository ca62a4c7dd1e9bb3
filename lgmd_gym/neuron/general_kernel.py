"""The general kernel: every structural choice of `LGMDParams`, in plain loops; `kernels` is the fast one."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from lgmd_gym.neuron import scalars as sc
from lgmd_gym.neuron.scalars import feed_forward, fire


def allocate(num: int, shape: tuple[int, int], n_p: int, paths: int) -> tuple[NDArray[np.float32], ...]:
    """The maps of `num` neurons over `shape` pixels, all zero.

    Returns:
        P of the last n_p frames (at least one), newest first, (N, n_p, H, W); E of both paths with a
        border of one pixel, (N, paths, H + 2, W + 2); the delay's memory per path and ring,
        (N, paths, 3, H, W); I per path, (N, paths, H, W); S with a border, (N, H + 2, W + 2); G, (N, H, W).
    """
    h, w = shape
    sizes = (
        (num, max(n_p, 1), h, w), (num, paths, h + 2, w + 2), (num, paths, 3, h, w), (num, paths, h, w),
        (num, h + 2, w + 2), (num, h, w),
    )  # fmt: skip
    return tuple(np.zeros(size, np.float32) for size in sizes)


@njit(cache=True, nogil=True)
def replicate_border(image: NDArray) -> None:
    """Fill the border of one pixel with the nearest inner pixel."""
    h, w = image.shape
    for y in range(1, h - 1):
        image[y, 0], image[y, w - 1] = image[y, 1], image[y, w - 2]
    for x in range(w):
        image[0, x], image[h - 1, x] = image[1, x], image[h - 2, x]


@njit(cache=True, nogil=True)
def photoreceptors(frame, prev, y0, x0, weight, par, p) -> float:
    """Shift P one frame back, write the new one to p[0] (eq. 1) and return the sum of |P|."""
    n_p, h, w = int(par[sc.N_P]), p.shape[1], p.shape[2]
    total = 0.0
    for y in range(h):
        for x in range(w):
            change = np.float32(frame[y0 + y, x0 + x]) - np.float32(prev[y, x])
            if weight.size > 0:
                change *= weight[y, x]
            value = np.float64(change)
            for i in range(n_p):
                value += par[sc.TAP + i] * p[i, y, x]
            for i in range(n_p - 1, 0, -1):
                p[i, y, x] = p[i - 1, y, x]
            p[0, y, x] = value
            total += abs(value)
            prev[y, x] = frame[y0 + y, x0 + x]
    return total


@njit(cache=True, nogil=True)
def excitation(p, e, par) -> None:
    """E of every path (eq. 3), with its border."""
    keep = np.float32(par[sc.RESIDUE])
    for c in range(e.shape[0]):
        for y in range(p.shape[0]):
            for x in range(p.shape[1]):
                value = p[y, x]
                if e.shape[0] == 2:
                    value = max(np.float32(0), value if c == 0 else -value) + keep * e[c, y + 1, x + 1]
                e[c, y + 1, x + 1] = value
        replicate_border(e[c])


@njit(cache=True, nogil=True)
def inhibition(e, memory, out, par, warm) -> None:
    """I of one path (eq. 4 to 6). Delay and neighbourhood commute, so each ring is summed, then delayed."""
    _, h, w = memory.shape
    for y in range(h):
        for x in range(w):
            near = e[y, x + 1] + e[y + 2, x + 1] + e[y + 1, x] + e[y + 1, x + 2]
            far = e[y, x] + e[y, x + 2] + e[y + 2, x] + e[y + 2, x + 2]
            total = np.float32(0)
            for ring in range(3):
                now = e[y + 1, x + 1] if ring == 0 else near if ring == 1 else far
                gain = np.float32(1) if warm else np.float32(par[sc.GAIN_2 + ring])
                delayed = memory[ring, y, x] + gain * (now - memory[ring, y, x])
                memory[ring, y, x] = now if par[sc.TWO_TAP] > 0 else delayed
                total += np.float32(par[sc.WEIGHT + ring]) * delayed
            out[y, x] = total


@njit(cache=True, nogil=True)
def summation(e, inhibited, s, w, par) -> None:
    """S of equations 7 and 8, with its border."""
    theta_1, theta_2 = np.float32(par[sc.THETA_1]), np.float32(par[sc.THETA_2])
    theta_3, weight, zero = np.float32(par[sc.THETA_3]), np.float32(w), np.float32(0)
    for y in range(s.shape[0] - 2):
        for x in range(s.shape[1] - 2):
            first = e[0, y + 1, x + 1] - weight * inhibited[0, y, x]
            if e.shape[0] == 2:
                on = max(zero, first)
                off = max(zero, e[1, y + 1, x + 1] - weight * inhibited[1, y, x])
                first = theta_1 * on + theta_2 * off + theta_3 * on * off
            s[y + 1, x + 1] = first
    replicate_border(s)


@njit(cache=True, nogil=True)
def local_mean(s, y, x) -> np.floating:
    """Ce, the mean of the 3x3 neighbourhood of pixel (y, x) of the bordered S."""
    total = np.float32(0)
    for dy in range(3):
        for dx in range(3):
            total += s[y + dy, x + dx]
    return total / np.float32(9)


@njit(cache=True, nogil=True)
def grouping(s, g_map, row, par) -> float | np.floating:
    """Group S, filter G (eq. 9) and return the sum of this frame's g."""
    h, w = g_map.shape
    largest = np.float32(0)
    for y in range(h):
        for x in range(w):
            largest = max(largest, abs(local_mean(s, y, x)))
    omega = par[sc.DELTA_C] + largest / par[sc.C_W]
    total, gain = 0.0, np.float32(row[sc.GAIN_G])
    for y in range(h):
        for x in range(w):
            g = np.float32(s[y + 1, x + 1] * local_mean(s, y, x) / omega)
            g = g if g >= par[sc.T_G] else np.float32(0)
            g_map[y, x] += gain * (g - g_map[y, x])
            total += g
    return total


@njit(cache=True, nogil=True)
def step(first, last, frames, prev, y0, x0, weight, active, rows, par, p, e, memory, inhibited, s, g) -> None:
    """Step the neurons first..last-1 that are active.

    Args:
        first: First neuron.
        last: One beyond the last neuron.
        frames: New frames, (N, H, W), uint8 or float32; the neuron sees the region that starts at (y0, x0).
        prev: The region's last luminance, (N, h, w), in the dtype of `frames`; overwritten.
        y0: First row of the region.
        x0: First column of the region.
        weight: Weights of the pixels, (h, w) float32, or (0, 0) for 1 everywhere.
        active: Which neurons to step, (N,) bool.
        rows: Scalars, see `scalars`, (N, RING + n_ts) float64.
        par: Constants, see `scalars`.
        p: This and the next are the maps of `allocate`.
        e: See `allocate`.
        memory: See `allocate`.
        inhibited: See `allocate`.
        s: See `allocate`.
        g: See `allocate`.
    """
    for n in range(first, last):
        if not active[n]:
            continue
        row = rows[n]
        if row[sc.AGE] == 0.0:
            prev[n] = frames[n, y0 : y0 + prev.shape[1], x0 : x0 + prev.shape[2]]
            row[sc.AGE] = 1.0
            continue
        feed_forward(row, par, photoreceptors(frames[n], prev[n], y0, x0, weight, par, p[n]))
        excitation(p[n, 0], e[n], par)
        warm = par[sc.WARM_START] > 0.0 and row[sc.AGE] == 1.0
        for c in range(e.shape[1]):
            inhibition(e[n, c], memory[n, c], inhibited[n, c], par, warm)
        summation(e[n], inhibited[n], s[n], row[sc.W], par)
        fire(row, par, grouping(s[n], g[n], row, par))


def layers(rows, par, p, e, memory, inhibited, s, g) -> dict[str, NDArray[np.float32]]:
    """P, E, I, S and G of the last frame, each (N, H, W)."""
    inner = (..., slice(1, -1), slice(1, -1))
    ours = inhibited[:, 0] if e.shape[1] == 1 else np.where(p[:, 0] >= 0, inhibited[:, 0], inhibited[:, 1])
    return {"P": p[:, 0], "E": e[inner].sum(1), "I": ours, "S": s[inner], "G": g}
