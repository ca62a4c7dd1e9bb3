"""Compiled contact prediction against the same algorithm on `Path` and `Rectangle`."""

import copy
from math import hypot, inf

import numpy as np
import pytest

from lgmd_gym.envs.dynamics.contact import PathMotion, Rectangle, first_touch, gap_on_path, time_on_paths
from lgmd_gym.envs.dynamics.path import Path
from lgmd_gym.envs.dynamics.script import Bend, Pose

TIME_HORIZON, TIME_STEP = 10.0, 0.1  # [s]
GAP_HORIZON, GAP_STEP = 300.0, 1.0  # [m]


class Box:
    """A rectangle on a path at constant speed."""

    def __init__(self, path, travelled, speed, length, width):
        self.path, self.speed = path, speed
        self.motion = PathMotion(path.table, travelled, speed, length, width)

    def outline(self, distance):
        return Rectangle(*self.path.pose(self.motion.travelled + distance), *self.motion[3:5])


def clearance(one, other):
    reach = hypot(one.length, one.width) / 2 + hypot(other.length, other.width) / 2
    return hypot(other.x - one.x, other.y - one.y) - reach


def reference_time(one, other):
    fastest, time = one.speed + other.speed, 0.0
    while time < TIME_HORIZON and fastest > 0.0:
        a, b = one.outline(one.speed * time), other.outline(other.speed * time)
        free = clearance(a, b) / fastest
        if free > TIME_STEP:
            time += free
            continue
        later = time + TIME_STEP
        c, d = one.outline(one.speed * later), other.outline(other.speed * later)
        touch = first_touch(a, b, (c.x - a.x) - (d.x - b.x), (c.y - a.y) - (d.y - b.y))
        if touch < inf:
            return time + touch * TIME_STEP
        time = later
    return inf


def reference_gap(one, standing):
    gap = 0.0
    while gap < GAP_HORIZON:
        here, there = one.outline(gap), one.outline(gap + GAP_STEP)
        free = clearance(here, standing)
        if free > GAP_STEP:
            gap += free
            continue
        touch = first_touch(here, standing, there.x - here.x, there.y - here.y)
        if touch < inf:
            return gap + touch * GAP_STEP
        gap += GAP_STEP
    return inf


def random_box(rng, near, travelled=None):
    """A box near a pose, on a path of up to three bends: before, on or beyond them."""
    offset = rng.uniform(-4.0, 4.0, 2)
    start = Pose(near.x + offset[0], near.y + offset[1], rng.uniform(-3.2, 3.2))
    bends = []
    for _ in range(rng.integers(0, 4)):
        first, last = rng.uniform(-0.05, 0.05, 2)
        bends.append(Bend(float(rng.uniform(5.0, 60.0)), float(first), [None, float(last)][rng.integers(2)]))
    speed = float(rng.choice([0.0, rng.uniform(0.5, 30.0)]))
    travelled = float(rng.uniform(-20.0, 80.0)) if travelled is None else travelled
    length, width = rng.uniform(0.3, 6.0, 2)
    return Box(Path(start, tuple(bends)), travelled, speed, float(length), float(width))


def test_compiled_prediction_equals_the_reference():
    rng, touches = np.random.default_rng(0), 0
    for _ in range(300):
        one = random_box(rng, Pose(0.0, 0.0, 0.0))
        other = random_box(rng, one.path.pose(one.motion.travelled + float(rng.uniform(0.0, 60.0))), 0.0)
        time = time_on_paths(one.motion, other.motion, TIME_HORIZON, TIME_STEP)
        assert time == pytest.approx(reference_time(one, other), abs=1e-9)
        standing = Rectangle(*map(float, other.outline(0.0)))
        gap = gap_on_path(one.motion, standing, GAP_HORIZON, GAP_STEP)
        assert gap == pytest.approx(reference_gap(one, standing), abs=1e-9)
        touches += (time < inf) + (gap < inf)
    assert touches > 100


def test_copies_of_a_scene_share_its_paths():
    """Paths are immutable, and recordings copy an environment at every decision."""
    path = Path(Pose(0.0, 0.0, 0.0), (Bend(10.0, 0.1),))
    assert copy.deepcopy({"path": path})["path"] is path
