"""RoadPool: the static geometry of the roads of many environments in common arrays."""

import copy
from collections.abc import Sequence
from hashlib import sha256
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from lgmd_gym.camera.objects import OBJECT
from lgmd_gym.camera.road_geometry import LINE, QUAD, RoadGeometry, network_of, road_geometry
from lgmd_gym.camera.scene import Scene
from lgmd_gym.camera.worlds import draw_world
from lgmd_gym.kernels.bundle import Bundle

if TYPE_CHECKING:
    from highway_env.road.road import Road, RoadNetwork


RoadKey: TypeAlias = tuple[float, int, bool, bool, int | None]
"""What the geometry depends on besides the lanes: the arguments of `road_geometry`."""
Span: TypeAlias = tuple[int, ...]
"""A row of `RoadArrays.spans`."""


def road_key(scene: Scene) -> RoadKey:
    """Return what the geometry of the road depends on in a scene."""
    world = draw_world(scene.world)
    rail = scene.guard_rail or world.guard_rail
    queue_lane = scene.queue_lane if world.drawn else None
    return scene.roadside * world.roadside, scene.noise_seed, rail, world.drawn, queue_lane


def scene_geometry(road: "Road | RoadNetwork", scene: Scene) -> RoadGeometry:
    """Return the geometry of a road in a scene."""
    return road_geometry(road, *road_key(scene))


class RoadArrays(NamedTuple):
    """Roads as the kernels read them."""

    surface: np.ndarray  # asphalt of all roads, `QUAD` records
    lines: np.ndarray  # markings of all roads, `LINE` records
    roadside: np.ndarray  # posts, trees and rails of all roads, `OBJECT` records
    # first and last + 1 row of `surface`, `lines` and `roadside`, and 1 for an all-paved ground, per
    # environment, int64, shape (num_envs, 7)
    spans: np.ndarray


class RoadPool:
    """Geometry of the roads of many environments; equal roads are stored once.

    One thread at a time may call `assign`, also while others draw environments whose roads stay the same:
    rows in use never change, and a larger pool is a new set of arrays.

    Args:
        num_envs: Number of environments.

    Attributes:
        arrays: The present `RoadArrays`.
        bundle: The same arrays.
    """

    def __init__(self, num_envs: int) -> None:
        spans = np.zeros((num_envs, 7), dtype=np.int64)
        self.arrays = RoadArrays(np.zeros(0, QUAD), np.zeros(0, LINE), np.zeros(0, OBJECT), spans)
        self.bundle = Bundle(*self.arrays)
        self._roads: list[tuple[Road | RoadNetwork, RoadKey] | None] = [None] * num_envs
        self._stored: dict[bytes, Span] = {}
        self._used = [0, 0, 0]  # rows of surface, lines and roadside
        self._shared = False  # whether a copy of this pool has the same arrays

    def assign(
        self, index: int, road: "Road | RoadNetwork", key: RoadKey, geometry: RoadGeometry | None = None
    ) -> None:
        """Set the road of an environment.

        A call with the same network and key as before returns at once: a network must not change.

        Args:
            index: Environment.
            road: A highway-env `Road` or `RoadNetwork`.
            key: `road_key` of the scene.
            geometry: Its `road_geometry` for this key, if it is known.
        """
        network, known = network_of(road), self._roads[index]
        if known is not None and network is known[0] and key == known[1]:
            return
        geometry = road_geometry(network, *key) if geometry is None else geometry
        digest = _digest(geometry)
        if digest not in self._stored:
            self._reserve(geometry)
            self._stored[digest] = _append(self.arrays, self._used, geometry)
        self.arrays.spans[index] = self._stored[digest]
        self._roads[index] = network, key

    def _reserve(self, road: RoadGeometry) -> None:
        """Make space for one more road, if necessary in new arrays without the roads that nothing uses."""
        needed = [used + len(rows) for used, rows in zip(self._used, _rows(road), strict=True)]
        old = self.arrays
        fits = all(need <= len(rows) for need, rows in zip(needed, old[:3], strict=True))
        if fits and not self._shared:
            return
        spans = old.spans.tolist()
        in_use: set[tuple[int, ...]] = set(map(tuple, spans))
        kept = {digest: span for digest, span in self._stored.items() if span in in_use}
        old_roads = {digest: _road_at(old, span) for digest, span in kept.items()}
        sizes = [_count([*old_roads.values(), road], kind) for kind in range(3)]
        arrays = RoadArrays(
            *(
                np.zeros((2 * size, *rows.shape[1:]), rows.dtype)
                for size, rows in zip(sizes, old[:3], strict=True)
            ),
            spans=old.spans.copy(),
        )
        used = [0, 0, 0]
        stored = {digest: _append(arrays, used, kept_road) for digest, kept_road in old_roads.items()}
        moved = {span: stored[digest] for digest, span in kept.items()}
        arrays.spans[:] = [moved.get(tuple(span), span) for span in spans]
        self.arrays, self._stored, self._used, self._shared = arrays, stored, used, False
        self.bundle = Bundle(*arrays)

    def __deepcopy__(self, memo: dict[int, object]) -> "RoadPool":
        """Copy with common geometry: the next new road of either pool goes into new arrays."""
        self._shared = True
        clone = copy.copy(self)
        clone.arrays = self.arrays._replace(spans=self.arrays.spans.copy())
        clone.bundle = Bundle(*clone.arrays)
        clone._roads = copy.deepcopy(self._roads, memo)
        clone._stored, clone._used = dict(self._stored), list(self._used)
        return clone


def _digest(road: RoadGeometry) -> bytes:
    """Return a digest of a geometry's contents."""
    digest = sha256(bytes([road.paved]))
    for rows in _rows(road):
        digest.update(len(rows).to_bytes(8, "little"))
        digest.update(rows.view(np.uint8).data)
    return digest.digest()


def _append(arrays: RoadArrays, used: list[int], road: RoadGeometry) -> Span:
    """Store a road behind the rows in use, and return its span."""
    span: list[int] = []
    for kind, rows in enumerate(_rows(road)):
        start = used[kind]
        used[kind] = end = start + len(rows)
        # As bytes: structured rows are copied field by field.
        arrays[kind][start:end].view(np.uint8)[:] = rows.view(np.uint8)
        span += [start, end]
    return *span, int(road.paved)


def _rows(road: RoadGeometry) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return road.surface, road.lines, road.roadside


def _count(roads: Sequence[RoadGeometry], kind: int) -> int:
    """Return the number of rows of several roads; `kind` is 0, 1 or 2 for surface, lines or roadside."""
    return sum(len(_rows(road)[kind]) for road in roads)


def _road_at(arrays: RoadArrays, span: Span) -> RoadGeometry:
    surface, lines, roadside = (arrays[kind][span[2 * kind] : span[2 * kind + 1]] for kind in range(3))
    return RoadGeometry(surface, lines, roadside, span[6] != 0)
