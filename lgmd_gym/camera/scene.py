"""`Scene` and `Weather`: what an episode looks like, read by cameras and brake."""

import os
from collections.abc import Mapping
from typing import TypeAlias, cast

from lgmd_gym.camera.worlds import LABORATORY, check_world
from lgmd_gym.errors import check_whole, shown
from lgmd_gym.fields import Record, choice, flag, number, optional, record, text, value, whole

ROADS = {"still": 0.0, "smooth": 0.5, "normal": 1.0, "rough": 2.0}
"""Motion of the car's body on each road, as a multiple of the measured motion in `body_motion`.

`smooth`, `normal` and `rough` are ISO 8608 classes A, B and C; each class has twice the amplitude of the one
before.
"""
SKYLINE = "skyline"
_MAX_PATH = 4096  # characters


@record
class Weather(Record):
    """Light and air."""

    label = "weather"

    name: str = text("custom", "Name of the weather.")
    light: str = choice(
        "day",
        ("day", "night", "low_sun"),
        "At night, the ego's headlights and the lights of other cars are on. A low sun is 4° to 12° above "
        "the horizon, near the direction +x; in the laboratory it equals day.",
    )
    upper_beam: bool = flag(
        False, "Whether the ego's headlights are the upper beam, in place of the low beam, at night."
    )
    wet: bool = flag(
        False,
        "Whether the road is wet: darker, lighter towards the horizon, where it reflects the sky, and with a "
        "weaker brake.",
    )
    visibility_m: float = number(
        0.0,
        "[0, 1e6]",
        "m",
        "Meteorological visibility in fog (5 % contrast, Koschmieder); 0 is clear air. At night, the fog "
        "scatters light of the own headlights back, see `render.veil`.",
    )
    shot_noise: float = number(
        0.0, "[0, 10]", "grey levels", "Least photon noise of every camera in the laboratory."
    )
    read_noise: float = number(
        0.0, "[0, 50]", "grey levels", "Least read noise of every camera in the laboratory."
    )

    @classmethod
    def presets(cls) -> Mapping[str, "Weather"]:
        """Return the weathers that `make` accepts by name; "clear" is the default.

        Example:
            >>> Weather.make("fog").visibility_m
            120.0
        """
        return WEATHERS


WeatherItem: TypeAlias = str | Weather | Mapping[str, object]
"""The `weather` of a scene: a name, a `Weather`, or a mapping of its fields."""

CLEAR = "clear"
WEATHERS: dict[str, Weather] = {
    weather.name: weather
    for weather in (
        Weather(name=CLEAR),
        Weather(name="night", light="night", read_noise=2.0, shot_noise=3.0),
        Weather(name="night_upper_beam", light="night", upper_beam=True, read_noise=2.0, shot_noise=3.0),
        Weather(name="fog", visibility_m=120.0),
        Weather(name="rain", wet=True, visibility_m=600.0, read_noise=1.0, shot_noise=2.0),
        Weather(name="low_sun", light="low_sun"),
    )
}
"""Weathers by name."""


def _check_world(_: str, world: object) -> int | None:
    return None if world is None else check_world(world)


def _check_panorama(name: str, panorama: object) -> str:
    given = shown(panorama)
    path = os.fspath(cast("os.PathLike[str]", panorama)) if isinstance(panorama, os.PathLike) else panorama
    if not isinstance(path, str) or not 0 < len(path) <= _MAX_PATH:
        raise ValueError(f"{name} must be 'skyline', 'natural' or the path of an image, got {given}")
    return path


def _check_lane(name: str, lane: object) -> int | None:
    return None if lane is None else check_whole(name, lane, 0)


@record
class Scene(Record):
    """Surroundings of an episode: world, weather, road and roadside."""

    label = "scene"

    world: int | None = value(
        None,
        _check_world,
        "Number of the world that determines the appearance of road, surroundings and light, and errors of "
        f"camera and sensor, see `World`; None or {LABORATORY!r} for the laboratory",
    )
    weather: Weather = value(WEATHERS[CLEAR], lambda _, weather: Weather.make(weather), "Light and air.")
    road: str = choice(
        "still",
        tuple(ROADS),
        "Motion of the car's body (pitch, roll, yaw and heave): none, or that of a car on a smooth, normal "
        "or rough road (ISO 8608 classes A, B and C): 0.5, 1 and 2 times the motion measured on a drive, "
        "which has 0.14° of pitch (RMS) at 17 m/s; it grows with √speed.",
    )
    dive_deg: float = number(
        0.0,
        "[0, 2]",
        "degrees per m/s²",
        "Nose-down pitch of the car per braking deceleration; 0.05 to 0.15 for sprung cars.",
    )
    texture: float = number(
        1.0, "[0, 5]", "", "Contrast of asphalt and verge, as a multiple of the natural contrast."
    )
    roadside: float = number(
        1.0, "[0, 4]", "", "Density of posts and trees along the road, as a multiple of the natural density."
    )
    vehicles: str = choice(
        "car",
        ("car", "box"),
        "`car` for bodies with windows, lights and wheels, `box` for plain shaded boxes, also of pedestrians "
        "and two-wheelers.",
    )
    panorama: str = value(
        SKYLINE,
        _check_panorama,
        "Distant surroundings: `skyline` (hills and trees under an even sky), `natural` (1/f noise with the "
        "statistics of natural scenes), or the path of an image. An image is converted to grey and wrapped "
        "around 360°, with its middle row at the horizon and its left edge in the direction +x.",
    )
    guard_rail: bool = flag(
        False, "Whether steel rails, 0.75 m high on posts, run along the outer edges of the road."
    )
    queue_lane: int | None = value(
        None,
        _check_lane,
        "Index of the lane on which the queues of the world's clutter stand, in the order of the road "
        "network; None for none. Braking environments set it to a free lane next to the ego's.",
    )
    seed: int = whole(
        0,
        "[0, 4294967295]",
        "",
        "Seed of textures and skyline of the laboratory, and of the grey of vehicles without a `shade`.",
    )
    mount_height_m: float | None = optional(
        number(None, "(0, 100]", "m", "Height of every lens above the ground; None for that of its mount.")
    )
    pitch_error_deg: float = number(
        0.0, "[-5, 5]", "degrees", "Upward tilt of every lens that no calibration finds."
    )
    height_error_m: float = number(0.0, "[-0.5, 0.5]", "m", "Height of every lens that no calibration finds.")
    gyroscope: bool = flag(True, "Whether the car has the gyroscope that stabilises lenses.")

    @property
    def number(self) -> int:
        """Number of the world, -1 in the laboratory."""
        return -1 if self.world is None else self.world

    @property
    def noise_seed(self) -> int:
        """Seed of noise and of vehicles without a `shade`: the world, or `seed` in the laboratory."""
        return self.seed if self.world is None else self.world
