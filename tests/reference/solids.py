"""The solids of the reference camera: where rays meet the faces of an object, and with what grey."""

import itertools
import math
import warnings

import numpy as np
from reference.air import beam, row_slope, veil
from reference.figures import figure_layers
from reference.geometry import camera_axes, covered

from lgmd_gym.camera.objects import MODEL_MARK, is_figure, is_picture
from lgmd_gym.camera.render.models import all_models
from lgmd_gym.camera.render.models.builder import BODY, LAMP, TAIL


def ordered_solids(scene, rays, row, column):
    """Return the coverage and the grey of each solid in each pixel, and its contrast, from far to near.

    Args:
        scene: `ReferenceCamera`.
        rays: `Rays`.
        row: Row of each pixel.
        column: Column of each pixel.

    Returns:
        Triples of arrays, shape (pixels,). The order of two solids may differ from pixel to pixel.
    """
    models, found = all_models(linear=False), []
    for item in scene.objects:
        away = math.hypot(item.x - scene.lens.x, item.y - scene.lens.y)
        if is_figure(item.model):
            light = veil(scene, column, row_slope(scene.lens, row), away)
            found += figure_layers(scene, item, rays, light)
        elif item.model != MODEL_MARK:
            solids = [_solid(scene, item, solid, rays) for solid in range(*models.models[item.model])]
            solids = [solid for solid in solids if solid is not None]
            light = veil(scene, column, row_slope(scene.lens, row), away) if solids else 0.0
            found += _with_distances([(cover, grey + light, *rest) for cover, grey, *rest in solids])
    if not found:
        return []
    *layers, away = (np.stack(values) for values in zip(*found, strict=True))
    order = np.argsort(-away, axis=0, kind="stable")
    return list(zip(*(np.take_along_axis(layer, order, axis=0) for layer in layers), strict=True))


def _with_distances(solids):
    """Return the solids of one object with its mean distance, smaller for solids in front of others.

    A solid is in front of another if it is nearer along the rays that meet both; the later one if equal.
    """
    if not solids:
        return []
    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # pixels without a hit
        mean = np.nanmean(np.concatenate([solid[-1] for solid in solids], axis=1), axis=1)
        away = [np.nan_to_num(mean, nan=np.inf)] * len(solids)
        for i, j in itertools.permutations(range(len(solids)), 2):
            nearer = np.nanmean(solids[i][-1] - solids[j][-1], axis=1)
            away[i] = away[i] - 1e-9 * ((nearer < 0.0) | ((nearer == 0.0) & (i > j)))
    return [(*solid[:-1], distance) for solid, distance in zip(solids, away, strict=True)]


def _solid(scene, item, solid, rays):
    """Return coverage, grey and contrast of a solid in each pixel, and its distance along each ray (or NaN).

    None if it is in no pixel.
    """
    models, lens = all_models(linear=False), scene.lens
    away = math.hypot(item.x - lens.x, item.y - lens.y)
    opacity, clear = min(1.0, 6.0 * (1.0 - away / item.range)), math.exp(-away * scene.look.extinction)
    covers = light = contrast = 0.0
    distances = np.full(rays.v.shape, np.nan)
    for face in range(*models.solids[solid]):
        if models.parent[face] >= 0:
            continue
        corners = _corners(scene, item, models, face)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        hit = covered(lens, corners, rays)
        if normal @ corners[0] >= 0.0 or not hit.any():
            continue
        grey = _covered_grey(scene, item, models, face, _face_light(scene, item, normal), rays)
        distance = np.full(rays.v.shape, away / lens.focal)
        if not is_picture(item.model):
            with np.errstate(divide="ignore"):
                distance = (normal @ corners[0]) / (rays.direction @ normal)
        covers = covers + rays.mean(hit)
        light = light + rays.mean(grey)
        contrast = np.maximum(contrast, np.ptp(grey, axis=1) * (rays.mean(hit) > 0.0))
        distances[hit] = distance[hit]
    if not np.any(covers):
        return None
    inverse = 1.0 / np.maximum(covers, 1e-12)
    grey = scene.look.haze + clear * (light * inverse - scene.look.haze)
    return opacity * np.minimum(covers, 1.0), grey, contrast, distances


def _corners(scene, item, models, polygon):
    """Return the corners of a polygon as (depth, right, down), shape (corners, 3) [m]."""
    a, b, c = models.corners[polygon, :, : models.corners_used[polygon]]
    lens, cos, sin = scene.lens, item.cos, item.sin
    dx, dy = item.x - lens.x, item.y - lens.y
    if is_picture(item.model):
        away = max(math.hypot(dx, dy), 1e-6)
        cos, sin = dx / away, dy / away
    x = dx + a * item.length * cos - b * item.width * sin
    y = dy + a * item.length * sin + b * item.width * cos
    return camera_axes(lens, x, y, item.base + c * (item.height - item.base) - lens.z)


def _face_light(scene, item, normal):
    """Return the light on a face: from the sky, the sun and, at night, the low beam."""
    lens = scene.lens
    sun = camera_axes(lens, scene.look.sun_x, scene.look.sun_y, scene.look.sun_z)
    light = scene.look.ambient + scene.look.direct * max(0.0, float(normal @ sun) / np.linalg.norm(normal))
    if scene.look.night:
        dx, dy = item.x - lens.x, item.y - lens.y
        ahead, across = dx * lens.cos_yaw + dy * lens.sin_yaw, dy * lens.cos_yaw - dx * lens.sin_yaw
        light *= scene.look.night_light + beam(scene.look, max(ahead, 0.0), across / max(ahead, 1.0))
    return light


def _covered_grey(scene, item, models, face, light, rays):
    """Return the grey of a face with its details at each ray, 0 beside it; details fade in with the size.

    Details of a tree protrude from its crown by 1 % of its height, where they change what is behind it.
    """
    away = math.hypot(item.x - scene.lens.x, item.y - scene.lens.y)
    size = scene.lens.focal * (item.height - item.base) / max(away - 0.5 * item.length, 1.0)
    greys = {face: _grey(scene, item, models, face, light)}
    out = greys[face] * covered(scene.lens, _corners(scene, item, models, face), rays)
    for detail in range(face + 1, len(models.parent)):
        parent = models.parent[detail]
        if parent not in greys:
            continue
        weight = min(1.0, size / models.fine[detail] - 1.0)
        if weight <= 0.0:
            continue
        greys[detail] = _grey(scene, item, models, detail, light)
        hit = covered(scene.lens, _corners(scene, item, models, detail), rays)
        out += weight * hit * (greys[detail] - greys[parent])
    return out


def _grey(scene, item, models, polygon, light):
    role, value = models.role[polygon], models.value[polygon]
    night = scene.look.night > 0.0
    if role == TAIL:
        return 255.0 if item.braking else 170.0 if night else value * light
    if role == LAMP:
        return 255.0 if night else value
    return min(value * (item.shade if role == BODY else 1.0) * light, 250.0)
