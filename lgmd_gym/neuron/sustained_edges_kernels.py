"""Kernel of the detector of sustained edges."""

import numpy as np

from lgmd_gym.kernels import kernel
from lgmd_gym.neuron.motion_kernels import start
from lgmd_gym.neuron.scalars import AGE, GAIN_G, LATENCY, F, W, fire


@kernel(exact=True, arrays=True)
def step(first, last, frames, active, scalars, const, gain, light, edges) -> None:
    """Step the active detectors among first..last-1.

    Args:
        first: First detector.
        last: Last detector + 1.
        frames: Frames, (N, H, W).
        active: Detectors to step, bool, (N,).
        scalars: Scalar state, see `scalars`, (N, ...).
        const: Constants of the stage of spikes, see `scalars.pack_constants`.
        gain: Gain of the low-passed light, float32.
        light: Low-passed light, float32, (N, H, W).
        edges: Edge strength, float32, (N, H, W); 0 in the last column.
    """
    height, width = frames.shape[1], frames.shape[2]
    for n in range(first, last):
        if not active[n]:
            continue
        row = scalars[n]
        if row[AGE] == 0.0:
            start(frames[n], light[n])
            row[AGE] = 1.0
            continue
        total = 0.0
        for y in range(height):
            for x in range(width):
                light[n, y, x] += gain * (np.float32(frames[n, y, x]) - light[n, y, x])
            for x in range(width - 1):
                edges[n, y, x] = abs(light[n, y, x + 1] - light[n, y, x])
                total += edges[n, y, x]
        mean = total / (height * width)
        row[F], row[W], row[LATENCY], row[GAIN_G] = mean, 0.0, 0.0, 1.0
        fire(row, const, mean)
