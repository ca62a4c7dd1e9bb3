# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Kernels of learned policies: features of fields, and the layers of dense networks.

The results for an environment depend neither on the other environments nor on their number.
"""

import math

import numpy as np

from lgmd_gym.agents.rules import POTENTIAL_MARGIN
from lgmd_gym.kernels import kernel

_BLOCK = 16  # rows of weights that stay in the L1 cache while all environments use them
_UNROLLED = 4


PART = np.dtype(
    [
        ("first", np.int64),  # the first of its fields; those of all inputs lie side by side
        ("count", np.int64),  # number of fields
        ("factor", np.float64),  # of the signal before the logarithm
        ("is_potential", np.bool_),  # whether the signal is a membrane potential
    ],
    align=True,
)


@kernel(exact=True)
def update_fields(signals, rows, started, parts, gains, norm, levels, frames, features):
    """Update the features of fields of some environments with their signals, see `FeatureHistory`.

    Args:
        signals: Signals of all fields, float64, shape (N, fields); replaced by their levels.
        rows: Indices of the environments, int64.
        started: Whether each environment has a state, bool, shape (N,).
        parts: Record of `PART` for each input.
        gains: Gains of the averages, float64, shape (averages,).
        norm: Divisor of the levels.
        levels: Levels of the last frame, float64, shape (N, fields).
        frames: Number of frames since the start, float64, shape (N,).
        features: Features, float64, shape (N, fields * (1 + averages)); for each input, the weaker levels of
            its fields, then their averages.
    """
    for n in rows:
        old = started[n]
        frames[n] = frames[n] + 1.0 if old else 1.0
        for index in range(len(parts)):
            part = parts[index]
            first, count = part["first"], part["count"]
            place = first * (1 + len(gains))
            for field in range(count):
                signal = _level(signals[n, first + field], part["factor"], part["is_potential"])
                signals[n, first + field] = signal / norm
            for field in range(count):
                level = signals[n, first + field]
                last = levels[n, first + field] if old else level
                features[n, place + field] = level if abs(level) <= abs(last) else last
                levels[n, first + field] = level
            for average in range(len(gains)):
                place += count
                gain = max(gains[average], 1.0 / frames[n])
                for field in range(count):
                    mean = features[n, place + field] if old else 0.0
                    features[n, place + field] = mean + gain * (signals[n, first + field] - mean)


@kernel(exact=True, inline=True)
def _level(signal, factor, is_potential):
    """Return a signal on a logarithmic scale, with its sign; a membrane potential K as log(K / (1 - K))."""
    if is_potential:
        if signal < POTENTIAL_MARGIN:
            signal = POTENTIAL_MARGIN
        elif signal > 1.0 - POTENTIAL_MARGIN:
            signal = 1.0 - POTENTIAL_MARGIN
        signal = math.log(signal / (1.0 - signal))
    # Half the time of log1p; the error, 1e-16, counts only for signals below 1e-9.
    return math.copysign(math.log(1.0 + factor * abs(signal)), signal)


@kernel
def affine(values, weights, bias, out):
    """Calculate `values @ weights + bias`, each sum in an order that does not depend on N.

    Args:
        values: Inputs, float32, shape (N, inputs).
        weights: Weights, float32, shape (inputs, units).
        bias: Biases, float32, shape (units,).
        out: Results, float32, shape (N, units).
    """
    inputs = len(weights)
    whole = inputs - inputs % _UNROLLED
    for n in range(len(values)):
        _begin(values, weights, bias, whole, n, out)
    for start in range(0, whole, _BLOCK):
        end = min(start + _BLOCK, whole)
        for n in range(len(values)):
            for k in range(start, end, _UNROLLED):
                _add(values, weights, k, n, out)


@kernel(inline=True)
def _begin(values, weights, bias, whole, n, out):
    """Set the results of environment n to the biases and the products of the inputs from `whole` on."""
    inputs, units = weights.shape
    for unit in range(units):
        out[n, unit] = bias[unit]
    for k in range(whole, inputs):
        for unit in range(units):
            out[n, unit] += values[n, k] * weights[k, unit]


@kernel(inline=True)
def _add(values, weights, k, n, out):
    """Add the products of four inputs, from k on, to the results of environment n."""
    a0, a1, a2, a3 = values[n, k], values[n, k + 1], values[n, k + 2], values[n, k + 3]
    for unit in range(weights.shape[1]):
        w0, w1 = weights[k, unit], weights[k + 1, unit]
        w2, w3 = weights[k + 2, unit], weights[k + 3, unit]
        out[n, unit] = out[n, unit] + a0 * w0 + a1 * w1 + a2 * w2 + a3 * w3
