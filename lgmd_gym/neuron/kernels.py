"""The fast kernel: the paper's model in three passes over float32 maps, sixteen pixels at a time.

For ON and OFF paths without residue, the recursive delay and up to two persistent frames (`supports`);
`general` does the rest. What makes it short:

- The delay and the neighbourhood sum of I are both linear, so each ring is summed first and delayed
  after: one delayed map per ring and path, and one pass.
- The ON and OFF sums of a neighbourhood are (sum|P| +- sum P) / 2. The maps kept are those of |P| and
  P, and a pixel needs the I of its own path only: the other one's S is max(0, 0 - w I) = 0, and so is
  S_on * S_off.
- All pixels share the gain of G's latency filter, so K needs the sum of g alone. G itself is kept up
  only in rows where it is not 0.
- g >= t_de / c_de needs S * Ce / omega at least as large, and omega only grows as the frame is read:
  a row that falls short of it already cannot survive and is forgotten at once.

The passes: (1) P and F; (2) with w, the rings, S, Ce and S * Ce; (3) with omega, g over what is left.
Rows are padded to whole vectors of 16. Pixel (y, x) of a bordered row-map is at `_at(y, stride) + x`, its
left border in the padding of the row above.
"""

import numpy as np
from numba import njit

from lgmd_gym.neuron import scalars as sc
from lgmd_gym.neuron.params import LGMDParams
from lgmd_gym.neuron.scalars import feed_forward, fire
from lgmd_gym.neuron.simd import (
    LANES,
    at_least,
    by_sign,
    copy,
    largest,
    load,
    madd,
    magnitude,
    maximum,
    splat,
    store,
    total,
    unless_below,
)

# Below this a filter's memory is set to 0, long before it would slow down as a denormal number.
_TINY = np.float32(1e-30)
# Each frame clears the tiny values of every 16th row.
_SWEEP = 16
# G below this is taken as 0: a survivor has g >= t_de / c_de (30), and K does not read this map.
_G_FLOOR = 1e-3


def supports(params: LGMDParams) -> bool:
    """Whether the fast kernel computes these parameters."""
    return params.on_off and params.on_off_residue == 0.0 and params.delay == "recursive" and params.n_p <= 2


@njit(inline="always")
def _at(row, stride):
    """Index of the first pixel of a row of a bordered map."""
    return LANES + row * stride


@njit(cache=True, nogil=True)
def _replicate_sides(image, start, w) -> None:
    """Give a row its left and right border."""
    image[start - 1] = image[start]
    image[start + w] = image[start + w - 1]


@njit(cache=True, nogil=True)
def _photoreceptors(frame, prev, at, width, weight, now, last, h, w, stride, par) -> float:
    """Pass 1: write P (eq. 1) over the P of two frames ago, keep the luminance, return the sum of |P|.

    `frame` and `prev` are flat; the region starts at frame[at], whose rows are `width` apart.
    """
    n_p = int(par[sc.N_P])
    a_1 = np.float32(par[sc.TAP]) if n_p > 0 else np.float32(0)
    a_2 = np.float32(par[sc.TAP + 1]) if n_p > 1 else np.float32(0)
    v_1, v_2 = splat(a_1), splat(a_2)
    weighted, sum_p = weight.size > 0, 0.0
    for y in range(h):
        source, kept, i = at + y * width, y * w, _at(y + 1, stride)
        row_sum = splat(np.float32(0))
        whole = w - w % LANES
        for x in range(0, whole, LANES):
            change = load(frame, source + x) - load(prev, kept + x)
            if weighted:
                change = change * load(weight, kept + x)
            p = madd(v_2, load(now, i + x), madd(v_1, load(last, i + x), change))
            row_sum = row_sum + magnitude(p)
            store(now, i + x, p)
            copy(frame, source + x, prev, kept + x)
        row_total = total(row_sum)
        for x in range(whole, w):
            change = np.float32(frame[source + x]) - np.float32(prev[kept + x])
            if weighted:
                change *= weight[kept + x]
            p = change + a_1 * last[i + x] + a_2 * now[i + x]
            now[i + x] = p
            row_total += abs(p)
            prev[kept + x] = frame[source + x]
        sum_p += row_total
        _replicate_sides(now, i, w)
    for x in range(-1, w + 1):
        now[LANES + x] = now[_at(1, stride) + x]
        now[_at(h + 1, stride) + x] = now[_at(h, stride) + x]
    return sum_p


@njit(cache=True, nogil=True)
def _clear_tiny(values, first, last) -> None:
    """Set what is too small to matter to 0."""
    tiny = splat(_TINY)
    for i in range(first, last, LANES):
        store(values, i, unless_below(load(values, i), tiny))


@njit(inline="always")
def _delayed(memory, i, gain, value):
    """Step one low-pass (eq. 4) and return it."""
    old = load(memory, i)
    new = madd(gain, value - old, old)
    store(memory, i, new)
    return new


@njit(cache=True, nogil=True)
def _summation(p, memory, s, y, to, blocks, stride, warm, weight, par) -> None:
    """Row y of I and S (eq. 4 to 8), the latter to s[to:]."""
    one = np.float32(1)
    gain_0 = splat(one if warm else np.float32(par[sc.GAIN_2]))
    gain_1 = splat(one if warm else np.float32(par[sc.GAIN_2 + 1]))
    gain_2 = splat(one if warm else np.float32(par[sc.GAIN_2 + 2]))
    # Half of w: I of a path is half the sum of both maps, or half their difference.
    w_0 = splat(np.float32(-0.5 * weight * par[sc.WEIGHT]))
    w_1 = splat(np.float32(-0.5 * weight * par[sc.WEIGHT + 1]))
    w_2 = splat(np.float32(-0.5 * weight * par[sc.WEIGHT + 2]))
    theta_on, theta_off = splat(np.float32(par[sc.THETA_1])), splat(np.float32(par[sc.THETA_2]))
    zero = splat(np.float32(0))
    for b in range(blocks):
        i, m = _at(y + 1, stride) + b * LANES, (y * blocks + b) * 6 * LANES
        above, below = i - stride, i + stride
        centre, left, right = load(p, i), load(p, i - 1), load(p, i + 1)
        up, down = load(p, above), load(p, below)
        up_left, up_right = load(p, above - 1), load(p, above + 1)
        down_left, down_right = load(p, below - 1), load(p, below + 1)
        e = magnitude(centre)
        near, far = up + down + left + right, up_left + up_right + down_left + down_right
        near_sum = magnitude(up) + magnitude(down) + magnitude(left) + magnitude(right)
        far_sum = magnitude(up_left) + magnitude(up_right) + magnitude(down_left) + magnitude(down_right)
        both = w_0 * _delayed(memory, m, gain_0, e)
        side = w_0 * _delayed(memory, m + LANES, gain_0, centre)
        both = madd(w_1, _delayed(memory, m + 2 * LANES, gain_1, near_sum), both)
        side = madd(w_1, _delayed(memory, m + 3 * LANES, gain_1, near), side)
        both = madd(w_2, _delayed(memory, m + 4 * LANES, gain_2, far_sum), both)
        side = madd(w_2, _delayed(memory, m + 5 * LANES, gain_2, far), side)
        excess = maximum(zero, e + both + by_sign(centre, side, zero - side))
        store(s, to + b * LANES, excess * by_sign(centre, theta_on, theta_off))


@njit(cache=True, nogil=True)
def _local_means(s, top, middle, bottom, sums, products, to, w):
    """S * Ce of a row to products[to:] from three rows of S; return the largest Ce and S * Ce."""
    columns = -(-w // LANES) * LANES
    for x in range(0, columns, LANES):
        store(s, sums + x, load(s, top + x) + load(s, middle + x) + load(s, bottom + x))
    s[sums - 1], s[sums + w] = s[sums], s[sums + w - 1]
    ninth = splat(np.float32(1.0 / 9.0))
    top_mean = splat(np.float32(0))
    top_product = top_mean
    for x in range(0, columns, LANES):
        mean = (load(s, sums + x - 1) + load(s, sums + x) + load(s, sums + x + 1)) * ninth
        product = load(s, middle + x) * mean
        store(products, to + x, product)
        top_mean, top_product = maximum(top_mean, mean), maximum(top_product, product)
    return largest(top_mean), largest(top_product)


@njit(cache=True, nogil=True)
def _inhibited(p, memory, s, products, slots, h, w, warm, row, par) -> np.floating:
    """Pass 2: S * Ce of every row that may hold a survivor; return omega, the grouping scale."""
    blocks = -(-w // LANES)
    columns, stride = blocks * LANES, (blocks + 1) * LANES
    delta, over, needed = np.float32(par[sc.DELTA_C]), np.float32(1.0 / par[sc.C_W]), np.float32(par[sc.T_G])
    omega, used, sums = delta, 0, 3 * columns + LANES
    for y in range(h + 1):
        if y < h:
            to = y % 3 * columns
            if (y + int(row[sc.AGE])) % _SWEEP == 0:
                _clear_tiny(memory, y * columns * 6, (y + 1) * columns * 6)
            _summation(p, memory, s, y, to, blocks, stride, warm, row[sc.W], par)
            for x in range(w, columns):
                s[to + x] = np.float32(0)
        if y == 0:
            continue
        # Row y - 1, now that the one below it is there; the edges replicate.
        top, middle, bottom = max(y - 2, 0) % 3 * columns, (y - 1) % 3 * columns, min(y, h - 1) % 3 * columns
        mean, product = _local_means(s, top, middle, bottom, sums, products, used * columns, w)
        omega = max(omega, delta + over * mean)
        survives = product >= needed * omega
        slots[0, y - 1] = used if survives else -1
        used += 1 if survives else 0
    return omega


@njit(cache=True, nogil=True)
def _grouped(products, g, slots, h, columns, omega, gain, needed) -> float:
    """Pass 3: return the sum of g (Yue & Rind) and step G (eq. 9) where either is not 0."""
    sum_g = 0.0
    zero = splat(np.float32(0))
    threshold, over = splat(np.float32(needed * omega)), splat(np.float32(1.0 / omega))
    v_gain, v_floor = splat(np.float32(gain)), splat(np.float32(_G_FLOOR))
    for y in range(h):
        slot = slots[0, y]
        if slot < 0 and slots[1, y] == 0:
            continue
        row_sum = most = zero
        for x in range(0, columns, LANES):
            new = at_least(load(products, slot * columns + x), threshold) * over if slot >= 0 else zero
            old = load(g, y * columns + x)
            filtered = at_least(madd(v_gain, new - old, old), v_floor)
            store(g, y * columns + x, filtered)
            row_sum, most = row_sum + new, maximum(most, filtered)
        slots[1, y] = largest(most) > np.float32(0)
        sum_g += total(row_sum)
    return sum_g


@njit(cache=True, nogil=True)
def step(
    first, last, frames, prev, y0, x0, weight, active, rows, par, p, memory, s, products, g, slots
) -> None:  # fmt: skip
    """Step the neurons first..last-1 that are active: `general.step` for the parameters that it `supports`.

    The arguments are those of `general.step`, with the maps of `layout.allocate`. S and
    S * Ce hold nothing from one neuron to the next: all use those of the first, which stay in the cache.
    """
    h, w, width = prev.shape[1], prev.shape[2], frames.shape[2]
    columns = -(-w // LANES) * LANES
    for n in range(first, last):
        if not active[n]:
            continue
        row = rows[n]
        if row[sc.AGE] == 0.0:
            prev[n] = frames[n, y0 : y0 + h, x0 : x0 + w]
            row[sc.AGE] = 1.0
            continue
        now, before = p[n, int(row[sc.AGE]) % 2], p[n, 1 - int(row[sc.AGE]) % 2]
        warm = par[sc.WARM_START] > 0.0 and row[sc.AGE] == 1.0
        sum_p = _photoreceptors(
            frames[n].ravel(), prev[n].ravel(), y0 * width + x0, width, weight.ravel(), now, before, h, w,
            columns + LANES, par,
        )  # fmt: skip
        feed_forward(row, par, sum_p)
        omega = _inhibited(now, memory[n], s[first], products[first], slots[n], h, w, warm, row, par)
        gain = row[sc.GAIN_G]
        fire(row, par, _grouped(products[first], g[n], slots[n], h, columns, omega, gain, par[sc.T_G]))
