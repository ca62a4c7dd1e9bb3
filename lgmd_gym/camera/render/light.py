# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Light and air: weather, headlights, fog, the veil of scattered light, and glare.

A ray of the camera meets droplets in the headlights. Droplets at the distance x scatter their share of it
back, and the fog weakens the light on both ways, so that the veil in front of a thing at the distance b is

    veil · F · ∫ σ · exp(-x / reach - 2 σ x) dx, over the lit part of 0 ≤ x ≤ b,

with the extinction σ and the beam of `light_at`: F is its fall-off across, which is the same along a ray. The
integral has a closed form. The low beam starts at the headlights and ends at its cut-off, above which it has
a small share of its light; the upper beam has no cut-off.

Approximations: light is scattered once only, in the same share at all angles near 180°, paths are as long as
their distance ahead, and both headlights are one below the lens. All pixels of an object have its distance.
"""

import math
from typing import NamedTuple

import numba as nb

from lgmd_gym.camera.effects import BEAM_WIDTH
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import LANES, load_part, madd, splat, store_part

_LAMP_HEIGHT = 0.65  # of the headlights above the ground [m]
_CUT_OFF = 0.01  # the cut-off falls by this much per metre (UN R48: 1 % for headlights below 0.8 m)
_FAR = 1e9  # distance of the sky [m]


@kernel
def veil_at(look, height, slope, away):
    """Return the light of the veil straight ahead, without the beam's fall-off across.

    Args:
        look: Extinction, light of the veil, and place of the headlights.
        height: Height of the lens above the ground [m].
        slope: Fall of the ray per metre ahead; below 0 upwards.
        away: Distance ahead of what the ray meets [m].
    """
    rate, start = 2.0 * look.extinction + 1.0 / look.beam_reach, look.lamps_ahead
    end, fall = max(away, start), slope - _CUT_OFF
    # Where the ray crosses the cut-off: into the beam if it falls faster, else out of it.
    crossing = (height - _LAMP_HEIGHT) / (fall if fall != 0.0 else -1e-9)
    first = min(max(crossing, start), end) if fall > 0.0 else start
    last = end if fall > 0.0 else min(max(crossing, start), end)
    lit = math.exp(-rate * first) - math.exp(-rate * last)
    every = math.exp(-rate * start) - math.exp(-rate * end)
    return look.veil * look.extinction / rate * (lit + look.beam_stray * (every - lit))


@kernel
def row_slope(lens, row):
    """Return the fall per metre ahead of the ray through the middle of an image row; below 0 upwards."""
    down = (row + 0.5 - lens.centre_v) * lens.cos_roll
    ahead = lens.focal * lens.cos_pitch + down * lens.sin_pitch
    return (down * lens.cos_pitch - lens.focal * lens.sin_pitch) / max(ahead, 1e-3 * lens.focal)


@kernel
def add_sky_veil(image, view, rows):
    """Add the veil in front of the sky to the first rows of an image."""
    width = image.shape[1]
    for i in range(rows):
        veil = veil_at(view.look, view.lens.z, row_slope(view.lens, i), _FAR)
        light = splat(nb.float32(veil))
        for j in range(0, width, LANES):
            at, count = i * width + j, width - j
            fall_off = load_part(view.beam, j, count)
            store_part(image, at, count, madd(light, fall_off, load_part(image, at, count)))


@kernel
def aim_beam(beam, lens):
    """Write the fall-off of the headlights over the columns of a lens that is turned relative to the car.

    Args:
        beam: Fall-off to write, float32, shape (width,); see `Views.beams`.
        lens: `LENS` record.
    """
    turn = math.tan(lens.turn)
    for j in range(beam.shape[0]):
        tan = (j + 0.5 - lens.centre_u) / lens.focal
        ahead = 1.0 - tan * turn  # cosine of the direction relative to the car, up to a factor
        across = (tan + turn) / ahead
        beam[j] = nb.float32(math.exp(-((across / BEAM_WIDTH) ** 2)) if ahead > 1e-3 else 0.0)


@kernel
def light_at(ahead, across, look):
    """Return the light at a point `ahead` and `across` of the lens [m]: 1 by day, the headlights at night.

    Fog takes its share of the beam on the way to the point, too.
    """
    if look.night == 0.0:
        return 1.0
    tan, way = across / max(ahead, 1.0), max(ahead, 0.0)
    beam = math.exp(-way / look.beam_reach - way * look.extinction - (tan / BEAM_WIDTH) ** 2)
    return look.night_light + look.beam_gain * beam


class RowAir(NamedTuple):
    """Headlights (if `night`), reflections (if `wet`) and fog (if `foggy`) on a row of ground.

    The light is `dark` plus `gain` times the headlights; the share `gloss` of it is replaced by `mirrored`;
    the fog leaves the share `clear` of the contrast to `haze`; `veil` times the fall-off of the headlights is
    the light that it scatters back.
    """

    night: bool
    dark: float
    gain: float
    wet: bool
    gloss: float
    mirrored: float
    foggy: bool
    clear: float
    haze: float
    veil: float


@kernel
def row_air(look, ahead, height):
    """Return the `RowAir` of ground at the distance `ahead` of a lens of this height [m].

    The distance is below 0 behind a lens that points down.
    """
    night, foggy = look.night > 0.0, look.extinction > 0.0
    way = max(ahead, 0.0)
    gain = look.beam_gain * math.exp(-way / look.beam_reach - way * look.extinction) if night else 0.0
    clear = math.exp(-abs(ahead) * look.extinction) if foggy else 1.0
    # A rough wet surface reflects the sky as water does, by Schlick's approximation, and half of the water
    # stands on it: at 20 m from a lens 1.2 m high a quarter of the light.
    grazing = 1.0 - height / math.sqrt(height * height + ahead * ahead)
    gloss = 0.5 * (0.02 + 0.98 * grazing**5) if look.wet > 0.0 else 0.0
    veil = veil_at(look, height, height / max(ahead, 1e-3), way) if look.veil > 0.0 else 0.0
    wet, mirrored = look.wet > 0.0, look.horizon
    return RowAir(
        night=night,
        dark=look.night_light,
        gain=gain,
        wet=wet,
        gloss=gloss,
        mirrored=mirrored,
        foggy=foggy,
        clear=clear,
        haze=look.haze,
        veil=veil,
    )


@kernel
def through_air(grey, air, beam, column):
    """Return sixteen pixels of ground, from a column, under headlights and fog; see `Views.beams`."""
    if air.night:
        fall_off = load_part(beam, column, beam.shape[0] - column)
        grey = grey * madd(splat(nb.float32(air.gain)), fall_off, splat(nb.float32(air.dark)))
    if air.wet:
        grey = madd(splat(nb.float32(air.gloss)), splat(nb.float32(air.mirrored)) - grey, grey)
    if air.foggy:
        haze = splat(nb.float32(air.haze))
        grey = madd(splat(nb.float32(air.clear)), grey - haze, haze)
        if air.veil > 0.0:
            fall_off = load_part(beam, column, beam.shape[0] - column)
            grey = madd(splat(nb.float32(air.veil)), fall_off, grey)
    return grey


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
