"""Motion of the ego in observations, by hand."""

from math import pi

import gymnasium as gym
import numpy as np
import pytest

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym.sensing.assembly import EgoMotion, EgoPose


def test_rates_between_two_states():
    before = EgoPose(np.array([pi - 0.1, 0.0]), np.array([10.0, 4.0]))
    after = EgoPose(np.array([-pi + 0.1, -0.3]), np.array([9.0, 6.0]))
    motion = EgoMotion.between(before, after, 0.5)
    assert motion.speed.tolist() == [9.0, 6.0]
    assert motion.yaw_rate == pytest.approx([0.4, -0.6])  # the shorter turn
    assert motion.acceleration.tolist() == [-2.0, 4.0]
    assert EgoMotion.between(before, after, 0.0).acceleration.tolist() == [0.0, 0.0]


def test_full_braking_in_the_laboratory_is_9_m_s2():
    env = gym.make("LGMD/CCRs-v0", ego_speed=20.0, world="laboratory")
    observation, _ = env.reset(seed=0)
    assert observation["ego_acceleration"] == 0.0
    for _ in range(20):  # after latency, dead time and build-up, 0.33 s
        observation, *_ = env.step([-1.0])
    assert observation["ego_acceleration"] == pytest.approx(-9.0, abs=1e-4)
