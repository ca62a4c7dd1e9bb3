"""Overlays on the camera frame: edges of the danger zone and target boxes."""

import gymnasium as gym
import numpy as np
import pytest
from support.cameras import ego_camera

from lgmd_gym.neuron import danger_zone
from lgmd_gym.rendering.display import danger_zone_edges, target_boxes

EGO_SPEED = 8.0


@pytest.fixture
def env():
    env = gym.make("LGMD/CCRs-v0", ego_speed=EGO_SPEED, camera=None)
    env.reset(seed=0)
    return env


def test_danger_zone_edges_equal_those_of_the_mask(env):
    camera = ego_camera("standard", setback_m=0.0)
    camera.render(env)
    mask = danger_zone(camera.shape, camera.camera.hfov_deg, height_m=camera.camera.mount.height_m)
    left, right = danger_zone_edges(camera, env.unwrapped.vehicle)
    for row in (60, 75, 88):
        inside = np.flatnonzero(mask[row] > 0.5)
        u = [np.interp(row + 0.5, edge[::-1, 1], edge[::-1, 0]) for edge in (left, right)]
        assert u == pytest.approx([inside[0], inside[-1] + 1], abs=1.5)


def test_target_box_encloses_the_target(env):
    camera = ego_camera("fovea", vehicles="box", setback_m=0.0)
    camera.render(env)
    ((left, top, right, bottom),) = target_boxes(camera, env.unwrapped)
    gap = 5.0 * EGO_SPEED  # contact after 5 s
    assert right - left == pytest.approx(camera.camera.focal_px * 1.712 / gap, rel=1e-6)
    assert bottom - top == pytest.approx(camera.camera.focal_px * 1.427 / gap, rel=0.12)  # with the far end
    assert (left + right) / 2 == pytest.approx(80.0, abs=1e-6)
