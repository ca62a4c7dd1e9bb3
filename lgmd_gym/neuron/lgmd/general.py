# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""General kernel: all structural options of `LGMDParams` in plain loops; `kernels` has the fast kernel."""

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.kernels import kernel
from lgmd_gym.neuron import scalars as sc
from lgmd_gym.neuron.scalars import feed_forward, fire


def allocate(num: int, shape: tuple[int, int], n_p: int) -> tuple[NDArray[np.float32], ...]:
    """Return the maps of `num` neurons over `shape` pixels, filled with 0; the paths are ON and OFF.

    Returns:
        p: P of the last n_p frames (at least one), newest first, (N, n_p, H, W).
        e: E per path with a border of one pixel, (N, 2, H + 2, W + 2).
        memory: Memory of the delay per path and ring, (N, 2, 3, H, W).
        inhibition: I per path, (N, 2, H, W).
        s: S with a border of one pixel, (N, H + 2, W + 2).
        g: G, (N, H, W).
    """
    h, w = shape
    sizes = (
        (num, max(n_p, 1), h, w), (num, 2, h + 2, w + 2), (num, 2, 3, h, w), (num, 2, h, w),
        (num, h + 2, w + 2), (num, h, w),
    )  # fmt: skip
    return tuple(np.zeros(size, np.float32) for size in sizes)


@kernel(exact=True, arrays=True)
def replicate_border(image: NDArray) -> None:
    """Set the border of one pixel to the nearest inner pixel."""
    h, w = image.shape
    for y in range(1, h - 1):
        image[y, 0], image[y, w - 1] = image[y, 1], image[y, w - 2]
    for x in range(w):
        image[0, x], image[h - 1, x] = image[1, x], image[h - 2, x]


@kernel(exact=True, arrays=True)
def photoreceptors(frame, previous, y0, x0, weight, const, p) -> float:
    """Shift P back by one frame, write the new P to p[0] (eq. 1) and return the sum of |P|."""
    n_p, h, w = int(const[sc.N_P]), p.shape[1], p.shape[2]
    total = 0.0
    for y in range(h):
        for x in range(w):
            change = np.float32(frame[y0 + y, x0 + x]) - np.float32(previous[y, x])
            if weight.size > 0:
                change *= weight[y, x]
            value = np.float64(change)
            for i in range(n_p):
                value += const[sc.TAP + i] * p[i, y, x]
            for i in range(n_p - 1, 0, -1):
                p[i, y, x] = p[i - 1, y, x]
            p[0, y, x] = value
            total += abs(value)
            previous[y, x] = frame[y0 + y, x0 + x]
    return total


@kernel(exact=True, arrays=True)
def excitation(p, e, const) -> None:
    """Compute E of every path with its border (eq. 3)."""
    residue = np.float32(const[sc.RESIDUE])
    for c in range(e.shape[0]):
        for y in range(p.shape[0]):
            for x in range(p.shape[1]):
                value = p[y, x] if c == 0 else -p[y, x]
                e[c, y + 1, x + 1] = max(np.float32(0), value) + residue * e[c, y + 1, x + 1]
        replicate_border(e[c])


@kernel(exact=True, arrays=True)
def delayed_inhibition(e, memory, out, const, warm) -> None:
    """Compute I of one path (eq. 4 to 6); each ring of neighbours is summed first, then delayed."""
    _, h, w = memory.shape
    for y in range(h):
        for x in range(w):
            near = e[y, x + 1] + e[y + 2, x + 1] + e[y + 1, x] + e[y + 1, x + 2]
            far = e[y, x] + e[y, x + 2] + e[y + 2, x] + e[y + 2, x + 2]
            total = np.float32(0)
            for ring in range(3):
                now = e[y + 1, x + 1] if ring == 0 else near if ring == 1 else far
                gain = np.float32(1) if warm else np.float32(const[sc.GAIN_2 + ring])
                delayed = memory[ring, y, x] + gain * (now - memory[ring, y, x])
                memory[ring, y, x] = now if const[sc.TWO_TAP] > 0 else delayed
                total += np.float32(const[sc.WEIGHT + ring]) * delayed
            out[y, x] = total


@kernel(exact=True, arrays=True)
def summation(e, inhibition, s, w, const) -> None:
    """Compute S with its border (eq. 7 and 8)."""
    theta_1, theta_2 = np.float32(const[sc.THETA_1]), np.float32(const[sc.THETA_2])
    theta_3, weight, zero = np.float32(const[sc.THETA_3]), np.float32(w), np.float32(0)
    for y in range(s.shape[0] - 2):
        for x in range(s.shape[1] - 2):
            on = max(zero, e[0, y + 1, x + 1] - weight * inhibition[0, y, x])
            off = max(zero, e[1, y + 1, x + 1] - weight * inhibition[1, y, x])
            s[y + 1, x + 1] = theta_1 * on + theta_2 * off + theta_3 * on * off
    replicate_border(s)


@kernel(exact=True, arrays=True)
def local_mean(s, y, x) -> np.floating:
    """Return Ce, the mean of the 3x3 neighbourhood of pixel (y, x), from the bordered S."""
    total = np.float32(0)
    for dy in range(3):
        for dx in range(3):
            total += s[y + dy, x + dx]
    return total / np.float32(9)


@kernel(exact=True, arrays=True)
def grouping(s, g_map, row, const) -> float | np.floating:
    """Compute g from S, update G (eq. 9) and return the sum of g."""
    h, w = g_map.shape
    largest = np.float32(0)
    for y in range(h):
        for x in range(w):
            largest = max(largest, abs(local_mean(s, y, x)))
    omega = const[sc.DELTA_C] + largest / const[sc.C_W]
    total, gain = 0.0, np.float32(row[sc.GAIN_G])
    for y in range(h):
        for x in range(w):
            g = np.float32(s[y + 1, x + 1] * local_mean(s, y, x) / omega)
            g = g if g >= const[sc.T_G] else np.float32(0)
            g_map[y, x] += gain * (g - g_map[y, x])
            total += g
    return total


@kernel(exact=True, arrays=True)
def step(
    first, last, frames, previous, y0, x0, weight, active, scalars, const, p, e, memory, inhibition, s, g
) -> None:  # fmt: skip
    """Step the active neurons among first..last-1 and update `previous`, `scalars` and the maps.

    `frames` (N, H, W) and `previous`, the last frames of the region (N, h, w), are uint8 or float32. The
    region starts at (y0, x0); `weight` holds its pixel weights, (h, w) float32, or is of shape (0, 0) if all
    are 1. `active` is (N,) bool. `scalars` (N, RING + window) and `const` are float64, indexed by the names
    in `scalars`. The other arguments are the maps of `allocate`.
    """
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[sc.AGE] == 0.0:
            _, h, w = previous.shape
            previous[n] = frames[n, y0 : y0 + h, x0 : x0 + w]
            row[sc.AGE] = 1.0
            continue
        feed_forward(row, const, photoreceptors(frames[n], previous[n], y0, x0, weight, const, p[n]))
        excitation(p[n, 0], e[n], const)
        warm = const[sc.WARM_START] > 0.0 and row[sc.AGE] == 1.0
        for c in range(e.shape[1]):
            delayed_inhibition(e[n, c], memory[n, c], inhibition[n, c], const, warm)
        summation(e[n], inhibition[n], s[n], row[sc.W], const)
        fire(row, const, grouping(s[n], g[n], row, const))


def layers(scalars, const, p, e, memory, inhibition, s, g) -> dict[str, NDArray[np.float32]]:
    """Return P, E, I, S and G of the last frame, each of shape (N, H, W)."""
    inner = (..., slice(1, -1), slice(1, -1))
    own_path = np.where(p[:, 0] >= 0, inhibition[:, 0], inhibition[:, 1])
    return {"P": p[:, 0], "E": e[inner].sum(1), "I": own_path, "S": s[inner], "G": g}
