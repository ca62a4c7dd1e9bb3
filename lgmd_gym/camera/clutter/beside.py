"""What stands beside a road, per site on its outer edge."""

from collections.abc import Callable

import numpy as np

from lgmd_gym.camera.clutter.parts import mark, part
from lgmd_gym.camera.clutter.sites import Sites
from lgmd_gym.camera.objects import (
    MODEL_BEAM,
    MODEL_BOARD,
    MODEL_BOX,
    MODEL_CROWN,
    MODEL_HEDGE,
    MODEL_HOUSE,
    MODEL_LAMP,
    MODEL_PLATE_SIGN,
    MODEL_POST,
    MODEL_POWER_POLE,
    MODEL_ROUND_SIGN,
    MODEL_THICKET,
    MODEL_TREE,
    MODEL_TRIANGLE_SIGN,
    MODEL_WALL,
    body_of,
)
from lgmd_gym.kernels import kernel

Parts = list[np.ndarray]
_SIGNS = np.array([MODEL_ROUND_SIGN, MODEL_TRIANGLE_SIGN, MODEL_PLATE_SIGN])
_BEYOND = 0.35  # distance of parked cars from the lane [m]


def signs(s: Sites, rng: np.random.Generator) -> Parts:
    """Return traffic signs of three shapes, 2.2 to 3 m high."""
    n = len(s.place)
    height = rng.uniform(2.2, 3.0, n)
    shapes = _SIGNS[rng.integers(3, size=n)]
    return [part(s, shapes, (0.06, 0.28 * height, height), 170.0, out=rng.uniform(1.2, 2.0, n))]


def boards(s: Sites, rng: np.random.Generator) -> Parts:
    """Return direction signs on two posts."""
    n = len(s.place)
    width, height = rng.uniform(2.4, 4.5, n), rng.uniform(3.0, 4.2, n)
    shade = rng.choice((45.0, 70.0, 205.0), n)
    return [part(s, MODEL_BOARD, (0.1, width, height), shade, out=1.6 + 0.5 * width)]


def lamp_posts(s: Sites, rng: np.random.Generator) -> Parts:
    """Return lamp posts with an arm of 2 m towards the road."""
    height, shade = rng.uniform(6.5, 9.0), rng.uniform(70.0, 150.0)
    return [
        part(s, MODEL_BOX, (0.16, 0.16, height), shade, out=1.5),
        part(s, MODEL_BEAM, (0.2, 1.9, height), shade, out=0.5, base=height - 0.14),
        part(s, MODEL_LAMP, (0.3, 0.7, height - 0.14), shade, out=-0.1, base=height - 0.3),
    ]


def power_poles(s: Sites, rng: np.random.Generator) -> Parts:
    """Return wooden power poles."""
    height = rng.uniform(8.0, 10.0)
    return [part(s, MODEL_POWER_POLE, (0.2, 2.4, height), 70.0, out=rng.uniform(5.0, 8.0))]


def overhanging_trees(s: Sites, rng: np.random.Generator) -> Parts:
    """Return trees whose crown reaches over the road, above vehicles."""
    n = len(s.place)
    bottom, width = rng.uniform(4.5, 5.2, n), rng.uniform(6.5, 9.5, n)
    shade, out = rng.uniform(40.0, 75.0, n), rng.uniform(2.6, 3.4, n)
    crown = (2.0, width, bottom + width * rng.uniform(0.6, 0.9, n))
    return [
        # Behind the crown, which is a flat picture.
        part(s, MODEL_BOX, (0.4, 0.4, bottom + 0.8), 0.6 * shade, out=out, along=0.35),
        part(s, MODEL_CROWN, crown, shade, out=out, base=bottom),
    ]


def avenues(s: Sites, rng: np.random.Generator) -> Parts:
    """Return rows of four trees, 7 m apart."""
    n = len(s.place)
    shade, out = rng.uniform(30.0, 70.0, n), rng.uniform(2.9, 3.6, n)
    trees = []
    for k in range(4):
        height = rng.uniform(5.5, 8.0, n)
        width = np.minimum(rng.uniform(0.55, 0.75, n) * height, 5.0)
        trees.append(part(s, MODEL_TREE, (width, width, height), shade, out=out, along=7.0 * k - 10.5))
    return trees


def thickets(s: Sites, rng: np.random.Generator) -> Parts:
    """Return pieces of 24 m of dense trees and bushes, 4 to 9 m high."""
    n = len(s.place)
    width, shade = rng.uniform(1.5, 3.0, n), rng.uniform(34.0, 80.0, n)
    out = rng.uniform(1.2, 4.0, n) + 0.5 * width
    return [part(s, MODEL_THICKET, (24.0, width, rng.uniform(4.0, 9.0, n)), shade, out=out)]


def walls(s: Sites, rng: np.random.Generator) -> Parts:
    """Return walls of 30 m, 2 to 4 m high."""
    n = len(s.place)
    height, shade = rng.uniform(2.0, 4.0), rng.uniform(80.0, 190.0)
    return [part(s, MODEL_WALL, (30.0, 0.3, height), shade, out=rng.uniform(2.5, 3.5, n))]


def hedges(s: Sites, rng: np.random.Generator) -> Parts:
    """Return pieces of hedge."""
    n = len(s.place)
    size = (10.0, rng.uniform(0.8, 1.4, n), rng.uniform(1.0, 2.0, n))
    return [part(s, MODEL_HEDGE, size, rng.uniform(45.0, 80.0, n), out=rng.uniform(3.0, 5.0, n))]


def houses(s: Sites, rng: np.random.Generator) -> Parts:
    """Return houses, 6 to 12 m high, that begin 6 to 25 m beyond the edge."""
    n = len(s.place)
    depth, front = rng.uniform(7.0, 11.0, n), rng.uniform(8.0, 20.0, n)
    size = (front, depth, rng.uniform(6.0, 12.0, n))
    out = rng.uniform(6.0, 25.0, n) + 0.5 * depth
    return [part(s, MODEL_HOUSE, size, rng.uniform(90.0, 210.0, n), out=out)]


def parked_cars(s: Sites, rng: np.random.Generator) -> Parts:
    """Return parked vehicles next to the lane, along the road."""
    n = len(s.place)
    length = np.where(rng.random(n) < 0.85, rng.uniform(3.7, 4.8, n), rng.uniform(5.2, 6.5, n))
    width = np.where(length < 5.0, rng.uniform(1.65, 1.9, n), 2.05)
    model, height = bodies(length, width, rng)
    out = _BEYOND + 0.5 * width + rng.uniform(0.0, 0.6, n)
    return [part(s, model, (length, width, height), rng.uniform(30.0, 225.0, n), out=out)]


def bodies(length: np.ndarray, width: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Draw the models and heights of vehicles by their size; float64, shape (2, n)."""
    out = np.zeros((2, len(length)))
    _write_bodies(int(rng.integers(2**31)), length, width, out)
    return out


@kernel(exact=True, arrays=True)
def _write_bodies(world, length, width, out):
    for i in range(len(length)):
        out[0, i], out[1, i] = body_of(world, i, length[i], width[i], 1.5)


def bollards(s: Sites, rng: np.random.Generator) -> Parts:
    """Return groups of three bollards."""
    shade = rng.uniform(60.0, 220.0)
    return [part(s, MODEL_POST, (0.15, 0.15, 0.9), shade, out=0.9, along=along) for along in (-1.5, 0.0, 1.5)]


def drains(s: Sites, rng: np.random.Generator) -> Parts:
    """Return drains at the edge of the asphalt."""
    return [mark(s, (0.5, 0.35), rng.uniform(25.0, 50.0, len(s.place)), out=0.2)]


BESIDE: dict[str, Callable[[Sites, np.random.Generator], Parts]] = {
    "house": houses,
    "wall": walls,
    "lamp_post": lamp_posts,
    "overhanging_tree": overhanging_trees,
    "thicket": thickets,
    "avenue": avenues,
    "power_pole": power_poles,
    "board": boards,
    "sign": signs,
    "parked_car": parked_cars,
    "hedge": hedges,
    "bollard": bollards,
    "drain": drains,
}
"""Kinds beside the road, those that must not give way first."""
