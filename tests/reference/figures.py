"""The figures of the reference camera: pedestrians and two-wheelers with their riders."""

import math

import numpy as np
from reference.air import beam
from reference.geometry import camera_axes, covered

from lgmd_gym.camera.objects import MODEL_BICYCLE, MODEL_PEDESTRIAN
from lgmd_gym.camera.render.models import builder as names
from lgmd_gym.camera.render.models.builder import BODY, LAMP, TAIL
from lgmd_gym.camera.render.models.figures import figure_tables


def figure_layers(scene, item, rays, veil):
    """Return coverage, grey, contrast and distance of each part of a figure in each pixel, far ones first."""
    tables, lens = figure_tables(linear=False), scene.lens
    row, away = item.model - MODEL_PEDESTRIAN, math.hypot(item.x - lens.x, item.y - lens.y)
    opacity, clear = min(1.0, 6.0 * (1.0 - away / item.range)), math.exp(-away * scene.look.extinction)
    size = lens.focal * (item.height - item.base) / max(away - 0.5 * item.length, 1.0)
    joints, thick = _posed(item, tables, row)
    points = _in_camera(lens, item, joints)
    origin = _in_camera(lens, item, np.zeros(3))
    axes = [_in_camera(lens, item, unit) - origin for unit in np.eye(3)]
    turn = math.atan2(lens.y - item.y, lens.x - item.x) - math.atan2(item.sin, item.cos)
    facing, layers = math.cos(turn), []
    for place, index in enumerate(tables.orders[row, _direction(lens, item)][: tables.counts[row, 0]]):
        part = tables.parts[row, index]
        weight = opacity * (min(1.0, size / part["fine"] - 1.0) if part["fine"] else 1.0)
        weight *= min(1.0, part["abeam"] + part["facing"] * facing)
        if weight <= 0.0:
            continue
        outlines = _wheel(points[part["a"]], part, thick, axes)
        along = axes[2]
        if part["shape"] == names.LIMB:
            outlines, along = _limb(points[part["a"]], points[part["b"]], part, thick, axes)
        middle = 0.5 * (points[part["a"]] + points[part["b"]])
        grey = _grey(scene, item, part, _light(scene, middle, along))
        cover = sum(share * rays.mean(covered(lens, outline, rays)) for outline, share in outlines)
        grey = scene.look.haze + clear * (grey - scene.look.haze) + veil
        near = np.where(cover > 0.0, away / lens.focal - 1e-9 * place, np.inf)
        layers.append((weight * cover, np.broadcast_to(grey, cover.shape), np.zeros(cover.shape), near))
    return layers


def _direction(lens, item):
    """Return the order of drawing: the lens is ahead or behind, and on the left or right."""
    x, y = lens.x - item.x, lens.y - item.y
    turn = math.atan2(y, x) - math.atan2(item.sin, item.cos)
    return (1 if math.cos(turn) < 0.0 else 0) + (2 if math.sin(turn) < 0.0 else 0)


def _in_camera(lens, item, point):
    forward, left, up = point[..., 0], point[..., 1], point[..., 2]
    x = item.x - lens.x + forward * item.cos - left * item.sin
    y = item.y - lens.y + forward * item.sin + left * item.cos
    return camera_axes(lens, x, y, item.base - lens.z + up)


def _posed(item, tables, row):
    """Return the joints in the axes of the figure [m], and the factor of all radii."""
    height = item.height - item.base
    scale = np.array([item.length, item.width, height]) / tables.sizes[row]
    thick = scale.min()
    if item.model == MODEL_PEDESTRIAN:
        scale[0] = min(scale[0], scale[2])
    joints = tables.joints[row] * scale
    if item.model == MODEL_PEDESTRIAN:
        _walk(item, height, joints)
    elif item.model == MODEL_BICYCLE:
        _pedal(item.travelled, scale, joints)
    return joints, thick


def _walk(item, height, joints):
    unit = height / 1.8
    stride = 2.0 * math.pi * item.travelled / (2.0 * 0.43 * height)
    amount = np.clip(abs(item.speed) / 0.8, 0.0, 1.0)
    ahead, behind = (np.clip(0.5 * item.length - part * unit, 0.0, 0.22 * height) for part in (0.165, 0.06))
    swing = 0.5 * amount * (ahead + behind) * math.sin(stride)
    sunk = unit * 0.84 - math.sqrt((unit * 0.84) ** 2 - swing**2)
    joints[8:, 2] -= sunk
    for leg, arm, angle in ((0, 8, stride), (4, 11, stride + math.pi)):
        hip, knee, ankle, toe = joints[leg : leg + 4]
        hip[2] -= sunk
        forward = math.sin(angle)
        ankle[0] = amount * forward * (0.5 * (ahead + behind) + 0.5 * (ahead - behind) * forward)
        heel, toes = max(-forward, 0.0) ** 2, max(forward, 0.0) ** 2
        ankle[2] += amount * unit * (0.08 * heel + 0.07 * max(math.cos(angle), 0.0) ** 2)
        _place_knee(hip, knee, ankle, 0.4225 * unit)
        pitch = -0.29 + amount * (0.3 * toes - 0.9 * heel)
        toe[0] = ankle[0] + 0.157 * unit * math.cos(pitch)
        toe[2] = max(ankle[2] + 0.157 * unit * math.sin(pitch), 0.035 * unit)
        shoulder, elbow, hand = joints[arm : arm + 3]
        turn = -0.36 * amount * forward * min(1.0, 3.0 * item.length / height)
        elbow[::2] = shoulder[::2] + 0.3 * unit * np.array([math.sin(turn), -math.cos(turn)])
        turn += 0.12 + 0.5 * max(turn, 0.0)
        hand[::2] = elbow[::2] + 0.26 * unit * np.array([math.sin(turn), -math.cos(turn)])


def _pedal(travelled, scale, joints):
    turn = -2.0 * math.pi * travelled / 4.6
    for leg, pedal, angle in ((0, 14, turn), (4, 15, turn + math.pi)):
        hip, knee, ankle, toe = joints[leg : leg + 4]
        joints[pedal, ::2] = joints[16, ::2] + 0.17 * scale[::2] * (math.cos(angle), math.sin(angle))
        ankle[::2] = joints[pedal, ::2] + (-0.06, 0.1) * scale[::2]
        toe[::2] = joints[pedal, ::2] + (0.08, 0.04) * scale[::2]
        _place_knee(hip, knee, ankle, 0.43 * scale[2])
    for spoke, axle, start in ((19, 17, 0.0), (20, 17, math.pi), (21, 18, 0.0), (22, 18, math.pi)):
        angle = start + travelled / max(joints[axle, 2], 1e-3)
        joints[spoke, ::2] = joints[axle, ::2] + 0.2 * scale[::2] * (math.sin(angle), math.cos(angle))


def _place_knee(hip, knee, ankle, bone):
    """Place a knee by the angles of the triangle of thigh, shank and the line from hip to ankle."""
    x, z = ankle[0] - hip[0], ankle[2] - hip[2]
    line = math.hypot(x, z)
    angle = math.acos(min(0.5 * line / bone, 1.0)) if bone else 0.0
    turn = math.atan2(z, x) + angle
    reach = max(bone, 0.5 * line)
    knee[0], knee[2] = hip[0] + reach * math.cos(turn), hip[2] + reach * math.sin(turn)


def _limb(a, b, part, thick, axes):
    """Return the outline of a limb as seen from the lens, with its share, and the direction of its length."""
    view = 0.5 * (a + b)
    view = view / np.linalg.norm(view)
    across = np.cross(b - a, view)
    if np.linalg.norm(across) < 1e-6:
        across = np.cross(view, axes[2])
    across = across / np.linalg.norm(across)
    along = np.cross(view, across)
    wide = float(across @ axes[1])
    deep = math.sqrt(max(1.0 - wide**2, 0.0))
    corners = []
    for end, name, way in ((a, "a", -1.0), (b, "b", 1.0)):
        radius = thick * math.hypot(part[f"deep_{name}"] * deep, part[f"wide_{name}"] * wide)
        tip = end + way * thick * part["cap"] * along
        half = [end - way * radius * across, tip - way * 0.55 * radius * across]
        corners += [*half, tip + way * 0.55 * radius * across, end + way * radius * across]
    return [(np.array(corners), 1.0)], along


def _wheel(centre, part, thick, axes):
    """Return the outlines of a wheel, and of its hole with a share below 0."""
    forward, _, up = axes
    view = centre / np.linalg.norm(centre)
    level = np.cross(up, view)
    level = level / np.linalg.norm(level)
    shown = float(level @ forward)
    half = thick * part["wide_a"] * (1.0 if shown >= 0.0 else -1.0) * level
    angles = 2.0 * np.pi * (np.arange(16) + 0.5)[:, None] / 16
    swell = math.sqrt(2.0 * math.pi / 16 / math.sin(2.0 * math.pi / 16))
    outlines = []
    for radius, wider, share in (
        (part["deep_a"], half, 1.0),
        (part["hole"], -half, part["spokes"] - 1.0),
    ):
        radius = thick * swell * radius
        if share > 0.0 or thick * part["hole"] * abs(shown) > thick * part["wide_a"]:
            ring = np.cos(angles) * (radius * forward + wider) + np.sin(angles) * radius * up
            outlines.append((centre + ring, share))
    return outlines


def _light(scene, middle, along):
    """Return the mean light on the visible half of a cylinder, by sums over the directions of its surface."""
    view = -middle / np.linalg.norm(middle)
    across = np.cross(along, view)
    angles = (np.arange(4000) + 0.5) * math.pi / 4000 - 0.5 * math.pi
    normals = np.cos(angles)[:, None] * view + np.sin(angles)[:, None] * across
    sun = camera_axes(scene.lens, scene.look.sun_x, scene.look.sun_y, scene.look.sun_z)
    mean = np.average(np.maximum(normals @ sun, 0.0), weights=np.cos(angles))
    return scene.look.ambient + scene.look.direct * mean


def _grey(scene, item, part, light):
    look, lens, role, value = scene.look, scene.lens, part["role"], part["value"]
    low_beam, air = 0.0, 1.0
    if look.night:
        dx, dy = item.x - lens.x, item.y - lens.y
        ahead, across = dx * lens.cos_yaw + dy * lens.sin_yaw, dy * lens.cos_yaw - dx * lens.sin_yaw
        low_beam = beam(look, max(ahead, 0.0), across / max(ahead, 1.0))
        air = look.night_light + low_beam
    if role == names.DAY_LAMP:
        return 255.0
    if role == TAIL:
        return 255.0 if item.braking else 170.0 if look.night else value * light
    if role == LAMP:
        return 255.0 if look.night else value
    grey = min(value * (item.shade if role == BODY else 1.0) * light * air, 250.0)
    if role == names.REFLECTOR:
        return min(grey + 12.0 * 255.0 * low_beam, 255.0)
    return grey
