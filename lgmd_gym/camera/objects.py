"""The drawable objects of a highway-env road (vehicles, obstacles, landmarks) as an array.

Objects are read by duck typing, so that this module does not import highway-env.
"""

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pose import CameraPose
from lgmd_gym.camera.scene import SceneState

MAX_RANGE = 600.0
"""Range of vehicles and obstacles from the lens; they fade in over the last sixth [m]."""
MAX_DRAWN = 512
"""Maximum number of objects in a frame; the first ones of the road's lists are kept."""

MODEL_CAR, MODEL_TRUCK, MODEL_BOX, MODEL_MARK, MODEL_BARRIER, MODEL_RAIL = 0, 1, 2, 3, 4, 5
MODEL_POST, MODEL_TREE = 6, 7  # flat pictures that face the lens
OUTLINE = -1.0
"""Shade of a ground mark that is painted as an outline; other shades fill it."""

OBJECT = np.dtype(
    [
        *((name, np.float64) for name in ("x", "y", "cos", "sin", "length", "width", "height", "shade")),
        *(("braking", np.int64), ("model", np.int64), ("range", np.float64), ("speed", np.float64)),
    ]
)
"""An object: centre [m], heading, size [m], grey of the body, brake lights, model, range [m], speed [m/s]."""
_RECORD = struct.Struct("=8d2q2d")  # packing is twice as fast as assigning a record

_BRAKE_LIGHT_MPS2 = -0.5
_MOUNT_REACH = 100.0  # upper bound of the distance between a lens and the ego's centre [m]
_MODELS: dict[type, tuple[int, float]] = {}


class ObjectList:
    """The objects of a scene that may be visible to the cameras.

    Attributes:
        records: `OBJECT` records, shape (512,). The kernels append the roadside.
        count: Number of records in use.
    """

    def __init__(self) -> None:
        self.records = np.zeros(MAX_DRAWN, OBJECT)
        self.count = 0
        self._bytes = self.records.view(np.uint8).data

    def __reduce__(self) -> tuple[type, tuple[()]]:
        """Copy and pickle as an empty list; every frame rewrites the records."""
        return ObjectList, ()

    def read(self, scene: SceneState, p: CameraParams, poses: Sequence[CameraPose]) -> None:
        """Read all objects except the ego that may be visible from these poses.

        Args:
            scene: State of the environment.
            p: Parameters of one of the cameras, for `seed` and `vehicles`.
            poses: Poses of the lenses.

        Raises:
            ValueError: For an object whose pose is not finite.
        """
        x, y, _, yaw, _ = poses[0]
        if len(poses) == 1 or all(pose.x == x and pose.y == y and pose.yaw == yaw for pose in poses):
            # One direction of view: skip the objects behind the lens.
            self._read(scene, p, (x, y), (math.cos(yaw), math.sin(yaw)), MAX_RANGE)
        else:
            self._read(scene, p, (scene.x, scene.y), (0.0, 0.0), MAX_RANGE + _MOUNT_REACH)

    def _read(
        self,
        scene: SceneState,
        p: CameraParams,
        centre: tuple[float, float],
        view: tuple[float, float],
        reach: float,
    ) -> None:
        self.count = 0
        x, y = centre
        view_x, view_y = view
        ego = scene.ego
        for group in (scene.road.vehicles, scene.road.objects):
            for index, item in enumerate(group):
                if item is ego:
                    continue
                position = item.position
                # Arithmetic on Python floats is several times faster than on NumPy scalars.
                px, py = position.tolist() if position.__class__ is np.ndarray else position
                dx, dy = px - x, py - y
                ahead = dx * view_x + dy * view_y
                if not -item.LENGTH - item.WIDTH < ahead < reach or dx * dx + dy * dy > reach * reach:
                    if not math.isfinite(ahead):
                        raise ValueError(
                            f"{type(item).__name__} {index} of the road has position ({px}, {py})"
                        )
                    continue
                if self.count == MAX_DRAWN:
                    return
                self._append(item, px, py, index, p)

    def _append(self, item: Any, px: float, py: float, index: int, p: CameraParams) -> None:
        heading = item.heading
        if not math.isfinite(heading):
            raise ValueError(f"{type(item).__name__} {index} of the road has heading {heading}")
        model, height, shade = _appearance(item, index, p)
        action = getattr(item, "action", None)
        braking = bool(action) and action.get("acceleration", 0.0) < _BRAKE_LIGHT_MPS2
        _RECORD.pack_into(
            self._bytes, self.count * _RECORD.size,
            px, py, math.cos(heading), math.sin(heading), item.LENGTH, item.WIDTH, height, shade,
            braking, model, MAX_RANGE, getattr(item, "speed", 0.0),
        )  # fmt: skip
        self.count += 1


def _appearance(item: Any, index: int, p: CameraParams) -> tuple[int, float, float]:
    """Return model, height [m] and shade of an object."""
    cls = item.__class__
    model, height = _MODELS.get(cls) or _default_appearance(cls)
    height = getattr(item, "HEIGHT", height)
    if model == MODEL_CAR:
        if p.vehicles == "box":
            model = MODEL_BOX
        elif height > 2.2 or item.LENGTH > 7.5:
            model, height = MODEL_TRUCK, max(height, 2.8)
    shade = getattr(item, "shade", None)
    if shade is not None:
        # An obstacle with a grey of its own has no stripes.
        return MODEL_BOX if model == MODEL_BARRIER else model, height, shade
    if model == MODEL_MARK:
        return model, height, OUTLINE
    return model, height, 185.0 if model == MODEL_BARRIER else index_shade(p.seed, index)


def _default_appearance(cls: type) -> tuple[int, float]:
    """Return model and default height [m] of a class of objects, from the names of its base classes."""
    names = {base.__name__ for base in cls.__mro__}
    if "Landmark" in names:
        model = MODEL_MARK, 0.0
    elif "Obstacle" in names:
        model = MODEL_BARRIER, 1.0
    else:
        model = MODEL_CAR, 1.5
    _MODELS[cls] = model
    return model


def index_shade(seed: int, index: int) -> float:
    """Return the grey of the index-th vehicle: 30 to 225, evenly spread, the same in every process."""
    # Golden-ratio steps: neighbours in the list differ, and any few cover dark to light.
    return 30.0 + 195.0 * ((0.29 + 0.6180339887498949 * index + 0.7548776662466927 * seed) % 1.0)
