"""Kernels of the ground: asphalt, verge and whatever is flat on them.

Without roll every image row is one distance ahead, so a row of ground is a straight walk over the
texture with one footprint: the level of the rip-map is chosen once per row.
"""

from __future__ import annotations

import math

import numba as nb

from lgmd_gym.camera.pinhole import (
    CAM_COS_PITCH,
    CAM_COS_YAW,
    CAM_CU,
    CAM_CV,
    CAM_FOCAL,
    CAM_SIN_PITCH,
    CAM_SIN_YAW,
    CAM_X,
    CAM_Y,
    CAM_Z,
)
from lgmd_gym.camera.render.coverage import NEAR, add_polygon, clip_and_project, winding
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.camera.render.texture import TEXEL_M

# Channels of the ground accumulator.
ROAD, PAINT, SHADOW = 0, 1, 2


@kernel
def ground_corner(cam, x, y, out, i):
    """Write a point of the ground as (depth, right, down) to row i of `out`."""
    dx, dy = x - cam[CAM_X], y - cam[CAM_Y]
    ahead = dx * cam[CAM_COS_YAW] + dy * cam[CAM_SIN_YAW]
    out[i, 0] = ahead * cam[CAM_COS_PITCH] - cam[CAM_Z] * cam[CAM_SIN_PITCH]
    out[i, 1] = dy * cam[CAM_COS_YAW] - dx * cam[CAM_SIN_YAW]
    out[i, 2] = ahead * cam[CAM_SIN_PITCH] + cam[CAM_Z] * cam[CAM_COS_PITCH]


@kernel
def add_ground_quad(acc, k, cam, quad, weight, pts, uv):
    """Add a quad of the ground, given as x, y of its four corners, to channel k."""
    for i in range(4):
        ground_corner(cam, quad[2 * i], quad[2 * i + 1], pts, i)
    add_quad(acc, k, cam, weight, pts, uv)


@kernel
def add_quad(acc, k, cam, weight, pts, uv):
    """Add a quad given in camera axes, whichever way round it runs."""
    if max(max(pts[0, 0], pts[1, 0]), max(pts[2, 0], pts[3, 0])) < NEAR:
        return
    n = clip_and_project(cam, pts, 4, uv)
    if n >= 3:
        add_polygon(acc, k, uv, n, weight if winding(uv, n) > 0.0 else -weight, 0.0)


@kernel
def _sample(data, walk, out, j0, j1):
    """Bilinear walk over one level of a rip-map.

    Args:
        data: Texture bytes.
        walk: `texture_walk(...)`.
        out: Row that gets grey deviations, in bytes around 128.
        j0: First pixel.
        j1: Last pixel + 1.
    """
    base, x, y, dx, dy, log_x, log_y = walk
    # 16.16 fixed point wraps and floors without branches; unsigned, so that no index may be negative.
    px = nb.uint64(nb.int64(math.floor((x + dx * j0) * 65536.0)))
    py = nb.uint64(nb.int64(math.floor((y + dy * j0) * 65536.0)))
    sx = nb.uint64(nb.int64(math.floor(dx * 65536.0 + 0.5)))
    sy = nb.uint64(nb.int64(math.floor(dy * 65536.0 + 0.5)))
    one, shift, bits = nb.uint64(1), nb.uint64(log_y), nb.uint64(16)
    mask_x, mask_y = (one << nb.uint64(log_x)) - one, (one << shift) - one
    fraction, start = nb.uint64(65535), nb.uint64(base)
    scale = nb.float32(1.0 / 65536.0)
    for j in range(j0, j1):
        ix, iy = px >> bits, py >> bits
        r0 = start + ((ix & mask_x) << shift)
        r1 = start + (((ix + one) & mask_x) << shift)
        c0, c1 = iy & mask_y, (iy + one) & mask_y
        wx, wy = scale * nb.float32(px & fraction), scale * nb.float32(py & fraction)
        a, b = nb.float32(data[r0 + c0]), nb.float32(data[r0 + c1])
        c, d = nb.float32(data[r1 + c0]), nb.float32(data[r1 + c1])
        near = a + wy * (b - a)
        far = c + wy * (d - c)
        out[j] = near + wx * (far - near) - nb.float32(128.0)
        px += sx
        py += sy


@kernel
def distance_ahead(cam, row):
    """Distance of the ground in the middle of an image row, at most 100 km [m]."""
    v = row + 0.5 - cam[CAM_CV]
    fall = max(v * cam[CAM_COS_PITCH] - cam[CAM_FOCAL] * cam[CAM_SIN_PITCH], 1e-6)
    return min(cam[CAM_Z] / fall * (cam[CAM_FOCAL] * cam[CAM_COS_PITCH] + v * cam[CAM_SIN_PITCH]), 1e5)


@kernel
def _level(footprint, top):
    """Level of the rip-map whose texels are as large as the footprint [texels]."""
    if not footprint < 1e12:
        return top
    return min(math.floor(math.log2(max(footprint, 1.0)) + 0.5), top)


@kernel
def texture_walk(cam, row, offset):
    """Describe the walk of an image row below the horizon over a ground texture.

    Returns:
        (offset of the level, texel x and y of pixel 0, steps in x and y, log2 of the level's sizes).
    """
    v = row + 0.5 - cam[CAM_CV]
    fall = v * cam[CAM_COS_PITCH] - cam[CAM_FOCAL] * cam[CAM_SIN_PITCH]
    reach = cam[CAM_Z] / max(fall, 1e-6)
    ahead = reach * (cam[CAM_FOCAL] * cam[CAM_COS_PITCH] + v * cam[CAM_SIN_PITCH])
    c, s = cam[CAM_COS_YAW], cam[CAM_SIN_YAW]
    along = cam[CAM_FOCAL] * reach / max(fall, 0.3)
    # The pixel's footprint in the axes of the texture.
    wide_x = math.sqrt((along * c) ** 2 + (reach * s) ** 2) / TEXEL_M
    wide_y = math.sqrt((along * s) ** 2 + (reach * c) ** 2) / TEXEL_M
    top_x, top_y = offset.shape[0] - 1, offset.shape[1] - 1
    i, j = _level(wide_x, top_x), _level(wide_y, top_y)
    log_x, log_y = top_x - i, top_y - j
    scale_x, scale_y = 1.0 / (TEXEL_M * (1 << i)), 1.0 / (TEXEL_M * (1 << j))
    left = (0.5 - cam[CAM_CU]) * reach
    x = (cam[CAM_X] + ahead * c - left * s) * scale_x - 0.5
    y = (cam[CAM_Y] + ahead * s + left * c) * scale_y - 0.5
    x -= math.floor(x / (1 << log_x)) * (1 << log_x)
    y -= math.floor(y / (1 << log_y)) * (1 << log_y)
    return offset[i, j], x, y, -s * reach * scale_x, c * reach * scale_y, log_x, log_y


@kernel
def _sum_row(acc, row, rows):
    """Turn one row of coverage differences into coverage (rows 0 to 2 of `rows`), and clear it."""
    width = rows.shape[1] - 2
    cells = acc[row]
    for k in range(3):
        total = nb.float32(0.0)
        out = rows[k]
        j = 0
        # Four at a time: the sums inside a block do not wait for the sum before it.
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
    # Rounding must not leave a breath of verge on the road, nor of road on the verge.
    for j in range(width):
        road = rows[ROAD, j]
        road = nb.float32(1.0) if road > nb.float32(0.9999) else road
        rows[ROAD, j] = nb.float32(0.0) if road < nb.float32(1e-4) else road


@kernel
def _span(road, width, verge):
    """First and last + 1 pixel with any road (or any verge); (0, 0) if there is none."""
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
    """Part of [start, end) that is road alone, if all verge is on its two sides; else empty, at `end`."""
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
def shade_row(acc, cam, row, look, textures, rows, out):
    """Turn one row of the accumulator into grey, and clear it.

    Args:
        acc: Ground accumulator, float32, shape (height, width + 2, 3).
        cam: `camera_vector(...)`.
        row: The row.
        look: Grey levels: asphalt mean and contrast, verge mean and contrast, paint.
        textures: Bytes and offsets of asphalt, then of verge.
        rows: Scratch, float32, shape (6, width + 2).
        out: Gets the row, float32, shape (width,).
    """
    width = out.shape[0]
    _sum_row(acc, row, rows)
    walk = texture_walk(cam, row, textures[1])
    start, end = _span(rows[ROAD], width, False)
    _sample(textures[0], walk, rows[3], start, end)
    start, end = _span(rows[ROAD], width, True)
    # Most rows show verge on the left and on the right only: skip the road between them.
    inner, outer = _gap(rows[ROAD], start, end)
    _sample(textures[2], walk, rows[4], start, inner)
    _sample(textures[2], walk, rows[4], outer, end)
    _mix_row(look, rows, out)


@kernel
def _mix_row(look, rows, out):
    """Mix verge, asphalt, paint and shadow by their coverage."""
    a_mean, a_gain = nb.float32(look[0]), nb.float32(look[1])
    v_mean, v_gain = nb.float32(look[2]), nb.float32(look[3])
    white, half = nb.float32(look[4]), nb.float32(0.5)
    one, zero, deep = nb.float32(1.0), nb.float32(0.0), nb.float32(0.75)
    for j in range(out.shape[0]):
        m = rows[0, j]
        p = min(max(rows[1, j], zero), one)
        d = min(max(rows[2, j], zero), deep)
        grain = a_gain * rows[3, j]
        asphalt = a_mean + grain
        verge = v_mean + v_gain * rows[4, j]
        # Not verge + m · (asphalt − verge): where m is 1 the verge's row may hold stale values.
        grey = m * asphalt + (one - m) * verge
        # Worn paint keeps a little of the asphalt's grain.
        grey += p * (white + half * grain - grey)
        out[j] = grey * (one - d)
