"""CameraParams: everything that makes a camera, as plain values, and the presets."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from numbers import Integral, Real
from typing import Any, TypeAlias

from lgmd_gym.errors import check_keys, unknown_name

# name: (low, high, low is allowed, high is allowed), each with the unit for the message.
_BOUNDS: dict[str, tuple[float, float, bool, bool, str]] = {
    "hfov_deg": (1.0, 170.0, False, False, "degrees"),
    "mount_height": (0.0, 100.0, False, True, "m above the ground"),
    "mount_setback": (-10.0, 50.0, True, True, "m behind the front bumper"),
    "mount_left": (-10.0, 10.0, True, True, "m left of the centreline"),
    "pitch_deg": (-60.0, 60.0, True, True, "degrees"),
    "yaw_deg": (-360.0, 360.0, True, True, "degrees"),
    "texture": (0.0, 5.0, True, True, "times the natural contrast"),
    "roadside": (0.0, 4.0, True, True, "times the natural density"),
    "seed": (0, 2**32 - 1, True, True, ""),
    "visibility_m": (0.0, 1e6, True, True, "m (0 is clear air)"),
    "shot_noise": (0.0, 10.0, True, True, "grey levels at mid-grey"),
    "read_noise": (0.0, 50.0, True, True, "grey levels"),
    "vibration_deg": (0.0, 5.0, True, True, "degrees"),
    "dive_deg": (0.0, 2.0, True, True, "degrees per m/s²"),
    "heave_m": (0.0, 0.1, True, True, "m"),
    "shutter_s": (0.0, 0.1, True, True, "s"),
}
_CHOICES = {"gaze": ("fixed", "path"), "vehicles": ("car", "box"), "light": ("day", "night")}


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraParams:
    """A camera on a car: optics, mount, gaze, look of the world and conditions.

    Pixels per degree at the centre of the frame, with square pixels: `wide` 2.4, `standard` 3.8,
    `tele` 6.3, `fovea` 16.0, `paper` 5.3. 160 px over 10° is the centre of a production 8-megapixel
    120° front camera (3840 px / 120° = 32 px/°, binned two by two).

    Attributes:
        name: A label; the key under which results of this camera are filed.
        shape: `(height, width)` of the frame [px].
        hfov_deg: Horizontal field of view, in (1, 170) [degrees].
        mount_height: Height of the lens above the ground [m].
        mount_setback: Distance of the lens behind the front bumper [m].
        mount_left: Distance of the lens left of the car's centreline [m].
        pitch_deg: Upward tilt of the optical axis; 0 puts the horizon at half height [degrees].
        yaw_deg: Turn of the optical axis to the right of straight ahead [degrees].
        gaze: `"fixed"` to the car, or `"path"`: turned towards where the car will be in one second
            on its present circle, from its own speed and steering only.
        texture: Contrast of asphalt and verge, as a multiple of the natural one.
        roadside: Density of posts and trees beside the road, as a multiple of the natural one.
        vehicles: `"car"`: bodies with windows, lights, wheels; `"box"`: plain shaded boxes.
        panorama: What is all round, far away: `"skyline"` (hills and trees under an even sky), `"natural"`
            (1/f noise with the statistics of natural scenes), or the path of an image that is wrapped
            round 360°, its middle row at the horizon, its left edge in the direction +x, in grey.
        guard_rail: Steel rails, 0.75 m high on posts, along the outer edges of the road.
        seed: Seed of textures, skyline and of the grey of vehicles that bring no `shade`.
        light: `"day"` or `"night"` (own headlights, others' lights shine).
        visibility_m: Meteorological visibility in fog (5 % contrast, Koschmieder); 0 is clear air [m].
        shot_noise: Standard deviation of photon noise at grey 128; it grows with √grey [grey levels].
        read_noise: Standard deviation of the sensor's own noise [grey levels].
        vibration_deg: RMS pitch of the body on an uneven road at 14 m/s, growing with √speed [degrees].
        dive_deg: Nose-down pitch per braking deceleration [degrees per m/s²]; sprung cars have 0.05 to 0.15.
        heave_m: RMS rise and fall of the body on an uneven road at 14 m/s, growing with √speed [m]; roads
            of ISO 8608 class A to C leave 0.0015 to 0.006 above 1 Hz.
        shutter_s: Exposure time, over which everything that moves is smeared; 0 freezes [s]. The exposure
            ends at the time of the frame. Automotive cameras that must not miss a pulsed light (90 Hz)
            expose 0.011 or more by day.
    """

    name: str = "custom"
    shape: tuple[int, int] = (90, 160)
    hfov_deg: float = 60.0
    mount_height: float = 1.2
    mount_setback: float = 1.7
    mount_left: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    gaze: str = "fixed"
    texture: float = 1.0
    roadside: float = 1.0
    vehicles: str = "car"
    panorama: str = "skyline"
    guard_rail: bool = False
    seed: int = 0
    light: str = "day"
    visibility_m: float = 0.0
    shot_noise: float = 0.0
    read_noise: float = 0.0
    vibration_deg: float = 0.0
    dive_deg: float = 0.0
    heave_m: float = 0.0
    shutter_s: float = 0.0

    def __post_init__(self) -> None:
        """Check every field; the message names field, value and bound."""
        if not isinstance(self.name, str) or not self.name:
            raise ValueError(f"camera name must be a non-empty string, got {self.name!r}")
        object.__setattr__(self, "shape", _checked_shape(self.shape))
        for name, bound in _BOUNDS.items():
            object.__setattr__(self, name, _checked_number(name, getattr(self, name), bound))
        _check_world(self)
        for name, known in _CHOICES.items():
            if getattr(self, name) not in known:
                raise unknown_name(f"camera {name}", getattr(self, name), known)

    @property
    def focal_px(self) -> float:
        """Focal length [px]: also pixels per radian at the centre of the frame."""
        return 0.5 * self.shape[1] / math.tan(math.radians(0.5 * self.hfov_deg))

    @property
    def pixels_per_degree(self) -> float:
        """Pixels per degree at the centre of the frame."""
        return self.focal_px * math.pi / 180.0

    @classmethod
    def preset(cls, name: str, **changes: Any) -> CameraParams:
        """Return the preset of this name, with fields changed.

        Example:
            >>> CameraParams.preset("fovea").hfov_deg
            10.0
        """
        if name not in PRESETS:
            raise unknown_name("camera preset", name, PRESETS)
        check_keys("camera field", changes, _field_names())
        return replace(PRESETS[name], **changes) if changes else PRESETS[name]

    @classmethod
    def make(
        cls, value: str | CameraParams | Mapping[str, Any] | None = None, **changes: Any
    ) -> CameraParams:
        """Return camera parameters from a preset's name, parameters, or a dict of fields.

        Args:
            value: None for the `wide` preset; in a dict, `name` may be a preset's: then the other
                fields change that preset, and `condition` may name one of `CONDITIONS`.
            changes: Fields to change on top.
        """
        if value is None:
            value = "wide"
        if isinstance(value, str):
            base = cls.preset(value)
        elif isinstance(value, CameraParams):
            base = value
        elif isinstance(value, Mapping):
            base = cls._from_mapping(value)
        else:
            raise TypeError(f"camera must be a preset name, CameraParams or a dict, got {value!r}")
        check_keys("camera field", changes, _field_names())
        return replace(base, **changes) if changes else base

    @classmethod
    def _from_mapping(cls, value: Mapping[str, Any]) -> CameraParams:
        given = dict(value)
        condition = given.pop("condition", "clear")
        check_keys("camera field", given, [*_field_names(), "condition"])
        if condition not in CONDITIONS:
            raise unknown_name("camera condition", condition, CONDITIONS)
        base = PRESETS.get(given.get("name", ""))
        given = {**CONDITIONS[condition], **given}
        return replace(base, **given) if base else cls(**given)

    def with_condition(self, condition: str) -> CameraParams:
        """Return this camera under a named condition (`clear`, `night`, `fog`, `degraded`)."""
        if condition not in CONDITIONS:
            raise unknown_name("camera condition", condition, CONDITIONS)
        return replace(self, **CONDITIONS[condition])


def _check_world(p: CameraParams) -> None:
    if isinstance(p.panorama, os.PathLike):
        object.__setattr__(p, "panorama", os.fspath(p.panorama))
    if not isinstance(p.panorama, str) or not p.panorama:
        raise ValueError(
            f"camera panorama must be 'skyline', 'natural' or an image's path, got {p.panorama!r}"
        )
    if not isinstance(p.guard_rail, bool):
        raise ValueError(f"camera guard_rail must be true or false, got {p.guard_rail!r}")


def _field_names() -> list[str]:
    return [field.name for field in fields(CameraParams)]


def _checked_shape(shape: Any) -> tuple[int, int]:
    ok = isinstance(shape, tuple | list) and len(shape) == 2 and all(isinstance(n, Integral) for n in shape)
    if not ok or not all(4 <= n <= 4096 for n in shape):
        raise ValueError(f"camera shape must be (height, width), each 4 to 4096 px, got {shape!r}")
    return int(shape[0]), int(shape[1])


def _checked_number(name: str, value: Any, bound: tuple[float, float, bool, bool, str]) -> float | int:
    low, high, low_ok, high_ok, unit = bound
    if not isinstance(value, Real) or isinstance(value, bool):
        raise ValueError(f"camera {name} must be a number, got {value!r}")
    value = int(value) if isinstance(value, Integral) else float(value)
    inside = (value >= low if low_ok else value > low) and (value <= high if high_ok else value < high)
    if not inside:
        span = f"{'[' if low_ok else '('}{low:g}, {high:g}{']' if high_ok else ')'}"
        raise ValueError(f"camera {name}={value!r} is outside {span} {unit}".rstrip())
    if name == "seed":
        if not isinstance(value, int):
            raise ValueError(f"camera seed must be a whole number, got {value!r}")
        return value
    return float(value)


PRESETS: dict[str, CameraParams] = {
    "wide": CameraParams(name="wide", hfov_deg=60.0),
    "standard": CameraParams(name="standard", hfov_deg=40.0),
    "tele": CameraParams(name="tele", hfov_deg=25.0),
    "fovea": CameraParams(name="fovea", hfov_deg=10.0),
    "paper": CameraParams(name="paper", hfov_deg=60.0, shape=(288, 352)),
}
"""The named cameras; `paper` has the frame of the paper's clips."""

CONDITIONS: dict[str, dict[str, Any]] = {
    "clear": {},
    "night": {"light": "night", "read_noise": 2.0, "shot_noise": 3.0},
    "fog": {"visibility_m": 120.0},
    "degraded": {
        "read_noise": 1.5,
        "shot_noise": 2.0,
        "vibration_deg": 0.1,
        "dive_deg": 0.1,
        "heave_m": 0.005,
        "shutter_s": 0.011,
    },
}
"""Named conditions: fields laid over a camera by `CameraParams.with_condition`."""


CameraItem: TypeAlias = str | CameraParams | Mapping[str, Any]
"""One camera: a preset name, a `CameraParams`, or the fields of one."""
CameraSpec: TypeAlias = CameraItem | Sequence[CameraItem]
"""The `camera` argument of environments and wrappers: one camera, or several."""
