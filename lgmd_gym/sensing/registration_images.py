"""Kernels of the far-field registration that write images: smoothing, shift of the reference, and warp.

A frame is divided into blocks of 16 columns and a quarter of the rows. Within a block, a small rotation is a
translation, so that sixteen pixels of a row have the same weights of interpolation and fill one vector.
"""

import math

import numba as nb
import numpy as np

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load, madd, splat, store
from lgmd_gym.sensing.registration_layout import (
    BANDS,
    MARGIN_COLUMNS,
    MARGIN_ROWS,
    NEW,
    PAD,
    PAN,
    PITCH_PX,
    ROLL_RAD,
    YAW_PX,
)


@kernel(exact=True, arrays=True)
def blur(frame, padded, line) -> None:
    """Write the frame, smoothed by a binomial of 3 × 3 px and with repeated edges."""
    height, width = frame.shape
    total_width, quarter = padded.shape[1], splat(nb.float32(0.25))
    for row in range(padded.shape[0]):
        middle = min(max(row - PAD, 0), height - 1) * width
        above = min(max(row - PAD - 1, 0), height - 1) * width
        below = min(max(row - PAD + 1, 0), height - 1) * width
        for x in range(0, width, LANES):
            twice = load(frame, middle + x)
            mean = (load(frame, above + x) + twice + twice + load(frame, below + x)) * quarter
            store(line, LANES + x, mean)
        store(line, 0, splat(line[LANES]))
        store(line, LANES + width, splat(line[LANES + width - 1]))
        for x in range(0, total_width, LANES):
            place = LANES - PAD + x
            twice = load(line, place)
            mean = (load(line, place - 1) + twice + twice + load(line, place + 1)) * quarter
            store(padded, row * total_width + x, mean)


@kernel(exact=True, arrays=True)
def follow_turn(shift, row, reference, variance) -> None:
    """Shift the reference by whole pixels with the turn of the car; `shift` is that of the frame [px]."""
    height, width = reference.shape
    row[PAN] += shift
    row[YAW_PX] += shift
    n = int(np.rint(row[PAN]))
    if n == 0:
        return
    row[PAN] -= n
    row[YAW_PX] -= n
    for y in range(height):
        for k in range(width):
            x = width - 1 - k if n > 0 else k  # do not overwrite columns that are still to be read
            source = x - n
            if 0 <= source < width:
                reference[y, x], variance[y, x] = reference[y, source], variance[y, source]
            else:
                variance[y, x] = NEW


@kernel(exact=True, arrays=True)
def warp(padded, row, warped) -> None:
    """Write the frame as registered with the reference, by bilinear interpolation."""
    height, width = warped.shape
    blocks, band = (width - 2 * MARGIN_COLUMNS) // LANES, (height - 2 * MARGIN_ROWS) // BANDS
    for k in range(-1, blocks + 1):
        block = min(max(k, 0), blocks - 1)
        # The margins belong to the block beside them.
        x = min(max(MARGIN_COLUMNS + LANES * k, 0), width - LANES)
        xc = MARGIN_COLUMNS + LANES * block + 0.5 * (LANES - width)
        for b in range(BANDS):
            y0 = 0 if b == 0 else MARGIN_ROWS + band * b
            y1 = height if b == BANDS - 1 else MARGIN_ROWS + band * (b + 1)
            yc = MARGIN_ROWS + band * b + 0.5 * (band - height)
            dy = min(max(row[PITCH_PX] + row[ROLL_RAD] * xc, 1.0 - PAD), PAD - 1.001)
            dx = min(max(row[YAW_PX] - row[ROLL_RAD] * yc, 1.0 - PAD), PAD - 1.001)
            _warp_block(padded, y0, y1, x, dy, dx, warped)


@kernel(exact=True, arrays=True)
def _warp_block(padded, y0, y1, x, dy, dx, warped) -> None:
    i, j = math.floor(dy), math.floor(dx)
    down, along = splat(nb.float32(dy - i)), splat(nb.float32(dx - j))
    stride = padded.shape[1]
    place = (PAD + y0 + int(i)) * stride + PAD + x + int(j)
    left, right = load(padded, place), load(padded, place + 1)
    upper = madd(along, right - left, left)
    for y in range(y0, y1):
        place += stride
        left, right = load(padded, place), load(padded, place + 1)
        lower = madd(along, right - left, left)
        store(warped, y * warped.shape[1] + x, madd(down, lower - upper, upper))
        upper = lower
