"""Frames of all camera presets, conditions and options against stored ones."""

import numpy as np
from support.golden_frames import PATH, golden_frames


def test_frames_equal_the_golden_frames():
    """Fused multiply-add differs between processors: one grey level in a thousandth of the pixels."""
    golden, frames = np.load(PATH), golden_frames()
    assert set(frames) == set(golden.files)
    different = {}
    for name, frame in frames.items():
        change = np.abs(frame.astype(int) - golden[name])
        if change.max() > 1 or np.mean(change > 0) > 0.001:
            different[name] = (change.max(), np.mean(change > 0))
    assert different == {}
