"""CameraParams: optics, mount and conditions of a camera as plain values; presets and named conditions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from lgmd_gym.camera.bounds import BOUNDS, checked_number
from lgmd_gym.camera.params_checks import (
    check_columns,
    check_surroundings,
    check_zoom,
)
from lgmd_gym.camera.worlds import check_world
from lgmd_gym.errors import check_keys, check_known, check_size, check_text, check_whole, shown

MAX_WIDTH = 4096
"""Maximum width and height of a frame [px]."""


ROADS = {"still": 0.0, "smooth": 0.5, "normal": 1.0, "rough": 2.0}
"""Motion of the car's body on each road, as a multiple of the measured motion in `body_motion`.

`smooth`, `normal` and `rough` are ISO 8608 classes A, B and C; each class has twice the amplitude of the one
before.
"""
_CHOICES = {
    "gaze": ("fixed", "path", "stopping"),
    "vehicles": ("car", "box"),
    "light": ("day", "night", "low_sun"),
    "road": tuple(ROADS),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraParams:
    """Parameters of a camera on a car: optics, mount, gaze, appearance of the world and conditions.

    Pixels per degree at the centre of the frame: `wide` 2.4, `standard` 3.8, `tele` 6.3, `fovea` 16.0,
    `paper` 5.3. `fovea` (160 px over 10°) matches the centre of a production 8-megapixel 120° front camera
    (3840 px / 120° = 32 px/°) after 2 × 2 binning.

    Attributes:
        name: Label of the camera; its results are stored under this key.
        shape: `(height, width)` of the frame [px].
        detector: Name of the neuron model that processes the frames, see `lgmd_gym.neuron.register`.
        columns: Number of vertical strips of equal width whose potentials are the observation
            `column_potential` (`FrameNeuron.column_potentials`); 0 for none. Divides the width; only for
            models with a map of columns.
        hfov_deg: Horizontal field of view, in (1, 170) [degrees].
        mount_height: Height of the lens above the ground [m].
        mount_setback: Distance of the lens behind the front bumper [m].
        mount_left: Distance of the lens left of the car's centreline [m].
        pitch_deg: Upward tilt of the optical axis; 0 puts the horizon at half height [degrees].
        yaw_deg: Yaw of the optical axis, + to the right; 0 is straight ahead [degrees].
        gaze: `"fixed"` to the car, or `"path"`: turned towards the car's position in one second on its
            present circle, from its own speed and steering angle only; or `"stopping"`: turned and zoomed to
            the point of that circle at `reach` stopping distances, see `camera.aim`.
        reach: Distance of the aim of the gaze `"stopping"` as a multiple of the stopping distance.
        span_m: Width of the frame at that distance; replaces `hfov_deg` [m].
        offset_m: Distance of the aim left of the ego's path [m].
        lift: Elevation of the optical axis, as a multiple of the angle from the horizon down to the aim.
        stop_deceleration: Deceleration of the stopping distance on a dry road; two thirds of it on a wet one
            [m/s²]. The least of all worlds is 7.5.
        stop_reaction: Time from a demand to full braking [s].
        brake_known: Whether the stopping distance follows the car's estimate of its full braking: its
            deceleration is then `stop_deceleration` times that estimate over 9 m/s², on any road. See
            `brake_estimate.known_deceleration`, also the observation `known_deceleration`.
        max_deceleration: Full braking of the car; braking environments set it to that of their brake [m/s²].
        stabilised: Whether the rotation of the body is compensated with a gyroscope whose errors are
            assumptions, see `body_motion.residual_motion`.
        derotated: Whether the rotation of the car about the vertical axis, from its yaw rate, and that of the
            gaze cause no motion in the input of the neuron: the view turns by whole pixels, and the state of
            the neuron is shifted by as many (`FrameNeuron.step`). Not for the gaze `"stopping"`, which zooms.
        calibrated: Whether the sensor knows the errors of its mount up to a tenth, see `pose.CALIBRATED`.
        texture: Contrast of asphalt and verge, as a multiple of the natural contrast.
        roadside: Density of posts and trees along the road, as a multiple of the natural density.
        vehicles: `"car"` for bodies with windows, lights and wheels, `"box"` for plain shaded boxes, also of
            pedestrians and two-wheelers.
        panorama: Distant surroundings: `"skyline"` (hills and trees under an even sky), `"natural"`
            (1/f noise with the statistics of natural scenes), or the path of an image. An image is
            converted to grey and wrapped around 360°, with its middle row at the horizon and its left
            edge in the direction +x.
        guard_rail: Whether steel rails, 0.75 m high on posts, run along the outer edges of the road.
        world: Number of the world that determines the appearance of road, surroundings and light, and the
            sensor, see `World` and `in_world`; None for the laboratory.
        queue_lane: Index of the lane on which the queues of the world's clutter stand, in the order of the
            road network; None for none. Braking environments set it to a free lane next to the ego's.
        seed: Seed of textures and skyline of the laboratory, and of the grey of vehicles without a `shade`.
        light: `"day"`, `"night"` or `"low_sun"`. At night, the ego's headlights and the lights of other cars
            are on. A low sun is 4° to 12° above the horizon, near the direction +x; in the laboratory it
            equals day.
        upper_beam: Whether the ego's headlights are the upper beam, in place of the low beam, at night.
        wet: Whether the road is wet: darker, and lighter towards the horizon, where it reflects the sky.
        visibility_m: Meteorological visibility in fog (5 % contrast, Koschmieder); 0 is clear air [m]. At
            night, the fog scatters light of the own headlights back, see `render.veil`.
        shot_noise: Standard deviation of photon noise at grey 128, growing with √grey [grey levels].
        read_noise: Standard deviation of the sensor's read noise [grey levels].
        road: Motion of the body (pitch, roll, yaw and heave): `"still"` for none, or that of a car on a
            `"smooth"`, `"normal"` or `"rough"` road (ISO 8608 classes A, B and C): 0.5, 1 and 2 times the
            motion measured on a drive, which has 0.14° of pitch (RMS) at 17 m/s; it grows with √speed.
        dive_deg: Nose-down pitch per braking deceleration [degrees per m/s²]; 0.05 to 0.15 for sprung cars.
        shutter_s: Exposure time, which ends at the time of the frame; 0 disables motion blur [s].
            Automotive cameras that must capture 90 Hz pulsed lights expose for 0.011 s or more by day.
        linear_light: Whether the scene is in linear light (255 is white), which the sensor encodes with a
            square-root curve: grey = 255·√(light / 255). Noise is added to the light; its stated standard
            deviation is that at grey 128, and photon noise then has it at every grey.
        auto_exposure_s: Time constant of the gain that brings the mean of the frames before to grey 110
            [s]; the first frame of an episode has its own gain. 0 disables it. The gain is 1/4 to 8 by day
            and 1 to 24 at night.
        contrast_s: Time constant of a contrast control [s], which brings the standard deviation of the frames
            before to 25 grey levels with a gain of 0.5 to 3, and their mean to 110; 0 disables it. Fog and a
            dark road then weaken the responses of a neuron less, and a bright skyline raises them less.
    """

    name: str = "custom"
    shape: tuple[int, int] = (90, 160)
    detector: str = "lgmd"
    columns: int = 0
    hfov_deg: float = 60.0
    mount_height: float = 1.2
    mount_setback: float = 1.7
    mount_left: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    gaze: str = "fixed"
    reach: float = 1.0
    span_m: float = 2.4
    offset_m: float = 0.0
    lift: float = 0.0
    stop_deceleration: float = 7.5
    stop_reaction: float = 0.5
    brake_known: bool = False
    max_deceleration: float = 9.0
    stabilised: bool = False
    derotated: bool = False
    calibrated: bool = False
    texture: float = 1.0
    roadside: float = 1.0
    vehicles: str = "car"
    panorama: str = "skyline"
    guard_rail: bool = False
    world: int | None = None
    queue_lane: int | None = None
    seed: int = 0
    light: str = "day"
    upper_beam: bool = False
    wet: bool = False
    visibility_m: float = 0.0
    shot_noise: float = 0.0
    read_noise: float = 0.0
    road: str = "still"
    dive_deg: float = 0.0
    shutter_s: float = 0.0
    linear_light: bool = False
    auto_exposure_s: float = 0.0
    contrast_s: float = 0.0

    def __post_init__(self) -> None:
        """Check every field."""
        if not isinstance(self.name, str) or not self.name:
            raise ValueError(f"camera name must be a non-empty string, got {shown(self.name)}")
        object.__setattr__(self, "shape", check_size("camera shape", self.shape, 4, MAX_WIDTH))
        for name in BOUNDS:
            object.__setattr__(self, name, checked_number(name, getattr(self, name)))
        check_surroundings(self)
        object.__setattr__(self, "world", None if self.world is None else check_world(self.world))
        if self.queue_lane is not None:
            object.__setattr__(self, "queue_lane", check_whole("camera queue_lane", self.queue_lane, 0))
        for name, known in _CHOICES.items():
            check_known(f"camera {name}", getattr(self, name), known)
        check_text("camera detector", self.detector)
        check_columns(self)
        if self.gaze == "stopping":
            check_zoom(self)

    @property
    def focal_px(self) -> float:
        """Focal length [px], equal to the pixels per radian at the centre of the frame."""
        return 0.5 * self.shape[1] / math.tan(math.radians(0.5 * self.hfov_deg))

    @property
    def pixels_per_degree(self) -> float:
        """Pixels per degree at the centre of the frame."""
        return self.focal_px * math.pi / 180.0

    @classmethod
    def preset(cls, name: str, **changes: Any) -> CameraParams:
        """Return a preset, with fields changed.

        Example:
            >>> CameraParams.preset("fovea").hfov_deg
            10.0
        """
        check_known("camera preset", name, PRESETS)
        return cls.make(PRESETS[name], **changes)

    @classmethod
    def make(
        cls, value: str | CameraParams | Mapping[str, Any] | None = None, **changes: Any
    ) -> CameraParams:
        """Return camera parameters from a preset's name, parameters, or a dict of fields.

        Args:
            value: A preset's name, parameters, or a dict; None for the `wide` preset. If `name` in a dict
                is that of a preset, the other fields change the preset.
            changes: Fields to change on top.

        The dict and `changes` may contain `condition`, a key of `CONDITIONS`. The other fields override
        those of the condition.
        """
        if value is None:
            value = "wide"
        if isinstance(value, str):
            base = cls.preset(value)
        elif isinstance(value, CameraParams):
            base = value
        elif isinstance(value, Mapping):
            name = value.get("name")
            base = PRESETS[name] if isinstance(name, str) and name in PRESETS else cls()
            base = replace(base, **_with_condition(value))
        else:
            raise ValueError(f"camera must be a preset name, CameraParams or a dict, got {shown(value)}")
        return replace(base, **_with_condition(changes)) if changes else base

    def with_condition(self, condition: str) -> CameraParams:
        """Return this camera under a named condition (`clear`, `night`, `night_upper_beam`, …)."""
        return CameraParams.make(self, condition=condition)


def _with_condition(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return `changes` with `condition` replaced by the fields that it sets."""
    check_keys("camera field", changes, [*_field_names(), "condition"])
    others = dict(changes)
    condition = others.pop("condition", CLEAR)
    check_known("camera condition", condition, CONDITIONS)
    return {**CONDITIONS[condition], **others}


def _field_names() -> list[str]:
    return [field.name for field in fields(CameraParams)]


PRESETS: dict[str, CameraParams] = {
    "wide": CameraParams(name="wide", hfov_deg=60.0),
    "standard": CameraParams(name="standard", hfov_deg=40.0),
    "tele": CameraParams(name="tele", hfov_deg=25.0),
    "fovea": CameraParams(name="fovea", hfov_deg=10.0),
    "paper": CameraParams(name="paper", hfov_deg=60.0, shape=(288, 352)),
}
"""Cameras by name; `paper` has the frame size of the paper's clips."""

CLEAR = "clear"
CONDITIONS: dict[str, dict[str, Any]] = {
    CLEAR: {},
    "night": {"light": "night", "read_noise": 2.0, "shot_noise": 3.0},
    "night_upper_beam": {"light": "night", "upper_beam": True, "read_noise": 2.0, "shot_noise": 3.0},
    "fog": {"visibility_m": 120.0},
    "rain": {"wet": True, "visibility_m": 600.0, "read_noise": 1.0, "shot_noise": 2.0},
    "low_sun": {"light": "low_sun"},
}
"""Named conditions: the fields of `CameraParams` that each one sets."""
