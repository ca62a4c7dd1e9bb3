"""Numeric parameters of light, weather and sensor noise for the kernels."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from lgmd_gym.camera.params import MAX_WIDTH, CameraParams
from lgmd_gym.camera.worlds import World, draw_world

LOOK = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("asphalt", "asphalt_gain", "verge", "verge_gain", "paint", "line_width", "dash", "dash_period"),
            *("zenith", "horizon", "hills", "trees", "leaf_gain", "hill_scale", "tree_scale"),
            *("sun_x", "sun_y", "sun_z", "ambient", "direct", "cast", "glare"),
            *("under_body", "under_lean", "under_first", "under_step", "under_rings", "under_box"),
            *("under_road", "shadow_limit"),
            *("haze", "extinction", "night", "night_light", "beam_gain", "wet", "paved"),
            *("beam_reach", "beam_stray"),
            *("shot_noise", "read_noise", "shutter_s"),
            *("linear", "auto_exposure_s", "target_grey", "least_gain", "most_gain"),
            *("veil", "lamps_ahead"),
            *("contrast", "contrast_s"),
        )
    ]
)
"""Appearance of the world for one camera, as the kernels read it.

Light (`…_gain`: per stored unit of a texture or skyline); width of markings, length and period of dashes [m];
scale of the skyline's elevations; direction of the sun; light on a face from the sky, and from the sun where
it is at right angles, as shares of the light on the road; share of light that a cast shadow removes; glare
in the direction of the sun; the soft shadow below an object, see `shadows.add_shadow`; light of the road
below a vehicle, 0 in the laboratory; light of the fog and extinction of the air [1/m]; 1.0 for night; light
at night apart from the headlights, and their peak; 1.0 for a wet and for an all-paved ground; distance over
which the headlights fall to 1/e [m], and their share above the cut-off; sensor noise [grey levels]; exposure
time [s]; 1.0 for linear light; time constant [s], target [grey levels] and bounds of the gain of the
automatic exposure; light of fog in the headlights, see `veil_at`, 0 by day and in clear air; distance of the
own headlights ahead of the lens [m]; slope of the tone curve at the target grey; time constant of the control
of the contrast, 0 for none [s].
"""
ASPHALT_GREY, PAINT_GREY = 104.0, 208.0  # of the laboratory by day
BEAM_WIDTH = 0.26  # the headlights fall to 1/e at this tangent of the angle from straight ahead
# Distance over which the headlights fall to 1/e [m], and their share above the cut-off. UN R112 allows 625 cd
# above that of the low beam and demands 12,500 cd below. The upper beam has no cut-off and four times the
# light of the low beam at 50 m, an assumption.
LOW_BEAM, UPPER_BEAM = (26.0, 0.05), (90.0, 1.0)
WHITE = 255.0  # grey level and light
SHOT_NOISE, READ_NOISE = 1.2, 0.8
"""Usual noise of the sensor in numbered worlds, see `CameraParams`."""
_GLARE = 700.0  # light that is scattered in the direction of a low sun
_WET_ASPHALT, _WET_VERGE, _WET_PAINT = 0.78, 0.85, 0.9  # grey of a wet surface over that of a dry one
# Glass beads return headlights: a marking has at least 100 mcd/(m² lx) (EN 1436), asphalt 10 to 20. By day
# the marking has two to four times the light of the asphalt.
_RETRO_REFLECTION = 1.8
# Droplets of fog scatter 1/18.5 of the light that they remove per steradian backwards (the extinction-to-
# backscatter ratio of water clouds, 18 to 19 sr), a white surface 1/π: fog is as light as a surface that
# reflects π/18.5 = 17 %, which has this grey.
_FOG_GREY = 105.0
_LABORATORY_SUN = (-0.48, 0.36, 0.80)
_TEXTURE_GAIN = 1.0 / 36.0  # textures store 36 per standard deviation
NOISE_LOG2 = 17
"""Binary logarithm of the number of different numbers in the noise table."""


def in_world(p: CameraParams) -> CameraParams:
    """Return a camera with the sensor of its world: linear light, noise and automatic exposure.

    The noise replaces that of `p`, also that of a condition: at night it grows with the gain of the exposure.
    """
    world = draw_world(p.world)
    if not world.drawn:
        return p
    return replace(
        p,
        linear_light=True,
        auto_exposure_s=p.auto_exposure_s or world.exposure_s,
        shot_noise=SHOT_NOISE * world.noise,
        read_noise=READ_NOISE * world.noise,
    )


def look_of(p: CameraParams) -> np.ndarray:
    """Return the appearance of the world for a camera, a `LOOK` record of shape ()."""
    look, world = np.zeros((), LOOK), draw_world(p.world)
    look["asphalt"] = to_light(p, _wet(p, world.asphalt_grey, _WET_ASPHALT))
    look["verge"] = to_light(p, _wet(p, world.verge_grey, _WET_VERGE))
    look["paint"] = to_light(p, _wet(p, world.paint_grey, _WET_PAINT))
    if world.drawn and p.light == "night" and not p.wet:
        look["paint"] *= _RETRO_REFLECTION
    for name, gain in texture_gains(p, p.texture).items():
        look[name] = gain
    look["line_width"], (look["dash"], look["dash_period"]) = world.line_width, world.dash
    _set_sky(look, p, world)
    _set_sun(look, p, world)
    _set_sensor(look, p)
    look["night"], look["wet"] = float(p.light == "night"), float(p.wet)
    look["night_light"], look["beam_gain"] = world.street_light, world.beam
    look["beam_reach"], look["beam_stray"] = UPPER_BEAM if p.upper_beam else LOW_BEAM
    if p.visibility_m > 0.0:
        # Koschmieder: 5 % of the contrast remains at the visibility.
        look["extinction"] = math.log(20.0) / p.visibility_m
        remaining, haze = far_transmission(p), look["haze"]
        for name in ("zenith", "horizon", "hills", "trees"):
            look[name] = haze + remaining * (look[name] - haze)
        look["leaf_gain"] *= remaining
        if p.light == "night":
            look["veil"] = to_light(p, _FOG_GREY) * world.beam
            look["lamps_ahead"] = max(p.mount_setback, 0.0)
    return look


def to_light(p: CameraParams, grey: float) -> float:
    """Return the light of a display-coded grey level; both are 255 for white."""
    return grey * grey / WHITE if p.linear_light else grey


def _slope(p: CameraParams, grey: float) -> float:
    """Return the change of light per grey level at a display-coded grey level."""
    return 2.0 * grey / WHITE if p.linear_light else 1.0


def texture_gains(p: CameraParams, texture: float) -> dict[str, float]:
    """Return the fields of `LOOK` that the contrast of asphalt and verge determines.

    Args:
        p: Parameters of the camera.
        texture: Contrast, in place of that of `p`.
    """
    world = draw_world(p.world)
    asphalt, verge = _wet(p, world.asphalt_grey, _WET_ASPHALT), _wet(p, world.verge_grey, _WET_VERGE)
    return {
        "asphalt_gain": 9.0 * texture * world.asphalt_contrast * _TEXTURE_GAIN * _slope(p, asphalt),
        "verge_gain": 16.0 * texture * world.verge_contrast * _TEXTURE_GAIN * _slope(p, verge),
    }


def _set_sensor(look: np.ndarray, p: CameraParams) -> None:
    """Set noise and exposure."""
    night = p.light == "night"
    look["shot_noise"], look["read_noise"] = p.shot_noise, p.read_noise
    look["shutter_s"] = p.shutter_s
    look["linear"], look["auto_exposure_s"] = float(p.linear_light), p.auto_exposure_s
    world = draw_world(p.world)
    look["target_grey"] = (world.night_exposure if night else 1.0) * world.exposure_grey
    look["contrast"], look["contrast_s"] = world.contrast, p.contrast_s
    look["least_gain"], look["most_gain"] = (0.5, 6.0) if night else (0.25, 8.0)


def _wet(p: CameraParams, grey: float, darkening: float) -> float:
    """Return the grey of a surface, multiplied by `darkening` if it is wet."""
    return grey * darkening if p.wet else grey


def _set_sky(look: np.ndarray, p: CameraParams, world: World) -> None:
    """Set the light of sky, skyline and fog."""
    greys = (*world.greys, world.leaf_contrast)
    if p.light == "night":
        # In numbered worlds street lamps light the sky.
        glow = math.sqrt(world.street_light / 0.04) if world.drawn else 1.0
        greys = tuple(glow * grey for grey in (6.0, 14.0, 7.0, 4.0, 1.0))
    names = ("zenith", "horizon", "hills", "trees")
    for name, grey in zip(names, greys, strict=False):
        look[name] = to_light(p, grey)
    look["leaf_gain"] = greys[4] * _slope(p, greys[3])
    look["hill_scale"], look["tree_scale"] = world.hill_scale, world.tree_scale
    look["haze"] = to_light(p, haze_grey(p))


def _set_sun(look: np.ndarray, p: CameraParams, world: World) -> None:
    """Set the direction of the sun, the light on faces, and shadows."""
    if not world.drawn:
        look["sun_x"], look["sun_y"], look["sun_z"] = _LABORATORY_SUN
        look["ambient"], look["direct"] = 0.62, 0.42
        # Three rings of 0.22 around a shadow that leans away from the sun.
        values = (0.22, -0.12 / _LABORATORY_SUN[2], -0.08, 0.16, 3.0, 1.0, 0.75)
    else:
        azimuth, elevation, share = sun_of(p, world)
        level = math.cos(elevation)
        look["sun_x"], look["sun_y"] = level * math.cos(azimuth), level * math.sin(azimuth)
        look["sun_z"] = math.sin(elevation)
        # A vertical face receives light from half of the sky and from the ground.
        look["ambient"], look["direct"] = 0.12 + 0.55 * (1.0 - share), share / math.sin(elevation)
        look["cast"], look["glare"] = share, _GLARE if p.light == "low_sun" and share > 0.0 else 0.0
        # From 0.1 m inside the outline of a car to 0.5 m outside it; a box has a shadow at its edges only.
        rings, missing = 7, world.under_body * (0.6 if p.light == "night" else 1.0)
        values = (missing / rings, 0.0, -0.1, 0.1, rings, 0.2, 0.95)
        look["under_road"] = look["asphalt"] * (1.0 - missing)
    names = (
        *("under_body", "under_lean", "under_first", "under_step", "under_rings", "under_box"),
        "shadow_limit",
    )
    for name, value in zip(names, values, strict=True):
        look[name] = value


def sun_of(p: CameraParams, world: World) -> tuple[float, float, float]:
    """Return azimuth and elevation of the sun [rad], and its share of the light on the road."""
    azimuth, elevation, share = world.sun_azimuth_deg, world.sun_elevation_deg, world.sun_share
    if p.light == "night" or p.wet or p.visibility_m > 0.0:
        share = 0.0
    elif p.light == "low_sun":
        # Within 25° of +x, where roads lead, 4° to 12° above the horizon.
        azimuth = 25.0 * (azimuth / 180.0 - 1.0)
        elevation = 4.0 + 8.0 * (elevation - 18.0) / 44.0
        share = 0.6
    return math.radians(azimuth), math.radians(elevation), share


def haze_grey(p: CameraParams) -> float:
    """Return the grey level of the fog."""
    return 18.0 if p.light == "night" else 200.0


def far_transmission(p: CameraParams) -> float:
    """Return the share of the contrast of sky and skyline that remains behind 500 m of fog."""
    return math.exp(-500.0 * math.log(20.0) / p.visibility_m)


def beam_profile(p: CameraParams) -> np.ndarray:
    """Return the headlights' fall-off over the columns of a frame; float32, shape (width,)."""
    width = p.shape[1]
    tan = (np.arange(width) + 0.5 - 0.5 * width) / p.focal_px
    return np.exp(-((tan / BEAM_WIDTH) ** 2)).astype(np.float32)


@lru_cache(maxsize=4)
def noise_table(seed: int) -> np.ndarray:
    """Return 2^`NOISE_LOG2` standard normal numbers and the first ones again, float32.

    The repeated ones let a row of a frame begin at any of the numbers.
    """
    numbers = np.random.default_rng([seed, 5]).standard_normal(1 << NOISE_LOG2, dtype=np.float32)
    return np.concatenate((numbers, numbers[: MAX_WIDTH + 16]))
