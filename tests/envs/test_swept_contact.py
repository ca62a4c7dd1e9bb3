"""The look-ahead kernels against the plain walk along paths, one piece of way after the other."""

import copy
from math import hypot, isnan

import numpy as np
import pytest

from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.path import Bend, Path, Pose
from lgmd_gym.envs.dynamics.swept_contact import gap_on_path, time_on_paths

HORIZON, STEP = 10.0, 0.1  # [s]
FAR, PIECE = 300.0, 1.0  # [m]


class Item:
    """A box that keeps its path and speed."""

    def __init__(self, path, along, speed, length, width):
        self.path, self.along, self.speed, self.size = path, along, speed, (length, width)

    def outline(self, further):
        return Rectangle(*self.path.pose(self.along + further), *self.size)


def free_way(one, other):
    return hypot(other.x - one.x, other.y - one.y) - one.reach - other.reach


def walked_time(one, other):
    fastest, time = one.speed + other.speed, 0.0
    while time < HORIZON and fastest > 0.0:
        here, there = one.outline(one.speed * time), other.outline(other.speed * time)
        free = free_way(here, there) / fastest
        if free > STEP:
            time += free
            continue
        ends = one.outline(one.speed * (time + STEP)), other.outline(other.speed * (time + STEP))
        dx = (ends[0].x - here.x) - (ends[1].x - there.x)
        dy = (ends[0].y - here.y) - (ends[1].y - there.y)
        touch = first_touch(here, there, dx, dy)
        if touch is not None:
            return time + touch * STEP
        time += STEP
    return np.nan


def walked_gap(one, outline):
    gone = 0.0
    while gone < FAR:
        here, there = one.outline(gone), one.outline(gone + PIECE)
        free = free_way(here, outline)
        if free > PIECE:
            gone += free
            continue
        touch = first_touch(here, outline, there.x - here.x, there.y - here.y)
        if touch is not None:
            return gone + touch * PIECE
        gone += PIECE
    return np.nan


def drawn(rng, near, along=None):
    """A box on a path of up to three bends that starts near a pose: before, on or beyond its bends."""
    aside = rng.uniform(-4.0, 4.0, 2)
    start = Pose(near.x + aside[0], near.y + aside[1], rng.uniform(-3.2, 3.2))
    bends = []
    for _ in range(rng.integers(0, 4)):
        first, last = rng.uniform(-0.05, 0.05, 2)
        bends.append(Bend(float(rng.uniform(5.0, 60.0)), float(first), [None, float(last)][rng.integers(2)]))
    speed = float(rng.choice([0.0, rng.uniform(0.5, 30.0)]))
    along = float(rng.uniform(-20.0, 80.0)) if along is None else along
    return Item(Path(start, tuple(bends)), along, speed, *rng.uniform(0.3, 6.0, 2))


def test_kernels_find_what_a_walk_finds():
    rng, touches = np.random.default_rng(0), 0
    for _ in range(300):
        one = drawn(rng, Pose(0.0, 0.0, 0.0))
        other = drawn(rng, one.path.pose(one.along + float(rng.uniform(0.0, 60.0))), 0.0)
        sizes = (*one.size, *other.size)
        places = (one.path.table, one.along), (other.path.table, other.along)
        time = time_on_paths(*places, (one.speed, other.speed), sizes, HORIZON, STEP)
        assert time == pytest.approx(walked_time(one, other), abs=1e-9, nan_ok=True)
        standing = other.outline(0.0)
        place = (standing.x, standing.y, standing.heading)
        gap = gap_on_path(places[0], place, sizes, FAR, PIECE)
        assert gap == pytest.approx(walked_gap(one, standing), abs=1e-9, nan_ok=True)
        touches += (not isnan(time)) + (not isnan(gap))
    assert touches > 100


def test_copies_of_a_scene_share_its_paths():
    """They never change, and an environment is copied at every decision of a recorded drive."""
    path = Path(Pose(0.0, 0.0, 0.0), (Bend(10.0, 0.1),))
    assert copy.deepcopy({"path": path})["path"] is path
