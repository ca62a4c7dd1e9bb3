"""Exact area coverage of polygons, the camera's only drawing primitive.

A polygon's edges are added to an accumulator of coverage *differences*. The running sum along a row is, at
each pixel, the exact area of the pixel inside all polygons added so far. The cost grows with the outline
only, shared edges cancel exactly, and a polygon of any size contributes its exact area: an edge that moves by
a tenth of a pixel changes the frame by a tenth of its contrast.
"""

import math

import numba as nb

from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.simd import LANES, any_different, load_part, running_sum, splat, splat_last, store_part

NEAR = 0.1
"""Depth of the near plane [m]."""


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


@kernel
def _add_cell(acc, k, row, col, w, w2):
    """Add to one cell; unsigned indices avoid the check for negative ones."""
    r, c = nb.uint64(row), nb.uint64(col)
    acc[nb.uint64(k), r, c] += nb.float32(w)
    if w2 != 0.0:
        acc[nb.uint64(k + 1), r, c] += nb.float32(w2)


@kernel
def _add_upright(acc, k, x0, y0, x1, y1, w, w2):
    """Add an edge within one column of the frame, the most common case for small and upright objects."""
    slope = (x1 - x0) / (y1 - y0)
    row, col = int(y0), int(x0 if x0 < x1 else x1)
    left, y = col + 1.0 - x0, y0
    while y < y1:
        y_next = row + 1.0 if row + 1.0 < y1 else y1
        dy = y_next - y
        area = dy * (left - 0.5 * slope * dy)
        left -= slope * dy
        _add_cell(acc, k, row, col, w * area, w2 * area)
        _add_cell(acc, k, row, col + 1, w * (dy - area), w2 * (dy - area))
        y = y_next
        row += 1


@kernel
def _add_run(plane, at, count, step):
    """Add `step` to `count` differences of a channel from index `at` on."""
    step = splat(nb.float32(step))
    for j in range(0, count, LANES):
        store_part(plane, at + j, count - j, load_part(plane, at + j, count - j) + step)


@kernel
def _add_shallow(acc, k, row, low, high, dy, w, w2):
    """Add the part of an edge in one row, from column coordinate `low` to `high`, over several columns."""
    rise = dy / (high - low)
    first, last = int(low), math.ceil(high) - 1
    area = 0.5 * rise * (first + 1.0 - low) ** 2
    _add_cell(acc, k, row, first, w * area, w2 * area)
    if last > first + 1:
        step = rise * (first + 1.5 - low) - area
        _add_cell(acc, k, row, first + 1, w * step, w2 * step)
        # Further columns to the last one are covered by `rise` more each.
        at, count = row * acc.shape[2] + first + 2, last - first - 2
        _add_run(acc[k], at, count, w * rise)
        if w2 != 0.0:
            _add_run(acc[k + 1], at, count, w2 * rise)
        area = rise * (last - 0.5 - low)
    end = rise * (high - last) * (0.5 * (last + high) - low) + dy * (last + 1.0 - high)
    _add_cell(acc, k, row, last, w * (end - area), w2 * (end - area))
    _add_cell(acc, k, row, last + 1, w * (dy - end), w2 * (dy - end))


@kernel
def _add_inside(acc, k, x0, y0, x1, y1, w, w2):
    """Add an edge inside the frame that runs down (y0 < y1)."""
    width = float(acc.shape[2] - 2)
    slope = (x1 - x0) / (y1 - y0)
    row = int(y0)
    x, y = x0, y0
    while y < y1:
        y_next = row + 1.0 if row + 1.0 < y1 else y1
        dy = y_next - y
        x_next = x + slope * dy
        # Rounding may move the end of the edge out of the frame.
        x_next = 0.0 if x_next < 0.0 else width if x_next > width else x_next
        low, high = (x, x_next) if x < x_next else (x_next, x)
        col = int(low)
        if high <= col + 1.0:
            area = dy * (col + 1.0 - 0.5 * (low + high))
            _add_cell(acc, k, row, col, w * area, w2 * area)
            _add_cell(acc, k, row, col + 1, w * (dy - area), w2 * (dy - area))
        else:
            _add_shallow(acc, k, row, low, high, dy, w, w2)
        x, y = x_next, y_next
        row += 1


@kernel
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
    if abs(x1 - x0) <= 1.0 and math.ceil(max(x0, x1)) <= math.floor(min(x0, x1)) + 1.0:
        _add_upright(acc, k, x0, y0, x1, y1, w, w2)
    else:
        _add_inside(acc, k, x0, y0, x1, y1, w, w2)


@kernel
def clip_and_project(lens, corners, n, out):
    """Clip a polygon at the near plane and project it.

    Args:
        lens: The lens.
        corners: Corners as (depth, right, down), float64, shape (>= n, 3) [m].
        n: Number of corners.
        out: Output: projected corners (u, v), shape (> n, 2) [px].

    Returns:
        Number of projected corners; 0 if the polygon is entirely behind the near plane.
    """
    f, cu, cv = lens.focal, lens.centre_u, lens.centre_v
    m = 0
    d0, r0, z0 = corners[n - 1, 0], corners[n - 1, 1], corners[n - 1, 2]
    for i in range(n):
        d1, r1, z1 = corners[i, 0], corners[i, 1], corners[i, 2]
        if (d0 >= NEAR) != (d1 >= NEAR):
            t = (NEAR - d0) / (d1 - d0)
            out[m, 0] = cu + f * (r0 + t * (r1 - r0)) / NEAR
            out[m, 1] = cv + f * (z0 + t * (z1 - z0)) / NEAR
            m += 1
        if d1 >= NEAR:
            scale = f / d1
            out[m, 0] = cu + scale * r1
            out[m, 1] = cv + scale * z1
            m += 1
        d0, r0, z0 = d1, r1, z1
    return m


@kernel
def winding(uv, n):
    """Return twice the signed area of a projected polygon; positive if its left edge runs downwards."""
    area = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        area += uv[j, 0] * uv[i, 1] - uv[i, 0] * uv[j, 1]
    return area


@kernel
def bounds(uv, n):
    """Return the bounds (left, top, right, bottom) of a projected polygon [px]."""
    left = right = uv[0, 0]
    top = bottom = uv[0, 1]
    for i in range(1, n):
        left, right = min(left, uv[i, 0]), max(right, uv[i, 0])
        top, bottom = min(top, uv[i, 1]), max(bottom, uv[i, 1])
    return left, top, right, bottom


@kernel
def add_polygon(acc, k, uv, n, w, w2):
    """Add a projected polygon of positive winding; one of negative winding is subtracted."""
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        add_edge(acc, k, uv[i, 0], uv[i, 1], uv[j, 0], uv[j, 1], w, w2)


@kernel
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
