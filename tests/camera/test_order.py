"""Drawing order of objects: from far to near where one may hide the other."""

import numpy as np
import pytest
from support.records import lens_of
from support.roads import box_record

from lgmd_gym.camera.objects import MODEL_BEAM, MODEL_BOX, MODEL_MARK, MODEL_POST, MODEL_RAIL, MODEL_TREE
from lgmd_gym.camera.render.seen import Seen, aim_frustum, make_seen, order_objects, seen_by


def ordered(*records, **lens):
    """Return the indices of the visible objects in drawing order, and whether this order is a right one."""
    arrays = (array.view(np.recarray) if array.dtype.names else array for array in make_seen(1))
    seen, posed, count = Seen(*arrays), lens_of(**lens), len(records)
    aim_frustum(posed, seen.frusta[0])
    for i, record in enumerate(records):
        seen.objects[i] = record[0]
        seen.lenses[i] = seen_by(seen.frusta, 1, seen.objects[i], False)
    seen.counts[0] = count
    exists = order_objects(posed, posed.focal, 1, seen)
    return seen.order[: seen.counts[1]].tolist(), bool(exists)


def drawing_order(*records, **lens):
    """Return the indices of the visible objects in drawing order."""
    return ordered(*records, **lens)[0]


def test_car_is_in_front_of_the_wall_whose_centre_is_nearer():
    wall = box_record(20.0, 4.0, (50.0, 0.3, 3.0))
    car = box_record(30.0, 2.0, (4.0, 1.8, 1.5))
    behind = box_record(15.0, 6.0, (4.0, 1.8, 1.5))
    assert drawing_order(wall, car, behind) == [2, 0, 1]
    assert drawing_order(behind, car, wall) == [0, 2, 1]


def test_tree_is_behind_the_wall_that_ends_farther_away():
    wall = box_record(30.0, 4.0, (50.0, 0.3, 3.0))
    tree = box_record(25.0, 9.0, (6.0, 6.0, 8.0), model=MODEL_TREE)
    assert drawing_order(wall, tree) == drawing_order(tree, wall)[::-1] == [1, 0]


@pytest.mark.parametrize(("height", "order"), [(1.0, [1, 0]), (8.0, [0, 1])])
@pytest.mark.parametrize(("x", "width"), [(30.0, 30.0), (32.0, 4.0)])
def test_deck_hides_what_is_below_it_only_from_above(x, width, height, order):
    """The car is below the middle of a wide deck, or below the far end of a narrow one."""
    car, deck = box_record(x, 0.0, (4.0, 1.8, 1.5)), box_record(28.0, 0.0, (10.0, width, 7.0), base=5.0)
    assert drawing_order(car, deck, z=height) == order


@pytest.mark.parametrize(("height", "seen"), [(4.9, True), (5.0, False), (6.9, False), (7.0, True)])
def test_lens_under_a_deck_is_outside_it(height, seen):
    deck = box_record(2.0, 0.0, (10.0, 30.0, 7.0), base=5.0)
    assert (drawing_order(deck, z=height) == [0]) == seen


def test_marks_come_last():
    mark = box_record(40.0, 0.0, (2.0, 2.0, 0.0), model=MODEL_MARK)
    car = box_record(10.0, 0.0, (4.0, 1.8, 1.5))
    assert drawing_order(mark, car) == [1, 0]


def test_objects_that_intersect_are_all_drawn():
    """A post in a container behind a rail: nearer than the rail, which hides the container around it."""
    rail = box_record(-41.92, -108.98, (5.32, 0.12, 0.75), heading=0.08, model=MODEL_RAIL)
    post = box_record(-44.58, -108.73, (0.1, 0.1, 1.0), model=MODEL_POST)
    container = box_record(-44.5, -108.58, (7.22, 0.8, 5.31))
    order, exists = ordered(rail, post, container, yaw=-1.94)
    assert sorted(order) == [0, 1, 2]
    assert not exists


def test_objects_whose_azimuths_only_touch_hide_each_other_in_neither_order():
    """A post behind a rail, beside it in the frame: planes between them have the lens on either side."""
    rail = box_record(129.9, -6.75, (8.0, 0.12, 0.75), model=MODEL_RAIL)
    post = box_record(128.9, -7.2, (0.1, 0.1, 1.0), model=MODEL_POST)
    assert ordered(rail, post)[1]
    assert ordered(post, rail)[1]


@pytest.mark.parametrize("turn", [0, 1, 2])
def test_arm_of_a_lamp_behind_a_hedge_has_a_drawing_order(turn):
    """The arm is above the hedge, and in front of its side; the pole ends above the arm."""
    pole = box_record(147.0, -7.5, (0.16, 0.16, 7.9), model=MODEL_BOX)
    arm = box_record(147.0, -6.5, (0.2, 1.9, 7.9), model=MODEL_BEAM, base=7.76)
    hedge = box_record(138.5, -9.1, (24.0, 2.8, 5.6), model=MODEL_BOX)
    records = [pole, arm, hedge]
    order, exists = ordered(*records[turn:], *records[:turn])
    names = [("pole", "arm", "hedge")[(turn + index) % 3] for index in order]
    assert exists
    assert names.index("hedge") < names.index("pole") < names.index("arm")


def first_and_further_hits(boxes, azimuth):
    """Return the box that a ray from the origin meets first, and the others that it meets, by index."""
    entries = []
    for index, (x, y, heading, length, width) in enumerate(boxes):
        c, s = np.cos(heading), np.sin(heading)
        start = np.array([-x * c - y * s, x * s - y * c])  # of the ray, along the sides of the box
        step = np.array([np.cos(azimuth - heading), np.sin(azimuth - heading)])
        half = 0.5 * np.array([length, width])
        enter, leave = np.sort([(-half - start) / step, (half - start) / step], axis=0)
        if enter.max() < leave.min() and leave.min() > 0.0:
            entries.append((enter.max(), index))
    hits = [index for _, index in sorted(entries)]
    return hits[:1], hits[1:]


@pytest.mark.parametrize("seed", range(40))
def test_what_a_ray_meets_first_is_drawn_last(seed):
    """Boxes in strips across the view; in odd seeds upright and wide, in even ones of any heading."""
    rng = np.random.default_rng(seed)
    strips = 6.0 + np.cumsum(rng.uniform(1.0, 9.0, 14))
    boxes = []
    for middle, depth in zip(0.5 * (strips[1:] + strips[:-1]), np.diff(strips), strict=True):
        size = (0.8 * depth, rng.uniform(0.1, 20.0)) if seed % 2 else rng.uniform(0.1, 0.7, 2) * depth
        boxes.append((middle, rng.uniform(-0.5, 0.5) * middle, (1 - seed % 2) * rng.uniform(0.0, 3.1), *size))
    rng.shuffle(boxes)
    yaw, met = rng.uniform(-0.3, 0.3), 0
    records = [box_record(x, y, (length, width, 3.0), heading=turn) for x, y, turn, length, width in boxes]
    order, exists = ordered(*records, yaw=yaw)
    assert exists
    for azimuth in yaw + np.linspace(-0.5, 0.5, 200):
        first, further = first_and_further_hits(boxes, azimuth)
        met += len(further)
        assert all(order.index(other) < order.index(first[0]) for other in further)
    assert met > 0
