"""Cast shadows of objects outside the frame, and of objects that a shutter shows passing the lens."""

import math

import numpy as np
import pytest
from support.cameras import ego_camera
from support.records import frustum_of, lens_of, records
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera.objects import MODEL_CAR, OBJECT
from lgmd_gym.camera.render.buffers import GroundLayer
from lgmd_gym.camera.render.coverage import add_polygon
from lgmd_gym.camera.render.ground import CAST
from lgmd_gym.camera.render.shadows import add_shadow_of
from lgmd_gym.camera.worlds import draw_world

PLAIN = {"texture": 0.0, "roadside": 0.0}
POST = (1.0, 1.0, 4.0)  # length, width and height [m]: a car that is a thin, tall box
WORLDS = [draw_world(number) for number in range(6000)]


def sunny(azimuth_deg, elevation_deg=26.0):
    """Return a world with a low, bright sun at about this azimuth, and the length of a post's shadow [m]."""
    off = [
        abs((world.sun_azimuth_deg - azimuth_deg + 180.0) % 360.0 - 180.0)
        + 180.0 * (world.sun_share < 0.7 or world.sun_elevation_deg > elevation_deg or world.guard_rail)
        for world in WORLDS
    ]
    world = WORLDS[int(np.argmin(off))]
    assert min(off) < 5.0
    return world.number, POST[2] / math.tan(math.radians(world.sun_elevation_deg))


def light(env, **fields):
    """Return the light of a frame, without noise and exposure."""
    camera = ego_camera("wide", **PLAIN, **fields)
    camera.render(env)
    return camera.light.copy(), camera


@pytest.mark.parametrize(("side", "azimuth_deg"), [(-1, 270.0), (1, 90.0)])
def test_shadow_from_beside_the_frame(side, azimuth_deg):
    """A post beside a narrow frame, its shadow across the road: as in the middle of a wide frame."""
    world, length = sunny(azimuth_deg)
    shape, margin, focal = (48, 80), 200, 80 / 2 / math.tan(math.radians(10.0))
    wide = shape[0], shape[1] + 2 * margin
    hfov_deg = 2 * math.degrees(math.atan(wide[1] / 2 / focal))
    hidden = 0
    for aside in np.arange(4.0, 4.0 + length + 6.0, 1.0):
        env = straight_env(lanes=3, x=0.3, line_types=False)
        bare, _ = light(env, world=world, shape=shape, hfov_deg=20.0)
        add_car(env, 27.0, 3.5 + side * aside, 40, size=POST)
        small, camera = light(env, world=world, shape=shape, hfov_deg=20.0)
        large, _ = light(env, world=world, shape=wide, hfov_deg=hfov_deg)
        crop = large[:, margin:-margin]
        assert np.abs(crop - small).max() < 0.02 * bare.max()
        u, _ = camera.project([27.0, 3.5 + side * aside, 1.0])
        outside = not -20 < u < shape[1] + 20
        hidden += outside and (small < 0.8 * bare).any()
    assert hidden >= 2  # the post is outside, its shadow inside


@pytest.mark.parametrize("gain", [10.0, 20.0])
def test_shadow_of_an_object_that_passes_the_lens_within_the_exposure(gain):
    """A post that overtakes is beside the lens at the end of the exposure, and behind it before.

    An object is behind a lens from its length plus width on, 2 m. At the end the post is 1.95 m behind, at
    the start 0.3 or 0.6 m farther. Its shadow on the road ahead moves as little, so that it is as dark.
    """
    world, length = sunny(180.0)
    env = straight_env(lanes=3, x=40.0, speed=10.0, line_types=False)
    bare, camera = light(env, world=world)
    add_car(env, lens_x(env) - 1.95, 3.5 + 1.6, 40, size=POST, speed=10.0 + gain)
    sharp, _ = light(env, world=world)
    blurred, _ = light(env, world=world, shutter_s=0.03)
    sun = math.radians(WORLDS[world].sun_azimuth_deg)
    found = 0
    for part in np.arange(0.6, 0.95, 0.02):
        x, y = lens_x(env) - 1.95 - part * length * math.cos(sun), 5.1 - part * length * math.sin(sun)
        u, v = camera.project([x, y, 0.0])
        if math.isfinite(u) and 0 <= u < bare.shape[1] and 0 <= v < bare.shape[0]:
            row, column = int(v), int(u)
            if sharp[row, column] < 0.6 * bare[row, column]:
                found += 1
                assert blurred[row, column] == pytest.approx(sharp[row, column], rel=0.1)
    assert found >= 3


@pytest.mark.parametrize("roll", [0.0, 0.3, -0.1])
def test_shadow_rolls_with_the_lens(roll):
    """The shadow of a plate on the ground is the plate itself, 2 m by 1 m, 8 m ahead and 1 m to the right."""
    shape, pose = (80, 120), {"roll": roll}
    coverage = np.zeros((4, shape[0], shape[1] + 2), np.float32)
    layer = GroundLayer(coverage, np.zeros((3, 16)), np.zeros((2, 20)), np.zeros((2, 8)), frustum_of(**pose))
    plate = {"x": 8.0, "y": 1.0, "cos": 1.0, "length": 2.0, "width": 1.0, "model": MODEL_CAR}
    add_shadow_of(layer, lens_of(**pose), records(OBJECT, plate)[0], (0.5, 0.2), 1.0)
    corners = []
    for ahead, across in ((7.0, 0.5), (7.0, 1.5), (9.0, 1.5), (9.0, 0.5)):
        right, down = 100.0 * across / ahead, 100.0 / ahead  # the lens is 1 m high
        u = 60.0 + right * math.cos(roll) + down * math.sin(roll)
        corners.append((u, 40.0 + down * math.cos(roll) - right * math.sin(roll)))
    expected = np.zeros((2, *coverage.shape[1:]), np.float32)
    add_polygon(expected, 0, np.transpose(corners).copy(), 4, 1.0, 0.0)
    assert abs(expected).sum() > 4.0
    assert np.cumsum(coverage[CAST], axis=1) == pytest.approx(np.cumsum(expected[0], axis=1), abs=1e-5)
