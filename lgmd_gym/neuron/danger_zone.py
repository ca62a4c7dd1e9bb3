"""The danger zone: the ground a car is about to drive over, as a mask for the neuron."""

import math

import numpy as np
from numpy.typing import NDArray

# Sub-rows and sub-columns per pixel: the zone's edges are anti-aliased.
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
    """Project the lane ahead to the image: weight 1 on it, 0 beside it, in between along its edges.

    A pinhole camera over flat ground, in the middle of a straight lane (after Hartbauer, 2017). A row
    below the horizon sees the ground at one distance; the zone's half width there is that of the lane.
    With `clearance_m` the zone is the box of that height above the lane instead, so that it also
    covers the upper part of a vehicle ahead: each row takes the widest section which it crosses.

    Args:
        shape: (height, width) of the frames [px].
        hfov_deg: Horizontal field of view [deg], in (0, 180).
        width_m: Width of the zone [m].
        height_m: Height of the camera above the ground [m].
        pitch_deg: Pitch of the camera [deg], positive upwards.
        near_m: Where the zone begins [m].
        far_m: Where it ends [m].
        clearance_m: Height of the zone above the ground [m].

    Returns:
        Weights in [0, 1], float32, shape (height, width), for `LGMD(..., mask=...)`.

    Raises:
        ValueError: For a value out of bounds, or when the zone lies outside the image.

    Example:
        >>> danger_zone((90, 160), hfov_deg=40.0)[60].sum() > 0
        True
    """
    height, width = shape
    _check(hfov_deg, width_m, height_m, near_m, far_m, clearance_m)
    focal = width / 2.0 / math.tan(math.radians(hfov_deg) / 2.0)
    step = 1.0 / _OVERSAMPLING
    rows = np.arange(step / 2, height, step) - height / 2.0
    columns = np.abs(np.arange(step / 2, width, step) - width / 2.0)
    below = rows / focal  # the tangent of the angle below the optical axis
    tilt = math.tan(math.radians(pitch_deg))
    slope = (below - tilt) / (1.0 + below * tilt)  # below the horizon
    depth = _nearest_section(slope, height_m, clearance_m, max(near_m, 1e-6), far_m)
    # A pitched camera sees a point at depth d along its axis at d * (cos + slope * sin).
    axial = depth * (math.cos(math.radians(pitch_deg)) - slope * math.sin(math.radians(pitch_deg)))
    half = np.where(np.isfinite(depth) & (axial > 0), focal * width_m / 2.0 / np.maximum(axial, 1e-9), -1.0)
    inside = columns[None, :] <= half[:, None]
    zone = inside.reshape(height, _OVERSAMPLING, width, _OVERSAMPLING).mean((1, 3), dtype=np.float32)
    if not zone.any():
        raise ValueError(
            f"the danger zone from {near_m:g} to {far_m:g} m lies outside an image of {hfov_deg:g} deg; "
            "lower near_m, raise far_m or widen hfov_deg"
        )
    return zone


def _nearest_section(slope: NDArray, camera: float, clearance: float, near: float, far: float) -> NDArray:
    """The distance at which each ray first meets the box over the lane; infinite where it never does."""
    with np.errstate(divide="ignore"):
        ground = np.where(slope > 0, camera / slope, np.inf)  # where the ray meets the ground
        roof = (camera - clearance) / slope  # where it meets the plane of the clearance
    if clearance >= camera:  # inside the box from the start, out of it through the roof or the far end
        meets = np.where((slope >= 0) | (roof >= near), near, np.inf)
    else:
        meets = np.where(slope > 0, np.maximum(roof, near), np.inf)
    if clearance == 0.0:
        meets = np.where(ground >= near, ground, np.inf)
    return np.where((meets <= far) & (meets <= ground), meets, np.inf)


def _check(hfov: float, width: float, height: float, near: float, far: float, clearance: float) -> None:
    """Refuse what no camera or lane has."""
    if not 0.0 < hfov < 180.0:
        raise ValueError(f"hfov_deg = {hfov:g} must lie between 0 and 180")
    for name, value in (("width_m", width), ("height_m", height)):
        if not 0.0 < value < math.inf:
            raise ValueError(f"{name} = {value:g} must be > 0 and finite, in metres")
    if not 0.0 <= near < far:
        raise ValueError(f"near_m = {near:g} must be >= 0 and below far_m = {far:g}")
    if not 0.0 <= clearance < math.inf:
        raise ValueError(f"clearance_m = {clearance:g} must be >= 0 and finite, in metres")
