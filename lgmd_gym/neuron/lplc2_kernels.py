"""Kernels of the LPLC2 model: units with four arms."""

import math

from numba import njit

from lgmd_gym.kernels import kernel
from lgmd_gym.neuron.motion_kernels import (
    detect_motion_down,
    detect_motion_right,
    filter_light,
    start,
    update_delay,
)
from lgmd_gym.neuron.scalars import AGE, GAIN_G, LATENCY, F, W, fire


@kernel(exact=True, arrays=True)
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


@kernel(exact=True, arrays=True)
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


@kernel(exact=True, arrays=True)
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
            start(frames[n], mean[n])
            row[AGE] = 1.0
            continue
        filter_light(frames[n], mean[n], on[n], off[n], gains[0])
        _, total = detect_motion_right(on[n], off[n], late_on[n], late_off[n], right[n])
        detect_motion_down(on[n], off[n], late_on[n], late_off[n], down[n])
        update_delay(on[n], off[n], late_on[n], late_off[n], gains[1])
        across, along = tables[n, 0], tables[n, 1]
        _integrate(right[n], across)
        if sizes[2] != 0:
            _integrate(down[n], along)
        response = _strongest_unit(across, along, sizes[0], sizes[1], sizes[2] != 0, units[n])
        row[F], row[W], row[LATENCY], row[GAIN_G] = total / (mean.shape[1] * mean.shape[2]), 0.0, 0.0, 1.0
        fire(row, const, response)
