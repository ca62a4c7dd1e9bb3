"""Grey frames out of a highway-env road: the driver's view and the view from above."""

from lgmd_gym.camera.birdseye import BirdsEye
from lgmd_gym.camera.ego import EgoCamera
from lgmd_gym.camera.params import CONDITIONS, PRESETS, CameraItem, CameraParams, CameraSpec
from lgmd_gym.camera.rig import CameraRig

__all__ = [
    "CONDITIONS",
    "PRESETS",
    "BirdsEye",
    "CameraItem",
    "CameraParams",
    "CameraRig",
    "CameraSpec",
    "EgoCamera",
]
