# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Kernels on the maps of any model: their shift by whole pixels as the view turns, and their columns.

A view that turns to the right by one pixel moves its content one pixel to the left. The state that belongs
to the content moves with it: element x gets the value of element x + `pixels`. What enters at the side has no
past: its light is that of the present frame, and its change is 0.

Arguments of the kernels that shift: first neuron and last neuron + 1; neurons to shift, bool, (N,); scalar
state, see `scalars`, (N, ...); and the shift of each neuron, + for a turn to the right, int64, (N,) [px].
"""

import math

import numpy as np

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load_part, splat, total
from lgmd_gym.neuron.scalars import AGE


@kernel(exact=True, inline=True, arrays=True)
def _is_shifted(n, active, scalars, pixels):
    return active[n] and pixels[n] != 0 and scalars[n, AGE] > 0.0


@kernel(exact=True, inline=True, arrays=True)
def _column(step, width, pixels):
    """Return the column that is written in a step, so that no value is read after it is overwritten."""
    return step if pixels > 0 else width - 1 - step


@kernel(exact=True, arrays=True)
def shift_light(first, last, active, scalars, pixels, light, frames, y0, x0) -> None:
    """Shift the light of the last frame, (N, H, W); that of the present one, frames[n, y0:, x0:], enters."""
    _, height, width = light.shape
    for n in range(first, last):
        if not _is_shifted(n, active, scalars, pixels):
            continue
        for y in range(height):
            for step in range(width):
                x = _column(step, width, pixels[n])
                source = x + pixels[n]
                inside = 0 <= source < width
                light[n, y, x] = light[n, y, source] if inside else frames[n, y0 + y, x0 + x]


@kernel(exact=True, arrays=True)
def shift_rows(first, last, active, scalars, pixels, values, width) -> None:
    """Shift the rows of maps, (N, rows, at least width); 0 enters."""
    for n in range(first, last):
        if not _is_shifted(n, active, scalars, pixels):
            continue
        for y in range(values.shape[1]):
            for step in range(width):
                x = _column(step, width, pixels[n])
                source = x + pixels[n]
                values[n, y, x] = values[n, y, source] if 0 <= source < width else 0.0


@kernel(exact=True, arrays=True)
def shift_blocks(first, last, active, scalars, pixels, memory, width) -> None:
    """Shift the delayed rings of the fast kernel, (N, H, blocks, 6, 16), see `state.allocate`; 0 enters."""
    for n in range(first, last):
        if not _is_shifted(n, active, scalars, pixels):
            continue
        for y in range(memory.shape[1]):
            rings = memory[n, y]
            for step in range(width):
                x = _column(step, width, pixels[n])
                source = x + pixels[n]
                for ring in range(rings.shape[1]):
                    value = 0.0
                    if 0 <= source < width:
                        value = rings[source // LANES, ring, source % LANES]
                    rings[x // LANES, ring, x % LANES] = value


@kernel(exact=True, arrays=True)
def column_potentials(first, last, active, maps, width, sigma, out) -> None:
    """Write the potential of each column for the active neurons among first..last-1.

    K_c = 1 / (1 + exp(-m_c / sigma)) for the mean m_c of the map over column c.

    Args:
        first: First neuron.
        last: Last neuron + 1.
        active: Selection of the neurons, bool, shape (N,).
        maps: Maps, contiguous, float32, shape (N, H, at least width).
        width: Width of the maps without padding, a multiple of the number of columns [px].
        sigma: Mean at which K_c = 0.73.
        out: Output, float64, shape (N, columns).
    """
    height, columns, stride = maps.shape[1], out.shape[1], maps.shape[2]
    span = width // columns
    for n in range(first, last):
        if not active[n]:
            continue
        values = maps[n]
        for column in range(columns):
            sums = splat(np.float32(0.0))
            for x in range(0, span, LANES):
                at = column * span + x
                for y in range(height):
                    sums = sums + load_part(values, y * stride + at, span - x)
            out[n, column] = 1.0 / (1.0 + math.exp(-total(sums) / (height * span * sigma)))
