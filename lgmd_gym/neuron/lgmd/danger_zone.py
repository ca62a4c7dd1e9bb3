"""Pixel weights of the danger zone, the stretch of road directly ahead (Hartbauer, 2017)."""

import math

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.errors import check_finite, check_number, check_size, check_within
from lgmd_gym.neuron.validation import MAX_SIDE

# Sub-rows and sub-columns per pixel, for anti-aliased edges.
_OVERSAMPLING = 4


def danger_zone(
    shape: tuple[int, int],
    hfov_deg: float,
    width_m: float = 3.5,
    *,
    height_m: float = 1.2,
    pitch_deg: float = 0.0,
    near_m: float = 0.0,
    far_m: float = math.inf,
    clearance_m: float = 0.0,
) -> NDArray[np.float32]:
    """Project the lane ahead to the image: weight 1 inside, 0 outside, fractions along the edges.

    The model is a pinhole camera above flat ground in the middle of a straight lane, as in the danger
    zone of Hartbauer (2017). With `clearance_m`, the zone is the box of that height above the lane, which
    also covers the upper part of a vehicle ahead; each row then has the width of its nearest section.

    Args:
        shape: (height, width) of the frames [px].
        hfov_deg: Horizontal field of view, in (0, 180) [deg].
        width_m: Width of the zone, > 0 [m].
        height_m: Height of the camera above the ground, > 0 [m].
        pitch_deg: Pitch of the camera, positive upwards [deg].
        near_m: Distance at which the zone begins, in [0, far_m) [m].
        far_m: Distance at which the zone ends [m].
        clearance_m: Height of the zone above the ground, >= 0 [m].

    Returns:
        Weights in [0, 1], float32, shape (height, width), for `LGMD(..., mask=...)`.

    Raises:
        ValueError: For a value out of range, or a zone outside the image.

    Example:
        >>> zone = danger_zone((90, 160), hfov_deg=40.0)
        >>> [float(zone[row].max()) for row in (44, 60)]  # above and below the horizon
        [0.0, 1.0]
    """
    height, width = check_size("shape", shape, 1, MAX_SIDE)
    check_within("pitch_deg", pitch_deg, -89.0, 89.0, "deg")
    _check_arguments(hfov_deg, width_m, height_m, near_m, far_m, clearance_m)
    focal = width / 2.0 / math.tan(math.radians(hfov_deg) / 2.0)
    step = 1.0 / _OVERSAMPLING
    rows = np.arange(step / 2, height, step) - height / 2.0
    columns = np.abs(np.arange(step / 2, width, step) - width / 2.0)
    below_axis = rows / focal  # tangent of the angle below the optical axis
    tilt = math.tan(math.radians(pitch_deg))
    slope = (below_axis - tilt) / (1.0 + below_axis * tilt)  # tangent of the angle below the horizon
    distance = _nearest_section(slope, height_m, clearance_m, max(near_m, 1e-6), far_m)
    # Depth along the optical axis of a pitched camera.
    depth = distance * (math.cos(math.radians(pitch_deg)) - slope * math.sin(math.radians(pitch_deg)))
    visible = np.isfinite(distance) & (depth > 0)
    half_width = np.where(visible, focal * width_m / 2.0 / np.maximum(depth, 1e-9), -1.0)
    inside = columns[None, :] <= half_width[:, None]
    zone = inside.reshape(height, _OVERSAMPLING, width, _OVERSAMPLING).mean((1, 3), dtype=np.float32)
    if not zone.any():
        raise ValueError(
            f"the danger zone must overlap the image, got width_m {width_m:g}, height_m {height_m:g}, "
            f"near_m {near_m:g}, far_m {far_m:g} and hfov_deg {hfov_deg:g}; lower near_m, raise far_m or "
            "widen hfov_deg"
        )
    return zone


def _nearest_section(
    slope: NDArray[np.float64], camera: float, clearance: float, near: float, far: float
) -> NDArray[np.float64]:
    """Return the distance [m] at which rays of a slope enter the box above the lane, or infinity."""
    with np.errstate(divide="ignore"):
        ground = np.where(slope > 0, camera / slope, np.inf)  # intersection with the ground
        top = (camera - clearance) / slope  # intersection with the top of the box
    if clearance >= camera:  # rays start at the height of the box
        entry = np.where((slope >= 0) | (top >= near), near, np.inf)
    else:
        entry = np.where(slope > 0, np.maximum(top, near), np.inf)
    if clearance == 0.0:
        entry = np.where(ground >= near, ground, np.inf)
    return np.where((entry <= far) & (entry <= ground), entry, np.inf)


def _check_arguments(
    hfov: float, width: float, height: float, near: float, far: float, clearance: float
) -> None:
    for name, value in (("hfov_deg", hfov), ("width_m", width), ("height_m", height), ("near_m", near)):
        check_finite(name, value)
    check_finite("clearance_m", clearance)
    check_number("far_m", far)
    if not 0.0 < hfov < 180.0:
        raise ValueError(f"hfov_deg must be > 0 and < 180, got {hfov:g}")
    for name, value in (("width_m", width), ("height_m", height)):
        if not 0.0 < value < math.inf:
            raise ValueError(f"{name} must be > 0 and finite, got {value:g}")
    if not 0.0 <= near < far:
        raise ValueError(f"near_m must be >= 0 and < far_m = {far:g}, got {near:g}")
    if not 0.0 <= clearance < math.inf:
        raise ValueError(f"clearance_m must be >= 0 and finite, got {clearance:g}")
