"""Direction and zoom of a lens on the ego car: fixed, along the path, or to the stopping distance.

The gaze `"stopping"` keeps a part of the road in the frame that the car reaches when it brakes: its distance
follows the ego's speed, and its direction the ego's steering angle. A frame of a given size then contains the
same part of the lane at every speed. Other pixels of a real sensor are read; nothing moves.
"""

import math

import numpy as np

from lgmd_gym.camera.bounds import MIN_STOP
from lgmd_gym.camera.brake_estimate import known_deceleration
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.kernels import kernel

FIXED, PATH, STOPPING = 0, 1, 2  # values of `gaze`
GAZES = {"fixed": FIXED, "path": PATH, "stopping": STOPPING}
MAX_TURN = math.radians(40.0)
"""Bound of the turn towards the path [rad]."""
_PATH_S = 1.0  # look-ahead time of the gaze "path" [s]
_USUAL_BRAKE = CameraParams().max_deceleration
_WET = 2.0 / 3.0  # deceleration on a wet road over that on a dry one

AIM = np.dtype(
    [
        *((name, np.float64) for name in ("reach", "span", "offset", "lift", "deceleration", "reaction")),
        *((name, np.float64) for name in ("setback", "height", "width")),
    ]
)
"""Aim of the gaze `"stopping"`, as the kernels read it: fields of `CameraParams`; deceleration on the present
road; height of the lens as the sensor knows it [m]; width of the frame [px]."""


def aim_of(p: CameraParams, known_height: float) -> np.ndarray:
    """Return the `AIM` record of a camera, shape ().

    Args:
        p: Its parameters.
        known_height: Height of the lens above the ground as far as the sensor knows it [m].
    """
    values = (p.reach, p.span_m, p.offset_m, p.lift, _stop_deceleration(p), p.stop_reaction)
    return np.array((*values, p.mount_setback, known_height, p.shape[1]), dtype=AIM)


def _stop_deceleration(p: CameraParams) -> float:
    """Return the deceleration of the stopping distance: of the present road or the present brake [m/s²]."""
    if p.brake_known:
        return p.stop_deceleration * known_deceleration(p) / _USUAL_BRAKE
    return p.stop_deceleration * (_WET if p.wet else 1.0)


@kernel(exact=True, arrays=True)
def slip_and_yaw_rate(scene):
    """Return slip angle [rad] and yaw rate [rad/s] of highway-env's kinematic bicycle."""
    slip = math.atan(0.5 * math.tan(scene.steering))
    return slip, scene.speed * math.sin(slip) / (0.5 * scene.length)


@kernel(exact=True, arrays=True)
def path_yaw(scene):
    """Return the direction, relative to the heading, of the ego's position in one second [rad]."""
    slip, rate = slip_and_yaw_rate(scene)
    return max(-MAX_TURN, min(MAX_TURN, slip + 0.5 * (rate * _PATH_S)))


@kernel(exact=True, arrays=True)
def aim_depth(aim, speed):
    """Return the distance of the aim from the lens at an ego speed [m]."""
    v = max(speed, 0.0)
    distance = v * v / (2.0 * aim.deceleration) + v * aim.reaction
    return max(distance, MIN_STOP) * aim.reach + aim.setback


@kernel(exact=True, arrays=True)
def aim_yaw(aim, scene, depth):
    """Return the direction of the aim, at a distance from the lens [m], relative to the heading [rad]."""
    slip, _ = slip_and_yaw_rate(scene)
    forward = 0.5 * scene.length - aim.setback  # of the lens, from the ego's centre
    way = depth + forward
    course = slip + math.sin(slip) / scene.length * way  # half of the turn on the way to the aim
    ahead = max(way * math.cos(course) - forward, 0.5 * depth)
    turn = math.atan(way * math.sin(course) / ahead)
    return max(-MAX_TURN, min(MAX_TURN, turn)) - math.atan(aim.offset / depth)


@kernel(exact=True, arrays=True)
def aim_pitch(aim, depth):
    """Return the elevation of the optical axis for an aim at a distance from the lens [m] [rad]."""
    return aim.lift * math.atan(aim.height / depth)


@kernel(exact=True, arrays=True)
def aim_focal(aim, depth):
    """Return the focal length for an aim at a distance from the lens [m] [px]."""
    return aim.width * depth / aim.span
