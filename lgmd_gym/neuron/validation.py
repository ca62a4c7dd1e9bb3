"""Checks of what comes in: each refuses in one line that names the value and the mend."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.neuron.params import LGMDParams


def checked_shape(shape: Any) -> tuple[int, int]:
    """Return (height, width) as ints of at least 1."""
    try:
        height, width = (int(side) for side in shape)
    except (TypeError, ValueError):
        raise ValueError(f"shape {shape!r} must be (height, width) in pixels") from None
    if height < 1 or width < 1:
        raise ValueError(f"shape {(height, width)} holds no pixel; height and width must be >= 1")
    return height, width


def checked_fps(fps: Any) -> float:
    """Return the frame rate as a finite float above 0."""
    value = float(fps)
    if not 0.0 < value < np.inf:
        raise ValueError(f"fps = {value:g} must be > 0 and finite, in frames per second")
    return value


def checked_num(num: int | None) -> int | None:
    """Return the number of neurons, at least 1, or None for a single one."""
    if num is None:
        return None
    if isinstance(num, bool) or int(num) != num:
        raise TypeError(f"num = {num!r} must be a whole number of neurons, or None for a single one")
    if num < 1:
        raise ValueError(f"num = {num} must be >= 1, or None for a single neuron that answers plain numbers")
    return int(num)


def checked_mask(mask: Any, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Return the weights of the pixels, float32 of `shape` within [0, 1], not all 0."""
    weight = np.array(mask, np.float32)
    if weight.shape != shape:
        raise ValueError(f"mask of shape {weight.shape} does not fit frames of {shape} (height, width)")
    if not ((weight >= 0.0) & (weight <= 1.0)).all():
        span = f"{float(weight.min()):g} to {float(weight.max()):g}"
        raise ValueError(f"mask holds {span}; weights must lie in [0, 1]")
    if not weight.any():
        raise ValueError("mask is 0 everywhere; give at least one pixel a weight above 0, or mask=None")
    return weight


def checked_params(params: LGMDParams | None) -> LGMDParams:
    """Return the parameters, or the paper's for None."""
    if params is None:
        return LGMDParams()
    if not isinstance(params, LGMDParams):
        raise TypeError(f"params must be LGMDParams, not {type(params).__name__}; see LGMDParams.from_dict")
    return params


def checked_threads(threads: int | None) -> int:
    """Return the number of threads, at least 1."""
    count = 1 if threads is None else int(threads)
    if count < 1:
        raise ValueError(f"threads = {threads} must be >= 1, or None for the calling thread alone")
    return count


def checked_region(
    shape: tuple[int, int], mask: ArrayLike | None, roi: tuple[int, int, int, int] | None
) -> tuple[int, int, tuple[int, int], NDArray[np.float32], int]:
    """The rectangle that has to be computed: top, left, (height, width), its weights, pixels that count."""
    if mask is not None and roi is not None:
        raise ValueError("give mask or roi, not both; multiply the mask by 0 outside the region instead")
    if roi is not None:
        top, left, height, width = (int(side) for side in roi)
        if min(top, left) < 0 or min(height, width) < 1 or top + height > shape[0] or left + width > shape[1]:
            raise ValueError(f"roi {tuple(roi)}, (top, left, height, width), leaves the frame of {shape}")
        mask = np.zeros(shape, np.float32)
        mask[top : top + height, left : left + width] = 1.0
    if mask is None:
        return 0, 0, shape, np.zeros((0, 0), np.float32), shape[0] * shape[1]
    weight = checked_mask(mask, shape)
    # One pixel around the support: there P is 0 but its neighbours' inhibition and grouping still reach.
    rows, columns = np.flatnonzero(weight.any(1)), np.flatnonzero(weight.any(0))
    top, left = max(rows[0] - 1, 0), max(columns[0] - 1, 0)
    box = weight[top : rows[-1] + 2, left : columns[-1] + 2]
    return int(top), int(left), box.shape, np.ascontiguousarray(box), int(np.count_nonzero(weight))


def checked_frames(frames: Any, shape: tuple[int, ...], active: NDArray[np.bool_] | None = None) -> NDArray:
    """Return frames of `shape` as contiguous uint8 or float32; a contiguous uint8 array passes untouched.

    Args:
        frames: Luminance in 0-255, uint8 or float.
        shape: (H, W), or (N, H, W).
        active: Which of the N frames count, shape (N,); the others are not looked at.
    """
    frames = np.asarray(frames)
    if frames.shape != shape:
        raise ValueError(_shape_message(frames.shape, shape))
    if frames.dtype == np.uint8:
        return np.ascontiguousarray(frames)
    if frames.dtype.kind != "f":
        raise TypeError(
            f"frame of dtype {frames.dtype} must be uint8 or float, in 0-255; see .astype(np.uint8)"
        )
    frames = np.ascontiguousarray(frames, np.float32)
    stack = frames.reshape(-1, *shape[-2:])
    for frame in stack if active is None else stack[active]:
        _check_luminance(frame)
    return frames


def _check_luminance(frame: NDArray[np.float32]) -> None:
    """Refuse a float frame that is not luminance in 0-255."""
    low, high = float(frame.min()), float(frame.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        bad = int(frame.size - np.count_nonzero(np.isfinite(frame)))
        raise ValueError(f"frame holds {bad} NaN or infinite pixels; mend them, as with np.nan_to_num(frame)")
    span = f"{low:g} to {high:g}"
    # One grey level of slack for resampling that overshoots.
    if low < -1.0 or high > 256.0:
        raise ValueError(f"frame holds {span}; luminance must lie in 0-255, as after np.clip(frame, 0, 255)")
    if low != high and low >= 0.0 and high <= 1.0:
        raise ValueError(f"float frame of {span} looks scaled to 0-1; luminance is 0-255: pass frame * 255")


def _shape_message(given: tuple[int, ...], wanted: tuple[int, ...]) -> str:
    """Say how a frame's shape is wrong."""
    axes = "(height, width)" if len(wanted) == 2 else "(num, height, width)"
    if 0 in given:
        return f"frame of shape {given} is empty; this neuron takes {wanted} {axes}"
    if len(given) == len(wanted) + 1 and given[-1] in (3, 4):
        return f"frame of shape {given} looks like colour; pass grey luminance of {wanted} {axes}"
    if given == wanted[::-1]:
        return f"frame of shape {given} looks transposed; this neuron takes {wanted} {axes}, row 0 at the top"
    return f"frame of shape {given} does not fit; this neuron takes {wanted} {axes}, fixed when it was made"
