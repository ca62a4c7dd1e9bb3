"""Kernels of the light between the world and the lens: headlights and fog."""

import math
from typing import NamedTuple

import numba as nb

from lgmd_gym.camera.effects import BEAM_WIDTH
from lgmd_gym.camera.render.veil import veil_at
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import load_part, madd, splat


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
    return RowAir(night, look.night_light, gain, wet, gloss, mirrored, foggy, clear, look.haze, veil)


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
