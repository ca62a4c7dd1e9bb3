# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""The drawable objects of a highway-env road (vehicles, obstacles, landmarks) as an array.

Objects are read by duck typing, so that this module does not import highway-env.
"""

import math
import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lgmd_gym.camera.env_state import Ego
from lgmd_gym.kernels import kernel

if TYPE_CHECKING:
    from highway_env.vehicle.objects import RoadObject


MAX_RANGE = 600.0
"""Range of vehicles and obstacles from the lens; they fade in over the last sixth [m]."""
MAX_DRAWN = 512
"""Maximum number of objects in a frame; the first ones of the road's lists are kept."""

MODEL_CAR, MODEL_TRUCK, MODEL_BOX, MODEL_MARK, MODEL_BARRIER, MODEL_RAIL = 0, 1, 2, 3, 4, 5
MODEL_POST, MODEL_TREE, MODEL_CROWN = 6, 7, 8  # flat pictures that face the lens
MODEL_SMALL, MODEL_SUV, MODEL_VAN, MODEL_TRAILER, MODEL_BUS = 9, 10, 11, 12, 13
MODEL_BEAM, MODEL_DECK, MODEL_PANEL, MODEL_BOARD, MODEL_SIGNAL = 14, 15, 16, 17, 18
MODEL_ROUND_SIGN, MODEL_TRIANGLE_SIGN, MODEL_PLATE_SIGN, MODEL_POWER_POLE = 19, 20, 21, 22
MODEL_WALL, MODEL_HEDGE, MODEL_HOUSE, MODEL_LAMP, MODEL_THICKET = 23, 24, 25, 26, 27
MODEL_PEDESTRIAN, MODEL_BICYCLE, MODEL_MOTORCYCLE = 28, 29, 30  # figures, in the order of their tables
OUTLINE = -1.0
"""Shade of a ground mark that is painted as an outline; other shades fill it."""
FIRST_INDEXED = -2.0
"""Shade of the first vehicle without a grey of its own, see `index_shade`; that of the k-th is lower by k."""

OBJECT = np.dtype(
    [
        *((name, np.float64) for name in ("x", "y", "cos", "sin", "length", "width", "height", "shade")),
        *(("braking", np.int64), ("model", np.int64), ("range", np.float64), ("speed", np.float64)),
        *((name, np.float64) for name in ("base", "travelled")),
    ]
)
"""An object: centre [m], heading, size [m], grey of the body, brake lights, model, range [m], speed [m/s],
height of the underside, 0 for all that stands on the ground [m]; `height` is that of the top, with a rider;
distance travelled, which moves the legs of pedestrians and cyclists [m].

A vehicle has the model `MODEL_CAR`; `choose_objects` draws large ones as trucks.
"""
_PLAIN = np.dtype((np.void, OBJECT.itemsize))
_RECORD = struct.Struct("=8d2q4d")  # packing is twice as fast as assigning a record

BRAKE_LIGHT_MPS2 = -0.5
"""Acceleration below which the brake lights are on [m/s²]."""
_MOUNT_REACH = 100.0  # upper bound of the distance between a lens and the ego's centre [m]
_TALL_M, _LONG_M, _TRUCK_HEIGHT_M = 2.2, 7.5, 2.8  # a taller or longer car is drawn as a truck
FIGURES = {
    "Pedestrian": (MODEL_PEDESTRIAN, 1.8),
    "Bicycle": (MODEL_BICYCLE, 1.86),
    "Motorcycle": (MODEL_MOTORCYCLE, 1.45),
}
"""Models and default heights [m] of classes by name; the height of a two-wheeler includes its rider."""
JACKET = 60.0
"""Grey of a figure without a grey of its own: a dark jacket, as that of test dummies."""
_SHADES = {
    MODEL_MARK: OUTLINE,
    MODEL_BARRIER: 185.0,
    **{model: JACKET for model, _ in FIGURES.values()},
}
_MODELS: dict[type, tuple[int, float]] = {}


class Body(NamedTuple):
    """A body that a vehicle may have."""

    model: int
    lowest: float  # lower end of its usual heights [m]
    highest: float  # upper end [m]


BODY_MODELS = {
    "small": Body(MODEL_SMALL, 1.44, 1.56),
    "saloon": Body(MODEL_CAR, 1.40, 1.50),
    "suv": Body(MODEL_SUV, 1.62, 1.82),
    "van": Body(MODEL_VAN, 2.20, 2.80),
    "truck": Body(MODEL_TRUCK, 2.80, 3.80),
    "trailer": Body(MODEL_TRAILER, 3.85, 4.00),
    "bus": Body(MODEL_BUS, 2.95, 3.40),
}
"""Bodies of vehicles by name, see `body_of`."""
_HEIGHTS = np.zeros((MODEL_BUS + 1, 2))
for _body in BODY_MODELS.values():
    _HEIGHTS[_body.model] = _body.lowest, _body.highest
_DEFAULT_HEIGHTS = (1.5, 1.427)  # of highway-env's vehicles, and of the target car of the scenarios [m]
_BODY_LONG_M, _BODY_WIDE_M, _TRAILER_LONG_M = 5.2, 2.3, 10.0
_HASH_MASK, _HASH_FACTOR = 0xFFFFFFFF, 0x045D9F3B


class Sector(NamedTuple):
    """Directions that the cameras of a car look in: from `first` to `last`, at most 170° apart."""

    first: float  # yaw to the left of or at all optical axes, relative to the ego's heading [rad]
    last: float  # yaw to the right of or at all optical axes [rad]
    reach: float  # maximum distance of a lens from the ego's front, rear or centreline [m]


def take(records: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Return the `OBJECT` records with these indices, or of a selection, in a new array."""
    # NumPy selects and joins structured records field by field, which takes ten times as long.
    return records.view(_PLAIN)[index].view(OBJECT)


def sorted_by_x(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Return the `OBJECT` records of all parts in one array, sorted by x; equal ones keep their order."""
    joined = np.concatenate([part.view(_PLAIN) for part in parts]).view(OBJECT)
    return take(joined, np.argsort(joined["x"], kind="stable"))


def read_objects(ego: Ego, sector: Sector | None, records: memoryview, index: int = 0) -> int:
    """Read all objects of a road that may be visible, except the ego; returns their number.

    Args:
        ego: The ego and its road.
        sector: Directions of view, to skip objects behind all lenses; None for all around.
        records: Bytes of `OBJECT` records, shape (environments, 512).
        index: Index of the environment.

    Raises:
        ValueError: For an object whose pose is not finite.
    """
    road, vehicle, x, y, heading = ego
    reach = (MAX_RANGE + _MOUNT_REACH) ** 2
    rear, a_x, a_y, b_x, b_y = -math.inf, 0.0, 0.0, 0.0, 0.0
    if sector is not None:
        rear = -sector.reach - 0.5 * vehicle.LENGTH
        a_x, a_y = math.cos(heading + sector.first), math.sin(heading + sector.first)
        b_x, b_y = math.cos(heading + sector.last), math.sin(heading + sector.last)
    count, start = 0, index * MAX_DRAWN
    for group in (road.vehicles, road.objects):
        for place, item in enumerate(group):
            if item is vehicle:
                continue
            position = item.position
            # Arithmetic on Python floats is several times faster than on NumPy scalars.
            px, py = position.tolist() if position.__class__ is np.ndarray else position
            dx, dy = px - x, py - y
            away = dx * dx + dy * dy
            if not away <= reach:
                if not math.isfinite(away):
                    raise ValueError(f"{type(item).__name__} {place} of the road has position ({px}, {py})")
                continue
            behind = rear - item.LENGTH - item.WIDTH
            if dx * a_x + dy * a_y < behind and dx * b_x + dy * b_y < behind:
                continue
            if count == MAX_DRAWN:
                return count
            _write(item, px, py, place, records, start + count)
            count += 1
    return count


def _write(item: "RoadObject", x: float, y: float, place: int, records: memoryview, row: int) -> None:
    heading = item.heading
    if not math.isfinite(heading):
        raise ValueError(f"{type(item).__name__} {place} of the road has heading {heading}")
    model, height = _MODELS.get(item.__class__) or _default_appearance(item.__class__)
    shade = getattr(item, "shade", None)
    if shade is None:
        shade = _SHADES.get(model, FIRST_INDEXED - place)
    elif model == MODEL_BARRIER:
        model = MODEL_BOX  # an obstacle with a grey of its own has no stripes
    action = getattr(item, "action", None)
    braking = bool(action) and action.get("acceleration", 0.0) < BRAKE_LIGHT_MPS2
    _RECORD.pack_into(
        records, row * _RECORD.size,
        x, y, math.cos(heading), math.sin(heading), item.LENGTH, item.WIDTH, getattr(item, "HEIGHT", height),
        shade, braking, model, MAX_RANGE, getattr(item, "speed", 0.0), 0.0, getattr(item, "travelled", 0.0),
    )  # fmt: skip


@kernel
def is_picture(model):
    """Return whether a model is a flat picture that faces the lens."""
    return MODEL_POST <= model <= MODEL_CROWN


@kernel
def is_figure(model):
    """Return whether a model is a pedestrian or a two-wheeler with its rider."""
    return MODEL_PEDESTRIAN <= model <= MODEL_MOTORCYCLE


@kernel(exact=True, arrays=True)
def behind(frustum, obj):
    """Return whether an object is behind a lens, given as a `FRUSTUM` record."""
    ahead = (obj.x - frustum.x) * frustum.cos_yaw + (obj.y - frustum.y) * frustum.sin_yaw
    return frustum.tangent >= 0.0 and ahead <= -obj.length - obj.width


@kernel(exact=True, arrays=True)
def _is_near(frusta, lenses, obj):
    """Return whether an object is within range and not behind all lenses of an eye."""
    dx, dy = obj.x - frusta[0].x, obj.y - frusta[0].y
    if dx * dx + dy * dy > MAX_RANGE * MAX_RANGE:
        return False
    near = False
    for k in range(lenses):
        near |= not behind(frusta[k], obj)
    return near


@kernel(exact=True, arrays=True)
def choose_objects(frusta, lenses, mount, objects, count, chosen):
    """Copy the objects that one of several lenses at one place may see; returns their number.

    Args:
        frusta: `FRUSTUM` records of the lenses.
        lenses: Number of lenses.
        mount: `MOUNT` record, for `box`, `seed`, `drawn` and `linear`.
        objects: `OBJECT` records.
        count: Number of objects.
        chosen: `OBJECT` records to write, with the model and the grey that are drawn.
    """
    n = 0
    for i in range(count):
        if not _is_near(frusta, lenses, objects[i]):
            continue
        chosen[n] = objects[i]
        obj = chosen[n]
        n += 1
        if is_figure(obj.model) and mount.box != 0:
            obj.model = MODEL_BOX
        if obj.model == MODEL_CAR:
            if mount.box != 0:
                obj.model = MODEL_BOX
            elif mount.drawn != 0:
                # The index of a vehicle depends on which ones are visible, but its shade does not.
                index = int(16.0 * obj.shade)
                obj.model, obj.height = body_of(mount.seed, index, obj.length, obj.width, obj.height)
            elif obj.height > _TALL_M or obj.length > _LONG_M:
                obj.model, obj.height = MODEL_TRUCK, max(obj.height, _TRUCK_HEIGHT_M)
        if obj.shade <= FIRST_INDEXED:
            obj.shade = index_shade(mount.seed, FIRST_INDEXED - obj.shade)
        if obj.model != MODEL_MARK:
            obj.shade = light_of_code(obj.shade, mount.linear)
    return n


@kernel(exact=True, arrays=True)
def light_of_code(grey, linear):
    """Return the light of a display-coded grey level, 255 for white; see `effects.to_light`."""
    return grey * grey * (1.0 / 255.0) if linear > 0.0 else grey


def _default_appearance(cls: type) -> tuple[int, float]:
    """Return model and default height [m] of a class of objects, from the names of its base classes."""
    names = {base.__name__ for base in cls.__mro__}
    figure = [FIGURES[name] for name in FIGURES if name in names]
    if figure:
        model = figure[0]
    elif "Landmark" in names:
        model = MODEL_MARK, 0.0
    elif "Obstacle" in names:
        model = MODEL_BARRIER, 1.0
    else:
        model = MODEL_CAR, 1.5
    _MODELS[cls] = model
    return model


@kernel(exact=True, arrays=True)
def index_shade(seed, index):
    """Return the grey of the index-th vehicle: 30 to 225, evenly spread, the same in every process."""
    # Golden-ratio steps: neighbours in the list differ, and any few cover dark to light.
    return 30.0 + 195.0 * ((0.29 + 0.6180339887498949 * index + 0.7548776662466927 * seed) % 1.0)


@kernel(exact=True, arrays=True)
def _share(world, index, draw):
    """Return a number from 0 to 1 that is drawn by hashing three integers, the same in every process."""
    mixed = 0
    for number in (world, index, draw):
        mixed = ((mixed ^ (number & _HASH_MASK)) * _HASH_FACTOR + 1) & _HASH_MASK
        mixed = ((mixed ^ (mixed >> 16)) * _HASH_FACTOR) & _HASH_MASK
        mixed ^= mixed >> 16
    return mixed / 4294967296.0


@kernel(exact=True, arrays=True)
def body_of(world, index, length, width, height):
    """Return the model and the height [m] of the index-th vehicle of a world.

    Cars are small cars, saloons or SUVs. From 5.2 m they are vans; from 7.5 m, or wider than 2.3 m, they are
    trucks, buses and, from 10 m, articulated trucks. A vehicle of the default height (1.5 m, 1.427 m) gets a
    usual one of its body.

    Args:
        world: Integer that draws the appearance of an episode.
        index: Place of the vehicle in the road's list.
        length: Length of the vehicle [m].
        width: Width of the vehicle [m].
        height: Height of the vehicle [m].
    """
    kind = _share(world, index, 0)
    if length >= _LONG_M or (length >= _BODY_LONG_M and width > _BODY_WIDE_M):
        if length >= _TRAILER_LONG_M and kind < 0.5:
            model = MODEL_TRAILER
        else:
            model = MODEL_BUS if kind > 0.75 else MODEL_TRUCK
    elif length >= _BODY_LONG_M:
        model = MODEL_VAN
    else:
        model = MODEL_SMALL if kind < 0.3 else MODEL_SUV if kind > 0.7 else MODEL_CAR
    if height in _DEFAULT_HEIGHTS:
        low, high = _HEIGHTS[model, 0], _HEIGHTS[model, 1]
        height = low + (high - low) * _share(world, index, 1)
    return model, height
