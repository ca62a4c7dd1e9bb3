"""Kernels of glare: halos around the headlights of oncoming cars and street lamps at night."""

import math

import numba as nb

from lgmd_gym.kernels import kernel

BUDGET_PX = 3000.0
"""Approximate maximum area of all halos of a frame [px]."""
_RADIUS = 0.03  # radius of a halo, 1.7°, from scatter in the lens [rad]
_PEAK = 200.0  # grey added at the centre by a lamp nearer than _FULL
_LAMP_PEAK = 60.0  # the same of a street lamp, which shines downwards for the most part
_FULL = 50.0  # [m]
_SUN_RADIUS = 0.05  # the glare of the sun halves at this angle from it [rad]


@kernel
def add_glare(image, lens, obj, lamps, clear, budget):
    """Add the halos of an object's headlights that face the lens, or of a street lamp.

    `lamps` is the row of `Models.lamps` of the object's model, `clear` the transmission of the air times the
    opacity of the object, and `budget` the remaining area for halos [px]. Returns the budget after these
    halos.
    """
    if lamps[1] == 0.0 or budget <= 0.0:
        return budget
    c, s = obj.cos, obj.sin
    up = lamps[1] * obj.height
    around = lamps[0] == 0.0
    for k in range(2 if lamps[0] > 0.0 else 1):
        side = max(lamps[0], 0.0) * (1.0 if k == 1 else -1.0)
        x = obj.x + 0.5 * obj.length * c - side * obj.width * s - lens.x
        y = obj.y + 0.5 * obj.length * s + side * obj.width * c - lens.y
        away = math.sqrt(x * x + y * y)
        # Full within 30° of the direction to the lens, zero beyond 60°.
        facing = 1.0 if around else min((-(x * c + y * s) / max(away, 0.1) - 0.5) / 0.366, 1.0)
        ahead = x * lens.cos_yaw + y * lens.sin_yaw
        z = up - lens.z
        depth = ahead * lens.cos_pitch + z * lens.sin_pitch
        if not (facing > 0.0 and depth > 1.0):
            continue
        f = lens.focal
        right, down = y * lens.cos_yaw - x * lens.sin_yaw, ahead * lens.sin_pitch - z * lens.cos_pitch
        u = lens.centre_u + f * (right * lens.cos_roll + down * lens.sin_roll) / depth
        v = lens.centre_v + f * (down * lens.cos_roll - right * lens.sin_roll) / depth
        near = min(_FULL / away, 1.0)
        radius = max(f * _RADIUS * math.sqrt(near), 1.5)
        radius = min(radius, math.sqrt(max(budget, 0.0) / math.pi), 24.0)
        peak = _LAMP_PEAK if around else _PEAK
        budget -= _add_halo(image, u, v, radius, peak * facing * near * clear)
    return budget


@kernel
def add_sun_glare(image, lens, look):
    """Add the light of a low sun that scatters in lens and windscreen: a wide halo around its direction."""
    level = look.sun_x * lens.cos_yaw + look.sun_y * lens.sin_yaw
    depth = level * lens.cos_pitch + look.sun_z * lens.sin_pitch
    if not depth > 0.1:
        return
    f, height, width = lens.focal, image.shape[0], image.shape[1]
    right = (look.sun_y * lens.cos_yaw - look.sun_x * lens.sin_yaw) / depth
    down = (level * lens.sin_pitch - look.sun_z * lens.cos_pitch) / depth
    u = lens.centre_u + f * (right * lens.cos_roll + down * lens.sin_roll)
    v = lens.centre_v + f * (down * lens.cos_roll - right * lens.sin_roll)
    scale, peak = nb.float32(1.0 / (f * _SUN_RADIUS) ** 2), nb.float32(look.glare)
    for i in range(height):
        dy = nb.float32(i + 0.5 - v)
        for j in range(width):
            dx = nb.float32(j + 0.5 - u)
            image[i, j] += peak / (nb.float32(1.0) + scale * (dx * dx + dy * dy))


@kernel
def _add_halo(image, u, v, radius, peak):
    """Add a round, soft light; returns the area of its bounding box [px]."""
    height, width = image.shape
    if not (
        radius > 0.5 and u + radius > 0.0 and u - radius < width and v + radius > 0.0 and v - radius < height
    ):
        return 0.0
    i0, i1 = int(max(v - radius, 0.0)), int(min(v + radius + 1.0, float(height)))
    j0, j1 = int(max(u - radius, 0.0)), int(min(u + radius + 1.0, float(width)))
    scale = 1.0 / (radius * radius)
    for i in range(i0, i1):
        dy = i + 0.5 - v
        for j in range(j0, j1):
            dx = j + 0.5 - u
            rest = max(1.0 - scale * (dx * dx + dy * dy), 0.0)
            image[i, j] += nb.float32(peak * rest * rest * rest)
    return float((i1 - i0) * (j1 - j0))
