"""Cameras and scenes of tests from one flat set of fields."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from lgmd_gym.camera import PRESETS, Camera, EgoCamera, Scene, Weather

_MOUNT = ("height_m", "setback_m", "left_m", "pitch_deg", "yaw_deg", "calibrated")
_GAZE = (*("derotated", "reach", "span_m", "offset_m", "lift", "deceleration", "reaction_s", "brake_known"),)
_SENSOR = ("shot_noise", "read_noise", "shutter_s", "linear_light", "auto_exposure_s", "contrast_s")
_CAMERA = ("name", "shape", "hfov_deg", "stabiliser")
_WEATHER = ("light", "upper_beam", "wet", "visibility_m")


class Rig(NamedTuple):
    """A camera and a scene; further attributes are fields of their records."""

    camera: Camera
    scene: Scene

    def __getattr__(self, name: str) -> Any:
        camera, scene = self
        for item in (camera, camera.mount, camera.gaze, camera.sensor, scene, scene.weather):
            if hasattr(item, name):
                return getattr(item, name)
        raise AttributeError(name)


def rig(base: Any = None, **fields: Any) -> Rig:
    """Return a camera and a scene.

    Args:
        base: A `Rig`, a `Camera`, a preset's name, flat fields like the others, or None for the default.
        **fields: Fields of `Camera`, `Mount`, gaze, `ImageSensor`, `Scene` and `Weather`; `gaze` is the kind
            of the gaze and `weather` a weather to change.
    """
    if isinstance(base, Mapping):
        base, fields = base.get("name"), {**base, **fields}
        base = base if base in PRESETS else None
    scene = Scene()
    if isinstance(base, Rig):
        base, scene = base
    camera = Camera() if base is None else Camera.make(base)
    mount, sensor = _taken(fields, _MOUNT), _taken(fields, _SENSOR)
    kind, gaze = fields.pop("gaze", None), _taken(fields, _GAZE)
    changes = _taken(fields, _CAMERA)
    if mount:
        changes["mount"] = camera.mount.to_dict() | mount
    if sensor:
        changes["sensor"] = camera.sensor.to_dict() | sensor
    if kind is not None:
        changes["gaze"] = {"kind": kind, **gaze}
    elif gaze:
        changes["gaze"] = camera.gaze.to_dict() | gaze
    weather = Weather.make(fields.pop("weather", scene.weather), **_taken(fields, _WEATHER))
    return Rig(Camera.make(camera, **changes), Scene.make(scene, weather=weather, **fields))


def ego_camera(base: Any = "wide", **fields: Any) -> EgoCamera:
    """Return a camera on the ego of any environment; see `rig`."""
    return EgoCamera(*rig(base, **fields))


def _taken(fields: dict[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Remove named fields and return them."""
    return {name: fields.pop(name) for name in names if name in fields}
