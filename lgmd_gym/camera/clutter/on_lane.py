"""What lies on a lane, and queues of cars that stand on it."""

from collections.abc import Callable

import numpy as np

from lgmd_gym.camera.clutter.beside import bodies
from lgmd_gym.camera.clutter.parts import mark, part
from lgmd_gym.camera.clutter.sites import Sites

Parts = list[np.ndarray]


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
        part(cars, model, (length, width, height), shade, along=along, out=rng.uniform(-0.2, 0.2, n),
             braking=braking)
    ]  # fmt: skip
