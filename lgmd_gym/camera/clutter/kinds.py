# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""What stands beside a road, spans it, or lies and queues on its lanes."""

from collections.abc import Callable

import numpy as np

from lgmd_gym.camera.clutter.sites import Sites, mark, part
from lgmd_gym.camera.objects import (
    MODEL_BEAM,
    MODEL_BOARD,
    MODEL_BOX,
    MODEL_CROWN,
    MODEL_DECK,
    MODEL_HEDGE,
    MODEL_HOUSE,
    MODEL_LAMP,
    MODEL_PANEL,
    MODEL_PLATE_SIGN,
    MODEL_POST,
    MODEL_POWER_POLE,
    MODEL_ROUND_SIGN,
    MODEL_SIGNAL,
    MODEL_THICKET,
    MODEL_TREE,
    MODEL_TRIANGLE_SIGN,
    MODEL_WALL,
    body_of,
)
from lgmd_gym.camera.roadside import PLANT_RANGE
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


_GANTRY_FREE = 5.5  # free height below panels [m]


def bridges(s: Sites, rng: np.random.Generator) -> Parts:
    """Return bridges with a deck of 6 to 14 m along the road, on abutments or piers."""
    n = len(s.place)
    return _covered(s, rng.uniform(6.0, 14.0, n), np.where(rng.random(n) < 0.5, 0.8, 3.5), rng)


def tunnels(s: Sites, rng: np.random.Generator) -> Parts:
    """Return underpasses of 30 to 60 m."""
    n = len(s.place)
    return _covered(s, rng.uniform(30.0, 60.0, n), np.full(n, 0.8), rng)


def _covered(s: Sites, length: np.ndarray, thick: np.ndarray, rng: np.random.Generator) -> Parts:
    """Return decks on walls of a thickness, 4.7 to 5.5 m above the road."""
    n = len(s.place)
    free, gap, shade = rng.uniform(4.7, 5.5, n), rng.uniform(0.9, 1.8, n), rng.uniform(110.0, 180.0, n)
    deck = (length, s.width + 2.0 * (gap + thick), free + rng.uniform(1.4, 2.2, n))
    walls = [
        part(s, MODEL_BOX, (length, thick, free), 0.85 * shade, out=out)
        for out in (gap + 0.5 * thick, -s.width - gap - 0.5 * thick)
    ]
    return [part(s, MODEL_DECK, deck, shade, out=-0.5 * s.width, base=free), *walls]


def gantries(s: Sites, rng: np.random.Generator) -> Parts:
    """Return gantries: two legs, a beam, and one to three panels in front of it."""
    n, top = len(s.place), _GANTRY_FREE + 1.7
    shade = rng.uniform(90.0, 160.0)
    out = [part(s, MODEL_BOX, (0.35, 0.35, top), shade, out=out, along=0.3) for out in (1.4, -s.width - 1.4)]
    beam = (0.5, s.width + 2.4, top)
    out.append(part(s, MODEL_BEAM, beam, shade, out=-0.5 * s.width, along=0.3, base=top - 0.7))
    panels = np.minimum(rng.integers(1, 4, n), np.maximum(s.width // 3.6, 1.0))
    grey = rng.choice((45.0, 65.0, 205.0), n)
    for k in range(3):
        chosen = panels > k
        some = s.select(chosen)
        size = (0.1, rng.uniform(2.4, 3.3), _GANTRY_FREE + rng.uniform(2.0, 2.9))
        out.append(
            part(
                some,
                MODEL_PANEL,
                size,
                grey[chosen],
                out=-(k + 0.5) * some.width / panels[chosen],
                base=_GANTRY_FREE,
            )
        )
    return out


def signals(s: Sites, rng: np.random.Generator) -> Parts:
    """Return traffic signals: a mast with an arm over the right lane, and a head on each."""
    shade = rng.uniform(50.0, 140.0)
    return [
        part(s, MODEL_BOX, (0.18, 0.18, 6.0), shade, out=1.1),
        part(s, MODEL_BEAM, (0.14, 4.0, 6.0), shade, out=-1.0, base=5.85),
        part(s, MODEL_SIGNAL, (0.3, 0.35, 5.8), 35.0, out=-1.6, along=-0.1, base=4.85),
        part(s, MODEL_SIGNAL, (0.3, 0.35, 3.2), 35.0, out=1.1, along=-0.3, base=2.25),
    ]


def zebras(s: Sites, rng: np.random.Generator) -> Parts:
    """Return zebra crossings: bars of 0.5 m by 3 to 4 m, every metre."""
    shade, length = rng.uniform(170.0, 220.0, len(s.place)), rng.uniform(3.0, 4.0)
    out = []
    for k in range(int(s.width.max(initial=0.0))):
        chosen = s.width > k + 0.5
        out.append(mark(s.select(chosen), (length, 0.5), shade[chosen], out=-k - 0.5, distance=PLANT_RANGE))
    return out


ACROSS: dict[str, Callable[[Sites, np.random.Generator], Parts]] = {
    "tunnel": tunnels,
    "bridge": bridges,
    "gantry": gantries,
    "signal": signals,
    "zebra": zebras,
}
"""Kinds across the road, those that must not give way first."""


def arrows(s: Sites, rng: np.random.Generator) -> Parts:
    """Return arrows straight ahead: a shaft and two strokes of the head."""
    shade = rng.uniform(165.0, 215.0, len(s.place))
    head = [mark(s, (1.3, 0.25), shade, along=1.75, out=0.28 * k, turn=-0.5 * k) for k in (-1.0, 1.0)]
    return [mark(s, (4.0, 0.18), shade), *head]


def patches(s: Sites, rng: np.random.Generator) -> Parts:
    """Return patches of tar, most of them darker than the asphalt."""
    n = len(s.place)
    size = (rng.uniform(0.8, 6.0, n), rng.uniform(0.5, 2.2, n))
    shade = np.where(rng.random(n) < 0.7, rng.uniform(60.0, 90.0, n), rng.uniform(107.0, 116.0, n))
    out = rng.uniform(-0.5, 0.5, n) * np.maximum(s.width - size[1], 0.0)
    return [mark(s, size, shade, out=out)]


def manholes(s: Sites, rng: np.random.Generator) -> Parts:
    """Return manholes, dark squares of 0.6 m."""
    n = len(s.place)
    out = rng.uniform(-0.3, 0.3, n) * s.width
    return [mark(s, (0.6, 0.6), rng.uniform(40.0, 70.0, n), out=out)]


def joints(s: Sites, rng: np.random.Generator) -> Parts:
    """Return joints of tar across the lane."""
    return [mark(s, (0.12, s.width), rng.uniform(35.0, 60.0, len(s.place)))]


def skids(s: Sites, rng: np.random.Generator) -> Parts:
    """Return pairs of skid marks."""
    n = len(s.place)
    size, shade = (rng.uniform(4.0, 15.0, n), 0.18), rng.uniform(60.0, 85.0, n)
    turn, out = rng.uniform(-0.03, 0.03, n), rng.uniform(-0.3, 0.3, n)
    return [mark(s, size, shade, out=out + k, turn=turn) for k in (-0.75, 0.75)]


ON_LANE: dict[str, Callable[[Sites, np.random.Generator], Parts]] = {
    "arrow": arrows,
    "patch": patches,
    "manhole": manholes,
    "joint": joints,
    "skid": skids,
}
"""Kinds on every lane."""


def queues(s: Sites, rng: np.random.Generator) -> Parts:
    """Return queues of 4 to 14 standing cars on straight lanes, from each site on."""
    count = rng.integers(4, 15, len(s.place))
    cars = s.select(np.repeat(np.arange(len(count)), count))
    n = len(cars.place)
    length, width = rng.uniform(3.7, 4.8, n), rng.uniform(1.65, 1.9, n)
    steps = length + rng.uniform(1.5, 3.5, n)
    along = np.cumsum(steps)
    along -= np.repeat(along[np.cumsum(count) - count], count)
    model, height = bodies(length, width, rng)
    shade, braking = rng.uniform(30.0, 225.0, n), rng.random(n) < 0.5
    return [
        part(
            cars,
            model,
            (length, width, height),
            shade,
            along=along,
            out=rng.uniform(-0.2, 0.2, n),
            braking=braking,
        )
    ]
