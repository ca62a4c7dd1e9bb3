"""The ground of the reference camera: asphalt, verge, markings, marks and shadows at points."""

import math

import numpy as np
from reference.air import beam, veil

from lgmd_gym.camera import objects as kinds
from lgmd_gym.camera.effects import ASPHALT_GREY, PAINT_GREY
from lgmd_gym.camera.render.texture import TEXEL_M, ground_texture


def ground_light(scene, rays, row, column):
    """Return the light of the ground in the part of each pixel below the horizon, and the contrast in it.

    Args:
        scene: `ReferenceCamera`.
        rays: `Rays`.
        row: Row of each pixel.
        column: Column of each pixel.
    """
    lens, look = scene.lens, scene.look
    x = lens.x + rays.forward * lens.cos_yaw - rays.across * lens.sin_yaw
    y = lens.y + rays.forward * lens.sin_yaw + rays.across * lens.cos_yaw
    # Lanes overlap: the coverage of a pixel is the sum of theirs.
    road = np.full(x.shape, float(scene.road.paved))
    for corners in scene.road.surface["corners"]:
        road += rays.shown & inside(x, y, corners.reshape(-1, 2))
    paint, shadow = _marks_and_shadows(scene, x, y)
    paint += _markings(scene.road.lines, look, x, y)
    share = np.maximum(rays.mean(rays.fall > 0.0), 1e-9)
    road, paint, shadow = (
        rays.mean(np.where(rays.fall > 0.0, cover, 0.0)) / share
        for cover in (road, paint * rays.shown, shadow * rays.shown)
    )
    partial = np.any([(cover > 0.0) & (cover < 1.0) for cover in (road, paint, shadow)], axis=0)
    grain = look.asphalt_gain * texture_at(scene, "asphalt", row, column)
    verge = look.verge + look.verge_gain * texture_at(scene, "verge", row, column)
    road = np.minimum(road, 1.0)
    grey = road * (look.asphalt + grain) + (1.0 - road) * verge
    grey += np.clip(paint, 0.0, 1.0) * (look.paint + 0.5 * grain - grey)
    grey *= 1.0 - np.clip(shadow, 0.0, look.shadow_limit)
    return _through_air(scene, grey, row, column), partial * (look.paint - look.verge)


def _markings(lines, look, x, y):
    """Return the paint of the markings at points: the number of strokes that cover each one."""
    paint = np.zeros(x.shape)
    for piece in lines:
        rx, ry = x - piece["x"], y - piece["y"]
        along = rx * piece["cos"] + ry * piece["sin"]
        beside = ry * piece["cos"] - rx * piece["sin"]
        covered = (along >= 0.0) & (along <= piece["length"]) & (np.abs(beside) <= 0.5 * look.line_width)
        if piece["striped"]:
            covered &= (piece["start"] + along) % look.dash_period < look.dash
        paint += covered
    return paint


def _marks_and_shadows(scene, x, y):
    """Return the paint of marks and the shadow of objects at points."""
    paint, shadow = np.zeros(x.shape), np.zeros(x.shape)
    look = scene.look
    for item in scene.objects:
        lean, model = look.under_lean * item.height, item.model
        at = item.x + lean * look.sun_x, item.y + lean * look.sun_y
        if model == kinds.MODEL_MARK and item.shade >= 0.0:
            covered = _footprint(x, y, item, (item.x, item.y), 0.0)
            if item.shade > ASPHALT_GREY:
                paint += covered * min((item.shade - ASPHALT_GREY) / (PAINT_GREY - ASPHALT_GREY), 1.0)
            else:
                shadow += covered * (1.0 - item.shade / ASPHALT_GREY)
        elif model == kinds.MODEL_MARK:
            inset = min(0.2, 0.25 * min(item.length, item.width))
            paint += 0.8 * _footprint(x, y, item, (item.x, item.y), 0.0)
            paint -= 0.5 * _footprint(x, y, item, (item.x, item.y), -inset)
        elif model == kinds.MODEL_TREE:
            away = math.hypot(item.x - scene.lens.x, item.y - scene.lens.y)
            dark = max(min(0.4, 0.8 - away / 60.0), 0.0)
            shadow += dark * _footprint(x, y, item, at, -0.2 * item.width)
        elif model not in (kinds.MODEL_POST, kinds.MODEL_RAIL) and (
            item.base == 0.0 or model == kinds.MODEL_DECK
        ):
            for ring in range(int(look.under_rings)):
                spread, dark = (0.3, 0.6) if kinds.is_figure(model) else (1.0, 1.0)
                grow = spread * (look.under_first + look.under_step * ring)
                grow = max(grow, -0.5 * min(item.length, item.width))
                shadow += dark * look.under_body * _footprint(x, y, item, at, grow)
    return paint, shadow


def _footprint(x, y, item, centre, grow):
    """Return 1.0 for points on an object's rectangle around `centre`, grown on all sides."""
    dx, dy = x - centre[0], y - centre[1]
    along, across = dx * item.cos + dy * item.sin, dy * item.cos - dx * item.sin
    reach = 0.5 * item.length + grow, 0.5 * item.width + grow
    return ((np.abs(along) <= reach[0]) & (np.abs(across) <= reach[1])).astype(float)


def ground_points(lens, v, u):
    """Return the ground at image points: distance ahead and across [m], slope, metres per direction."""
    u, v = u - lens.centre_u, v - lens.centre_v
    right, down = u * lens.cos_roll - v * lens.sin_roll, v * lens.cos_roll + u * lens.sin_roll
    fall = np.maximum(down * lens.cos_pitch - lens.focal * lens.sin_pitch, 1e-6)
    reach = lens.z / fall
    return reach * (lens.focal * lens.cos_pitch + down * lens.sin_pitch), reach * right, fall, reach


def middle_column(scene, row):
    """Return the column coordinate of the middle of the part of each row below the horizon."""
    columns = np.arange(0.0, scene.p.shape[1] + 0.01, 0.01)
    lens = scene.lens
    middles = {}
    for number in set(row.tolist()):
        below = columns[ground_points(lens, number + 0.5, columns)[2] > 1e-6]
        middles[number] = 0.5 * (below[0] + below[-1]) if len(below) else lens.centre_u
    return np.array([middles[number] for number in row.tolist()])


def texture_at(scene, kind, row, column):
    """Return a texture at the middle of pixels, in stored units, at the level of their footprint."""
    lens, texture = scene.lens, ground_texture(kind, scene.p.seed)
    forward, across, _, _ = ground_points(lens, row + 0.5, column + 0.5)
    x = lens.x + forward * lens.cos_yaw - across * lens.sin_yaw
    y = lens.y + forward * lens.sin_yaw + across * lens.cos_yaw
    # The level is that of the middle of the row, or of its part below the horizon.
    _, _, fall, reach = ground_points(lens, row + 0.5, middle_column(scene, row))
    long = reach * lens.focal / np.maximum(fall, 0.3)
    levels = []
    for parts, top in zip(((long, reach), (reach, long)), texture.level_start.shape, strict=True):
        square = (parts[0] * lens.cos_yaw) ** 2 + (parts[1] * lens.sin_yaw) ** 2
        level = np.ceil(np.log2(np.maximum(square / TEXEL_M**2, 1e-9) / 2.0) / 2.0)
        levels.append(np.clip(level, 0, top - 1).astype(int))
    out = np.zeros(len(x))
    for i, j in set(zip(*(level.tolist() for level in levels), strict=True)):
        chosen = (levels[0] == i) & (levels[1] == j)
        out[chosen] = _bilinear(texture, i, j, x[chosen], y[chosen])
    return out


def _bilinear(texture, i, j, x, y):
    """Return samples of one level at world points, minus the mean of 128."""
    long, wide = (
        1 << (size - 1 - level) for size, level in zip(texture.level_start.shape, (i, j), strict=True)
    )
    start = texture.level_start[i, j]
    texels = texture.data[start : start + long * (wide + 1)].reshape(long, wide + 1)[:, :wide].astype(float)
    x, y = x / (TEXEL_M * 2**i) - 0.5, y / (TEXEL_M * 2**j) - 0.5
    left, low = np.floor(x), np.floor(y)
    wx, wy = x - left, y - low
    a, c = (left % long).astype(int), (low % wide).astype(int)
    b, d = (a + 1) % long, (c + 1) % wide
    near = texels[a, c] + wy * (texels[a, d] - texels[a, c])
    far = texels[b, c] + wy * (texels[b, d] - texels[b, c])
    return near + wx * (far - near) - 128.0


def _through_air(scene, grey, row, column):
    """Return greys of the ground under headlights and fog, at the distance of each pixel's row."""
    lens, look = scene.lens, scene.look
    forward = np.minimum(ground_points(lens, row + 0.5, middle_column(scene, row))[0], 1e5)
    if look.night:
        tangent = (column + 0.5 - lens.centre_u) / lens.focal
        grey = grey * (look.night_light + beam(look, np.maximum(forward, 0.0), tangent))
    grey = look.haze + np.exp(-np.abs(forward) * look.extinction) * (grey - look.haze)
    return grey + veil(scene, column, lens.z / np.maximum(forward, 1e-3), forward)


def inside(x, y, corners):
    """Return whether points are inside a polygon, by the number of its edges to their right."""
    odd = np.zeros(x.shape, dtype=bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y0 != y1:
            crosses = (y0 > y) != (y1 > y)
            odd ^= crosses & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return odd
