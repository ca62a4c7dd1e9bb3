"""Random neurons against the float64 reference: `python tests/fuzz/neuron.py --seconds 60`.

A case is a preset with some parameters changed, a size, a frame rate, frames, and perhaps a mask or region.
"""

import sys
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]

from golden.sequences import KINDS
from support.fuzz import run_cases
from support.neurons import PRESETS, compare

CHANGES = {
    "n_p": lambda rng: int(rng.integers(0, 6)),
    "u": lambda rng: float(rng.uniform(0.8, 3.0)),
    "tau_1": lambda rng: float(rng.choice([0.0, 5.0, 50.0])),
    "tau_2": lambda rng: tuple(rng.uniform(0.0, 300.0, 3).tolist()),
    "weights": lambda rng: tuple(rng.uniform(0.0, 1.0, 3).tolist()),
    "theta_1": lambda rng: float(rng.uniform(0.0, 2.0)),
    "theta_3": lambda rng: float(rng.uniform(0.0, 2.0)),
    "t_de": lambda rng: float(rng.uniform(1.0, 30.0)),
    "sigma_1": lambda rng: float(rng.uniform(0.0, 3.0)),
    "sigma_3": lambda rng: float(rng.uniform(0.3, 5.0)),
    "tau_g": lambda rng: float(rng.uniform(0.0, 50.0)),
    "tau_s": lambda rng: float(rng.choice([0.0, 100.0, np.inf])),
    "t_f": lambda rng: float(rng.choice([5.0, 50.0, np.inf])),
    "t_ffi": lambda rng: float(rng.choice([10.0, 30.0])),
    "on_off_residue": lambda rng: float(rng.choice([0.0, 0.1, 0.8])),
    "delay": lambda rng: str(rng.choice(["recursive", "two-tap"])),
    "latency": lambda rng: str(rng.choice(["clamp", "jump"])),
    "warm_start": lambda rng: bool(rng.integers(2)),
    "spikes_from": lambda rng: str(rng.choice(["adapted", "membrane"])),
    "extra_frame": lambda rng: bool(rng.integers(2)),
    "n_ts": lambda rng: int(rng.integers(1, 12)),
}


def draw_region(rng, shape):
    """Return a mask and a region of interest; both None for the whole frame."""
    kind = rng.integers(4)
    if kind == 0:
        return None, None
    top, left = int(rng.integers(shape[0])), int(rng.integers(shape[1]))
    height, width = int(rng.integers(1, shape[0] - top + 1)), int(rng.integers(1, shape[1] - left + 1))
    mask = np.zeros(shape)
    mask[top : top + height, left : left + width] = 1.0
    if kind == 1:
        return mask, (top, left, height, width)
    if kind == 2:
        mask *= rng.random(shape).astype(np.float32)
    else:  # scattered pixels
        mask = (rng.random(shape) < 0.1).astype(float)
    mask[top, left] = 1.0
    return mask, None


def draw_frames(rng, shape):
    """Return uint8 frames of a random kind, some of them with jumps of the whole frame."""
    count = int(rng.integers(2, 16))
    frames = KINDS[str(rng.choice(list(KINDS)))](shape, count)
    if rng.random() < 0.3:
        frames = frames.copy()
        frames[:: int(rng.integers(2, 5))] = rng.integers(256)
    return frames


def draw_case(rng):
    """Return the description of a random neuron and its comparison with the reference."""
    preset = str(rng.choice(list(PRESETS)))
    changes = {name: draw(rng) for name, draw in CHANGES.items() if rng.random() < 0.12}
    params = PRESETS[preset].make(PRESETS[preset], **changes)
    shape = tuple(rng.integers(1, 56, 2).tolist())
    mask, roi = draw_region(rng, shape)
    frames, fps = draw_frames(rng, shape), float(rng.choice([10.0, 15.0, 18.0, 25.0, 30.0, 60.0]))
    text = f"{preset} {changes} {shape} {fps:g} Hz roi={roi} mask={mask is not None}"
    return text, lambda: compare(frames, fps, params, mask, roi)


if __name__ == "__main__":
    sys.exit(run_cases(draw_case, __doc__))
