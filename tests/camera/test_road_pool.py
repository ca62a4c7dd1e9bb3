"""`RoadPool`: roads of many environments in common arrays."""

import copy
import pickle

import numpy as np
import pytest
from support.roads import ring_road, straight_env

from lgmd_gym.camera.road_geometry import road_geometry
from lgmd_gym.camera.road_pool import RoadPool

PLAIN, SEEDED, RAILS = (1.0, 0, False), (2.0, 3, False), (0.0, 0, True)


def stored(pool, index):
    """Return the road of an environment as it is stored."""
    surface, lines, roadside, spans = pool.arrays
    a, b, c, d, e, f, paved = spans[index]
    return surface[a:b], lines[c:d], roadside[e:f], bool(paved)


def assert_holds(pool, index, road, key):
    for got, expected in zip(stored(pool, index), road_geometry(road, *key), strict=True):
        np.testing.assert_array_equal(got, expected)


def roads(count):
    return [straight_env(lanes=1 + k % 4, width=3.0 + 0.1 * k).road for k in range(count)]


def test_every_environment_has_its_road():
    pool = RoadPool(5)
    used = [*roads(4), ring_road()[0]]
    for index, road in enumerate(used):
        pool.assign(index, road, PLAIN)
    for index, road in enumerate(used):
        assert_holds(pool, index, road, PLAIN)
    pool.assign(2, used[2], RAILS)
    for index, road in enumerate(used):
        assert_holds(pool, index, road, RAILS if index == 2 else PLAIN)


def test_equal_roads_are_stored_once():
    pool = RoadPool(50)
    for index in range(50):
        pool.assign(index, straight_env().road.network, PLAIN)
    assert len(np.unique(pool.arrays.spans, axis=0)) == 1
    assert len(pool.arrays.roadside) <= 2 * len(stored(pool, 0)[2])


def test_space_of_unused_roads_is_used_again():
    pool = RoadPool(3)
    largest = 0
    for k, road in enumerate(roads(60)):
        pool.assign(k % 3, road, SEEDED)
        assert_holds(pool, k % 3, road, SEEDED)
        largest = max(largest, len(stored(pool, k % 3)[2]))
    assert len(pool.arrays.roadside) <= 2 * 4 * largest


def test_a_known_network_is_not_read_again(monkeypatch):
    pool, road = RoadPool(1), straight_env().road
    pool.assign(0, road, PLAIN)
    monkeypatch.setattr("lgmd_gym.camera.road_pool.road_geometry", None)
    pool.assign(0, road.network, PLAIN)
    with pytest.raises(TypeError):
        pool.assign(0, road, SEEDED)


def test_arrays_in_use_by_another_thread_stay_as_they_are():
    pool, (first, *others) = RoadPool(2), roads(12)
    pool.assign(0, first, PLAIN)
    old = pool.arrays
    before = copy.deepcopy(old)
    for road in others:
        pool.assign(1, road, PLAIN)
    assert pool.arrays is not old
    span = before.spans[0]
    np.testing.assert_array_equal(old.spans[0], before.spans[0])
    np.testing.assert_array_equal(old.roadside[span[4] : span[5]], before.roadside[span[4] : span[5]])


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda pool: pickle.loads(pickle.dumps(pool))])
def test_copies_are_independent(duplicate):
    pool, used = RoadPool(2), roads(6)
    for index in range(2):
        pool.assign(index, used[index], PLAIN)
    clone = duplicate(pool)
    pool.assign(0, used[2], PLAIN)
    clone.assign(0, used[3], PLAIN)
    clone.assign(1, used[4], PLAIN)
    pool.assign(1, used[5], PLAIN)
    assert_holds(pool, 0, used[2], PLAIN)
    assert_holds(pool, 1, used[5], PLAIN)
    assert_holds(clone, 0, used[3], PLAIN)
    assert_holds(clone, 1, used[4], PLAIN)


def test_a_road_without_lanes_is_paved():
    pool = RoadPool(1)
    pool.assign(0, None, PLAIN)
    assert stored(pool, 0)[3]
    assert pool.arrays.spans[0, :6].tolist() == [0] * 6
