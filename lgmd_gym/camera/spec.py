"""The `camera` argument of environments and wrappers: types and named conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import Any, TypeAlias, cast

from lgmd_gym.camera.params import CLEAR, CONDITIONS, PRESETS, CameraParams
from lgmd_gym.errors import as_tuple, check_known

BIRDSEYE = "birdseye"
"""The camera name of highway-env's top view."""

CameraItem: TypeAlias = str | CameraParams | Mapping[str, Any]
"""One camera: the name of a preset or "birdseye", a `CameraParams`, or a dict of its fields."""
CameraSpec: TypeAlias = CameraItem | Sequence[CameraItem]
"""The `camera` argument: one camera, or several."""


def with_condition(camera: CameraSpec, condition: str) -> CameraSpec:
    """Return a camera argument under a named condition.

    Fields that a dict sets explicitly take precedence over those of the condition.

    Args:
        camera: One camera or several.
        condition: A key of `CONDITIONS`; "clear" changes nothing.

    Raises:
        ValueError: For an unknown condition or preset, or for "birdseye" under a condition other than
            "clear".

    Example:
        >>> with_condition("fovea", "fog").visibility_m
        120.0
    """
    check_known("camera condition", condition, CONDITIONS)
    if condition == CLEAR:
        return camera
    if isinstance(camera, list | tuple):
        return [_item_with_condition(item, condition) for item in camera]
    return _item_with_condition(cast(CameraItem, camera), condition)


def check_camera(camera: CameraSpec) -> None:
    """Check a camera argument without building the cameras.

    Raises:
        ValueError: For an unknown preset or field, a value out of range, an empty sequence, or another type.
    """
    items = camera if isinstance(camera, list | tuple) else [camera]
    if not items:
        raise ValueError(f"camera must have at least one element, got {camera!r}; use camera='fovea'")
    for item in items:
        if not is_top_view(cast(CameraItem, item)):
            CameraParams.make(cast(CameraItem, item))


def is_top_view(camera: CameraItem) -> bool:
    """Return whether a camera is highway-env's top view."""
    name = camera.get("name") if isinstance(camera, Mapping) else camera
    return isinstance(name, str) and name == BIRDSEYE


def _item_with_condition(camera: CameraItem, condition: str) -> CameraParams:
    if is_top_view(camera):
        raise ValueError(f"camera 'birdseye' does not support condition {condition!r}; use 'clear'")
    if isinstance(camera, Mapping):
        return CameraParams.make({**camera, "condition": condition})
    return CameraParams.make(camera, condition=condition)


def plain_values(value: Any) -> Any:
    """Return a camera or neuron argument as plain values; of a camera only what differs from its preset.

    Fields of a dict take precedence over a condition, so a dict of all fields would disable conditions.
    """
    if isinstance(value, CameraParams):
        base = asdict(PRESETS.get(value.name, CameraParams()))
        changes = {name: field for name, field in asdict(value).items() if field != base[name]}
        return {"name": value.name} | changes
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    items = as_tuple(value)
    return value if items is None else [plain_values(item) for item in items]
