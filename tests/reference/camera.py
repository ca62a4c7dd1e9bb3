"""A slow reference of the camera: many rays per pixel, without culling, polygons' edges or kernels.

It leaves out motion blur, sensor noise, panoramas and the halos of headlights.
"""

import math
from types import SimpleNamespace

import numpy as np
from reference.air import row_slope, veil
from reference.ground import ground_light
from reference.solids import ordered_solids
from support.cameras import Rig, ego_camera

from lgmd_gym.camera import objects as kinds
from lgmd_gym.camera.effects import in_scene, look_of
from lgmd_gym.camera.render.coverage import NEAR
from lgmd_gym.camera.render.sky import skyline
from lgmd_gym.camera.road_geometry import road_geometry


class ReferenceCamera:
    """The light of a scene along rays.

    Args:
        camera: An `EgoCamera` that has rendered the scene; its lens is used.
        env: The environment.
    """

    def __init__(self, camera, env):
        p, lens = Rig(camera.camera, camera.scene), camera._lens
        self.p, self.lens = p, SimpleNamespace(**{name: float(lens[name]) for name in lens.dtype.names})
        self.look = SimpleNamespace(
            **{name: float(value) for name, value in _fields(look_of(in_scene(*p), p.scene))}
        )
        self.road = road_geometry(env.road, p.roadside, p.seed, p.guard_rail)
        roadside = [SimpleNamespace(**dict(_fields(record))) for record in self.road.roadside]
        everything = [*objects_of(env, p), *roadside]
        self.objects = [item for item in everything if self._drawn(item)]

    def light(self, row, column, side):
        """Return the light of pixels, shape (pixels,), and the range of what is in them [grey levels].

        Every coverage is a mean over `side` x `side` rays per pixel. Texture, fog and headlights are those
        of the middle of the pixel.

        Args:
            row: Row of each pixel, shape (pixels,).
            column: Column of each pixel.
            side: Square root of the number of rays.
        """
        rays = Rays(self.lens, row, column, side)
        light, gap = self._sky(rays, row, column)
        ground, contrast = ground_light(self, rays, row, column)
        below = rays.mean(rays.fall > 0.0)
        shares = [(1.0 - below, grey) for grey in (light, light + gap)]
        shares += [(below, grey) for grey in (ground, ground + contrast)]
        light = light + below * (ground - light)
        for share, grey, gap in ordered_solids(self, rays, row, column):
            light = light * (1.0 - share) + share * grey
            shares += [(share, grey), (share, grey + gap)]
        lows = [np.where(share > 0.0, grey, np.inf) for share, grey in shares]
        highs = [np.where(share > 0.0, grey, -np.inf) for share, grey in shares]
        return light, np.max(highs, axis=0) - np.min(lows, axis=0)

    def _drawn(self, item):
        """Return whether an object is in range, with the lens outside it."""
        dx, dy = item.x - self.lens.x, item.y - self.lens.y
        along, across = dx * item.cos + dy * item.sin, dy * item.cos - dx * item.sin
        inside = abs(along) < 0.5 * item.length and abs(across) < 0.5 * item.width
        solid = item.model != kinds.MODEL_MARK
        return math.hypot(dx, dy) <= item.range and not (
            solid and inside and item.base <= self.lens.z < item.height
        )

    def _sky(self, rays, row, column):
        """Return the light above the horizon in each pixel, and the contrast of sky, hills and trees."""
        lens, look = self.lens, self.look
        f, c, s = lens.focal, lens.cos_pitch, lens.sin_pitch
        _, down = upright(lens, row + 0.5, column + 0.5)
        elevation = np.maximum((f * s / c - down) / f, 0.0)
        # The skyline of a lens that rolls is sheared: its azimuth is that of the horizon in the column.
        tilt = (column + 0.5 - lens.centre_u) * lens.sin_roll
        right, _ = upright(lens, lens.centre_v + (f * s / c - tilt) / lens.cos_roll, column + 0.5)
        light = look.horizon + (look.zenith - look.horizon) * (1.0 - np.exp(-3.0 * elevation))
        hills, trees, leaves = skyline(self.p.seed)
        turn, away = lens.yaw + np.arctan2(right, f * c), np.hypot(f, right)
        leaf = look.trees + look.leaf_gain * _at_angle(leaves, turn)
        above, contrast = rays.fall <= 0.0, 0.0
        for line, grey in ((hills, look.hills), (trees, leaf)):
            tan = _at_angle(line, turn)
            top = f * (s * f - tan * c * away) / (c * f + tan * s * away)
            depth = np.clip((down - 0.5 - top) / (f * s / c - top + 1.0), 0.0, 1.0)
            cover = rays.mean((rays.direction[..., 2] > top[:, None]) & above)
            cover /= np.maximum(rays.mean(above), 1e-9)
            light = light + cover * (grey * (1.0 - 0.02 * look.leaf_gain * depth) - light)
            contrast = np.where((cover > 0.0) & (cover < 1.0), look.horizon - look.trees, contrast)
        return light + veil(self, column, row_slope(lens, row), 1e9), contrast


def upright(lens, v, u):
    """Return image coordinates (right, down) from the centre, as for a lens without roll [px]."""
    u, v = u - lens.centre_u, v - lens.centre_v
    return u * lens.cos_roll - v * lens.sin_roll, v * lens.cos_roll + u * lens.sin_roll


class Rays:
    """Rays through pixels.

    Attributes:
        v: Image coordinate, downwards, shape (pixels, rays) [px].
        direction: As (depth, right, down), shape (pixels, rays, 3).
        fall: Slope towards the ground, scaled; above 0 below the horizon.
        forward: Distance of the ground ahead of the lens [m].
        across: Distance of the ground to the right of the lens [m].
        shown: Whether polygons are drawn on the ground there: behind the near plane.
    """

    def __init__(self, lens, row, column, side):
        # Steps of the plastic number cover a square evenly, and resolve edges of any direction.
        number = np.arange(side * side)
        self.v = row[:, None] + (0.5 + 0.5698402909980532 * number) % 1.0
        right = column[:, None] + (0.5 + 0.7548776662466927 * number) % 1.0
        right, down = upright(lens, self.v, right)
        self.direction = np.stack((np.full_like(right, lens.focal), right, down), axis=-1)
        self.fall = down * lens.cos_pitch - lens.focal * lens.sin_pitch
        reach = lens.z / np.where(self.fall > 0.0, self.fall, np.inf)
        self.forward = reach * (lens.focal * lens.cos_pitch + down * lens.sin_pitch)
        self.across = reach * right
        self.shown = (self.fall > 0.0) & (reach * lens.focal >= NEAR)

    @staticmethod
    def mean(values):
        """Return the mean over the rays of each pixel."""
        return np.mean(values, axis=1)


def worst_error(params, env):
    """Return the largest difference between a camera's light and the reference, in units of the tolerance.

    The tolerance is one grey level and 4 % of the contrast in the pixel. Pixels that differ by more than half
    of it are measured again with more rays.
    """
    camera = ego_camera(params)
    camera.render(env)
    light, reference = camera.light.astype(float).ravel(), ReferenceCamera(camera, env)
    rows, columns = (places.ravel() for places in np.indices(params.shape))
    errors, chosen = np.zeros(len(light)), np.arange(len(light))
    for side in (3, 12, 40):
        expected, contrast = reference.light(rows[chosen], columns[chosen], side)
        errors[chosen] = np.abs(light[chosen] - expected) / (1.0 + 0.04 * contrast)
        chosen = np.flatnonzero(errors > 0.5)
    return errors.max()


def separate_objects(env, params):
    """Remove objects of a road that touch another, or the roadside: solids that intersect have no order."""
    roadside = road_geometry(env.road, params.roadside, params.seed, params.guard_rail).roadside
    kept = [(item["x"], item["y"], math.hypot(item["length"], item["width"])) for item in roadside]
    for group in (env.road.vehicles, env.road.objects):
        for item in [item for item in group if item is not env.vehicle]:
            x, y, size = *item.position, math.hypot(item.LENGTH, item.WIDTH)
            if any(math.hypot(x - a, y - b) < 0.5 * (size + other) + 0.05 for a, b, other in kept):
                group.remove(item)
            else:
                kept.append((x, y, size))


def separate_boxes(env):
    """Remove vehicles of a road that touch another, and the ego's place: exact for long boxes."""
    kept = [_outline(env.vehicle)]
    for car in [car for car in env.road.vehicles if car is not env.vehicle]:
        outline = _outline(car)
        if any(_apart(outline, other) <= 0.1 for other in kept):
            env.road.vehicles.remove(car)
        else:
            kept.append(outline)


def _outline(car):
    """Return the corners of a vehicle, shape (4, 2) [m]."""
    along, across = np.array([math.cos(car.heading), math.sin(car.heading)]), np.zeros(2)
    across[:] = -along[1], along[0]
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return np.array(
        [car.position + 0.5 * (a * car.LENGTH * along + b * car.WIDTH * across) for a, b in signs]
    )


def _apart(one, other):
    """Return the largest gap between two rectangles across one of their sides; below 0 if they overlap."""
    gaps = []
    for corners in (one, other):
        for side in (corners[1] - corners[0], corners[2] - corners[1]):
            a, b = one @ side, other @ side
            gaps.append(max(a.min() - b.max(), b.min() - a.max()) / np.linalg.norm(side))
    return max(gaps)


def objects_of(env, p):
    """Return the vehicles and objects of a road as they are drawn, except the ego."""
    return [
        _appearance(item, place, p)
        for group in (env.road.vehicles, env.road.objects)
        for place, item in enumerate(group)
        if item is not env.vehicle
    ]


def _appearance(item, place, p):
    """Return an object as it is drawn; vehicles without a shade get one by their place in the list."""
    named, height = kinds._default_appearance(type(item))
    model = named
    height, shade = getattr(item, "HEIGHT", height), getattr(item, "shade", None)
    if model == kinds.MODEL_CAR and (height > 2.2 or item.LENGTH > 7.5) and p.vehicles == "car":
        model, height = kinds.MODEL_TRUCK, max(height, 2.8)
    figures = {model: p.vehicles == "box" for model, _ in kinds.FIGURES.values()}
    plain = {**figures, kinds.MODEL_CAR: p.vehicles == "box", kinds.MODEL_BARRIER: shade is not None}
    if plain.get(model, False):
        model = kinds.MODEL_BOX
    if shade is None:
        turns = (0.29 + 0.6180339887498949 * place + 0.7548776662466927 * p.seed) % 1.0
        fixed = {kinds.MODEL_MARK: kinds.OUTLINE, kinds.MODEL_BARRIER: 185.0}
        fixed |= {model: 60.0 for model, _ in kinds.FIGURES.values()}
        shade = fixed.get(named, 30.0 + 195.0 * turns)
    return SimpleNamespace(
        x=float(item.position[0]),
        y=float(item.position[1]),
        cos=math.cos(item.heading),
        sin=math.sin(item.heading),
        length=item.LENGTH,
        width=item.WIDTH,
        height=height,
        shade=float(shade),
        braking=(getattr(item, "action", None) or {}).get("acceleration", 0.0) < -0.5,
        model=model,
        range=kinds.MAX_RANGE,
        base=0.0,
        speed=float(getattr(item, "speed", 0.0)),
        travelled=float(getattr(item, "travelled", 0.0)),
    )


def _fields(record):
    return [(name, record[name].item()) for name in record.dtype.names]


def _at_angle(profile, turn):
    """Return a profile over 360° at angles [rad], interpolated."""
    at = (turn / (2.0 * np.pi) * len(profile)) % len(profile)
    return np.interp(at, np.arange(len(profile) + 1), np.append(profile, profile[0]))
