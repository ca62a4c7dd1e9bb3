"""Independence of what a level draws: nothing but the scenario predicts a threat, and no field another one.

Draws that share a random stream are functions of one another, and a policy would learn them. Levels and
worlds are fixed, so that the tests themselves have no chance.
"""

from dataclasses import fields, replace
from itertools import combinations, product
from types import SimpleNamespace

import numpy as np
import pytest

from lgmd_gym.camera.worlds import World, draw_world
from lgmd_gym.envs.appearance import world_weather
from lgmd_gym.envs.dynamics.brake import draw_brake
from lgmd_gym.envs.episode_source import RandomLevels
from lgmd_gym.envs.families import LEVELS
from lgmd_gym.envs.families.distribution import ALL_FAMILIES

COUNT = 2500  # of levels, and of worlds
BINS = 8
LIMIT = 5.0  # [standard deviations], 1 in 3,500,000; there are about 1,000 pairs of fields
THREATS = {LEVELS[name].family for name in ALL_FAMILIES if LEVELS[name].threat}
SCENARIO = {"threat", "ego_speed"}
# Fields of a world that depend on one another on purpose: a grey or contrast on its surface.
ON_PURPOSE = ({"asphalt", "asphalt_grey", "asphalt_contrast"}, {"verge", "verge_grey"})


def level(source, number):
    """Return what a source draws for a level."""
    return source.draw(SimpleNamespace(integers=lambda count: number))


def fields_of_world(number):
    """Return the fields of a world and of its brake and weather, each a number or a name."""
    world, brake = draw_world(number), draw_brake(number, wet=False)
    row = {field.name: getattr(world, field.name) for field in fields(World)}
    row["asphalt"], row["asphalt tile"] = world.asphalt
    row["verge"], row["verge tile"] = world.verge
    row["dash"] = world.dash[0] + 100 * world.dash[1]
    zenith, row["horizon"], row["hills"], row["trees"] = row.pop("greys")
    row["zenith"] = zenith / row["horizon"]
    row |= {"max_deceleration": brake.max_deceleration, "dead_time": brake.dead_time}
    return row | {"build_up": brake.build_up, "mixed weather": world_weather(number)}


def columns_of(rows):
    """Return the bins of every field that varies."""
    columns = {name: binned(np.array([row[name] for row in rows])) for name in rows[0]}
    return {name: column for name, column in columns.items() if column.max() > 0}


def binned(column):
    """Return the bins of a column: its values, or about its octiles if it has more than 16."""
    values, codes = np.unique(column, return_inverse=True)
    if len(values) > 2 * BINS:
        codes = np.searchsorted(np.quantile(codes, np.arange(1, BINS) / BINS), codes, side="right")
    return np.unique(codes, return_inverse=True)[1]  # without empty ones


@pytest.fixture(scope="module")
def levels():
    """Return the bins of what levels draw, with the fields of their worlds."""
    source = RandomLevels(mount_heights=(1.0, 2.0), decelerations=(4.0, 10.0), sensor_errors=1.0)
    rows = []
    for number in range(COUNT):
        placement, scene, _, brake = level(source, number)
        row = {"threat": placement.scenario.family in THREATS, "ego_speed": placement.scenario.ego_speed}
        row |= {"start": placement.start.x, "weather": scene.weather.name, "texture": scene.texture}
        row |= {"mount height": scene.mount_height_m, "drawn deceleration": brake.max_deceleration}
        row |= {"pitch error": scene.pitch_error_deg, "height error": scene.height_error_m}
        row |= {"gyroscope": scene.gyroscope}
        rows.append(row | fields_of_world(scene.world))
    return columns_of(rows)


def deviation(one, other):
    """Return how far two columns of bins are from independence, in standard deviations.

    χ² of their table of counts, made normal by its cube root (Wilson and Hilferty 1931).
    """
    counts = np.zeros((one.max() + 1, other.max() + 1))
    np.add.at(counts, (one, other), 1)
    expected = counts.sum(1, keepdims=True) * counts.sum(0) / counts.sum()
    freedom = (counts.shape[0] - 1) * (counts.shape[1] - 1)
    spread = 2 / (9 * freedom)
    chi2 = ((counts - expected) ** 2 / expected).sum()
    return ((chi2 / freedom) ** (1 / 3) - (1 - spread)) / spread**0.5


def dependent(columns, pairs):
    """Return the pairs of columns that depend on one another, with their deviation."""
    found = {(one, other): deviation(columns[one], columns[other]) for one, other in pairs}
    return {pair: round(float(off), 1) for pair, off in found.items() if off > LIMIT}


def test_nothing_but_the_scenario_depends_on_the_level(levels):
    """Neither a field of the world nor another draw of the level predicts a threat, or one another."""
    of_level = ("threat", "ego_speed", "start", "weather", "texture", "mount height", "drawn deceleration")
    of_level += ("pitch error", "height error", "gyroscope")
    of_world = {*levels} - {*of_level}
    assert {"yaw_error_deg", "sun_azimuth_deg", "exposure_s", "dead_time", "mixed weather"} <= of_world
    assert len(of_world) > 35
    pairs = [*product(of_level, of_world), *combinations(of_level, 2)]
    assert dependent(levels, pairs).keys() == {("threat", "ego_speed")}  # reversing and turning are slow


def test_a_share_of_the_levels_has_errors_of_the_sensor():
    """Errors of ±1° and ±0.15 m, drawn evenly; half of these cars have no gyroscope."""
    with_errors, without = RandomLevels(sensor_errors=0.3), RandomLevels()
    scenes = [level(with_errors, number).scene for number in range(800)]
    changed = [scene for scene in scenes if scene.pitch_error_deg != 0.0]
    assert len(changed) == pytest.approx(240, abs=4 * (800 * 0.3 * 0.7) ** 0.5)
    tilts = np.array([scene.pitch_error_deg for scene in changed])
    heights = np.array([scene.height_error_m for scene in changed])
    for values, limit in ((tilts, 1.0), (heights, 0.15)):
        assert 0.95 * limit < np.abs(values).max() < limit
        assert abs(values.mean()) < 0.15 * limit
    absent = sum(not scene.gyroscope for scene in scenes)
    assert absent == sum(not scene.gyroscope for scene in changed)
    assert absent == pytest.approx(len(changed) / 2, abs=2 * len(changed) ** 0.5)
    for number, scene in enumerate(scenes[:50]):
        clean = replace(scene, pitch_error_deg=0.0, height_error_m=0.0, gyroscope=True)
        assert clean == level(without, number).scene


def test_no_field_of_a_world_depends_on_another_one():
    worlds = columns_of([fields_of_world(number) for number in range(COUNT)])
    worlds.pop("number")
    pairs = [pair for pair in combinations(worlds, 2) if not any({*pair} <= known for known in ON_PURPOSE)]
    assert dependent(worlds, pairs) == {}


def test_half_of_the_levels_are_threats_whatever_is_drawn(levels):
    threat = levels["threat"].astype(bool)
    for name in {*levels} - SCENARIO:
        for value in range(levels[name].max() + 1):
            chosen = threat[levels[name] == value]
            # 4.5 standard deviations of a share of 0.5
            assert abs(chosen.mean() - 0.5) < 4.5 * 0.5 / len(chosen) ** 0.5, (name, value)


@pytest.mark.parametrize(
    "function",
    [
        lambda uniform: np.exp(3 * uniform),
        lambda uniform: 0.5 - uniform,
        lambda uniform: np.where(uniform < 0.5, "day", "night"),
        lambda uniform: np.abs(uniform - 0.5),
        lambda uniform: 8 * uniform % 1.0,
    ],
)
def test_shared_streams_are_found(function):
    """Functions of one uniform number: on another scale, mirrored, as a name, folded and repeated."""
    uniform = np.random.default_rng(1).uniform(size=COUNT)
    columns = {"one": binned(uniform), "other": binned(np.random.default_rng(2).uniform(size=COUNT))}
    assert dependent(columns, [("one", "other")]) == {}
    columns["other"] = binned(function(np.round(uniform, 2)))
    assert dependent(columns, [("one", "other")])


def test_every_random_stream_of_a_level_is_used_once(monkeypatch):
    """Also streams of which only other bits are used, which no statistical test finds."""
    seeds, make = [], np.random.default_rng

    def recorded(seed):
        seeds.append(tuple(seed))
        return make(seed)

    source = RandomLevels(mount_heights=(1.0, 2.0), decelerations=(4.0, 10.0))
    monkeypatch.setattr(np.random, "default_rng", recorded)
    _, scene, _, _ = level(source, 5)
    assert sorted(seed for seed in seeds if seed[:2] == (0, 5)) == [
        (0, 5),
        *((0, 5, k) for k in (1, 2, 3, 4, 5)),
    ]
    seeds.clear()
    draw_world.__wrapped__(scene.world)
    draw_brake(scene.world, wet=False)
    world_weather(scene.world)
    assert len({*seeds}) == len(seeds) == 3
    assert {world for world, _ in seeds} == {scene.world}


def test_levels_of_the_same_number_differ_between_splits_and_parts():
    splits = [RandomLevels(split) for split in ("train", "validation", "test")]
    draws = [level(source, number) for source in splits for number in range(20)]
    for values in ([draw.scene.texture for draw in draws], [draw.placement.start.x for draw in draws]):
        assert len({*values}) == len(draws)
    source = RandomLevels(mount_heights=(0.5, 1.5), decelerations=(0.5, 1.5))
    for number in range(50):
        drawn = level(source, number)
        parts = drawn.scene.texture, drawn.scene.mount_height_m, drawn.brake.max_deceleration
        assert len({round(part, 6) for part in parts}) == 3
