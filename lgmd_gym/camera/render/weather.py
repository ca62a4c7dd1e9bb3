"""Kernels of the light between the world and the lens: headlights and fog."""

import math

import numba as nb

from lgmd_gym.camera.effects import BEAM_WIDTH
from lgmd_gym.camera.render.jit import kernel

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


@kernel
def apply_weather(grey, ahead, look, beam):
    """Apply headlights and fog to a row of ground at the distance `ahead` [m], in place."""
    if look.night > 0.0:
        gain = nb.float32(_BEAM_GAIN * math.exp(-ahead / _BEAM_REACH))
        rest = nb.float32(_NIGHT_LIGHT)
        for j in range(grey.shape[0]):
            grey[j] *= rest + gain * beam[j]
    if look.extinction > 0.0:
        clear = nb.float32(math.exp(-ahead * look.extinction))
        haze = nb.float32(look.haze)
        for j in range(grey.shape[0]):
            grey[j] = haze + clear * (grey[j] - haze)
