"""Checks of the values of `CameraParams` that have no simple bounds."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from lgmd_gym.camera.bounds import MIN_STOP
from lgmd_gym.errors import check_flag, check_whole, shown

if TYPE_CHECKING:
    from lgmd_gym.camera.params import CameraParams

MAX_PATH = 4096  # characters


def check_surroundings(p: CameraParams) -> None:
    """Check the panorama and the flags."""
    if isinstance(p.panorama, os.PathLike):
        object.__setattr__(p, "panorama", os.fspath(p.panorama))
    if not isinstance(p.panorama, str) or not 0 < len(p.panorama) <= MAX_PATH:
        raise ValueError(
            f"camera panorama must be 'skyline', 'natural' or the path of an image, got {shown(p.panorama)}"
        )
    flags = ("guard_rail", "upper_beam", "wet", "linear_light", "calibrated", "derotated")
    for name in (*flags, "brake_known", "stabilised"):
        object.__setattr__(p, name, check_flag(f"camera {name}", getattr(p, name)))


def check_columns(p: CameraParams) -> None:
    """Check that the columns divide the width."""
    columns, width = check_whole("camera columns", p.columns, 0, p.shape[1]), p.shape[1]
    object.__setattr__(p, "columns", columns)
    if columns and width % columns:
        raise ValueError(f"camera columns must divide the width of {width} px, got {columns}")


def check_zoom(p: CameraParams) -> None:
    """Check the zoom of the gaze `"stopping"`, and that nothing depends on a constant focal length."""
    nearest = MIN_STOP * p.reach + p.mount_setback
    if not p.span_m <= 4.0 * nearest:
        raise ValueError(
            f"camera span_m must be at most {4.0 * nearest:.3g} m, four times the least distance of the aim "
            f"from the lens, got {p.span_m:g}; reduce span_m or increase reach"
        )
    usual_values = (("panorama", "skyline"), ("derotated", False))
    for name, usual in usual_values:
        if getattr(p, name) != usual:
            raise ValueError(
                f"camera {name} must be {usual!r} with gaze='stopping', got {shown(getattr(p, name))}"
            )
