"""Pose of a lens on the moving ego car: mount, gaze and motion of the car's body."""

import math
from typing import Any, NamedTuple

from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.scene import SceneState

_PATH_S = 1.0  # look-ahead time of the gaze "path" [s]
_PATH_MAX = math.radians(40.0)
_BODY_HZ = (1.1, 1.9, 3.4)  # bounce, pitch and wheel-hop side band of a sprung body


class CameraPose(NamedTuple):
    """Position of the lens [m], yaw towards +y and pitch upwards [rad]."""

    x: float
    y: float
    z: float
    yaw: float
    pitch: float


def lens_pose(p: CameraParams, scene: SceneState, gaze: tuple[float, float] | None = None) -> CameraPose:
    """Return the pose of a camera's lens.

    Args:
        p: Camera parameters.
        scene: State of the environment.
        gaze: Turn to the right and upwards on top of the mount [degrees]; replaces the `path` gaze.
    """
    ego, heading = scene.ego, scene.heading
    forward = 0.5 * ego.LENGTH - p.mount_setback
    c, s = math.cos(heading), math.sin(heading)
    x, y = scene.x + forward * c + p.mount_left * s, scene.y + forward * s - p.mount_left * c
    z = p.mount_height
    if p.heave_m > 0.0:
        z = max(z + _vibration(p.heave_m, p.seed, scene, 0.61), 0.1 * z)  # above the ground
    yaw, pitch = p.yaw_deg, p.pitch_deg
    if gaze is not None:
        yaw, pitch = yaw + gaze[0], pitch + gaze[1]
    elif p.gaze == "path":
        yaw += math.degrees(_path_yaw(ego))
    return CameraPose(x, y, z, heading + math.radians(yaw), math.radians(pitch) + _body_pitch(p, scene))


def earlier(scene: SceneState, ago_s: float) -> SceneState:
    """Return the scene with the ego moved back along its present circle by `ago_s` [s]."""
    slip, rate = _slip_and_yaw_rate(scene.ego)
    distance, course = scene.ego.speed * ago_s, scene.heading + slip - 0.5 * rate * ago_s
    return scene._replace(
        x=scene.x - distance * math.cos(course),
        y=scene.y - distance * math.sin(course),
        heading=scene.heading - rate * ago_s,
        time_s=scene.time_s - ago_s,
    )


def _slip_and_yaw_rate(ego: Any) -> tuple[float, float]:
    """Return slip angle [rad] and yaw rate [rad/s] of highway-env's kinematic bicycle."""
    steering = (getattr(ego, "action", None) or {}).get("steering", 0.0)
    slip = math.atan(0.5 * math.tan(steering))
    return slip, ego.speed * math.sin(slip) / (0.5 * ego.LENGTH)


def _path_yaw(ego: Any) -> float:
    """Return the direction, relative to the heading, of the ego's position in one second [rad]."""
    slip, rate = _slip_and_yaw_rate(ego)
    return max(-_PATH_MAX, min(_PATH_MAX, slip + 0.5 * (rate * _PATH_S)))


def _body_pitch(p: CameraParams, scene: SceneState) -> float:
    """Return the upward pitch of the car's body due to an uneven road and braking [rad]."""
    pitch = 0.0
    if p.vibration_deg > 0.0:
        pitch += _vibration(p.vibration_deg, p.seed, scene, 0.37)
    if p.dive_deg > 0.0:
        demand = (getattr(scene.ego, "action", None) or {}).get("acceleration", 0.0)
        pitch += p.dive_deg * max(-12.0, min(6.0, float(demand)))
    return math.radians(pitch)


def _vibration(rms: float, seed: int, scene: SceneState, shift: float) -> float:
    """Return the sum of the body's natural vibrations, RMS `rms` at 14 m/s; `shift` offsets the phases.

    The spectrum of a road's height falls with the square of the spatial frequency (ISO 8608). The variance
    above the body's frequency is therefore proportional to the speed, and the RMS to its square root.
    """
    rms = rms * math.sqrt(min(abs(float(scene.ego.speed)), 60.0) / 14.0)
    phase = 0.1 * (seed % 10)
    turns = (hz * scene.time_s + shift * k + phase for k, hz in enumerate(_BODY_HZ))
    return rms * math.sqrt(2.0 / 3.0) * sum(math.sin(2.0 * math.pi * turn) for turn in turns)
