"""The low beam and the light that fog scatters back from it, for the reference camera."""

import numpy as np

_POINTS = 4000


def beam(look, ahead, tangent):
    """Return the light of the headlights at points, as a share of daylight.

    Args:
        look: Appearance of the world.
        ahead: Distance ahead of the lens, not below 0 [m].
        tangent: Distance to the side per metre ahead.
    """
    return np.exp(-ahead / look.beam_reach - look.extinction * ahead - (tangent / 0.26) ** 2) * look.beam_gain


def veil(scene, column, slope, away):
    """Return the light that fog scatters back in front of pixels, by sampling the rays.

    Points are dense where the light is strong: they divide the light of a ray in full beam evenly.

    Args:
        scene: `ReferenceCamera`.
        column: Column of each pixel.
        slope: Fall of each ray per metre ahead.
        away: Distance of what is in each pixel [m].
    """
    lens, look = scene.lens, scene.look
    if not (look.night and look.extinction):
        return np.zeros(column.shape)
    start, rate = max(scene.p.setback_m, 0.0), 2.0 * look.extinction + 1.0 / look.beam_reach
    slope, away = np.broadcast_to(slope, column.shape), np.broadcast_to(away, column.shape)
    remaining = np.exp(-rate * np.maximum(away - start, 0.0))[:, None]
    shares = remaining + (1.0 - remaining) * (np.arange(_POINTS) + 0.5) / _POINTS
    ahead = start - np.log(shares) / rate
    # Full light below the cut-off, which starts at the height of the lamps and falls by 1 %.
    lit = lens.z - slope[:, None] * ahead < 0.65 - 0.01 * ahead
    mean = np.mean(np.where(lit, 1.0, look.beam_stray), axis=1)
    whole = look.extinction / rate * np.exp(-rate * start) * (1.0 - remaining[:, 0])
    # Fog that lets no light through reflects π/18.5 of it, as a surface of the grey 105 does.
    side = np.exp(-(((column + 0.5 - lens.centre_u) / lens.focal / 0.26) ** 2))
    return 105.0 * look.beam_gain * side * whole * mean


def row_slope(lens, row):
    """Return the fall per metre ahead of the rays through the middle of rows."""
    down = (row + 0.5 - lens.centre_v) * lens.cos_roll
    ahead = lens.focal * lens.cos_pitch + down * lens.sin_pitch
    return (down * lens.cos_pitch - lens.focal * lens.sin_pitch) / np.maximum(ahead, 1e-3 * lens.focal)
