"""Kernel of the potentials of the columns of a map: vertical strips of equal width."""

import math

from lgmd_gym.kernels import kernel


@kernel(exact=True, arrays=True)
def column_potentials(first, last, active, maps, width, sigma, out) -> None:
    """Write the potential of each column for the active neurons among first..last-1.

    K_c = 1 / (1 + exp(-m_c / sigma)) for the mean m_c of the map over column c.

    Args:
        first: First neuron.
        last: Last neuron + 1.
        active: Selection of the neurons, bool, shape (N,).
        maps: Maps, float32, shape (N, H, at least width).
        width: Width of the maps without padding, a multiple of the number of columns [px].
        sigma: Mean at which K_c = 0.73.
        out: Output, float64, shape (N, columns).
    """
    height, columns = maps.shape[1], out.shape[1]
    span = width // columns
    for n in range(first, last):
        if not active[n]:
            continue
        for column in range(columns):
            total = 0.0
            for y in range(height):
                for x in range(column * span, (column + 1) * span):
                    total += maps[n, y, x]
            out[n, column] = 1.0 / (1.0 + math.exp(-total / (height * span * sigma)))
