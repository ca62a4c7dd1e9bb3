# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Pose of a lens on the moving ego car: mount, gaze, zoom and motion of the car's body.

The gaze `ToStoppingPoint` keeps a part of the road in the frame that the car reaches when it brakes: its
distance follows the ego's speed, and its direction the ego's steering angle. A frame of a given size then
contains the same part of the lane at every speed. Other pixels of a real sensor are read; nothing moves.
"""

import math
from functools import lru_cache

import numpy as np

from lgmd_gym.camera.body_motion import (
    HEAVE,
    PITCH,
    ROLL,
    YAW,
    body_motion,
    residual_motion,
    road_gain,
)
from lgmd_gym.camera.camera import MIN_STOP, Camera, ToStoppingPoint
from lgmd_gym.camera.effects import NOISE_LOG2
from lgmd_gym.camera.scene import ROADS, Scene
from lgmd_gym.camera.worlds import draw_world
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.hashing import START, add_hash, finish_hash

FIXED, PATH, STOPPING = 0, 1, 2  # values of `MOUNT.gaze`
GAZE_NUMBERS = {"fixed": FIXED, "path": PATH, "stopping": STOPPING}
MAX_TURN = math.radians(40.0)
"""Bound of the turn towards the path [rad]."""
USUAL_BRAKE = 9.0
"""Deceleration of full braking in the laboratory [m/s²]."""
CALIBRATED = 0.1
"""Share of the errors of a calibrated mount that remains: 0.05° and 1 cm at most. An assumption: a car that
drives for minutes measures the direction of its lens from the vanishing point of its own motion."""
ESTIMATE_ERROR = 0.07
"""Standard deviation of the car's estimate of its full braking in numbered worlds, as a share of the true
deceleration; errors are at most twice as large. An assumption for an estimate of the friction from wheel
slip, rain sensor and temperature."""
_ESTIMATE_STREAM = 13  # second part of the seed, which separates the error from other draws of the same world
_PATH_S = 1.0  # look-ahead time of the gaze `AlongPath` [s]
_WET = 2.0 / 3.0  # deceleration on a wet road over that on a dry one
_GYRO_DIVE = 0.02  # share of the dive that remains of a stabilised lens

AIM = np.dtype(
    [
        *((name, np.float64) for name in ("reach", "span", "offset", "lift", "deceleration", "reaction")),
        *((name, np.float64) for name in ("setback", "height", "width")),
    ]
)
"""Aim of the gaze `ToStoppingPoint`, as the kernels read it: its fields; deceleration on the present road;
height of the lens as the sensor knows it [m]; width of the frame [px]. Zeros for other gazes."""
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

Fields of `Mount`, `Scene` and `ImageSensor`; amplitude of the road in `ROADS`; focal length and image centre
[px]; gaze, see `GAZE_NUMBERS`; 1 for linear light, a stabilised lens, a derotated view, sensor noise,
`vehicles="box"` and a numbered world.
"""


SHAKE = np.dtype(
    [
        *((name, np.int64) for name in ("seed", "stabilised")),
        *((name, np.float64) for name in ("time_s", "pitch", "roll", "yaw", "heave")),
    ]
)
"""The motion of the body at one time, which all cameras of a car share: seed, whether the rotations are those
that a gyroscope leaves, time [s]; rotations [degrees] and heave [m] at `MEAN_SPEED`."""


def no_shake() -> np.ndarray:
    """Return a `SHAKE` record of no time, shape (1,)."""
    shake = np.zeros(1, SHAKE)
    shake["time_s"] = np.nan
    return shake


def mount_of(camera: Camera, scene: Scene, max_deceleration: float = USUAL_BRAKE) -> np.ndarray:
    """Return the `MOUNT` record of a camera, shape ().

    Args:
        camera: The camera in its scene, see `effects.in_scene`.
        scene: The scene.
        max_deceleration: Full braking of the car [m/s²].
    """
    world, mount, sensor = draw_world(scene.world), camera.mount, camera.sensor
    stabilised = camera.stabiliser is not None and scene.gyroscope
    left = CALIBRATED if mount.calibrated else 1.0
    # An error of the mount does not halve the height.
    height = max(mount.height_m + world.mount_height_error, 0.5 * mount.height_m)
    lens_height = max(height + scene.height_error_m, 0.5 * mount.height_m)
    record = np.zeros((), MOUNT)
    record["setback"], record["left"], record["height"] = mount.setback_m, mount.left_m, lens_height
    record["yaw_deg"] = mount.yaw_deg + left * world.yaw_error_deg
    record["pitch_deg"] = mount.pitch_deg + left * world.pitch_error_deg + scene.pitch_error_deg
    record["road"], record["shutter_s"] = ROADS[scene.road], sensor.shutter_s
    record["dive_deg"] = scene.dive_deg * (_GYRO_DIVE if stabilised else 1.0)
    record["focal"] = camera.focal_px
    record["centre_u"], record["centre_v"] = 0.5 * camera.shape[1], 0.5 * camera.shape[0]
    record["linear"], record["gaze"] = sensor.linear_light, GAZE_NUMBERS[camera.gaze.kind]
    record["stabilised"], record["derotated"] = stabilised, camera.gaze.derotated
    record["noisy"] = sensor.shot_noise > 0.0 or sensor.read_noise > 0.0
    record["box"], record["drawn"], record["seed"] = scene.vehicles == "box", world.drawn, scene.noise_seed
    if isinstance(camera.gaze, ToStoppingPoint):
        known_height = height - left * (height - mount.height_m)
        record["aim"] = _aim_of(camera, camera.gaze, scene, known_height, max_deceleration)
    return record


def _aim_of(
    camera: Camera, gaze: ToStoppingPoint, scene: Scene, known_height: float, max_deceleration: float
) -> np.ndarray:
    """Return an `AIM` record, shape (), for a height of the lens that the sensor knows [m]."""
    deceleration = gaze.deceleration * (_WET if scene.weather.wet else 1.0)
    if gaze.brake_known:
        deceleration = gaze.deceleration * known_deceleration(scene, max_deceleration) / USUAL_BRAKE
    aim = np.zeros((), AIM)
    aim["reach"], aim["span"], aim["offset"], aim["lift"] = gaze.reach, gaze.span_m, gaze.offset_m, gaze.lift
    aim["deceleration"], aim["reaction"] = deceleration, gaze.reaction_s
    aim["setback"], aim["height"], aim["width"] = camera.mount.setback_m, known_height, camera.shape[1]
    return aim


def known_deceleration(scene: Scene, max_deceleration: float) -> float:
    """Return the car's estimate of its full braking [m/s²].

    It is the true deceleration with an error that is constant in a world: normally distributed, see
    `ESTIMATE_ERROR`. The laboratory has no error.
    """
    return max_deceleration * (1.0 + _estimate_error(scene.world))


@lru_cache(maxsize=1024)
def _estimate_error(world: int | None) -> float:
    """Return the relative error of the estimate in a world; 0 in the laboratory."""
    if world is None:
        return 0.0
    drawn = float(np.random.default_rng([world, _ESTIMATE_STREAM]).standard_normal())
    return ESTIMATE_ERROR * max(-2.0, min(2.0, drawn))


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


@kernel(exact=True, arrays=True)
def _shake_body(mount, time_s, shake):
    """Write the motion of the body due to the road to a `SHAKE` record, unless it is that already."""
    if shake.time_s == time_s and shake.seed == mount.seed and shake.stabilised == mount.stabilised:
        return
    shake.time_s, shake.seed, shake.stabilised = time_s, mount.seed, mount.stabilised
    shake.heave = body_motion(mount.seed, HEAVE, time_s)
    if mount.stabilised != 0:
        shake.pitch = residual_motion(mount.seed, PITCH, time_s)
        shake.roll = residual_motion(mount.seed, ROLL, time_s)
        shake.yaw = residual_motion(mount.seed, YAW, time_s)
    else:
        shake.pitch = body_motion(mount.seed, PITCH, time_s)
        shake.roll = body_motion(mount.seed, ROLL, time_s)
        shake.yaw = body_motion(mount.seed, YAW, time_s)


@kernel(exact=True, arrays=True)
def _tilt(mount, scene, turn, gain, shake):
    """Return the pitch upwards and the roll to the right of a camera due to the road and braking [rad].

    Args:
        mount: `MOUNT` record.
        scene: `SCENE` record.
        turn: Direction of the camera relative to the car [rad]; to its side, the pitch of the body is roll.
        gain: See `road_gain`.
        shake: `SHAKE` record.
    """
    pitch = roll = 0.0
    if gain > 0.0:
        body_pitch, body_roll = gain * shake.pitch, gain * shake.roll
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
def pose_lens(mount, scene, ago_s, shake, lens):
    """Write the pose of a camera's lens to a `LENS` record.

    Args:
        mount: `MOUNT` record.
        scene: `SCENE` record.
        ago_s: Time before the scene, at which the ego was on its present circle [s].
        shake: `SHAKE` record of the car's last lens, which is brought to this time.
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
    if gain > 0.0:
        _shake_body(mount, time_s, shake)
    tilt, roll = _tilt(mount, scene, math.radians(yaw_deg), gain, shake)
    if gain > 0.0:
        z = max(z + gain * shake.heave, 0.1 * z)  # above the ground
        yaw_deg += gain * shake.yaw
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
    state = add_hash(add_hash(START, mount.seed), scene.steps)
    for place in (lens.x, lens.y, lens.yaw):
        state = add_hash(state, hash(place))
    return finish_hash(state, 5) & ((1 << NOISE_LOG2) - 1)
