"""Greyscale camera frames of a highway-env road: the view from the ego car and a top view."""

from lgmd_gym.camera.birdseye import BirdsEye
from lgmd_gym.camera.ego import EgoCamera
from lgmd_gym.camera.params import CLEAR, CONDITIONS, PRESETS, CameraParams
from lgmd_gym.camera.spec import BIRDSEYE, CameraItem, CameraSpec, with_condition

__all__ = [
    "BIRDSEYE",
    "CLEAR",
    "CONDITIONS",
    "PRESETS",
    "BirdsEye",
    "CameraItem",
    "CameraParams",
    "CameraSpec",
    "EgoCamera",
    "with_condition",
]
