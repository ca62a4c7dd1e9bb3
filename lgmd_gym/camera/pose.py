"""Pose of a lens on the moving ego car: mount, gaze and motion of the car's body."""

import math

import numpy as np

from lgmd_gym.camera.aim import (
    AIM,
    GAZES,
    PATH,
    STOPPING,
    aim_depth,
    aim_focal,
    aim_of,
    aim_pitch,
    aim_yaw,
    path_yaw,
    slip_and_yaw_rate,
)
from lgmd_gym.camera.body_motion import (
    HEAVE,
    PITCH,
    ROLL,
    YAW,
    body_motion,
    residual_motion,
    road_gain,
)
from lgmd_gym.camera.effects import NOISE_LOG2
from lgmd_gym.camera.params import ROADS, CameraParams
from lgmd_gym.camera.worlds import World, draw_world
from lgmd_gym.kernels import kernel

MOUNT = np.dtype(
    [
        *((name, np.float64) for name in ("setback", "left", "height", "yaw_deg", "pitch_deg")),
        *((name, np.float64) for name in ("road", "dive_deg", "shutter_s")),
        *((name, np.float64) for name in ("focal", "centre_u", "centre_v", "linear")),
        *((name, np.int64) for name in ("gaze", "stabilised", "derotated", "noisy", "box", "drawn", "seed")),
        ("aim", AIM),
    ]
)
"""How a camera sits on the car and moves with it, as the kernels read it.

The fields of `CameraParams`; amplitude of the road in `ROADS`; focal length and image centre [px]; gaze, see
`camera.aim`; 1 for linear light, a stabilised lens, a derotated view, sensor noise, `vehicles="box"` and a
numbered world.
"""
CALIBRATED = 0.1
"""Share of the errors of a calibrated mount that remains: 0.05° and 1 cm at most. An assumption: a car that
drives for minutes measures the direction of its lens from the vanishing point of its own motion."""
_GYRO_DIVE = 0.02  # share of the dive that remains of a stabilised lens


def mount_of(p: CameraParams) -> np.ndarray:
    """Return the `MOUNT` record of a camera, shape ()."""
    height, width = p.shape
    world = draw_world(p.world)
    left, lens_height = (CALIBRATED if p.calibrated else 1.0), height_of(p, world)
    known_height = lens_height - left * (lens_height - p.mount_height)
    values = (
        *(p.mount_setback, p.mount_left, lens_height),
        *(p.yaw_deg + left * world.yaw_error_deg, p.pitch_deg + left * world.pitch_error_deg),
        *(ROADS[p.road], p.dive_deg * (_GYRO_DIVE if p.stabilised else 1.0), p.shutter_s),
        *(p.focal_px, 0.5 * width, 0.5 * height, p.linear_light),
        *(
            GAZES[p.gaze],
            p.stabilised,
            p.derotated,
            p.shot_noise > 0.0 or p.read_noise > 0.0,
            p.vehicles == "box",
        ),
        *(world.drawn, seed_of(p)),
        aim_of(p, known_height),
    )
    return np.array(values, dtype=MOUNT)


def height_of(p: CameraParams, world: World) -> float:
    """Return the height of the lens above the ground [m]; an error of the mount does not halve it."""
    return max(p.mount_height + world.mount_height_error, 0.5 * p.mount_height)


def seed_of(p: CameraParams) -> int:
    """Return the seed of a camera's noise and of vehicles without a `shade`: its world, or `seed`."""
    return p.seed if p.world is None else p.world


@kernel(exact=True, arrays=True)
def _rotation(mount, axis, time_s):
    """Return the rotation of a lens about one axis due to the road, at `MEAN_SPEED` [degrees]."""
    if mount.stabilised != 0:
        return residual_motion(mount.seed, axis, time_s)
    return body_motion(mount.seed, axis, time_s)


@kernel(exact=True, arrays=True)
def _tilt(mount, scene, time_s, turn, gain):
    """Return the pitch upwards and the roll to the right of a camera due to the road and braking [rad].

    Args:
        mount: `MOUNT` record.
        scene: `SCENE` record.
        time_s: Time [s].
        turn: Direction of the camera relative to the car [rad]; to its side, the pitch of the body is roll.
        gain: See `road_gain`.
    """
    pitch = roll = 0.0
    if gain > 0.0:
        body_pitch = gain * _rotation(mount, PITCH, time_s)
        body_roll = gain * _rotation(mount, ROLL, time_s)
        c, s = math.cos(turn), math.sin(turn)
        pitch, roll = body_pitch * c - body_roll * s, body_roll * c + body_pitch * s
    if mount.dive_deg > 0.0:
        pitch += mount.dive_deg * max(-12.0, min(6.0, scene.acceleration))
    return math.radians(pitch), math.radians(roll)


@kernel(exact=True, arrays=True)
def _yaw_on_car(mount, scene):
    """Return the yaw of a lens relative to the car [degrees]."""
    if mount.gaze == PATH:
        return mount.yaw_deg + math.degrees(path_yaw(scene))
    if mount.gaze == STOPPING:
        return mount.yaw_deg + math.degrees(aim_yaw(mount.aim, scene, aim_depth(mount.aim, scene.speed)))
    return mount.yaw_deg


@kernel(exact=True, arrays=True)
def pose_lens(mount, scene, ago_s, lens):
    """Write the pose of a camera's lens to a `LENS` record.

    Args:
        mount: `MOUNT` record.
        scene: `SCENE` record.
        ago_s: Time before the scene, at which the ego was on its present circle [s].
        lens: Record to write.
    """
    x, y, heading, time_s = scene.x, scene.y, scene.heading, scene.time_s
    yaw_deg = _yaw_on_car(mount, scene)
    lens.yaw_px, rounding = 0.0, 0.0
    if mount.derotated != 0:
        exact = (heading + math.radians(yaw_deg)) * mount.focal
        lens.yaw_px = math.floor(exact + 0.5)
        rounding = (lens.yaw_px - exact) / mount.focal
    if ago_s > 0.0:
        slip, rate = slip_and_yaw_rate(scene)
        distance, course = scene.speed * ago_s, heading + slip - 0.5 * rate * ago_s
        x, y = x - distance * math.cos(course), y - distance * math.sin(course)
        heading, time_s = heading - rate * ago_s, time_s - ago_s
    forward = 0.5 * scene.length - mount.setback
    c, s = math.cos(heading), math.sin(heading)
    z = mount.height
    gain = road_gain(mount.road, scene.speed)
    tilt, roll = _tilt(mount, scene, time_s, math.radians(yaw_deg), gain)
    if gain > 0.0:
        # Above the ground.
        z = max(z + gain * body_motion(mount.seed, HEAVE, time_s), 0.1 * z)
        yaw_deg += gain * _rotation(mount, YAW, time_s)
    yaw = heading + math.radians(yaw_deg) + rounding
    pitch, focal = math.radians(mount.pitch_deg) + tilt, mount.focal
    lens.turn = 0.0
    if mount.gaze == STOPPING:
        depth = aim_depth(mount.aim, scene.speed)
        pitch += aim_pitch(mount.aim, depth)
        focal, lens.turn = aim_focal(mount.aim, depth), yaw - heading
    lens.x, lens.y, lens.z = x + forward * c + mount.left * s, y + forward * s - mount.left * c, z
    lens.cos_yaw, lens.sin_yaw = math.cos(yaw), math.sin(yaw)
    lens.cos_pitch, lens.sin_pitch = math.cos(pitch), math.sin(pitch)
    lens.focal, lens.centre_u, lens.centre_v = focal, mount.centre_u, mount.centre_v
    lens.cos_roll, lens.sin_roll = math.cos(roll), math.sin(roll)
    lens.yaw, lens.pitch, lens.roll = yaw, pitch, roll


@kernel(exact=True, arrays=True)
def half_frame(lens):
    """Return half of the width and height of the upright rectangle around the rolled frame [px]."""
    c, s = abs(lens.cos_roll), abs(lens.sin_roll)
    return lens.centre_u * c + lens.centre_v * s, lens.centre_v * c + lens.centre_u * s


@kernel(exact=True, arrays=True)
def side_tangent(lens):
    """Return the tangent of the largest horizontal angle between a point of the frame and the lens's yaw.

    It is -1.0 if the frame contains directions straight below or above the lens, or behind it.
    """
    half_width, half_height = half_frame(lens)
    nearest = lens.focal * lens.cos_pitch - half_height * abs(lens.sin_pitch)
    return half_width / nearest if nearest > 1e-3 * lens.focal else -1.0


@kernel(exact=True, arrays=True)
def noise_start(mount, scene, lens):
    """Return the index of a frame's first number in the noise table, a function of seed and road state."""
    return hash((mount.seed, scene.steps, lens.x, lens.y, lens.yaw)) & ((1 << NOISE_LOG2) - 1)
