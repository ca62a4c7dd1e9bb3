"""Kernels of the light between the world and the lens: headlights and fog."""

import math
from typing import NamedTuple

import numba as nb

from lgmd_gym.camera.effects import BEAM_WIDTH
from lgmd_gym.camera.render.jit import kernel
from lgmd_gym.simd import load_part, madd, splat

_BEAM_REACH = 26.0  # the low beam falls to 1/e over this distance [m]
_BEAM_GAIN, _NIGHT_LIGHT = 1.25, 0.04


@kernel
def light_at(ahead, across, night):
    """Return the light at a point `ahead` and `across` of the lens [m]: 1 by day, the low beam at night."""
    if night == 0.0:
        return 1.0
    tan = across / max(ahead, 1.0)
    beam = math.exp(-max(ahead, 0.0) / _BEAM_REACH - (tan / BEAM_WIDTH) ** 2)
    return _NIGHT_LIGHT + _BEAM_GAIN * beam


class RowAir(NamedTuple):
    """Headlights (if `night`) and fog (if `foggy`) on a row of ground.

    The light grows by `gain` times the low beam; the fog leaves the share `clear` of the contrast to `haze`.
    """

    night: bool
    gain: float
    foggy: bool
    clear: float
    haze: float


@kernel
def row_air(look, ahead):
    """Return the `RowAir` of ground at the distance `ahead` [m], below 0 behind a lens that points down."""
    night, foggy = look.night > 0.0, look.extinction > 0.0
    gain = _BEAM_GAIN * math.exp(-max(ahead, 0.0) / _BEAM_REACH) if night else 0.0
    clear = math.exp(-abs(ahead) * look.extinction) if foggy else 1.0
    return RowAir(night, gain, foggy, clear, look.haze)


@kernel
def through_air(grey, air, beam, column):
    """Return sixteen pixels of ground, from a column, under headlights and fog; see `Views.beams`."""
    if air.night:
        fall_off = load_part(beam, column, beam.shape[0] - column)
        grey = grey * madd(splat(nb.float32(air.gain)), fall_off, splat(nb.float32(_NIGHT_LIGHT)))
    if air.foggy:
        haze = splat(nb.float32(air.haze))
        grey = madd(splat(nb.float32(air.clear)), grey - haze, haze)
    return grey
