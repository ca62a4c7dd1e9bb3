"""Arrays of the far-field registration: state, constants and scratch memory."""

import numpy as np

from lgmd_gym.kernels.simd import LANES

PAD = 8
"""Columns and rows around a frame that repeat its edge; bounds the shifts [px]."""
MARGIN_ROWS, MARGIN_COLUMNS, BANDS = 2, 8, 4
MIDDLE = 128.0
"""Grey at which the offset of the exposure is defined."""
STARTED, PITCH_PX, ROLL_RAD, YAW_PX, GAIN, OFFSET, MEAN_PITCH, MEAN_ROLL, MEAN_YAW, COUNT, PAN = range(11)
STATE_SIZE = 11
"""Numbers per camera: 1.0 after the first frame; shift due to pitch [px], roll [rad] and shift due to yaw
[px], gain and offset of the exposure, relative to the reference; means of the three; frames since the
reference; shift that the turns of the car have caused [px]."""
CONSTANTS = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("reference_gain", "variance_gain", "mean_gain", "first_variance", "least_variance"),
            *("edge", "outlier", "share", "focal"),
            *("pitch_prior", "roll_prior", "yaw_prior", "gain_prior", "offset_prior"),
        )
    ]
)
"""Constants of the registration; the priors are inverse variances."""
NEW = 1e6
"""Variance of a pixel without a reference yet, whose weight is nearly 0 [grey levels²]."""
_SUMS = 14  # of each block: ten of the symmetric 4 × 4 matrix, four of the right side


def make_space(shape: tuple[int, int]) -> tuple[np.ndarray, ...]:
    """Return the scratch memory of one thread for frames of one shape.

    The padded frame, the registered frame, one row, the sums of the blocks, and the normal equations.
    """
    height, width = shape
    blocks = BANDS * ((width - 2 * MARGIN_COLUMNS) // LANES)
    return (
        np.zeros((height + 2 * PAD, width + 2 * PAD), np.float32),
        np.zeros(shape, np.float32),
        np.zeros(width + 2 * LANES, np.float32),
        np.zeros((blocks, _SUMS)),
        np.zeros((5, 5)),
        np.zeros(5),
    )
