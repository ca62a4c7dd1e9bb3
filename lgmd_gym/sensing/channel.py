"""`Channel`: one neuron behind one camera; the `camera` argument of environments and wrappers."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeAlias, cast

from lgmd_gym import neuron as models
from lgmd_gym.aliases import Values
from lgmd_gym.camera.birdseye import BirdsEye
from lgmd_gym.camera.camera import BIRDSEYE, PRESETS, Camera, CameraItem
from lgmd_gym.errors import as_tuple, check_keys, shown
from lgmd_gym.fields import Record, record, text, value, whole

LGMD = "lgmd"
"""Name of the usual neuron."""


def make_camera(camera: CameraItem | BirdsEye | None) -> Camera | BirdsEye:
    """Return a camera, or highway-env's top view for "birdseye" or a mapping with that name.

    Raises:
        ValueError: For an unknown preset or field, a value out of range, or another type.
    """
    if isinstance(camera, BirdsEye):
        return camera
    name = camera.get("name") if isinstance(camera, Mapping) else camera
    if not (isinstance(name, str) and name == BIRDSEYE):
        return Camera.make(camera)
    fields: Values = dict(camera) if isinstance(camera, Mapping) else {}
    check_keys("field of the top view", fields, ("name", "shape", "scaling"))
    return BirdsEye(**{key: field for key, field in fields.items() if key != "name"})


@record
class Channel(Record):
    """One neuron behind one camera."""

    label = "channel"

    name: str = text("", "Name; its results are stored under this key. Empty for that of the camera.")
    camera: Camera | BirdsEye = value(
        PRESETS["fovea"],
        lambda _, camera: make_camera(camera),
        "A preset's name, a `Camera`, a mapping of its fields, or `birdseye` for highway-env's top view.",
    )
    neuron: str = value(
        LGMD,
        models.check_model,
        "Name of the model that processes the frames, see `lgmd_gym.neuron.register`.",
    )
    columns: int = whole(
        0,
        "[0, 4096]",
        "",
        "Number of vertical strips of equal width whose potentials are the observation `column_potential` "
        "(`FrameNeuron.column_potentials`); 0 for none. Divides the width; only for models with a "
        "map of columns.",
    )

    def check(self) -> None:
        """Take the name of the camera for none, and check that the columns fit the frame."""
        if not self.name:
            object.__setattr__(self, "name", self.camera.name)
        width = self.camera.shape[1]
        if self.columns and width % self.columns:
            raise ValueError(f"channel columns must divide the width of {width} px, got {self.columns}")


ChannelItem: TypeAlias = CameraItem | BirdsEye | Channel
"""One channel: a `Channel`, a camera, or a mapping of the fields of either."""
ChannelSpec: TypeAlias = ChannelItem | Sequence[ChannelItem]
"""The `camera` argument: one channel, or several."""


def make_channels(camera: ChannelSpec, neuron: str = LGMD) -> tuple[Channel, ...]:
    """Return the channels of a `camera` argument.

    Args:
        camera: A preset's name, "birdseye", a `Camera`, a `Channel`, a `BirdsEye`, a mapping of the fields of
            a camera or, with the key `camera`, of a channel; or a sequence of these.
        neuron: Neuron of the cameras, and of mappings without one.

    Raises:
        ValueError: For an unknown name or field, a value out of range, an empty sequence, or a repeated name.
    """
    models.check_model("neuron", neuron)
    items = as_tuple(camera)
    channels = tuple(_make_channel(item, neuron) for item in ((camera,) if items is None else items))
    if not channels:
        raise ValueError(f"camera must have at least one element, got {shown(camera)}; use camera='fovea'")
    names = [channel.name for channel in channels]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(
                f"channel names must be unique, got {name!r} twice; give the channels different names"
            )
    return channels


def _make_channel(item: Any, neuron: str) -> Channel:
    if isinstance(item, Channel):
        return item
    is_mapping: bool = isinstance(item, Mapping)
    given = cast(Mapping[str, object], item if is_mapping else {})
    if "camera" not in given and {"neuron", "columns"} & given.keys():
        raise ValueError(
            f"neuron and columns are fields of a channel, not of a camera, got {shown(given)}; "
            "use {'camera': …, 'neuron': …, 'columns': …}"
        )
    fields: Mapping[str, object] = given if "camera" in given else {"camera": item}
    return Channel.make({"neuron": neuron, **fields})


def plain_values(value: Any) -> Any:
    """Return a `camera`, `params` or `scene` argument as plain values for JSON and TOML, without None."""
    items = as_tuple(value)
    if items is not None:
        return [plain_values(item) for item in items]
    if isinstance(value, BirdsEye):
        value = asdict(value)
    elif isinstance(value, Channel):
        value = {"name": value.name, "camera": value.camera, "neuron": value.neuron, "columns": value.columns}
    elif hasattr(value, "to_dict"):
        value = value.to_dict()
    if isinstance(value, Mapping):
        fields = cast(Mapping[str, object], value)
        return {key: plain_values(item) for key, item in fields.items() if item is not None}
    return value
