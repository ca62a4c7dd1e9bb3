"""Numeric parameters of light, weather and sensor noise for the kernels."""

import math
from functools import lru_cache

import numpy as np

from lgmd_gym.camera.params import CameraParams

LOOK = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("asphalt", "asphalt_gain", "verge", "verge_gain", "paint"),
            *("zenith", "horizon", "hills", "trees", "leaf_gain"),
            *("haze", "extinction", "night", "paved", "shot_noise", "read_noise", "shutter_s"),
        )
    ]
)
"""Appearance of the world for one camera, as the kernels read it.

Grey levels (`…_gain`: per stored unit of a texture or skyline), extinction of the air [1/m], 1.0 for night
and for an all-paved ground, sensor noise [grey levels], exposure time [s].
"""
ASPHALT_GREY, PAINT_GREY = 104.0, 208.0  # by day
BEAM_WIDTH = 0.26  # the low beam falls to 1/e at this tangent of the angle from straight ahead
_TEXTURE_GAIN = 1.0 / 36.0  # textures store 36 per standard deviation
NOISE_LOG2 = 17
"""Binary logarithm of the length of the noise table."""


def look_of(p: CameraParams) -> np.ndarray:
    """Return the appearance of the world for a camera, a `LOOK` record of shape ()."""
    look = np.zeros((), LOOK)
    look["asphalt"], look["verge"], look["paint"] = ASPHALT_GREY, 76.0, PAINT_GREY
    for name, gain in texture_gains(p.texture).items():
        look[name] = gain
    night = p.light == "night"
    sky = (6.0, 14.0, 7.0, 4.0, 1.0) if night else (172.0, 214.0, 128.0, 78.0, 12.0)
    for name, grey in zip(("zenith", "horizon", "hills", "trees", "leaf_gain"), sky, strict=True):
        look[name] = grey
    look["haze"], look["night"] = haze_grey(p), float(night)
    if p.visibility_m > 0.0:
        # Koschmieder: 5 % of the contrast remains at the visibility.
        look["extinction"] = math.log(20.0) / p.visibility_m
        remaining, haze = far_transmission(p), look["haze"]
        for name in ("zenith", "horizon", "hills", "trees"):
            look[name] = haze + remaining * (look[name] - haze)
        look["leaf_gain"] *= remaining
    look["shot_noise"], look["read_noise"] = p.shot_noise, p.read_noise
    look["shutter_s"] = p.shutter_s
    return look


def texture_gains(texture: float) -> dict[str, float]:
    """Return the fields of `LOOK` that the contrast of asphalt and verge determines."""
    return {
        "asphalt_gain": 9.0 * texture * _TEXTURE_GAIN,
        "verge_gain": 16.0 * texture * _TEXTURE_GAIN,
    }


def haze_grey(p: CameraParams) -> float:
    """Return the grey level of the fog."""
    return 18.0 if p.light == "night" else 200.0


def far_transmission(p: CameraParams) -> float:
    """Return the share of the contrast of sky and skyline that remains behind 500 m of fog."""
    return math.exp(-500.0 * math.log(20.0) / p.visibility_m)


def beam_profile(p: CameraParams) -> np.ndarray:
    """Return the low beam's fall-off over the columns of a frame; float32, shape (width,)."""
    width = p.shape[1]
    tan = (np.arange(width) + 0.5 - 0.5 * width) / p.focal_px
    return np.exp(-((tan / BEAM_WIDTH) ** 2)).astype(np.float32)


@lru_cache(maxsize=4)
def noise_table(seed: int) -> np.ndarray:
    """Return standard normal numbers, float32, shape (131072,)."""
    return np.random.default_rng([seed, 5]).standard_normal(1 << NOISE_LOG2, dtype=np.float32)
