"""Kernels of the LPLC2 model: motion of neighbouring pixels, and units with four arms."""

import math

import numpy as np
from numba import njit

from lgmd_gym.neuron.scalars import AGE, GAIN_G, LATENCY, F, W, fire


@njit(cache=True, nogil=True)
def _photoreceptors(frame, mean, on, off, gain):
    """Subtract the mean light and split the difference into ON and OFF (eq. 1 and 2)."""
    height, width = mean.shape
    for y in range(height):
        for x in range(width):
            change = np.float32(frame[y, x]) - mean[y, x]
            mean[y, x] += gain * change
            on[y, x], off[y, x] = max(change, np.float32(0.0)), max(-change, np.float32(0.0))


@njit(inline="always")
def _compressed(correlation):
    """Return the signed square root."""
    return math.copysign(math.sqrt(abs(correlation)), correlation)


@njit(cache=True, nogil=True)
def _motion(on, off, late_on, late_off, right, down):
    """Correlate each pixel with the next one to the right and below (eq. 4); returns the sum of |right|."""
    height, width = on.shape
    total = 0.0
    for y in range(height):
        for x in range(width - 1):
            value = late_on[y, x] * on[y, x + 1] - on[y, x] * late_on[y, x + 1]
            value += late_off[y, x] * off[y, x + 1] - off[y, x] * late_off[y, x + 1]
            right[y, x] = _compressed(value)
            total += abs(right[y, x])
    for y in range(height - 1):
        for x in range(width):
            value = late_on[y, x] * on[y + 1, x] - on[y, x] * late_on[y + 1, x]
            value += late_off[y, x] * off[y + 1, x] - off[y, x] * late_off[y + 1, x]
            down[y, x] = _compressed(value)
    return total


@njit(cache=True, nogil=True)
def _delay(on, off, late_on, late_off, gain):
    """Update the delayed ON and OFF (eq. 3)."""
    height, width = on.shape
    for y in range(height):
        for x in range(width):
            late_on[y, x] += gain * (on[y, x] - late_on[y, x])
            late_off[y, x] += gain * (off[y, x] - late_off[y, x])


@njit(cache=True, nogil=True)
def _integrate(image, table):
    """Write the sums of all rectangles from the top left corner, shape (height + 1, width + 1)."""
    for y in range(image.shape[0]):
        row = 0.0
        for x in range(image.shape[1]):
            row += image[y, x]
            table[y + 1, x + 1] = table[y, x + 1] + row


@njit(inline="always")
def _box(table, y0, x0, y1, x1):
    """Return the sum over rows y0..y1-1 and columns x0..x1-1."""
    return table[y1, x1] - table[y0, x1] - table[y1, x0] + table[y0, x0]


@njit(cache=True, nogil=True)
def _strongest_unit(across, along, radius, stride, vertical, units):
    """Write the response of every unit (eq. 5 and 6) and return the largest one."""
    area, best = 2.0 * radius * radius, 0.0
    for i in range(units.shape[0]):
        y = radius + i * stride
        for j in range(units.shape[1]):
            x = radius + j * stride
            low, high, left, right = y - radius, y + radius, x - radius, x + radius
            response = max(-_box(across, low, left, high, x) / area, 0.0)
            response *= max(_box(across, low, x, high, right) / area, 0.0)
            if vertical:
                response *= max(-_box(along, low, left, y, right) / area, 0.0)
                response *= max(_box(along, y, left, high, right) / area, 0.0)
                response = math.sqrt(response)
            units[i, j] = math.sqrt(response)
            best = max(best, units[i, j])
    return best


@njit(cache=True, nogil=True)
def step(
    first, last, frames, active, scalars, const, gains, sizes, mean, on, off, late_on, late_off, right, down,
    units, tables,
) -> None:  # fmt: skip
    """Step the active neurons among first..last-1.

    Args:
        first: First neuron.
        last: Last neuron + 1.
        frames: Frames, (N, H, W).
        active: Neurons to step, bool, (N,).
        scalars: Scalar state, see `scalars`, (N, ...).
        const: Constants of the stage of spikes, see `scalars.pack_constants`.
        gains: Gains of the mean light and of the delay, float32, (2,).
        sizes: Radius, stride, and whether units have vertical arms, int64, (3,).
        mean: Mean light; this and the next six are float32, (N, H, W).
        on: ON of the last frame.
        off: OFF of the last frame.
        late_on: Delayed ON.
        late_off: Delayed OFF.
        right: Motion to the right.
        down: Motion downwards.
        units: Responses of the units, float32, (N, rows, columns).
        tables: Sums of both motions, float64, (N, 2, H + 1, W + 1); the first row and column are 0.
    """
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[AGE] == 0.0:
            for y in range(mean.shape[1]):
                for x in range(mean.shape[2]):
                    mean[n, y, x] = frames[n, y, x]
            row[AGE] = 1.0
            continue
        _photoreceptors(frames[n], mean[n], on[n], off[n], gains[0])
        total = _motion(on[n], off[n], late_on[n], late_off[n], right[n], down[n])
        _delay(on[n], off[n], late_on[n], late_off[n], gains[1])
        across, along = tables[n, 0], tables[n, 1]
        _integrate(right[n], across)
        if sizes[2] != 0:
            _integrate(down[n], along)
        response = _strongest_unit(across, along, sizes[0], sizes[1], sizes[2] != 0, units[n])
        row[F], row[W], row[LATENCY], row[GAIN_G] = total / (mean.shape[1] * mean.shape[2]), 0.0, 0.0, 1.0
        fire(row, const, response)
