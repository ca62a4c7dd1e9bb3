"""Checks of the arguments and frames of `LGMD`."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.errors import as_tuple, check_finite, check_size, check_whole, check_within, is_integer, shown

Frames: TypeAlias = NDArray[np.uint8 | np.float32]
Real: TypeAlias = NDArray[Any]  # of bools, integers or floats
MAX_PIXELS = 2**31  # of all neurons, bounds the memory
MAX_SIDE = 16384  # [px]
MAX_THREADS = 1024


def checked_shape(shape: object) -> tuple[int, int]:
    """Return (height, width) as integers."""
    return check_size("shape", shape, 1, MAX_SIDE)


def checked_fps(fps: object) -> float:
    """Return the frame rate [Hz] as a finite float > 0."""
    value = check_finite("fps", fps)
    if not value > 0.0:
        raise ValueError(f"fps must be > 0 and finite, got {value:g}")
    return check_within("fps", value, 1e-3, 1e6, "Hz")


def checked_num(num: int | None, shape: tuple[int, int]) -> int | None:
    """Return the number of neurons, >= 1, or None for a single neuron."""
    if num is None:
        return None
    if not is_integer(num):
        raise TypeError(f"num must be an integer or None, got {shown(num)}")
    if num < 1:
        raise ValueError(
            f"num must be >= 1, got {shown(num)}; pass None for a single neuron with scalar outputs"
        )
    return check_whole("num", num, 1, MAX_PIXELS // (shape[0] * shape[1]))


def checked_threads(threads: int | None) -> int:
    """Return the number of threads, >= 1; None is the calling thread alone."""
    return 1 if threads is None else check_whole("threads", threads, 1, MAX_THREADS)


def checked_array(name: str, values: object) -> Real:
    """Return an array of bools or real numbers."""
    try:
        array = np.asarray(values)
    except ValueError:  # of nested lists of different lengths
        raise ValueError(f"{name} must be an array of numbers, got {shown(values)}") from None
    if array.dtype.kind not in "buif":
        raise TypeError(f"{name} must be an array of numbers, got {shown(values)}")
    return array


def checked_mask(mask: object, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Return pixel weights as float32 of `shape`, in [0, 1] and not all 0."""
    weight = checked_array("mask", mask)
    if weight.shape != shape:
        raise ValueError(
            f"mask must have the shape {shape} (height, width) of the frames, got {weight.shape}"
        )
    if not ((weight >= 0.0) & (weight <= 1.0)).all():
        span = f"{float(weight.min()):g} to {float(weight.max()):g}"
        raise ValueError(f"mask must have weights in [0, 1], got {span}")
    weight = weight.astype(np.float32)
    if not weight.any():
        raise ValueError("mask must have a weight > 0, got 0 everywhere; pass mask=None for all pixels")
    return weight


def checked_region(
    shape: tuple[int, int], mask: ArrayLike | None, roi: tuple[int, int, int, int] | None
) -> tuple[int, int, tuple[int, int], NDArray[np.float32], int]:
    """Return top row, left column, (height, width), pixel weights and number of pixels of the region.

    The region contains the pixels with a weight > 0 and one pixel around them, which I and Ce reach. The
    weights are of shape (0, 0) if all are 1; the number counts the pixels with a weight > 0.
    """
    if mask is not None and roi is not None:
        raise ValueError("mask and roi must not both be given; set the mask to 0 outside the region instead")
    if roi is not None:
        given = as_tuple(roi)
        if given is None or len(given) != 4 or not all(map(is_integer, given)):
            raise ValueError(f"roi must be 4 integers (top, left, height, width), got {shown(roi)}")
        top, left, height, width = roi
        if min(top, left) < 0 or min(height, width) < 1 or top + height > shape[0] or left + width > shape[1]:
            raise ValueError(
                f"roi (top, left, height, width) must be inside frames of shape {shape}, got {shown(roi)}"
            )
        mask = np.zeros(shape, np.float32)
        mask[top : top + height, left : left + width] = 1.0
    if mask is None:
        return 0, 0, shape, np.zeros((0, 0), np.float32), shape[0] * shape[1]
    weight = checked_mask(mask, shape)
    rows, columns = np.flatnonzero(weight.any(1)), np.flatnonzero(weight.any(0))
    top, left = max(rows[0] - 1, 0), max(columns[0] - 1, 0)
    box = weight[top : rows[-1] + 2, left : columns[-1] + 2]
    return int(top), int(left), box.shape, np.ascontiguousarray(box), int(np.count_nonzero(weight))


def checked_selection(name: str, selection: ArrayLike, count: int) -> NDArray[np.bool_]:
    """Return a selection of neurons as a contiguous bool array of shape (count,)."""
    selected = checked_array(name, selection)
    if selected.dtype != np.bool_ or selected.shape != (count,):
        given = f"dtype {selected.dtype} and shape {selected.shape}"
        raise ValueError(f"{name} must be a bool array of shape ({count},), got {given}")
    return np.ascontiguousarray(selected)


def checked_frames(frames: object, shape: tuple[int, ...], active: NDArray[np.bool_] | None = None) -> Frames:
    """Return frames as contiguous uint8 or float32; contiguous uint8 frames are not copied.

    Args:
        frames: Luminance in 0-255, uint8 or float.
        shape: Expected shape, (H, W) or (N, H, W).
        active: Selection of the frames to check, shape (N,); None for all.
    """
    frames = checked_array("frame", frames)
    if frames.shape != shape:
        raise ValueError(_shape_message(frames.shape, shape))
    if frames.dtype == np.uint8:
        return np.ascontiguousarray(frames)
    if frames.dtype.kind != "f":
        raise TypeError(f"frame must be uint8 or float, got {frames.dtype}; use frame.astype(np.uint8)")
    frames = np.ascontiguousarray(frames, np.float32)
    stack = frames.reshape(-1, *shape[-2:])
    for frame in stack if active is None else stack[active]:
        _check_luminance(frame)
    return frames


def _check_luminance(frame: NDArray[np.float32]) -> None:
    low, high = float(frame.min()), float(frame.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        count = int(frame.size - np.count_nonzero(np.isfinite(frame)))
        raise ValueError(
            f"frame must be finite, got {count} NaN or infinite pixels; use np.nan_to_num(frame)"
        )
    span = f"{low:g} to {high:g}"
    # One grey level of tolerance, because resampling may overshoot.
    if low < -1.0 or high > 256.0:
        raise ValueError(f"frame must be luminance in 0-255, got {span}; use np.clip(frame, 0, 255)")
    if low != high and low >= 0.0 and high <= 1.0:
        raise ValueError(f"frame must be luminance in 0-255, got a float frame of {span}; use frame * 255")


def _shape_message(given: tuple[int, ...], expected: tuple[int, ...]) -> str:
    axes = "(height, width)" if len(expected) == 2 else "(num, height, width)"
    message = f"frame must have the shape {expected} {axes}, got {given}"
    if 0 in given:
        return f"{message}, which is empty"
    if len(given) == len(expected) + 1 and given[-1] in (3, 4):
        return f"{message}; convert colour to grey luminance"
    if given == expected[::-1]:
        return f"{message}; transpose it, row 0 is the top"
    return message


def checked_turns(turn_px: object, count: int) -> NDArray[np.int64]:
    """Return the turn of each view [px], int64 of shape (count,); a scalar applies to all."""
    turns = checked_array("turn_px", turn_px)
    if turns.dtype.kind not in "ui" or turns.shape not in ((), (count,)):
        given = f"dtype {turns.dtype} and shape {turns.shape}"
        raise ValueError(f"turn_px must be an integer or integers of shape ({count},), got {given}")
    limited = np.clip(turns, -MAX_SIDE, MAX_SIDE)  # larger turns replace the whole state as well
    return np.ascontiguousarray(np.broadcast_to(limited, count), np.int64)
