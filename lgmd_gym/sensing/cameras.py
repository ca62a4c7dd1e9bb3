"""The cameras of a sensor array, from the `camera` argument and the fields that an environment changes."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

from lgmd_gym.camera import BIRDSEYE, BirdsEye, CameraItem, CameraParams, CameraSpec
from lgmd_gym.camera.bounds import checked_number
from lgmd_gym.camera.brake_estimate import known_deceleration
from lgmd_gym.camera.objects import View
from lgmd_gym.camera.road_pool import RoadKey, road_key
from lgmd_gym.camera.scene_table import view_of
from lgmd_gym.camera.spec import is_top_view
from lgmd_gym.errors import check_keys

_MAX_KNOWN = 256  # distinct fields that are remembered

Camera: TypeAlias = CameraParams | BirdsEye


def make_cameras(camera: CameraSpec) -> dict[str, Camera]:
    """Return parameters or top views by camera name.

    Args:
        camera: A preset name, "birdseye", `CameraParams`, a mapping of its fields, or a sequence of these.

    Raises:
        ValueError: For an unknown preset, an empty sequence, or a repeated name.
    """
    several = isinstance(camera, Sequence) and not isinstance(camera, str | bytes)
    items: Sequence[CameraItem] = camera if several else [camera]  # type: ignore[assignment, list-item]
    if not items:
        raise ValueError(f"camera must have at least one element, got {camera!r}; use camera='fovea'")
    cameras: dict[str, Camera] = {}
    for item in items:
        name, built = _make_camera(item)
        if name in cameras:
            raise ValueError(f"camera names must be unique, got {name!r} twice; rename one of them")
        cameras[name] = built
    return cameras


def _make_camera(item: CameraItem) -> tuple[str, Camera]:
    if is_top_view(item):
        if not isinstance(item, Mapping):
            return BIRDSEYE, BirdsEye()
        check_keys("field of the top view", item, ("name", "shape", "scaling"))
        return BIRDSEYE, BirdsEye(**{key: value for key, value in item.items() if key != "name"})
    params = CameraParams.make(item)
    return params.name, params


class Variant(NamedTuple):
    """The cameras of an environment with some fields changed, apart from the texture.

    Attributes:
        params: Parameters of every camera; None for a top view.
        road_keys: `road_key` of every camera, with a placeholder for a top view.
        view: Directions that the cameras look in, see `read_objects`.
        known_deceleration: The car's estimate of its full braking [m/s²]; None unless a camera has
            `brake_known`.
    """

    params: tuple[CameraParams | None, ...]
    road_keys: tuple[RoadKey, ...]
    view: View | None
    known_deceleration: float | None

    def __deepcopy__(self, memo: dict[int, Any]) -> "Variant":
        return self


class Variants:
    """The variants of the cameras, each built once.

    Args:
        cameras: The unchanged cameras.
    """

    def __init__(self, cameras: Sequence[Camera]) -> None:
        self._base = tuple(item if isinstance(item, CameraParams) else None for item in cameras)
        self._known: dict[str, Variant] = {}

    def __deepcopy__(self, memo: dict[int, Any]) -> "Variants":
        return self

    def make(self, fields: Mapping[str, Any]) -> tuple[Variant, float | None]:
        """Return the cameras with changed fields, and the texture among the fields or None.

        The texture is separate because environments draw it at random, and it changes two numbers only.

        Args:
            fields: Fields of `CameraParams`, and optionally `condition`.

        Raises:
            ValueError: If a field is unknown or out of range, changes the shape, detector or columns of a
                camera, `brake_known` or `derotated`.
        """
        others = {name: value for name, value in fields.items() if name != "texture"}
        texture = fields.get("texture")
        if texture is not None:
            texture = checked_number("texture", texture)
        key = repr(others)
        variant = self._known.get(key)
        if variant is None:
            if len(self._known) >= _MAX_KNOWN:
                self._known.clear()
            self._known[key] = variant = self._build(others)
        return variant, texture

    def _build(self, fields: dict[str, Any]) -> Variant:
        params = tuple(None if base is None else CameraParams.make(base, **fields) for base in self._base)
        for base, changed in zip(self._base, params, strict=True):
            if base is not None:
                _check_kept(base, changed)
        known = [p for p in params if p is not None]
        placeholder = road_key(known[0]) if known else (0.0, 0, False, False, None)
        keys = tuple(placeholder if p is None else road_key(p) for p in params)
        estimates = [known_deceleration(p) for p in known if p.brake_known]
        return Variant(params, keys, view_of(known), estimates[0] if estimates else None)


def _check_kept(base: CameraParams, changed: CameraParams | None) -> None:
    """Raise ValueError if fields that determine the arrays of the sensors are changed."""
    for name in ("shape", "detector", "columns", "brake_known", "derotated"):
        kept, given = getattr(base, name), getattr(changed, name)
        if kept != given:
            raise ValueError(
                f"camera_fields must keep the {name} {kept} of camera {base.name!r}, got {given}; "
                f"set the {name} in the camera argument"
            )
