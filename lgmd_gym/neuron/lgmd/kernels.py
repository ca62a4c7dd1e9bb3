# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Fast kernel: the paper's model in three passes over float32 maps, sixteen pixels at a time.

The kernel covers ON and OFF paths without residue, the recursive delay and up to two persistent frames
(`supports`). `general_kernel` covers all other parameters. These identities make the kernel fast:

- Delay and neighbourhood sum of I are both linear. Each ring of neighbours is summed first and delayed
  afterwards, so there is one delayed map per ring and path.
- The ON and OFF sums of a neighbourhood are (sum|P| +- sum P) / 2, so the stored maps are those of |P| and
  P. Each pixel needs I of its own path only: S of the other path is max(0, 0 - w I) = 0, and so is
  S_on * S_off.
- The latency filter of G has the same gain for all pixels, so K depends on the sum of g alone. G itself is
  updated only in rows where it is not 0.
- g >= t_de / c_de requires S * Ce / omega to be at least as large, and omega only grows during the pass. A
  row below that bound cannot pass the grouping threshold and is discarded immediately.

Pass 1 computes P and F. Pass 2 computes the rings with w, S, Ce, S * Ce and omega. Pass 3 computes g of the
remaining rows with omega. A row without any change, such as the sky of a lens that does not move, has no S:
pass 2 leaves out rows whose P, and that of their neighbours, is 0 and whose delayed rings have decayed.

Rows are padded to whole vectors of 16 pixels. Pixel (y, x) of a bordered map has the index
`_at(y, stride) + x`; its left border is in the padding of the row above.
"""

import math

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import (
    LANES,
    at_least,
    clear_below,
    copy,
    largest,
    load,
    madd,
    magnitude,
    maximum,
    prefetch,
    select_by_sign,
    splat,
    store,
    total,
)
from lgmd_gym.neuron import scalars as sc
from lgmd_gym.neuron.base import Map
from lgmd_gym.neuron.lgmd.params import LGMDParams
from lgmd_gym.neuron.scalars import feed_forward, fire

# Filter memories below this are set to 0, before they become slow denormal numbers.
_TINY = np.float32(1e-30)
# Each frame clears the tiny values of every 16th row that has delayed rings.
_CLEAR_INTERVAL = 16
# Memories this many vectors ahead are loaded early: processors stop loading ahead at the border of a page.
_AHEAD = 16
# Rows of the state of a neuron's rows, see `allocate`.
_SLOT, _GROUPED, _CHANGED, _DELAYED = 0, 1, 2, 3
# G below this is set to 0. Passing values are >= t_de / c_de (30), and K does not depend on this map.
_G_FLOOR = 1e-3


def supports(params: LGMDParams) -> bool:
    """Return whether the fast kernel covers these parameters."""
    return params.on_off_residue == 0.0 and params.delay == "recursive" and params.n_p <= 2


@kernel(exact=True, inline=True, arrays=True)
def _at(row, stride):
    """Return the index of the first pixel of a row of a bordered map."""
    return LANES + row * stride


@kernel(exact=True, arrays=True)
def _replicate_sides(image, start, w) -> None:
    """Write the left and right border of a row."""
    image[start - 1] = image[start]
    image[start + w] = image[start + w - 1]


@kernel(exact=True, arrays=True)
def _photoreceptors(frame, previous, at, width, weight, now, last, rows, h, w, stride, const) -> float:
    """Pass 1: compute P (eq. 1), note which rows of it are not 0, and return the sum of |P|.

    P overwrites the P of two frames ago in `now`, and the frame overwrites `previous`. Both frames are flat.
    The region starts at frame[at]; its rows are `width` apart.
    """
    n_p = int(const[sc.N_P])
    a_1 = np.float32(const[sc.TAP]) if n_p > 0 else np.float32(0)
    a_2 = np.float32(const[sc.TAP + 1]) if n_p > 1 else np.float32(0)
    v_1, v_2 = splat(a_1), splat(a_2)
    weighted, sum_p = weight.size > 0, 0.0
    for y in range(h):
        source, target, i = at + y * width, y * w, _at(y + 1, stride)
        row_sum = splat(np.float32(0))
        whole = w - w % LANES
        for x in range(0, whole, LANES):
            change = load(frame, source + x) - load(previous, target + x)
            if weighted:
                change = change * load(weight, target + x)
            p = madd(v_2, load(now, i + x), madd(v_1, load(last, i + x), change))
            row_sum = row_sum + magnitude(p)
            store(now, i + x, p)
            copy(frame, source + x, previous, target + x)
        row_total = total(row_sum)
        for x in range(whole, w):
            change = np.float32(frame[source + x]) - np.float32(previous[target + x])
            if weighted:
                change *= weight[target + x]
            p = change + a_1 * last[i + x] + a_2 * now[i + x]
            now[i + x] = p
            row_total += abs(p)
            previous[target + x] = frame[source + x]
        rows[_CHANGED, y] = row_total != np.float32(0)
        sum_p += row_total
        _replicate_sides(now, i, w)
    for x in range(-1, w + 1):
        now[LANES + x] = now[_at(1, stride) + x]
        now[_at(h + 1, stride) + x] = now[_at(h, stride) + x]
    return sum_p


@kernel(exact=True, arrays=True)
def _clear_tiny(values, first, last):
    """Set tiny values to 0 and return whether others are left."""
    tiny = splat(_TINY)
    most = splat(np.float32(0))
    for i in range(first, last, LANES):
        value = clear_below(load(values, i), tiny)
        store(values, i, value)
        most = maximum(most, magnitude(value))
    return largest(most) > np.float32(0)


@kernel(exact=True, arrays=True)
def _clear_row(memory, rows, y, columns, row) -> None:
    """Clear tiny values of the delayed rings of a row, if it has its turn, and note if others are left."""
    size = columns * 6
    if rows[_DELAYED, y] != 0 and (y + int(row[sc.AGE])) % _CLEAR_INTERVAL == 0:
        rows[_DELAYED, y] = _clear_tiny(memory, y * size, (y + 1) * size)


@kernel(exact=True, arrays=True)
def _is_still(rows, y, h):
    """Return whether S of row y is 0: no change in it and its neighbours, nor delayed changes."""
    above, below = rows[_CHANGED, max(y - 1, 0)], rows[_CHANGED, min(y + 1, h - 1)]
    return rows[_DELAYED, y] == 0 and above == 0 and rows[_CHANGED, y] == 0 and below == 0


@kernel(exact=True, inline=True, arrays=True)
def _delayed(memory, i, gain, value):
    """Update a low-pass filter (eq. 4) and return its value."""
    old = load(memory, i)
    new = madd(gain, value - old, old)
    store(memory, i, new)
    return new


@kernel(exact=True, arrays=True)
def _summation(p, memory, s, y, target, blocks, stride, warm, weight, const) -> None:
    """Compute I and S of row y (eq. 4 to 8) and write S to s[target:]."""
    one = np.float32(1)
    gain_0 = splat(one if warm else np.float32(const[sc.GAIN_2]))
    gain_1 = splat(one if warm else np.float32(const[sc.GAIN_2 + 1]))
    gain_2 = splat(one if warm else np.float32(const[sc.GAIN_2 + 2]))
    # Half of w: I of a path is half the sum or half the difference of both maps.
    w_0 = splat(np.float32(-0.5 * weight * const[sc.WEIGHT]))
    w_1 = splat(np.float32(-0.5 * weight * const[sc.WEIGHT + 1]))
    w_2 = splat(np.float32(-0.5 * weight * const[sc.WEIGHT + 2]))
    theta_on, theta_off = splat(np.float32(const[sc.THETA_1])), splat(np.float32(const[sc.THETA_2]))
    zero = splat(np.float32(0))
    for b in range(blocks):
        i, m = _at(y + 1, stride) + b * LANES, (y * blocks + b) * 6 * LANES
        for k in range(6):  # needed where the memories of many neurons exceed the cache
            prefetch(memory, m + (_AHEAD * 6 + k) * LANES)
        above, below = i - stride, i + stride
        centre, left, right = load(p, i), load(p, i - 1), load(p, i + 1)
        up, down = load(p, above), load(p, below)
        up_left, up_right = load(p, above - 1), load(p, above + 1)
        down_left, down_right = load(p, below - 1), load(p, below + 1)
        e = magnitude(centre)
        near, far = up + down + left + right, up_left + up_right + down_left + down_right
        near_sum = magnitude(up) + magnitude(down) + magnitude(left) + magnitude(right)
        far_sum = magnitude(up_left) + magnitude(up_right) + magnitude(down_left) + magnitude(down_right)
        absolute = w_0 * _delayed(memory, m, gain_0, e)
        signed = w_0 * _delayed(memory, m + LANES, gain_0, centre)
        absolute = madd(w_1, _delayed(memory, m + 2 * LANES, gain_1, near_sum), absolute)
        signed = madd(w_1, _delayed(memory, m + 3 * LANES, gain_1, near), signed)
        absolute = madd(w_2, _delayed(memory, m + 4 * LANES, gain_2, far_sum), absolute)
        signed = madd(w_2, _delayed(memory, m + 5 * LANES, gain_2, far), signed)
        excess = maximum(zero, e + absolute + select_by_sign(centre, signed, zero - signed))
        store(s, target + b * LANES, excess * select_by_sign(centre, theta_on, theta_off))


@kernel(exact=True, arrays=True)
def _local_means(s, top, middle, bottom, sums, products, target, w):
    """Write S * Ce of a row to products[target:] and return the largest Ce and S * Ce of the row."""
    columns = -(-w // LANES) * LANES
    for x in range(0, columns, LANES):
        store(s, sums + x, load(s, top + x) + load(s, middle + x) + load(s, bottom + x))
    s[sums - 1], s[sums + w] = s[sums], s[sums + w - 1]
    ninth = splat(np.float32(1.0 / 9.0))
    max_mean = splat(np.float32(0))
    max_product = max_mean
    for x in range(0, columns, LANES):
        mean = (load(s, sums + x - 1) + load(s, sums + x) + load(s, sums + x + 1)) * ninth
        product = load(s, middle + x) * mean
        store(products, target + x, product)
        max_mean, max_product = maximum(max_mean, mean), maximum(max_product, product)
    return largest(max_mean), largest(max_product)


@kernel(exact=True, arrays=True)
def _inhibition(p, memory, s, products, rows, h, w, warm, row, const) -> np.floating:
    """Pass 2: compute S * Ce of the rows that can pass the threshold, and return the grouping scale omega."""
    blocks = -(-w // LANES)
    columns, stride = blocks * LANES, (blocks + 1) * LANES
    delta, scale = np.float32(const[sc.DELTA_C]), np.float32(1.0 / const[sc.C_W])
    threshold = np.float32(const[sc.T_G])
    omega, used, sums = delta, 0, 3 * columns + LANES
    # Whether row y, the one above it and the one above that are still; rows above the first one are.
    still = still_1 = still_2 = True
    for y in range(h + 1):
        still_2, still_1 = still_1, still
        if y < h:
            target = y % 3 * columns
            _clear_row(memory, rows, y, columns, row)
            still = _is_still(rows, y, h)
            if still:
                for x in range(0, columns, LANES):
                    store(s, target + x, splat(np.float32(0)))
            else:
                rows[_DELAYED, y] = 1
                _summation(p, memory, s, y, target, blocks, stride, warm, row[sc.W], const)
                for x in range(w, columns):
                    s[target + x] = np.float32(0)
        if y == 0:
            continue
        # Row y - 1 has both neighbours now; edges are replicated.
        if still and still_1 and still_2 and threshold > np.float32(0):
            rows[_SLOT, y - 1] = -1
            continue
        top, middle, bottom = max(y - 2, 0) % 3 * columns, (y - 1) % 3 * columns, min(y, h - 1) % 3 * columns
        mean, product = _local_means(s, top, middle, bottom, sums, products, used * columns, w)
        omega = max(omega, delta + scale * mean)
        passes = product >= threshold * omega
        rows[_SLOT, y - 1] = used if passes else -1
        used += 1 if passes else 0
    return omega


@kernel(exact=True, arrays=True)
def _grouping(products, g, rows, h, columns, omega, gain, t_g) -> float:
    """Pass 3: update G (eq. 9) in rows where g or G is not 0, and return the sum of g (Yue & Rind)."""
    sum_g = 0.0
    zero = splat(np.float32(0))
    threshold, scale = splat(np.float32(t_g * omega)), splat(np.float32(1.0 / omega))
    v_gain, v_floor = splat(np.float32(gain)), splat(np.float32(_G_FLOOR))
    for y in range(h):
        slot = rows[_SLOT, y]
        if slot < 0 and rows[_GROUPED, y] == 0:
            continue
        row_sum = row_max = zero
        for x in range(0, columns, LANES):
            new = at_least(load(products, slot * columns + x), threshold) * scale if slot >= 0 else zero
            old = load(g, y * columns + x)
            filtered = at_least(madd(v_gain, new - old, old), v_floor)
            store(g, y * columns + x, filtered)
            row_sum, row_max = row_sum + new, maximum(row_max, filtered)
        rows[_GROUPED, y] = largest(row_max) > np.float32(0)
        sum_g += total(row_sum)
    return sum_g


@kernel(exact=True, arrays=True)
def step(
    first, last, frames, previous, y0, x0, weight, active, scalars, const, p, memory, s, products, g, rows
) -> None:  # fmt: skip
    """Step the active neurons among first..last-1.

    The arguments are those of `general_kernel.step`, with the maps of `allocate`. S and S * Ce
    are scratch memory; all neurons of a call share those of the first, which stay in the cache.
    """
    h, w, width = previous.shape[1], previous.shape[2], frames.shape[2]
    columns = -(-w // LANES) * LANES
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[sc.AGE] == 0.0:
            for y in range(h):  # an assignment of slices would compile for seconds, for its error message
                for x in range(w):
                    previous[n, y, x] = frames[n, y0 + y, x0 + x]
            row[sc.AGE] = 1.0
            continue
        now, before = p[n, int(row[sc.AGE]) % 2], p[n, 1 - int(row[sc.AGE]) % 2]
        warm = const[sc.WARM_START] > 0.0 and row[sc.AGE] == 1.0
        sum_p = _photoreceptors(
            frames[n].ravel(), previous[n].ravel(), y0 * width + x0, width, weight.ravel(), now, before,
            rows[n], h, w, columns + LANES, const,
        )  # fmt: skip
        feed_forward(row, const, sum_p)
        omega = _inhibition(now, memory[n], s[first], products[first], rows[n], h, w, warm, row, const)
        gain = row[sc.GAIN_G]
        fire(row, const, _grouping(products[first], g[n], rows[n], h, columns, omega, gain, const[sc.T_G]))


def allocate(num: int, shape: tuple[int, int]) -> tuple[Map, ...]:
    """Return the maps of `num` neurons over `shape` pixels, filled with 0.

    Rows are padded to `columns`, a multiple of 16 pixels. Maps are float32 unless stated otherwise.

    Returns:
        p: P of the current and the last frame in turn, with borders, (N, 2, size).
        memory: Delayed rings; each block of 16 pixels holds 16 lanes of |P| and of P per ring,
            (N, H * columns * 6).
        s: The last three rows of S, and their column sums with a border, (N, 4 * columns + 32).
        products: S * Ce of the rows that can pass the grouping threshold, (N, H * columns).
        g: G, (N, H * columns).
        rows: Per row, the index of its S * Ce or -1; whether its G and its P are not 0; and whether its
            delayed rings may be other than 0, (N, 4, H) int32.
    """
    h, w = shape
    columns = -(-w // LANES) * LANES
    sizes = (
        (num, 2, LANES + (h + 2) * (columns + LANES)), (num, h * columns * 6), (num, 4 * columns + 2 * LANES),
        (num, h * columns), (num, h * columns),
    )  # fmt: skip
    return *(_aligned_zeros(size) for size in sizes), np.zeros((num, 4, h), np.int32)


def shifted_views(maps: tuple[Map, ...], height: int) -> tuple[NDArray[np.float32], ...]:
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


def layers(scalars, const, p, memory, s, products, g, rows) -> dict[str, NDArray[np.float32]]:
    """Return P, E, I, S and G of the last frame, each of shape (N, H, columns)."""
    num, h = len(scalars), rows.shape[2]
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
