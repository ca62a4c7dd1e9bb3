"""Kernel of the far-field registration; `FarFieldRegistration` documents the method."""

import math

import numba as nb

from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load, madd, select_by_sign, splat, store
from lgmd_gym.sensing.registration_equations import add_blocks, add_prior, solve, sum_blocks
from lgmd_gym.sensing.registration_images import blur, follow_turn, warp
from lgmd_gym.sensing.registration_layout import (
    COUNT,
    GAIN,
    MEAN_PITCH,
    MEAN_ROLL,
    MEAN_YAW,
    MIDDLE,
    NEW,
    OFFSET,
    PAD,
    PAN,
    PITCH_PX,
    ROLL_RAD,
    STARTED,
    YAW_PX,
)

_ITERATIONS = 3


@kernel(exact=True, arrays=True)
def register(first, last, active, frames, turns, const, state, rotations, space) -> None:
    """Register a frame of the active cameras among first..last-1.

    Args:
        first: First camera.
        last: Last camera + 1.
        active: Selection of the cameras, bool, shape (N,).
        frames: Frames, uint8, shape (N, height, width).
        turns: Turn of the car to the right since the last frame, float64, shape (N,) [rad].
        const: `CONSTANTS` record, shape (1,).
        state: Numbers of each camera, float64, shape (N, `STATE_SIZE`); reference and variance of the
            residual, float32, shape (N, height, width).
        rotations: Output: pitch, roll and yaw of each camera, float64, shape (N, 3) [degrees].
        space: Scratch memory, see `make_space`.
    """
    numbers, references, variances = state
    padded, warped, line, sums, matrix, right = space
    for n in range(first, last):
        if not active[n]:
            continue
        row, reference, variance = numbers[n], references[n], variances[n]
        blur(frames[n], padded, line)
        if row[STARTED] == 0.0:
            _start(padded, const[0], row, reference, variance)
            rotations[n, :] = 0.0
            continue
        follow_turn(-const[0].focal * turns[n], row, reference, variance)
        gain, offset = row[GAIN], row[OFFSET]
        for _ in range(_ITERATIONS):
            warp(padded, row, warped)
            sum_blocks(warped, reference, variance, const[0], row, sums)
            add_blocks(sums, reference.shape, matrix, right)
            add_prior(const[0], row, gain, offset, matrix, right)
            solve(matrix, right)
            for k in range(5):
                row[PITCH_PX + k] += right[k]
        warp(padded, row, warped)
        row[COUNT] += 1.0
        _adapt(warped, const[0], row, reference, variance)
        _write_rotation(const[0], row, rotations[n])


@kernel(exact=True, arrays=True)
def _start(padded, const, row, reference, variance) -> None:
    height, width = reference.shape
    row[:] = 0.0
    row[STARTED], row[GAIN], row[OFFSET] = 1.0, 1.0, MIDDLE
    for y in range(height):
        for x in range(0, width, LANES):
            store(reference, y * width + x, load(padded, (y + PAD) * padded.shape[1] + x + PAD))
            store(variance, y * width + x, splat(nb.float32(const.first_variance)))


@kernel(exact=True, arrays=True)
def _adapt(warped, const, row, reference, variance) -> None:
    """Adapt the reference to the registered frame, and the variance to its residual.

    A pixel without a reference takes the value of the frame.
    """
    gain, offset = splat(nb.float32(row[GAIN])), splat(nb.float32(row[OFFSET]))
    inverse = splat(nb.float32(1.0 / max(row[GAIN], 1e-3)))
    middle, rate = splat(nb.float32(MIDDLE)), splat(nb.float32(const.reference_gain))
    known, start = splat(nb.float32(0.5 * NEW)), splat(nb.float32(const.first_variance))
    share = splat(nb.float32(max(const.variance_gain, 1.0 / (row[COUNT] + 1.0))))
    for at in range(0, warped.size, LANES):
        old, frame, spread = load(reference, at), load(warped, at), load(variance, at)
        residual = madd(gain, old - middle, offset) - frame
        equal = madd(frame - offset, inverse, middle)
        is_known = known - spread
        store(reference, at, select_by_sign(is_known, madd(rate, equal - old, old), equal))
        followed = madd(share, residual * residual - spread, spread)
        store(variance, at, select_by_sign(is_known, followed, start))


@kernel(exact=True, arrays=True)
def _write_rotation(const, row, rotation) -> None:
    """Write pitch, roll and yaw relative to their means [degrees], and follow the means."""
    pitch, roll = row[PITCH_PX] - row[MEAN_PITCH], row[ROLL_RAD] - row[MEAN_ROLL]
    yaw = row[YAW_PX] - row[PAN] - row[MEAN_YAW]
    row[MEAN_PITCH] += const.mean_gain * pitch
    row[MEAN_ROLL] += const.mean_gain * roll
    row[MEAN_YAW] += const.mean_gain * yaw
    rotation[0], rotation[1] = math.degrees(pitch / const.focal), -math.degrees(roll)
    rotation[2] = -math.degrees(yaw / const.focal)
