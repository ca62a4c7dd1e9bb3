"""Kernels of motion detectors: change of light, ON and OFF, and correlators of neighbouring pixels.

Equation numbers are those in the docstring of `LPLC2`.
"""

import math

import numpy as np
from numba import njit

from lgmd_gym.kernels import kernel


@kernel(exact=True, arrays=True)
def start(frame, mean):
    """Set the mean light to the first frame."""
    for y in range(mean.shape[0]):
        for x in range(mean.shape[1]):
            mean[y, x] = frame[y, x]


@kernel(exact=True, arrays=True)
def filter_light(frame, mean, on, off, gain):
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


@kernel(exact=True, arrays=True)
def detect_motion_right(on, off, late_on, late_off, right):
    """Correlate each pixel with the next one to the right (eq. 4); return the sums of m and |m|."""
    height, width = on.shape
    total = strength = 0.0
    for y in range(height):
        for x in range(width - 1):
            value = late_on[y, x] * on[y, x + 1] - on[y, x] * late_on[y, x + 1]
            value += late_off[y, x] * off[y, x + 1] - off[y, x] * late_off[y, x + 1]
            right[y, x] = _compressed(value)
            total += right[y, x]
            strength += abs(right[y, x])
    return total, strength


@kernel(exact=True, arrays=True)
def detect_motion_down(on, off, late_on, late_off, down):
    """Correlate each pixel with the next one below (eq. 4)."""
    height, width = on.shape
    for y in range(height - 1):
        for x in range(width):
            value = late_on[y, x] * on[y + 1, x] - on[y, x] * late_on[y + 1, x]
            value += late_off[y, x] * off[y + 1, x] - off[y, x] * late_off[y + 1, x]
            down[y, x] = _compressed(value)


@kernel(exact=True, arrays=True)
def update_delay(on, off, late_on, late_off, gain):
    """Update the delayed ON and OFF (eq. 3)."""
    height, width = on.shape
    for y in range(height):
        for x in range(width):
            late_on[y, x] += gain * (on[y, x] - late_on[y, x])
            late_off[y, x] += gain * (off[y, x] - late_off[y, x])
