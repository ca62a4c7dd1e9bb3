"""Kernels of the ground: asphalt, verge and everything flat on them.

Without roll, each image row is at one distance ahead: a row of ground is a straight line over the texture
with one footprint, and the level of the rip-map is chosen once per row.
"""

import numba as nb

from lgmd_gym.camera.render.coverage import NEAR, add_polygon, clip_and_project, winding
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.render.texture_sampling import sample_row, texture_line

# Channels of the ground layer.
ROAD, PAINT, SHADOW = 0, 1, 2


@kernel
def add_ground_quad(layer, k, lens, quad, weight):
    """Add a quad of the ground, given as x, y of its four corners, to channel k."""
    corners = layer.corners
    for i in range(4):
        dx, dy = quad[2 * i] - lens.x, quad[2 * i + 1] - lens.y
        ahead = dx * lens.cos_yaw + dy * lens.sin_yaw
        corners[i, 0] = ahead * lens.cos_pitch - lens.z * lens.sin_pitch
        corners[i, 1] = dy * lens.cos_yaw - dx * lens.sin_yaw
        corners[i, 2] = ahead * lens.sin_pitch + lens.z * lens.cos_pitch
    add_quad(layer, k, lens, weight)


@kernel
def add_quad(layer, k, lens, weight):
    """Add the quad in `layer.corners`, of either winding, to channel k."""
    corners, uv = layer.corners, layer.uv
    if max(max(corners[0, 0], corners[1, 0]), max(corners[2, 0], corners[3, 0])) < NEAR:
        return
    n = clip_and_project(lens, corners, 4, uv)
    if n >= 3:
        add_polygon(layer.coverage, k, uv, n, weight if winding(uv, n) > 0.0 else -weight, 0.0)


@kernel
def _sum_row(coverage, row, rows):
    """Sum one row of coverage differences into coverage (rows 0 to 2 of `rows`), and clear it."""
    width = rows.shape[1] - 2
    cells = coverage[row]
    for k in range(3):
        total = nb.float32(0.0)
        out = rows[k]
        j = 0
        # Four at a time: the sums inside a block do not depend on the sum before it.
        while j + 4 <= width:
            a = cells[j, k]
            b = a + cells[j + 1, k]
            c = b + cells[j + 2, k]
            d = c + cells[j + 3, k]
            out[j], out[j + 1], out[j + 2] = total + a, total + b, total + c
            total += d
            out[j + 3] = total
            j += 4
        while j < width:
            total += cells[j, k]
            out[j] = total
            j += 1
    cells[:] = nb.float32(0.0)
    # Remove rounding errors: a trace of verge on the road, or of road on the verge.
    for j in range(width):
        road = rows[ROAD, j]
        road = nb.float32(1.0) if road > nb.float32(0.9999) else road
        rows[ROAD, j] = nb.float32(0.0) if road < nb.float32(1e-4) else road


@kernel
def _span(road, width, verge):
    """Return the first and last + 1 pixel with any road (or any verge); (0, 0) if there is none."""
    none = nb.float32(1.0) if verge else nb.float32(0.0)
    first, last = 0, width
    while first < width and road[first] == none:
        first += 1
    if first == width:
        return 0, 0
    while road[last - 1] == none:
        last -= 1
    return first, last


@kernel
def _gap(road, start, end):
    """Return the part of [start, end) that is only road if all verge is on its two sides, else (end, end)."""
    inner, outer = start, end
    while inner < end and road[inner] < 1.0:
        inner += 1
    while outer > inner and road[outer - 1] < 1.0:
        outer -= 1
    for j in range(inner, outer):
        if road[j] < 1.0:
            return end, end
    return inner, outer


@kernel
def shade_row(coverage, lens, row, look, tables, rows, out):
    """Write one row of the ground layer as grey levels to `out`, float32 (width,), and clear its coverage."""
    width = out.shape[0]
    _sum_row(coverage, row, rows)
    line = texture_line(lens, row, tables.level_start)
    start, end = _span(rows[ROAD], width, False)
    sample_row(tables.asphalt, line, rows[3], start, end)
    start, end = _span(rows[ROAD], width, True)
    # Most rows have verge on the left and on the right only: skip the road between them.
    inner, outer = _gap(rows[ROAD], start, end)
    sample_row(tables.verge, line, rows[4], start, inner)
    sample_row(tables.verge, line, rows[4], outer, end)
    _mix_row(look, rows, out)


@kernel
def _mix_row(look, rows, out):
    """Mix verge, asphalt, paint and shadow by their coverage."""
    a_mean, a_gain = nb.float32(look.asphalt), nb.float32(look.asphalt_gain)
    v_mean, v_gain = nb.float32(look.verge), nb.float32(look.verge_gain)
    white, half = nb.float32(look.paint), nb.float32(0.5)
    one, zero, deep = nb.float32(1.0), nb.float32(0.0), nb.float32(0.75)
    for j in range(out.shape[0]):
        m = rows[0, j]
        p = min(max(rows[1, j], zero), one)
        d = min(max(rows[2, j], zero), deep)
        grain = a_gain * rows[3, j]
        asphalt = a_mean + grain
        verge = v_mean + v_gain * rows[4, j]
        # Not verge + m · (asphalt − verge): where m is 1, the row of the verge may contain old values.
        grey = m * asphalt + (one - m) * verge
        # Worn paint shows half of the asphalt's grain.
        grey += p * (white + half * grain - grey)
        out[j] = grey * (one - d)
