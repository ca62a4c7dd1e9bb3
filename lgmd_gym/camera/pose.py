"""Pose of a lens on the moving ego car: mount, gaze and motion of the car's body."""

import math

import numpy as np

from lgmd_gym.camera.effects import NOISE_LOG2
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.render.jit import exact_kernel
from lgmd_gym.camera.worlds import draw_world

MOUNT = np.dtype(
    [
        *((name, np.float64) for name in ("setback", "left", "height", "yaw_deg", "pitch_deg")),
        *((name, np.float64) for name in ("heave_m", "vibration_deg", "dive_deg", "phase", "shutter_s")),
        *((name, np.float64) for name in ("focal", "centre_u", "centre_v", "code_power")),
        *((name, np.int64) for name in ("path", "noisy", "box", "seed")),
    ]
)
"""How a camera sits on the car and moves with it, as the kernels read it.

The fields of `CameraParams`; phase of the vibrations [turns]; focal length and image centre [px]; 1 for the
gaze `"path"`, for sensor noise and for `vehicles="box"`; `LOOK`'s power of the display code.
"""

_PATH_S = 1.0  # look-ahead time of the gaze "path" [s]
_PATH_MAX = math.radians(40.0)
_BODY_HZ = (1.1, 1.9, 3.4)  # bounce, pitch and wheel-hop side band of a sprung body


def mount_of(p: CameraParams) -> np.ndarray:
    """Return the `MOUNT` record of a camera, shape ()."""
    height, width = p.shape
    world = draw_world(p.world)
    values = (
        *(p.mount_setback, p.mount_left, max(p.mount_height + world.mount_height_error, 0.05)),
        *(p.yaw_deg + world.yaw_error_deg, p.pitch_deg + world.pitch_error_deg),
        *(p.heave_m, p.vibration_deg, p.dive_deg, 0.1 * (seed_of(p) % 10), p.shutter_s),
        *(p.focal_px, 0.5 * width, 0.5 * height, 2.0 if world.drawn else 1.0),
        *(p.gaze == "path", p.shot_noise > 0.0 or p.read_noise > 0.0, p.vehicles == "box", seed_of(p)),
    )
    return np.array(values, dtype=MOUNT)


def seed_of(p: CameraParams) -> int:
    """Return the seed of a camera's noise and of vehicles without a `shade`: its world, or `seed`."""
    return p.seed if p.world is None else p.world


@exact_kernel
def _slip_and_yaw_rate(scene):
    """Return slip angle [rad] and yaw rate [rad/s] of highway-env's kinematic bicycle."""
    slip = math.atan(0.5 * math.tan(scene.steering))
    return slip, scene.speed * math.sin(slip) / (0.5 * scene.length)


@exact_kernel
def _path_yaw(scene):
    """Return the direction, relative to the heading, of the ego's position in one second [rad]."""
    slip, rate = _slip_and_yaw_rate(scene)
    return max(-_PATH_MAX, min(_PATH_MAX, slip + 0.5 * (rate * _PATH_S)))


@exact_kernel
def _vibration(rms, phase, scene, time_s, shift):
    """Return the sum of the body's natural vibrations, RMS `rms` at 14 m/s; `shift` offsets the phases.

    The spectrum of a road's height falls with the square of the spatial frequency (ISO 8608). The variance
    above the body's frequency is therefore proportional to the speed, and the RMS to its square root.
    """
    rms = rms * math.sqrt(min(abs(scene.speed), 60.0) / 14.0)
    total = 0.0
    for k in range(len(_BODY_HZ)):
        total += math.sin(2.0 * math.pi * (_BODY_HZ[k] * time_s + shift * k + phase))
    return rms * math.sqrt(2.0 / 3.0) * total


@exact_kernel
def _body_pitch(mount, scene, time_s):
    """Return the upward pitch of the car's body due to an uneven road and braking [rad]."""
    pitch = 0.0
    if mount.vibration_deg > 0.0:
        pitch += _vibration(mount.vibration_deg, mount.phase, scene, time_s, 0.37)
    if mount.dive_deg > 0.0:
        pitch += mount.dive_deg * max(-12.0, min(6.0, scene.acceleration))
    return math.radians(pitch)


@exact_kernel
def pose_lens(mount, scene, ago_s, lens):
    """Write the pose of a camera's lens to a `LENS` record.

    Args:
        mount: `MOUNT` record.
        scene: `SCENE` record.
        ago_s: Time before the scene, at which the ego was on its present circle [s].
        lens: Record to write.
    """
    x, y, heading, time_s = scene.x, scene.y, scene.heading, scene.time_s
    if ago_s > 0.0:
        slip, rate = _slip_and_yaw_rate(scene)
        distance, course = scene.speed * ago_s, heading + slip - 0.5 * rate * ago_s
        x, y = x - distance * math.cos(course), y - distance * math.sin(course)
        heading, time_s = heading - rate * ago_s, time_s - ago_s
    forward = 0.5 * scene.length - mount.setback
    c, s = math.cos(heading), math.sin(heading)
    z = mount.height
    if mount.heave_m > 0.0:
        # Above the ground.
        z = max(z + _vibration(mount.heave_m, mount.phase, scene, time_s, 0.61), 0.1 * z)
    yaw_deg = mount.yaw_deg
    if mount.path != 0:
        yaw_deg += math.degrees(_path_yaw(scene))
    yaw = heading + math.radians(yaw_deg)
    pitch = math.radians(mount.pitch_deg) + _body_pitch(mount, scene, time_s)
    lens.x, lens.y, lens.z = x + forward * c + mount.left * s, y + forward * s - mount.left * c, z
    lens.cos_yaw, lens.sin_yaw = math.cos(yaw), math.sin(yaw)
    lens.cos_pitch, lens.sin_pitch = math.cos(pitch), math.sin(pitch)
    lens.focal, lens.centre_u, lens.centre_v = mount.focal, mount.centre_u, mount.centre_v
    lens.yaw, lens.pitch = yaw, pitch


@exact_kernel
def side_tangent(lens):
    """Return the tangent of the largest horizontal angle between a point of the frame and the lens's yaw.

    It is -1.0 if the frame contains directions straight below or above the lens, or behind it.
    """
    nearest = lens.focal * lens.cos_pitch - lens.centre_v * abs(lens.sin_pitch)
    return lens.centre_u / nearest if nearest > 1e-3 * lens.focal else -1.0


@exact_kernel
def noise_start(mount, scene, lens):
    """Return the index of a frame's first number in the noise table, a function of seed and road state."""
    return hash((mount.seed, scene.steps, lens.x, lens.y, lens.yaw)) & ((1 << NOISE_LOG2) - 1)
