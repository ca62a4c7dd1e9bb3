"""Kernels of the normal equations of the far-field registration."""

import numba as nb

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load, madd, splat, total
from lgmd_gym.sensing.registration_layout import (
    BANDS,
    GAIN,
    MARGIN_COLUMNS,
    MARGIN_ROWS,
    MIDDLE,
    OFFSET,
    PAN,
    PITCH_PX,
    ROLL_RAD,
    YAW_PX,
)


@kernel(exact=True, arrays=True)
def sum_blocks(warped, reference, variance, const, row, sums) -> None:
    """Write the sums of the normal equations of every block."""
    height, width = warped.shape
    blocks, band = (width - 2 * MARGIN_COLUMNS) // LANES, (height - 2 * MARGIN_ROWS) // BANDS
    for b in range(BANDS):
        for k in range(blocks):
            y, x = MARGIN_ROWS + band * b, MARGIN_COLUMNS + LANES * k
            _sum_block(warped, reference, variance, const, row, (y, y + band, x), sums[b * blocks + k])


@kernel(exact=True, arrays=True)
def _sum_block(warped, reference, variance, const, row, place, out) -> None:
    """Sum the products of gradient, grey and 1, and those with the residual, over the pixels of a block."""
    first, last, x = place
    zero = splat(nb.float32(0.0))
    yy, yx, xx, yr, xr, rr, y1, x1, r1, w1 = zero, zero, zero, zero, zero, zero, zero, zero, zero, zero
    ye, xe, re, e1 = zero, zero, zero, zero
    for y in range(first, last):
        at = y * warped.shape[1] + x
        rise, slope, grey, residual, weight = _terms(warped, reference, variance, const, row, at)
        wy, wx, wr, we = weight * rise, weight * slope, weight * grey, weight * residual
        yy, yx, xx = madd(wy, rise, yy), madd(wy, slope, yx), madd(wx, slope, xx)
        yr, xr, rr = madd(wy, grey, yr), madd(wx, grey, xr), madd(wr, grey, rr)
        y1, x1, r1, w1 = y1 + wy, x1 + wx, r1 + wr, w1 + weight
        ye, xe = madd(we, rise, ye), madd(we, slope, xe)
        re, e1 = madd(we, grey, re), e1 + we
    out[0], out[1], out[2], out[3] = total(yy), total(yx), total(xx), total(yr)
    out[4], out[5], out[6], out[7] = total(xr), total(y1), total(x1), total(rr)
    out[8], out[9], out[10], out[11] = total(r1), total(w1), total(ye), total(xe)
    out[12], out[13] = total(re), total(e1)


@kernel(exact=True, arrays=True)
def _terms(warped, reference, variance, const, row, at):
    """Return gradient (down, right), grey of the reference, residual and weight of sixteen pixels.

    The gradient is that of the mean of the registered frame and the expected one. With the residual r and the
    variance s of a pixel, the weight is share · s / (s + r² / outlier)².
    """
    width = warped.shape[1]
    gain, quarter = splat(nb.float32(row[GAIN])), splat(nb.float32(0.25))
    grey = load(reference, at) - splat(nb.float32(MIDDLE))
    residual = madd(gain, grey, splat(nb.float32(row[OFFSET]))) - load(warped, at)
    rise = load(reference, at + width) - load(reference, at - width)
    slope = load(reference, at + 1) - load(reference, at - 1)
    rise = madd(gain, rise, load(warped, at + width) - load(warped, at - width)) * quarter
    slope = madd(gain, slope, load(warped, at + 1) - load(warped, at - 1)) * quarter
    edge, least = splat(nb.float32(const.edge**2)), splat(nb.float32(const.least_variance))
    spread = madd(edge, madd(rise, rise, slope * slope), load(variance, at) + least)
    root = madd(splat(nb.float32(const.outlier)), spread, residual * residual)
    weight = splat(nb.float32(const.share * const.outlier**2)) * spread / (root * root)
    return rise, slope, grey, residual, weight


@kernel(exact=True, arrays=True)
def add_blocks(sums, shape, matrix, right) -> None:
    """Write the normal equations of pitch, roll, yaw, gain and offset from the sums of the blocks."""
    height, width = shape
    blocks, band = (width - 2 * MARGIN_COLUMNS) // LANES, (height - 2 * MARGIN_ROWS) // BANDS
    matrix[:] = 0.0
    right[:] = 0.0
    for b in range(BANDS):
        y = MARGIN_ROWS + band * b + 0.5 * (band - height)
        for k in range(blocks):
            x = MARGIN_COLUMNS + LANES * k + 0.5 * (LANES - width)
            s = sums[b * blocks + k]
            matrix[0, 0] += s[0]
            matrix[0, 1] += x * s[0] - y * s[1]
            matrix[1, 1] += x * x * s[0] - 2.0 * x * y * s[1] + y * y * s[2]
            matrix[0, 2] += s[1]
            matrix[1, 2] += x * s[1] - y * s[2]
            matrix[2, 2] += s[2]
            matrix[0, 3] -= s[3]
            matrix[1, 3] -= x * s[3] - y * s[4]
            matrix[2, 3] -= s[4]
            matrix[0, 4] -= s[5]
            matrix[1, 4] -= x * s[5] - y * s[6]
            matrix[2, 4] -= s[6]
            matrix[3, 3] += s[7]
            matrix[3, 4] += s[8]
            matrix[4, 4] += s[9]
            right[0] += s[10]
            right[1] += x * s[10] - y * s[11]
            right[2] += s[11]
            right[3] -= s[12]
            right[4] -= s[13]


@kernel(exact=True, arrays=True)
def add_prior(const, row, gain, offset, matrix, right) -> None:
    """Add the prior: no pitch and roll, the yaw of the car's turns, and the exposure of the last frame."""
    matrix[0, 0] += const.pitch_prior
    matrix[1, 1] += const.roll_prior
    matrix[2, 2] += const.yaw_prior
    matrix[3, 3] += const.gain_prior
    matrix[4, 4] += const.offset_prior
    right[0] -= const.pitch_prior * row[PITCH_PX]
    right[1] -= const.roll_prior * row[ROLL_RAD]
    right[2] += const.yaw_prior * (row[PAN] - row[YAW_PX])
    right[3] += const.gain_prior * (gain - row[GAIN])
    right[4] += const.offset_prior * (offset - row[OFFSET])


@kernel(exact=True, arrays=True)
def solve(matrix, right) -> None:
    """Replace `right` by the solution of a symmetric positive definite system, given its upper triangle."""
    size = matrix.shape[0]
    for k in range(size):
        for i in range(k + 1, size):
            factor = matrix[k, i] / matrix[k, k]
            for j in range(i, size):
                matrix[i, j] -= factor * matrix[k, j]
            right[i] -= factor * right[k]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            right[i] -= matrix[i, j] * right[j]
        right[i] /= matrix[i, i]
