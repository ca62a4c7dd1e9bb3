"""Exact area coverage of polygons, the camera's only drawing primitive.

A polygon's edges are added to an accumulator of coverage *differences*. The running sum along a row is, at
each pixel, the exact area of the pixel inside all polygons added so far. The cost grows with the outline
only, shared edges cancel exactly, and a polygon of any size contributes its exact area: an edge that moves by
a tenth of a pixel changes the frame by a tenth of its contrast.
"""

import numba as nb

from lgmd_gym.camera.render.edges import add_edge
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import any_different, load_part, running_sum, splat, splat_last, store_part

NEAR = 0.1
"""Depth of the near plane [m]."""


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


@kernel(inline=True)
def winding(uv, n):
    """Return twice the signed area of a projected polygon; positive if its left edge runs downwards."""
    area = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        area += uv[j, 0] * uv[i, 1] - uv[i, 0] * uv[j, 1]
    return area


@kernel(inline=True)
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
