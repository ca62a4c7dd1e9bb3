"""Frames do not depend on what the scratch memory contains, that is, on frames drawn before."""

import gymnasium as gym
import numpy as np
import pytest
from support.cameras import ego_camera

import lgmd_gym  # noqa: F401
from lgmd_gym.camera import WEATHERS

ACCUMULATORS = ("ground", "solids")  # cleared by every frame
FAMILIES = ("CCRb", "CCCscp", "CurveGuardRail", "LeadTurnsOff", "AdjacentPass")


@pytest.mark.parametrize("condition", WEATHERS)
@pytest.mark.parametrize("camera", ["wide", "fovea"])
def test_light_does_not_depend_on_frames_drawn_before(camera, condition):
    rng = np.random.default_rng(0)
    for family in FAMILIES:
        env = gym.make(f"LGMD/{family}-v0", camera=None)
        env.reset(seed=1)
        clean, used = ego_camera(camera, weather=condition), ego_camera(camera, weather=condition)
        for _ in range(12):
            for _ in range(8):
                env.step(np.array([-0.1], np.float32))
            clean.render(env)
            for name, array in used.buffers._asdict().items():
                if array.dtype.kind == "f" and name not in ACCUMULATORS:
                    array[...] = rng.normal(0.0, 100.0, array.shape)
            used.render(env)
            np.testing.assert_array_equal(clean.light, used.light, f"{family} {camera}")
            for name in ACCUMULATORS:
                assert not getattr(used.buffers, name).any()
