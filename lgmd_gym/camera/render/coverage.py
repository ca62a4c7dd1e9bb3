# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Polygons as coverage of pixels: clipping, projection, and edges in an accumulator of differences.

An edge in one column of the frame, or with at most one column per row, is added cell by cell; a shallower one
in vectors of sixteen columns.

A polygon's edges are added to an accumulator of coverage *differences*. The running sum along a row is, at
each pixel, the exact area of the pixel inside all polygons added so far. The cost grows with the outline
only, shared edges cancel exactly, and a polygon of any size contributes its exact area: an edge that moves by
a tenth of a pixel changes the frame by a tenth of its contrast.
"""

import math

import numba as nb

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.doubles import (
    greatest_double,
    least_double,
    madd_doubles,
    splat_double,
    store_doubles,
)
from lgmd_gym.kernels.simd import (
    LANES,
    any_different,
    as_floats,
    lane_numbers,
    load_part,
    madd,
    maximum,
    minimum,
    running_sum,
    splat,
    splat_last,
    store_part,
)


@kernel
def _add_column(acc, k, y0, y1, w, w2):
    """Add an edge at or left of column 0, from row coordinate y0 down to y1."""
    row = int(y0)
    while row < y1:
        dy = min(row + 1.0, y1) - max(float(row), y0)
        acc[k, row, 0] += w * dy
        if w2 != 0.0:
            acc[k + 1, row, 0] += w2 * dy
        row += 1


@kernel(inline=True)
def _add_cell(acc, k, row, col, w, w2, both):
    """Add to one cell of channel k, and of the next if `both`; unsigned indices are not checked for sign."""
    r, c = nb.uint64(row), nb.uint64(col)
    acc[nb.uint64(k), r, c] += nb.float32(w)
    if both:
        acc[nb.uint64(k + 1), r, c] += nb.float32(w2)


@kernel(inline=True)
def _add_upright(acc, k, start, y1, slope, col, w, w2):
    """Add an edge within one column of the frame, the most common case for small and upright objects.

    `start` is (x0, y0); the edge runs down to y1, and x changes by `slope` per row.
    """
    y = start[1]
    row, left = int(y), col + 1.0 - start[0]
    while y < y1:
        y_next = row + 1.0 if row + 1.0 < y1 else y1
        dy = y_next - y
        area = dy * (left - 0.5 * slope * dy)
        left -= slope * dy
        _add_cell(acc, k, row, col, w * area, w2 * area, w2 != 0.0)
        _add_cell(acc, k, row, col + 1, w * (dy - area), w2 * (dy - area), w2 != 0.0)
        y = y_next
        row += 1


@kernel(inline=True)
def _add_steep(acc, k, start, y1, slope, w, w2):
    """Add an edge inside the frame with at most one column per row, and so in at most two columns of a row.

    `start` is (x0, y0); the edge runs down to y1, and x changes by `slope` per row.
    """
    x, y = start
    width = float(acc.shape[2] - 2)
    # Height per column; the bound keeps its product with 0 columns at 0.
    rise = 1.0 / max(abs(slope), 1e-30)
    row = int(y)
    while y < y1:
        y_next = min(row + 1.0, y1)
        dy = y_next - y
        # Rounding may move the end of the edge out of the frame.
        x_next = min(max(x + slope * dy, 0.0), width)
        low, high = min(x, x_next), max(x, x_next)
        col = int(min(low, width - 1.0))
        # Without a branch, which a processor would predict wrongly in every other row: `lost` of the height
        # is in the second column.
        beyond = high - (col + 1.0)
        inside, past = max(-beyond, 0.0), max(beyond, 0.0)
        lost = rise * past
        area = 0.5 * (dy - lost) * (col + 1.0 - low + inside)
        end = dy - 0.5 * lost * past
        _add_cell(acc, k, row, col, w * area, w2 * area, w2 != 0.0)
        _add_cell(acc, k, row, col + 1, w * (end - area), w2 * (end - area), w2 != 0.0)
        _add_cell(acc, k, row, col + 2, w * (dy - end), w2 * (dy - end), w2 != 0.0)
        x, y = x_next, y_next
        row += 1


@kernel(inline=True)
def _hat_integral(t):
    """Return the integral of the hat function max(1 - |t|, 0) up to t."""
    zero, one, half = splat(nb.float32(0.0)), splat(nb.float32(1.0)), splat(nb.float32(0.5))
    rising, falling = minimum(maximum(t + one, zero), one), minimum(maximum(t, zero), one)
    return madd(half, rising * rising - falling * falling, falling)


@kernel(inline=True)
def _add_lanes(acc, k, at, count, step):
    """Add to sixteen differences of channel k, at most `count`, from index `at` of the channel on."""
    plane = acc[k]
    store_part(plane, at, count, load_part(plane, at, count) + step)


@kernel(inline=True)
def _add_shallow(acc, k, start, y1, slope, w, w2):
    """Add an edge inside the frame with more than one column per row; see `_add_steep`.

    The coverage of column j minus that of the column before is the integral of the edge's height per column
    times a hat function around the column's left side.
    """
    x, y = start
    stride = acc.shape[2]
    width, rise = float(stride - 2), splat(nb.float32(1.0 / slope))
    even = splat(nb.float32(1.0 / abs(slope)))  # far from both ends
    weight, weight2, lanes = splat(nb.float32(w)), splat(nb.float32(w2)), as_floats(lane_numbers())
    row = int(y)
    while y < y1:
        y_next = min(row + 1.0, y1)
        x_next = min(max(x + slope * (y_next - y), 0.0), width)
        low, high = min(x, x_next), max(x, x_next)
        col = int(low)
        while col < high + 1.0:
            step = even
            if col < low + 1.0 or col + LANES > high:
                after = _hat_integral(splat(nb.float32(x_next - col)) - lanes)
                step = rise * (after - _hat_integral(splat(nb.float32(x - col)) - lanes))
            at, count = row * stride + col, stride - col
            _add_lanes(acc, k, at, count, weight * step)
            if w2 != 0.0:
                _add_lanes(acc, k + 1, at, count, weight2 * step)
            col += LANES
        x, y = x_next, y_next
        row += 1


@kernel(inline=True)
def _add_narrow(acc, k, start, y1, slope, first, w, w2):
    """Add an edge as `_add_shallow` does, within fourteen columns from column `first` on."""
    x, y = start
    at, count = int(y) * acc.shape[2] + first, acc.shape[2] - first
    rise, lanes = splat(nb.float32(1.0 / slope)), as_floats(lane_numbers())
    weight, weight2 = splat(nb.float32(w)), splat(nb.float32(w2))
    before = _hat_integral(splat(nb.float32(x - first)) - lanes)
    y_next = math.floor(y) + 1.0
    while y < y1:
        y_next = min(y_next, y1)
        x += slope * (y_next - y)
        after = _hat_integral(splat(nb.float32(x - first)) - lanes)
        step = rise * (after - before)
        _add_lanes(acc, k, at, count, weight * step)
        if w2 != 0.0:
            _add_lanes(acc, k + 1, at, count, weight2 * step)
        before, y = after, y_next
        y_next += 1.0
        at += acc.shape[2]


@kernel(inline=True)
def add_edge(acc, k, x0, y0, x1, y1, w, w2):  # noqa: C901  (six ways to leave the frame)
    """Add one directed edge, clipped to the frame.

    Args:
        acc: Accumulator, float32, shape (channels, height, width + 2).
        k: Channel of the weight `w`; `w2` goes to channel k + 1.
        x0: Start, from the left [px].
        y0: Start, from the top [px].
        x1: End, from the left [px].
        y1: End, from the top [px].
        w: Weight.
        w2: Second weight; 0 leaves channel k + 1 unchanged.
    """
    height, width = acc.shape[1], acc.shape[2] - 2
    if y0 > y1:
        x0, x1 = x1, x0
        y0, y1 = y1, y0
        w, w2 = -w, -w2
    # An edge right of the frame covers nothing. The condition also rejects NaN and infinity.
    if not (y1 > 0.0 and y0 < height and y1 > y0 and min(x0, x1) < width and abs(x1 - x0) < 1e30):
        return
    slope = (x1 - x0) / (y1 - y0)
    if y0 < 0.0:
        x0 -= y0 * slope
        y0 = 0.0
    if y1 > height:
        x1 = x0 + (height - y0) * slope
        y1 = float(height)
    if x0 <= 0.0 and x1 <= 0.0:
        _add_column(acc, k, y0, y1, w, w2)
        return
    if x0 < 0.0:
        cut = min(y0 - x0 / slope, y1)
        _add_column(acc, k, y0, cut, w, w2)
        x0, y0 = 0.0, cut
    elif x0 > width:
        y0 = min(y0 + (width - x0) / slope, y1)
        x0 = float(width)
    if x1 < 0.0:
        cut = min(max(y0 - x0 / slope, y0), y1)
        _add_column(acc, k, cut, y1, w, w2)
        x1, y1 = 0.0, cut
    elif x1 > width:
        y1 = min(max(y0 + (width - x0) / slope, y0), y1)
        x1 = float(width)
    if not y1 > y0:
        return
    col = int(min(x0, x1))
    if max(x0, x1) <= col + 1.0:
        _add_upright(acc, k, (x0, y0), y1, slope, col, w, w2)
    elif abs(slope) <= 1.0:
        _add_steep(acc, k, (x0, y0), y1, slope, w, w2)
    elif abs(x1 - x0) <= LANES - 3.0:
        _add_narrow(acc, k, (x0, y0), y1, slope, col, w, w2)
    else:
        _add_shallow(acc, k, (x0, y0), y1, slope, w, w2)


NEAR = 0.1
"""Depth of the near plane [m]."""


@kernel
def clip_and_project(lens, corners, n, out):
    """Clip a polygon at the near plane and project it.

    Args:
        lens: The lens.
        corners: Corners as (depth, right, down), float64, shape (3, >= n) [m].
        n: Number of corners.
        out: Output: projected corners (u, v), shape (2, > n) [px].

    Returns:
        Number of projected corners; 0 if the polygon is entirely behind the near plane.
    """
    f, cu, cv = lens.focal, lens.centre_u, lens.centre_v
    m = 0
    d0, r0, z0 = corners[0, n - 1], corners[1, n - 1], corners[2, n - 1]
    for i in range(n):
        d1, r1, z1 = corners[0, i], corners[1, i], corners[2, i]
        if (d0 >= NEAR) != (d1 >= NEAR):
            t = (NEAR - d0) / (d1 - d0)
            out[0, m] = cu + f * (r0 + t * (r1 - r0)) / NEAR
            out[1, m] = cv + f * (z0 + t * (z1 - z0)) / NEAR
            m += 1
        if d1 >= NEAR:
            scale = f / d1
            out[0, m] = cu + scale * r1
            out[1, m] = cv + scale * z1
            m += 1
        d0, r0, z0 = d1, r1, z1
    return m


@kernel(inline=True)
def project_eight(lens, depth, right, down, n, layer):
    """Project up to eight corners, lanes of float64, to `layer.uv`; unused lanes repeat a corner.

    Returns:
        Number of projected corners, below 3 for a polygon behind the near plane, and their bounds (left, top,
        right, bottom) [px].
    """
    uv = layer.uv
    if least_double(depth) < NEAR:
        stride = layer.corners.shape[1]
        store_doubles(layer.corners, 0, depth)
        store_doubles(layer.corners, stride, right)
        store_doubles(layer.corners, 2 * stride, down)
        n = clip_and_project(lens, layer.corners, n, uv)
        return n, bounds(uv, max(n, 1))
    scale = splat_double(lens.focal) / depth
    u = madd_doubles(scale, right, splat_double(lens.centre_u))
    v = madd_doubles(scale, down, splat_double(lens.centre_v))
    store_doubles(uv, 0, u)
    store_doubles(uv, uv.shape[1], v)
    return n, (least_double(u), least_double(v), greatest_double(u), greatest_double(v))


@kernel(inline=True)
def winding(uv, n):
    """Return twice the signed area of a projected polygon; positive if its left edge runs downwards."""
    area = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        area += uv[0, j] * uv[1, i] - uv[0, i] * uv[1, j]
    return area


@kernel(inline=True)
def bounds(uv, n):
    """Return the bounds (left, top, right, bottom) of a projected polygon [px]."""
    left = right = uv[0, 0]
    top = bottom = uv[1, 0]
    for i in range(1, n):
        left, right = min(left, uv[0, i]), max(right, uv[0, i])
        top, bottom = min(top, uv[1, i]), max(bottom, uv[1, i])
    return left, top, right, bottom


@kernel
def add_polygon(acc, k, uv, n, w, w2):
    """Add a projected polygon of positive winding; one of negative winding is subtracted."""
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        add_edge(acc, k, uv[0, i], uv[1, i], uv[0, j], uv[1, j], w, w2)


@kernel(inline=True)
def sum_differences(plane, at, count, carry):
    """Return sixteen coverages of a channel from its differences at index `at`, and the last of them.

    `carry` is the coverage of the pixel before, in all lanes. Reads and clears at most `count` differences.
    """
    differences, zero = load_part(plane, at, count), splat(nb.float32(0.0))
    if not any_different(differences, zero):
        return carry, carry
    store_part(plane, at, count, zero)
    sums = running_sum(differences) + carry
    return sums, splat_last(sums)
