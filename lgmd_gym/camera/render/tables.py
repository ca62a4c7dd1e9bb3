# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Lookup tables of a camera in its scene, which kernels reach by their addresses.

The cameras of a batch have tables of many worlds. One call draws them all, because it finds the tables of
each in `SharedTables.places` rather than among its arguments.
"""

from typing import NamedTuple

import numpy as np
from numba import carray, types  # pyright: ignore[reportPrivateImportUsage]
from numba.core import cgutils

from lgmd_gym.camera.camera import Camera
from lgmd_gym.camera.effects import noise_table
from lgmd_gym.camera.render.sky import panorama_table, skyline
from lgmd_gym.camera.render.texture import ground_texture
from lgmd_gym.camera.scene import Scene
from lgmd_gym.camera.worlds import draw_world
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import intrinsic


class Tables(NamedTuple):
    """Lookup tables."""

    asphalt: np.ndarray  # `Texture.data`
    verge: np.ndarray  # `Texture.data`
    level_start: np.ndarray  # `Texture.level_start` of both
    skyline: np.ndarray  # see `skyline`
    noise: np.ndarray  # see `noise_table`
    panorama: np.ndarray  # see `panorama_table`


PLACES = (len(Tables._fields), 3)
"""Shape of `SharedTables.places`."""


class SharedTables:
    """Lookup tables of a camera in its scene; cameras with the same surroundings share the arrays.

    Attributes:
        tables: The arrays.
        places: Address, and first and second length, of each array, int64, shape `PLACES`. The addresses hold
            as long as this object exists, in this process.
    """

    def __init__(self, camera: Camera, scene: Scene) -> None:
        self._arguments = camera, scene
        world, seed = draw_world(scene.world), scene.seed
        grounds = (world.asphalt, world.verge) if world.drawn else (("asphalt", seed), ("verge", seed))
        asphalt, verge = (ground_texture(*ground) for ground in grounds)
        self.tables = Tables(
            asphalt=asphalt.data,
            verge=verge.data,
            level_start=asphalt.level_start,
            skyline=skyline(100_000 + world.skyline if world.drawn else seed),
            noise=noise_table(0 if world.drawn else seed),
            panorama=panorama_table(camera, scene),
        )
        self.places = np.array([_place_of(table) for table in self.tables], np.int64)

    def __deepcopy__(self, memo: dict[int, object]) -> "SharedTables":
        return self

    def __reduce__(self) -> tuple[object, ...]:
        return SharedTables, self._arguments


def _place_of(table: np.ndarray) -> tuple[int, int, int]:
    """Return the address and the lengths of an array with one or two dimensions."""
    length, width = (*table.shape, 0)[:2]
    return table.__array_interface__["data"][0], length, width


@intrinsic
def _pointer(typing_context, address):
    """Return an address as a pointer."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


@kernel(arrays=True)
def tables_at(places):
    """Return the `Tables` in `SharedTables.places`."""
    return Tables(
        asphalt=carray(_pointer(places[0, 0]), (places[0, 1],), np.uint8),
        verge=carray(_pointer(places[1, 0]), (places[1, 1],), np.uint8),
        level_start=carray(_pointer(places[2, 0]), (places[2, 1], places[2, 2]), np.int64),
        skyline=carray(_pointer(places[3, 0]), (places[3, 1], places[3, 2]), np.float32),
        noise=carray(_pointer(places[4, 0]), (places[4, 1],), np.float32),
        panorama=carray(_pointer(places[5, 0]), (places[5, 1], places[5, 2]), np.float32),
    )
