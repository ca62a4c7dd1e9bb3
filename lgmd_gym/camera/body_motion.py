# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Motion of the car's body on an uneven road: pitch, roll, yaw and heave from a measured spectrum.

Each axis is a sum of sinusoids with fixed frequencies and random phases, a function of seed, time and speed.
Pitch, roll, yaw and heave above 1 Hz are those of a car on one minute of road, 8 to 20 m/s: gyroscope and
accelerometer of comma2k19, Example_1, 2018-08-02, segment 40 (github.com/commaai/comma2k19, MIT licence).
Below 1 Hz, the measured heave (6.5 mm) contains hills; the heave there is that of an ISO 8608 class B road,
whose profile the body follows. In 1 to 3 Hz, such a road has 2.7 mm at this speed, as measured.
"""

import math

import numpy as np

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.hashing import START, add_hash, finish_hash

MEAN_SPEED = 16.73  # of the recording [m/s]
_MAX_SPEED = 60.0  # the amplitude does not grow beyond this [m/s]

PITCH, ROLL, YAW, HEAVE = 0, 1, 2, 3
BANDS_HZ = ((0.5, 1.0), (1.0, 3.0), (3.0, 8.0), (8.0, 20.0))
BAND_RMS = np.array(
    [
        (0.0795, 0.1154, 0.0126, 0.0035),
        (0.0711, 0.0586, 0.0128, 0.0026),
        (0.0141, 0.0134, 0.0017, 0.0013),
        (0.0033, 0.0027, 0.0002, 0.0001),
    ]
)
"""RMS per axis and band at `MEAN_SPEED`; pitch, roll and yaw [degrees], heave [m]."""

HERTZ = 0.53 * 1.3 ** np.arange(14)
"""Frequencies of the sinusoids, up to 16 Hz; the last band contains the wheel hop, at 10 to 15 Hz."""
_BITS = 32


def _amplitudes() -> np.ndarray:
    """Return the amplitude of each axis at each frequency; equal within a band."""
    amplitudes = np.empty((len(BAND_RMS), len(HERTZ)))
    for band, (low, high) in enumerate(BANDS_HZ):
        members = (low <= HERTZ) & (high > HERTZ)
        amplitudes[:, members] = BAND_RMS[:, band, None] * math.sqrt(2.0 / members.sum())
    return amplitudes


_AMPLITUDES = _amplitudes()
_FASTEST = math.sqrt(_MAX_SPEED / MEAN_SPEED)
MAX_DEG = tuple(float(_FASTEST * _AMPLITUDES[axis].sum()) for axis in (PITCH, ROLL, YAW))
"""Bounds of pitch, roll and yaw for an amplitude of 1 at any speed [degrees]."""


GYRO_GAIN_ERROR = 0.02
"""Error of the scale of the gyroscope of a stabilised lens."""
GYRO_LAG_S = 0.002
"""Error of the time of the gyroscope relative to the exposure [s]."""
GYRO_DRIFT_DEG = 0.01
"""RMS of the drift of the angles that are integrated from the gyroscope, at 0.05 to 0.5 Hz [degrees]."""
_DRIFT_HERTZ = 0.053 * 1.7 ** np.arange(5)
_DRIFT_DEG = GYRO_DRIFT_DEG * math.sqrt(2.0 / len(_DRIFT_HERTZ))
_DRIFT_AXIS = 4  # of the random phases: after those of the axes of the body
# The error of scale is in phase with the motion, that of time is its derivative.
_LEFT = _AMPLITUDES * np.hypot(GYRO_GAIN_ERROR, 2.0 * math.pi * HERTZ * GYRO_LAG_S)
_LEAD = np.arctan2(2.0 * math.pi * HERTZ * GYRO_LAG_S, GYRO_GAIN_ERROR)


@kernel(exact=True, arrays=True)
def road_gain(factor, speed):
    """Return the amplitude at a speed [m/s], for the multiple `factor` of the measured motion.

    The spectrum of a road's height falls with the square of the spatial frequency (ISO 8608). The variance at
    a frequency is therefore proportional to the speed, and the RMS to its square root.
    """
    return factor * math.sqrt(min(abs(speed), _MAX_SPEED) / MEAN_SPEED)


@kernel(exact=True)
def _phase(seed, axis, k):
    """Return the random phase of a sinusoid, in [0, 1)."""
    number = finish_hash(add_hash(add_hash(add_hash(START, seed), axis), k), 3)
    return (number & ((1 << _BITS) - 1)) / (1 << _BITS)


@kernel(exact=True, arrays=True)
def body_motion(seed, axis, time_s):
    """Return the motion of one axis at `MEAN_SPEED`, in the unit of `BAND_RMS`."""
    total = 0.0
    for k in range(HERTZ.shape[0]):
        phase = _phase(seed, axis, k)
        total += _AMPLITUDES[axis, k] * math.sin(2.0 * math.pi * (HERTZ[k] * time_s + phase))
    return total


@kernel(exact=True, arrays=True)
def residual_motion(seed, axis, time_s):
    """Return the rotation that is left when a gyroscope compensates that of the body [degrees].

    The gyroscope is that of a stability control with six axes. Its errors are assumptions: 2 % of scale,
    2 ms between sample and exposure, and a slow drift of 0.01° (RMS). At `MEAN_SPEED`, 0.011° of the 0.14°
    of pitch (RMS) are left.
    """
    total = 0.0
    for k in range(HERTZ.shape[0]):
        phase = _phase(seed, axis, k)
        total += _LEFT[axis, k] * math.sin(2.0 * math.pi * (HERTZ[k] * time_s + phase) + _LEAD[k])
    for k in range(_DRIFT_HERTZ.shape[0]):
        phase = _phase(seed, _DRIFT_AXIS + axis, k)
        total += _DRIFT_DEG * math.sin(2.0 * math.pi * (_DRIFT_HERTZ[k] * time_s + phase))
    return total
