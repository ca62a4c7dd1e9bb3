"""Drawing order of objects: from far to near where one may hide the other."""

import numpy as np
import pytest
from support.records import lens_of
from support.roads import box_record

from lgmd_gym.camera.objects import MODEL_MARK, MODEL_TREE
from lgmd_gym.camera.render.seen import Seen, aim_frustum, make_seen, order_objects, seen_by


def drawing_order(*records, **lens):
    """Return the indices of the visible objects in drawing order."""
    arrays = (array.view(np.recarray) if array.dtype.names else array for array in make_seen(1))
    seen, posed, count = Seen(*arrays), lens_of(**lens), len(records)
    aim_frustum(posed, seen.frusta[0])
    for i, record in enumerate(records):
        seen.objects[i] = record[0]
        seen.lenses[i] = seen_by(seen.frusta, 1, seen.objects[i], False)
    seen.counts[0] = count
    order_objects(posed, posed.focal, 1, seen)
    return seen.order[: seen.counts[1]].tolist()


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
def test_deck_hides_what_is_below_it_only_from_above(height, order):
    car, deck = box_record(30.0, 0.0, (4.0, 1.8, 1.5)), box_record(28.0, 0.0, (10.0, 30.0, 7.0), base=5.0)
    assert drawing_order(car, deck, z=height) == order


@pytest.mark.parametrize(("height", "seen"), [(4.9, True), (5.0, False), (6.9, False), (7.0, True)])
def test_lens_under_a_deck_is_outside_it(height, seen):
    deck = box_record(2.0, 0.0, (10.0, 30.0, 7.0), base=5.0)
    assert (drawing_order(deck, z=height) == [0]) == seen


def test_marks_come_last():
    mark = box_record(40.0, 0.0, (2.0, 2.0, 0.0), model=MODEL_MARK)
    car = box_record(10.0, 0.0, (4.0, 1.8, 1.5))
    assert drawing_order(mark, car) == [1, 0]


def test_boxes_that_hide_each_other_in_turn_are_all_drawn():
    """Three long boxes, each with an end in front of the next one; none may be drawn first."""
    boxes = [
        box_record(20.0 + 4.0 * np.cos(turn), 4.0 * np.sin(turn), (16.0, 0.5, 3.0), heading=turn + 1.9)
        for turn in (0.0, 2.1, 4.2)
    ]
    assert sorted(drawing_order(*boxes)) == [0, 1, 2]
