"""Kernel of the direction-selective neuron."""

from lgmd_gym.kernels import kernel
from lgmd_gym.neuron.motion_kernels import detect_motion_right, filter_light, start, update_delay
from lgmd_gym.neuron.scalars import AGE, GAIN_G, LATENCY, F, W, fire


@kernel(exact=True, arrays=True)
def step(first, last, frames, active, scalars, const, gains, mean, on, off, late_on, late_off, right) -> None:
    """Step the active neurons among first..last-1.

    Args:
        first: First neuron.
        last: Last neuron + 1.
        frames: Frames, (N, H, W).
        active: Neurons to step, bool, (N,).
        scalars: Scalar state, see `scalars`, (N, ...).
        const: Constants of the stage of spikes, see `scalars.pack_constants`.
        gains: Gains of the mean light and of the delay, float32, (2,).
        mean: Mean light; this and the other maps are float32, (N, H, W).
        on: ON of the last frame.
        off: OFF of the last frame.
        late_on: Delayed ON.
        late_off: Delayed OFF.
        right: Motion to the right.
    """
    pixels = frames.shape[1] * frames.shape[2]
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[AGE] == 0.0:
            start(frames[n], mean[n])
            row[AGE] = 1.0
            continue
        filter_light(frames[n], mean[n], on[n], off[n], gains[0])
        total, strength = detect_motion_right(on[n], off[n], late_on[n], late_off[n], right[n])
        update_delay(on[n], off[n], late_on[n], late_off[n], gains[1])
        row[F], row[W], row[LATENCY], row[GAIN_G] = strength / pixels, 0.0, 0.0, 1.0
        fire(row, const, total / pixels)
