"""Numeric parameters of light, weather and sensor noise for the kernels."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from lgmd_gym.camera.camera import MAX_WIDTH, Camera, ImageSensor, ToStoppingPoint
from lgmd_gym.camera.scene import SKYLINE, Scene, Weather
from lgmd_gym.camera.worlds import World, draw_world
from lgmd_gym.errors import shown

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
"""Usual noise of the sensor in numbered worlds, see `ImageSensor`."""
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


def in_scene(camera: Camera, scene: Scene) -> Camera:
    """Return a camera with the sensor and the height of the lens that a scene determines.

    In a world: linear light, noise and automatic exposure; the noise replaces that of camera and weather, as
    it grows with the gain of the exposure. In the laboratory: at least the noise of the weather.

    Raises:
        ValueError: If the scene has a panorama and the camera the gaze `ToStoppingPoint`, which zooms.
    """
    if scene.panorama != SKYLINE and isinstance(camera.gaze, ToStoppingPoint):
        raise ValueError(
            f"scene panorama must be {SKYLINE!r} with the gaze 'stopping' of camera {camera.name!r}, got "
            f"{shown(scene.panorama)}"
        )
    world, weather, sensor, mount = draw_world(scene.world), scene.weather, camera.sensor, camera.mount
    if world.drawn:
        sensor = replace(
            sensor,
            linear_light=True,
            auto_exposure_s=sensor.auto_exposure_s or world.exposure_s,
            shot_noise=SHOT_NOISE * world.noise,
            read_noise=READ_NOISE * world.noise,
        )
    elif weather.shot_noise > sensor.shot_noise or weather.read_noise > sensor.read_noise:
        sensor = replace(
            sensor,
            shot_noise=max(sensor.shot_noise, weather.shot_noise),
            read_noise=max(sensor.read_noise, weather.read_noise),
        )
    if scene.mount_height_m is not None:
        mount = replace(mount, height_m=scene.mount_height_m)
    if sensor is camera.sensor and mount is camera.mount:
        return camera
    return replace(camera, sensor=sensor, mount=mount)


def look_of(camera: Camera, scene: Scene) -> np.ndarray:
    """Return the appearance of the world for a camera in its scene, a `LOOK` record of shape ()."""
    look, world, weather = np.zeros((), LOOK), draw_world(scene.world), scene.weather
    linear, night = camera.sensor.linear_light, weather.light == "night"
    look["asphalt"] = to_light(_wet(weather, world.asphalt_grey, _WET_ASPHALT), linear)
    look["verge"] = to_light(_wet(weather, world.verge_grey, _WET_VERGE), linear)
    look["paint"] = to_light(_wet(weather, world.paint_grey, _WET_PAINT), linear)
    if world.drawn and night and not weather.wet:
        look["paint"] *= _RETRO_REFLECTION
    for name, gain in texture_gains(scene, linear).items():
        look[name] = gain
    look["line_width"], (look["dash"], look["dash_period"]) = world.line_width, world.dash
    _set_sky(look, weather, world, linear)
    _set_sun(look, weather, world)
    _set_sensor(look, camera.sensor, world, night)
    look["night"], look["wet"] = float(night), float(weather.wet)
    look["night_light"], look["beam_gain"] = world.street_light, world.beam
    look["beam_reach"], look["beam_stray"] = UPPER_BEAM if weather.upper_beam else LOW_BEAM
    if weather.visibility_m > 0.0:
        # Koschmieder: 5 % of the contrast remains at the visibility.
        look["extinction"] = math.log(20.0) / weather.visibility_m
        remaining, haze = far_transmission(weather), look["haze"]
        for name in ("zenith", "horizon", "hills", "trees"):
            look[name] = haze + remaining * (look[name] - haze)
        look["leaf_gain"] *= remaining
        if night:
            look["veil"] = to_light(_FOG_GREY, linear) * world.beam
            look["lamps_ahead"] = max(camera.mount.setback_m, 0.0)
    return look


def to_light(grey: float, linear: bool) -> float:
    """Return the light of a display-coded grey level; both are 255 for white."""
    return grey * grey / WHITE if linear else grey


def _slope(grey: float, linear: bool) -> float:
    """Return the change of light per grey level at a display-coded grey level."""
    return 2.0 * grey / WHITE if linear else 1.0


def texture_gains(scene: Scene, linear: bool) -> dict[str, float]:
    """Return the fields of `LOOK` that the contrast of asphalt and verge determines."""
    world, texture = draw_world(scene.world), scene.texture
    asphalt = _wet(scene.weather, world.asphalt_grey, _WET_ASPHALT)
    verge = _wet(scene.weather, world.verge_grey, _WET_VERGE)
    return {
        "asphalt_gain": 9.0 * texture * world.asphalt_contrast * _TEXTURE_GAIN * _slope(asphalt, linear),
        "verge_gain": 16.0 * texture * world.verge_contrast * _TEXTURE_GAIN * _slope(verge, linear),
    }


def _set_sensor(look: np.ndarray, sensor: ImageSensor, world: World, night: bool) -> None:
    """Set noise and exposure."""
    look["shot_noise"], look["read_noise"] = sensor.shot_noise, sensor.read_noise
    look["shutter_s"] = sensor.shutter_s
    look["linear"], look["auto_exposure_s"] = float(sensor.linear_light), sensor.auto_exposure_s
    look["target_grey"] = (world.night_exposure if night else 1.0) * world.exposure_grey
    look["contrast"], look["contrast_s"] = world.contrast, sensor.contrast_s
    look["least_gain"], look["most_gain"] = (0.5, 6.0) if night else (0.25, 8.0)


def _wet(weather: Weather, grey: float, darkening: float) -> float:
    """Return the grey of a surface, multiplied by `darkening` if it is wet."""
    return grey * darkening if weather.wet else grey


def _set_sky(look: np.ndarray, weather: Weather, world: World, linear: bool) -> None:
    """Set the light of sky, skyline and fog."""
    greys = (*world.greys, world.leaf_contrast)
    if weather.light == "night":
        # In numbered worlds street lamps light the sky.
        glow = math.sqrt(world.street_light / 0.04) if world.drawn else 1.0
        greys = tuple(glow * grey for grey in (6.0, 14.0, 7.0, 4.0, 1.0))
    names = ("zenith", "horizon", "hills", "trees")
    for name, grey in zip(names, greys, strict=False):
        look[name] = to_light(grey, linear)
    look["leaf_gain"] = greys[4] * _slope(greys[3], linear)
    look["hill_scale"], look["tree_scale"] = world.hill_scale, world.tree_scale
    look["haze"] = to_light(haze_grey(weather), linear)


def _set_sun(look: np.ndarray, weather: Weather, world: World) -> None:
    """Set the direction of the sun, the light on faces, and shadows."""
    if not world.drawn:
        look["sun_x"], look["sun_y"], look["sun_z"] = _LABORATORY_SUN
        look["ambient"], look["direct"] = 0.62, 0.42
        # Three rings of 0.22 around a shadow that leans away from the sun.
        values = (0.22, -0.12 / _LABORATORY_SUN[2], -0.08, 0.16, 3.0, 1.0, 0.75)
    else:
        azimuth, elevation, share = sun_of(weather, world)
        level = math.cos(elevation)
        look["sun_x"], look["sun_y"] = level * math.cos(azimuth), level * math.sin(azimuth)
        look["sun_z"] = math.sin(elevation)
        # A vertical face receives light from half of the sky and from the ground.
        look["ambient"], look["direct"] = 0.12 + 0.55 * (1.0 - share), share / math.sin(elevation)
        look["cast"], look["glare"] = share, _GLARE if weather.light == "low_sun" and share > 0.0 else 0.0
        # From 0.1 m inside the outline of a car to 0.5 m outside it; a box has a shadow at its edges only.
        rings, missing = 7, world.under_body * (0.6 if weather.light == "night" else 1.0)
        values = (missing / rings, 0.0, -0.1, 0.1, rings, 0.2, 0.95)
        look["under_road"] = look["asphalt"] * (1.0 - missing)
    names = (
        *("under_body", "under_lean", "under_first", "under_step", "under_rings", "under_box"),
        "shadow_limit",
    )
    for name, value in zip(names, values, strict=True):
        look[name] = value


def sun_of(weather: Weather, world: World) -> tuple[float, float, float]:
    """Return azimuth and elevation of the sun [rad], and its share of the light on the road."""
    azimuth, elevation, share = world.sun_azimuth_deg, world.sun_elevation_deg, world.sun_share
    if weather.light == "night" or weather.wet or weather.visibility_m > 0.0:
        share = 0.0
    elif weather.light == "low_sun":
        # Within 25° of +x, where roads lead, 4° to 12° above the horizon.
        azimuth = 25.0 * (azimuth / 180.0 - 1.0)
        elevation = 4.0 + 8.0 * (elevation - 18.0) / 44.0
        share = 0.6
    return math.radians(azimuth), math.radians(elevation), share


def haze_grey(weather: Weather) -> float:
    """Return the grey level of the fog."""
    return 18.0 if weather.light == "night" else 200.0


def far_transmission(weather: Weather) -> float:
    """Return the share of the contrast of sky and skyline that remains behind 500 m of fog."""
    return math.exp(-500.0 * math.log(20.0) / weather.visibility_m)


def beam_profile(camera: Camera) -> np.ndarray:
    """Return the headlights' fall-off over the columns of a frame; float32, shape (width,)."""
    width = camera.shape[1]
    tan = (np.arange(width) + 0.5 - 0.5 * width) / camera.focal_px
    return np.exp(-((tan / BEAM_WIDTH) ** 2)).astype(np.float32)


@lru_cache(maxsize=4)
def noise_table(seed: int) -> np.ndarray:
    """Return 2^`NOISE_LOG2` standard normal numbers and the first ones again, float32.

    The repeated ones let a row of a frame begin at any of the numbers.
    """
    numbers = np.random.default_rng([seed, 5]).standard_normal(1 << NOISE_LOG2, dtype=np.float32)
    return np.concatenate((numbers, numbers[: MAX_WIDTH + 16]))
