"""Greyscale camera frames of a highway-env road: the view from the ego car and a top view."""

from lgmd_gym.camera.birdseye import BirdsEye
from lgmd_gym.camera.camera import (
    PRESETS,
    AlongPath,
    Camera,
    CameraItem,
    Fixed,
    ImageSensor,
    Mount,
    ToStoppingPoint,
)
from lgmd_gym.camera.ego import EgoCamera
from lgmd_gym.camera.scene import CLEAR, WEATHERS, Scene, Weather

__all__ = [
    "CLEAR",
    "PRESETS",
    "WEATHERS",
    "AlongPath",
    "BirdsEye",
    "Camera",
    "CameraItem",
    "EgoCamera",
    "Fixed",
    "ImageSensor",
    "Mount",
    "Scene",
    "ToStoppingPoint",
    "Weather",
]
