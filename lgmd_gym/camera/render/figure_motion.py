"""Kernels that place the joints of figures: the gait of a pedestrian and the crank of a bicycle."""

import math

from lgmd_gym.camera.objects import MODEL_BICYCLE, MODEL_PEDESTRIAN
from lgmd_gym.camera.render.figure_builder import (
    ANKLE,
    ARM,
    CRANK,
    ELBOW,
    FRONT_AXLE,
    HAND,
    HIP,
    KNEE,
    LEG,
    PEDAL,
    REAR_AXLE,
    SHOULDER,
    SPOKE,
    TOE,
)
from lgmd_gym.kernels import kernel

STEP = 0.43
"""Length of a step as a share of a pedestrian's height; adults walk with 0.41 to 0.45."""
DEVELOPMENT = 4.6
"""Distance per turn of a bicycle's crank [m]: 44 and 20 teeth, 28 inches; 54 turns a minute at 15 km/h."""
_FULL_STEP = 0.8  # speed from which a pedestrian takes whole steps [m/s]
_LEG, _BONE = 0.84, 0.4225  # height of the hip above the ankle, length of a thigh or shank of an adult [m]
_RIDER_BONE = 0.43  # the same of a cyclist
_CRANK, _SPOKE = 0.17, 0.2  # distance of the pedals and reflectors from their axles [m]


@kernel
def pose_figure(obj, tables, joints):
    """Write the joints of a figure (forward, left, up) from the centre of its underside.

    Args:
        obj: `OBJECT` record of a figure.
        tables: `FigureTables`.
        joints: Output: joints, float64, shape (56, 3) [m].

    Returns:
        Factor of the radii of the parts.
    """
    k = obj.model - MODEL_PEDESTRIAN
    tall = (obj.height - obj.base) / tables.sizes[k, 2]
    along, across = obj.length / tables.sizes[k, 0], obj.width / tables.sizes[k, 1]
    thick = min(along, across, tall)
    if k == 0:
        along = min(along, tall)  # the length of a pedestrian is that of the steps
    used = tables.counts[k, 1]
    for j in range(used):
        joints[j, 0] = along * tables.joints[k, j, 0]
        joints[j, 1] = across * tables.joints[k, j, 1]
        joints[j, 2] = tall * tables.joints[k, j, 2]
    if k == 0:
        _walk(obj, tall, joints, used)
    elif obj.model == MODEL_BICYCLE:
        _pedal(obj.travelled, along, tall, joints)
    return thick


@kernel
def _walk(obj, tall, joints, used):
    """Swing legs and arms with the distance walked; a pedestrian who stands has straight legs."""
    size = obj.height - obj.base
    phase = math.pi * obj.travelled / max(STEP * size, 1e-3)
    amount = min(1.0, abs(obj.speed) / _FULL_STEP)
    # With the foot, the leg reaches as far ahead and behind as the length allows.
    ahead = max(min(0.5 * obj.length - 0.165 * tall, 0.22 * size), 0.0)
    behind = max(min(0.5 * obj.length - 0.06 * tall, 0.22 * size), 0.0)
    swing = 0.5 * amount * (ahead + behind) * math.sin(phase)
    sunk = tall * _LEG - math.sqrt(max((tall * _LEG) ** 2 - swing * swing, 0.0))
    for j in range(SHOULDER, used):
        joints[j, 2] -= sunk
    for i in range(2):
        way = 1.0 - 2.0 * i
        ankle = LEG * i + ANKLE
        s, c = way * math.sin(phase), way * math.cos(phase)
        lift = max(-s, 0.0)  # of the heel, behind the body
        raised = max(s, 0.0)  # of the toes, ahead of it
        joints[LEG * i + HIP, 2] -= sunk
        joints[ankle, 0] = amount * (0.5 * (ahead + behind) * s + 0.5 * (ahead - behind) * s * s)
        joints[ankle, 2] += amount * tall * (0.08 * lift * lift + 0.07 * max(c, 0.0) ** 2)
        _bend(joints, LEG * i, _BONE * tall)
        turn = -0.29 + amount * (0.3 * raised * raised - 0.9 * lift * lift)
        toe, foot = LEG * i + TOE, 0.157 * tall
        joints[toe, 0] = joints[ankle, 0] + foot * math.cos(turn)
        joints[toe, 2] = max(joints[ankle, 2] + foot * math.sin(turn), 0.035 * tall)
        _swing_arm(joints, SHOULDER + ARM * i, -0.36 * amount * s * min(1.0, 3.0 * obj.length / size), tall)


@kernel
def _swing_arm(joints, shoulder, turn, tall):
    """Turn an arm forwards, with the elbow bent a little more [rad]."""
    elbow, hand = shoulder + ELBOW - SHOULDER, shoulder + HAND - SHOULDER
    bent = turn + 0.12 + 0.5 * max(turn, 0.0)
    joints[elbow, 0] = joints[shoulder, 0] + 0.3 * tall * math.sin(turn)
    joints[elbow, 2] = joints[shoulder, 2] - 0.3 * tall * math.cos(turn)
    joints[hand, 0] = joints[elbow, 0] + 0.26 * tall * math.sin(bent)
    joints[hand, 2] = joints[elbow, 2] - 0.26 * tall * math.cos(bent)


@kernel
def _bend(joints, leg, bone):
    """Place the knee of a leg ahead of the line from hip to ankle, with bones of equal length [m]."""
    hip, knee, ankle = leg + HIP, leg + KNEE, leg + ANKLE
    x, z = joints[ankle, 0] - joints[hip, 0], joints[ankle, 2] - joints[hip, 2]
    square = max(x * x + z * z, 1e-12)
    ahead = math.sqrt(max(bone * bone / square - 0.25, 0.0))
    joints[knee, 0] = joints[hip, 0] + 0.5 * x - ahead * z
    joints[knee, 2] = joints[hip, 2] + 0.5 * z + ahead * x


@kernel
def _pedal(travelled, along, tall, joints):
    """Turn the crank with the rider's legs, and the reflectors of the wheels."""
    turn = 2.0 * math.pi * travelled / DEVELOPMENT
    for i in range(2):
        way = 1.0 - 2.0 * i
        pedal, leg = PEDAL + i, LEG * i
        joints[pedal, 0] = joints[CRANK, 0] + along * _CRANK * way * math.cos(turn)
        joints[pedal, 2] = joints[CRANK, 2] - tall * _CRANK * way * math.sin(turn)
        joints[leg + ANKLE, 0] = joints[pedal, 0] - 0.06 * along
        joints[leg + ANKLE, 2] = joints[pedal, 2] + 0.1 * tall
        joints[leg + TOE, 0] = joints[pedal, 0] + 0.08 * along
        joints[leg + TOE, 2] = joints[pedal, 2] + 0.04 * tall
        _bend(joints, leg, _RIDER_BONE * tall)
    for i in range(4):
        axle = REAR_AXLE if i < 2 else FRONT_AXLE
        angle = travelled / max(joints[axle, 2], 1e-3) + math.pi * i
        joints[SPOKE + i, 0] = joints[axle, 0] + along * _SPOKE * math.sin(angle)
        joints[SPOKE + i, 2] = joints[axle, 2] + tall * _SPOKE * math.cos(angle)
