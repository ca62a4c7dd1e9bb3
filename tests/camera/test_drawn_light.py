"""Light and sensor of numbered worlds: tone curve, exposure at night, markings, street lamps."""

import numpy as np
import pytest
from support.cameras import ego_camera, rig
from support.roads import box_record, lens_x, set_roadside, straight_env

from lgmd_gym.camera.clutter import Clutter, place_clutter
from lgmd_gym.camera.effects import look_of, noise_table
from lgmd_gym.camera.objects import MODEL_LAMP, MODEL_THICKET, MODEL_TREE
from lgmd_gym.camera.render.sensor import expose, fixed_tone
from lgmd_gym.camera.worlds import SPLIT_WORLDS, World, draw_world

TRAINING = [draw_world(number) for number in SPLIT_WORLDS["train"][:300]]


@pytest.mark.parametrize(
    ("grey", "expected"), [(110.0, 110), (60.0, 35), (30.0, 0), (150.0, 170), (220.0, 255)]
)
def test_tone_curve_is_steeper_around_the_target_of_the_exposure(grey, expected):
    look = look_of(*rig(linear_light=True))
    assert (look["contrast"], look["target_grey"]) == (1.0, 110.0)
    look["contrast"] = 1.5
    image, out = np.full((3, 20), grey**2 / 255.0, np.float32), np.zeros((3, 20), np.uint8)
    expose(out, image, look[()], 1.0, fixed_tone(look[()]), noise_table(0), 0)
    assert np.abs(out.astype(int) - expected).max() <= 1


@pytest.mark.parametrize(
    ("name", "low", "high"), [("contrast", 1.0, 1.55), ("night_exposure", 0.22, 0.9), ("noise", 0.12, 1.2)]
)
def test_worlds_differ_in_their_sensor(name, low, high):
    values = np.array([getattr(world, name) for world in TRAINING])
    assert low <= values.min() < values.max() <= high
    assert values.max() - values.min() > 0.9 * (high - low)


def test_target_of_the_exposure_at_night():
    world = draw_world(5)
    looks = [look_of(*rig({"world": 5, "weather": name})) for name in ("clear", "night")]
    assert [float(look["target_grey"]) for look in looks] == pytest.approx(
        [world.exposure_grey, world.exposure_grey * world.night_exposure]
    )
    assert World().night_exposure == 0.5


@pytest.mark.parametrize(
    ("fields", "brighter"),
    [({"world": 5, "weather": "night"}, True), ({"world": 5, "weather": "night", "wet": True}, False),
     ({"world": 5}, False), ({"weather": "night"}, False)],
)  # fmt: skip
def test_dry_markings_return_headlights(fields, brighter):
    look, day = (look_of(*rig(f)) for f in (fields, {**fields, "light": "day"}))
    share = 1.8 if brighter else 1.0
    assert look["paint"] == pytest.approx(share * day["paint"])


def test_street_lamps_shine_at_night_to_all_sides():
    env = straight_env()
    frames = {}
    for light in ("day", "night"):
        for heading in (0.0, np.pi / 2):
            params = rig(light=light, roadside=0.0, pitch_deg=8.0)
            record = box_record(
                lens_x(env) + 40.0, 4.0, (0.5, 0.5, 8.0), heading=heading, model=MODEL_LAMP, base=7.8
            )
            set_roadside(env, params, record)
            camera = ego_camera(params)
            frames[light, heading] = camera.render(env).astype(int)
            u, v = np.floor(camera.project([lens_x(env) + 40.0, 4.0, 7.9])).astype(int)
    for heading in (0.0, np.pi / 2):
        night = frames["night", heading]
        assert night[v, u] > 200
        assert night[v - 2, u] > night[v - 12, u] + 10  # the halo
        assert frames["day", heading][v - 2, u] == frames["day", heading][v - 2, u + 4]


def test_rows_of_trees_and_thickets_stand_along_the_road():
    segments = np.array([[0.0, 0.0, 2000.0, 0.0, 0.0, 3.5]])
    trees = place_clutter(segments, Clutter(avenue=5.0), 0)
    assert set(trees["model"]) == {MODEL_TREE}
    right = np.sort(trees["x"][trees["y"] > 0.0])
    assert np.isclose(np.diff(right), 7.0).mean() > 0.6
    thickets = place_clutter(segments, Clutter(thicket=20.0), 0)
    assert set(thickets["model"]) == {MODEL_THICKET}
    # A piece of 24 m every 50 m on each side, less those that would overlap.
    assert 0.7 * 2 * 40 <= len(thickets) <= 2 * 40
    assert (np.abs(thickets["y"]) - 0.5 * thickets["width"] - 1.75).min() >= 1.2 - 1e-9
