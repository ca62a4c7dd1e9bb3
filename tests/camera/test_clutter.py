"""Clutter: where it stands, and how it is drawn."""

from dataclasses import fields, replace

import numpy as np
import pytest
from reference.camera import worst_error
from support.cameras import rig
from support.roads import box_record, lens_x, ring_road, set_roadside, straight_env

from lgmd_gym.camera import objects
from lgmd_gym.camera.clutter import ROAD_TYPES, Clutter, draw_clutter, place_clutter
from lgmd_gym.camera.objects import MODEL_BEAM, MODEL_BUS, MODEL_CAR, MODEL_DECK, MODEL_MARK, OBJECT

KINDS = [field.name for field in fields(Clutter)]
EVERYTHING = Clutter(**dict.fromkeys(KINDS, 6.0))
MODELS = {name: number for name, number in vars(objects).items() if name.startswith("MODEL_")}
NEW = [name for name, number in MODELS.items() if number >= MODEL_BEAM]


def straight(lanes=2, length=3000.0, heading=0.0):
    """Return the lanes of a straight road, 3.5 m wide each; the first one is on the left."""
    along = length * np.array([np.cos(heading), np.sin(heading)])
    right = np.array([-np.sin(heading), np.cos(heading)])
    starts = [3.5 * lane * right for lane in range(lanes)]
    return np.array([[*start, *(start + along), 0.0, 3.5] for start in starts])


def two_way():
    """Return two lanes in opposite directions."""
    return np.array([[3000.0, 0.0, 0.0, 0.0, 0.0, 3.5], [0.0, 3.5, 3000.0, 3.5, 0.0, 3.5]])


def curve():
    """Return a ring of 40 m radius, 4 m wide."""
    _, lane = ring_road()
    at = np.linspace(0.0, lane.length, 127)
    points = np.array([lane.position(s, 0.0) for s in at])
    return np.column_stack((points[:-1], points[1:], at[:-1], np.full(126, 4.0)))


ROADS = {"straight": straight(), "wide": straight(5), "oblique": straight(3, 2000.0, 2.0),
         "two-way": two_way(), "curve": curve()}  # fmt: skip


def place(road="straight", seed=0, clutter=EVERYTHING, **options):
    return place_clutter(ROADS[road], clutter, seed, **options)


def one(kind, density=20.0, **options):
    """Return the clutter of one kind."""
    return place(clutter=Clutter(**{kind: density}), **options)


def outlines(records):
    """Return points along the sides of objects, shape (n, points, 2) [m]."""
    a, b = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.5, 0.5, 15), np.linspace(-0.5, 0.5, 5)))
    lx, ly = a * records["length"][:, None], b * records["width"][:, None]
    cos, sin = records["cos"][:, None], records["sin"][:, None]
    x, y = records["x"][:, None] + lx * cos - ly * sin, records["y"][:, None] + lx * sin + ly * cos
    return np.stack((x, y), axis=2)


def beyond_lanes(points, road):
    """Return the distance of points beyond the nearest edge of a lane [m]; below 0 on a lane."""
    out = np.full(points.shape[:-1], np.inf)
    for x0, y0, x1, y1, _, width in ROADS[road]:
        start, step = np.array([x0, y0]), np.array([x1 - x0, y1 - y0])
        share = np.clip((points - start) @ step / (step @ step), 0.0, 1.0)
        gap = np.linalg.norm(points - start - share[..., None] * step, axis=-1) - 0.5 * width
        out = np.minimum(out, gap)
    return out


@pytest.mark.parametrize("road", ROADS)
@pytest.mark.parametrize("seed", range(3))
def test_nothing_stands_on_a_lane(road, seed):
    records = place(road, seed)
    low = records[(records["model"] != MODEL_MARK) & (records["base"] < 4.5)]
    assert len(low) > 10
    assert beyond_lanes(outlines(low), road).min() > 0.29


def test_what_is_over_a_lane_leaves_the_free_height():
    for kind, free in (("bridge", 4.7), ("tunnel", 4.7), ("gantry", 5.5), ("overhanging_tree", 4.5)):
        records = one(kind)
        over = records[beyond_lanes(outlines(records), "straight").min(axis=1) < 0.3]
        assert len(over) > 20, kind
        assert free <= over["base"].min() < free + 1.0, kind


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_has_its_density(kind):
    """3 km with two outer edges, one road, or two lanes; pieces may have several parts."""
    options = {"queue_lane": 0} if kind == "queue" else {}
    records = one(kind, 5.0, **options)
    assert len(records) >= 12
    twice = one(kind, 10.0, **options)
    assert 1.4 < len(twice) / len(records) < 2.6
    assert len(place(clutter=Clutter())) == 0


def test_gantries_have_their_density():
    beams = one("gantry", 5.0)
    beams = beams[beams["model"] == MODEL_BEAM]
    assert 13 <= len(beams) <= 16
    assert beams["width"] == pytest.approx(7.0 + 2.4)
    assert beams["y"] == pytest.approx(1.75)


def test_two_way_road_has_one_bridge_per_site():
    decks = place("two-way", clutter=Clutter(bridge=4.0))
    decks = decks[decks["model"] == MODEL_DECK]
    assert 10 <= len(decks) <= 13
    assert decks["y"] == pytest.approx(1.75)
    assert decks["width"].min() > 7.0 + 2 * (0.9 + 0.8) - 1e-9


def test_solids_do_not_overlap():
    records = place("two-way", clutter=ROAD_TYPES["urban"])
    solids = records[records["model"] != MODEL_MARK]
    points = outlines(solids)
    for i, item in enumerate(solids):
        dx, dy = points[..., 0] - item["x"], points[..., 1] - item["y"]
        along = np.abs(dx * item["cos"] + dy * item["sin"]) < 0.49 * item["length"]
        across = np.abs(dy * item["cos"] - dx * item["sin"]) < 0.49 * item["width"]
        touched = (along & across).any(axis=1)
        touched &= (solids["base"] < item["height"] - 1e-6) & (solids["height"] > item["base"] + 1e-6)
        others = np.flatnonzero(touched & (np.arange(len(solids)) != i))
        # Parts of one tree, lamp post, signal or bridge meet.
        gaps = np.hypot(solids["x"][others] - item["x"], solids["y"][others] - item["y"])
        assert (gaps < 6.0).all()


def test_queue_stands_on_its_lane_only():
    clutter = Clutter(queue=10.0)
    assert len(place(clutter=clutter)) == 0
    for lane in (0, 1):
        cars = place(clutter=clutter, queue_lane=lane)
        assert len(cars) > 50
        assert np.abs(cars["y"] - 3.5 * lane).max() <= 0.2
        assert {int(model) for model in cars["model"]} <= {MODEL_CAR, *range(9, MODEL_BUS + 1)}
    with pytest.raises(ValueError, match=r"queue_lane must be a whole number in \[0, 1\]"):
        place(clutter=clutter, queue_lane=2)


def test_same_seed_gives_the_same_records_sorted_by_x():
    records = place()
    assert records.dtype == OBJECT
    assert np.all(np.diff(records["x"]) >= 0.0)
    assert np.array_equal(records, place())
    assert not np.array_equal(records["x"][:50], place(seed=1)["x"][:50])


def test_range_limits_the_sites():
    records = place(x_range=(500.0, 700.0))
    assert 450.0 < records["x"].min() < 530.0
    assert 670.0 < records["x"].max() < 750.0


def test_road_without_lanes_has_no_clutter():
    assert len(place_clutter(np.zeros((0, 6)), EVERYTHING, 0)) == 0


@pytest.mark.parametrize("value", [-0.1, 200.1, np.nan, "4", True])
def test_density_out_of_range_is_an_error(value):
    with pytest.raises(ValueError, match="clutter sign must be"):
        Clutter(sign=value)


def is_drawn_from(clutter, typical, kind):
    """Return whether the density of a kind is 0, or 0.4 to 1.6 times the typical one."""
    density, usual = getattr(clutter, kind), getattr(typical, kind)
    return density == 0.0 or 0.4 * usual <= density <= 1.6 * usual


def test_drawn_clutter_is_that_of_a_road_type():
    drawn = [draw_clutter(np.random.default_rng(seed)) for seed in range(200)]
    assert drawn[3] == draw_clutter(np.random.default_rng(3))
    for clutter in drawn:
        fits = [
            all(is_drawn_from(clutter, typical, kind) for kind in KINDS) for typical in ROAD_TYPES.values()
        ]
        assert any(fits)
    signs = np.array([clutter.sign for clutter in drawn])
    assert 0.15 < np.mean(signs == 0.0) < 0.35


@pytest.mark.parametrize("name", NEW)
@pytest.mark.parametrize("heading", [0.15, 2.7])
def test_model_is_drawn_as_along_the_rays(name, heading):
    env = straight_env(lanes=1, y=0.0)
    params = rig(shape=(24, 32), hfov_deg=50.0, texture=0.0, roadside=0.0, pitch_deg=10.0)
    size = (0.4, 4.0, 6.0) if MODELS[name] <= 22 else (8.0, 4.0, 6.0)
    base = 3.0 if MODELS[name] <= 16 else 0.0
    record = box_record(lens_x(env) + 14.0, 1.0, size, heading=heading, model=MODELS[name], base=base)
    set_roadside(env, params, record)
    assert worst_error(params, env) <= 1.0


@pytest.mark.parametrize(("seed", "kind"), list(enumerate(ROAD_TYPES, start=8)))
def test_clutter_is_drawn_as_along_the_rays(seed, kind):
    """Also the order of what hides each other, next to a queue and under bridges.

    On one road in ten, long objects hide each other in turn, and some pixels are wrong.
    """
    env = straight_env(lanes=2, x=300.0)
    params = rig(shape=(21, 34), hfov_deg=60.0, texture=0.0)
    lanes = np.array([[-200.0, y, 5000.0, y, 0.0, 3.5] for y in (0.0, 3.5)])
    clutter = replace(ROAD_TYPES[kind], bridge=6.0, gantry=6.0, signal=6.0)
    records = place_clutter(lanes, clutter, seed, (250.0, 500.0), queue_lane=0)
    assert len(records) > 10
    set_roadside(env, params, records)
    assert worst_error(params, env) <= 1.0
