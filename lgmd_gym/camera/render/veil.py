"""Kernels of the veil: light of the own headlights that fog scatters back into the lens at night.

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

import numba as nb

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
