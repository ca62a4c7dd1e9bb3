"""Brakes that an episode brings with it."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from numba import config
from support.brakes import DrawnBrakes
from support.rollouts import BRAKE, HOLD, rollout

from lgmd_gym.envs import BrakingEnv, make_scenario
from lgmd_gym.envs.dynamics.brake import BrakeParams, draw_brake
from lgmd_gym.envs.episode_source import FixedScenario

WORLDS = range(400)

compiled_only = pytest.mark.skipif(config.DISABLE_JIT, reason="an environment needs compilation")


class OneBrake:
    """Episodes on an empty road with a given brake."""

    def __init__(self, brake):
        self.source, self.brake = FixedScenario(make_scenario("EmptyRoad", ego_speed=10.0)), brake
        self.first = self.source.first

    def draw(self, rng):
        return self.source.draw(rng)._replace(brake=self.brake)


def braking(env, steps=40):
    """Return the ego decelerations of an episode with full braking [m/s²]."""
    return np.array([result[-1]["deceleration"] for result in rollout(env, BRAKE, steps)])


@pytest.mark.parametrize(("wet", "low", "high"), [(False, 7.5, 9.5), (True, 5.0, 7.0)])
def test_ranges_of_drawn_brakes(wet, low, high):
    drawn = [draw_brake(world, wet) for world in WORLDS]
    ranges = {"max_deceleration": (low, high), "dead_time": (0.05, 0.25), "build_up": (0.15, 0.45)}
    for name, (lowest, highest) in ranges.items():
        values = np.array([getattr(brake, name) for brake in drawn])
        width = highest - lowest
        assert lowest <= values.min() < lowest + 0.02 * width
        assert highest - 0.02 * width < values.max() <= highest
        assert values.mean() == pytest.approx((lowest + highest) / 2, abs=0.05 * width)
    default = BrakeParams()
    for name in ("max_acceleration", "latency", "regain_acceleration"):
        assert {getattr(brake, name) for brake in drawn} == {getattr(default, name)}


def test_a_world_has_one_brake():
    assert draw_brake(3, False) == draw_brake(3, False) != draw_brake(4, False)
    dry, wet = draw_brake(3, False), draw_brake(3, True)
    assert (dry.dead_time, dry.build_up) == (wet.dead_time, wet.build_up)
    assert dry.max_deceleration - wet.max_deceleration == pytest.approx(2.5)
    generator = np.random.default_rng([3, 7])
    assert dry.max_deceleration == generator.uniform(7.5, 9.5)


@pytest.mark.parametrize(("world", "wet"), [(-1, False), (0.5, False), (0, 1), (True, False)])
def test_refused_worlds(world, wet):
    with pytest.raises(ValueError, match=r"world|wet"):
        draw_brake(world, wet)


@compiled_only
def test_episode_has_its_own_brake():
    weak = BrakeParams(max_deceleration=5.0, dead_time=0.5, build_up=0.1)
    source = OneBrake(weak)
    env = BrakingEnv(source)
    values = braking(env)
    assert env.brake == weak
    assert values.max() == pytest.approx(5.0)
    # Latency 1/30 s and dead time 0.5 s: no deceleration at 16/30 s, full at 19/30 s + 1 ms or later.
    assert values[16] == 0.0
    assert values[17] > 0.0
    assert values[20] == pytest.approx(5.0)
    source.brake = None
    values = braking(env)
    assert env.brake == BrakeParams()
    assert values.max() == pytest.approx(9.0)


@compiled_only
def test_long_delay_lines_hold_every_demand():
    """A brake whose dead time is longer than the configured one gets a longer delay line."""
    late = BrakeParams(dead_time=1.0)
    env, configured = BrakingEnv(OneBrake(late)), BrakingEnv(OneBrake(None), config={"dead_time": 1.0})
    for single in (env, configured):
        single.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1.0, 0.0, (90, 1)).astype(np.float32)
    for action in actions:
        one, other = env.step(action), configured.step(action)
        assert one[1:] == other[1:]


@compiled_only
def test_configuration_takes_precedence():
    weak = BrakeParams(max_deceleration=5.0, dead_time=0.5, build_up=0.1)
    env = BrakingEnv(OneBrake(weak), config={"max_deceleration": 9.0})
    env.reset(seed=0)
    assert env.brake == BrakeParams(max_deceleration=9.0, dead_time=0.5, build_up=0.1)
    env.reset(options={"config": {"dead_time": 0.1}})
    assert env.brake == BrakeParams(max_deceleration=9.0, dead_time=0.1, build_up=0.1)
    with pytest.raises(ValueError, match="build_up"):
        env.reset(options={"config": {"build_up": -1.0}})
    env.reset()
    assert env.brake.build_up == 0.1


@compiled_only
def test_reward_refers_to_the_brake_of_the_episode():
    """At full needless braking, a step of 1/30 s costs 2/30 with every brake, and progress is 1/30 · v/v₀."""
    for limit in (5.0, 9.0):
        env = BrakingEnv(OneBrake(BrakeParams(max_deceleration=limit, build_up=0.0)))
        results = rollout(env, BRAKE, 20)
        speeds = [result[0][0] for result in results]
        progress = (speeds[-2] + speeds[-1]) / 2 / 10.0 / 30.0
        assert results[-1][1] == pytest.approx(progress - 2 / 30, abs=1e-6)


@compiled_only
def test_agents_cannot_read_the_brake():
    """Until the first braking, observation and info are those of the default brake."""
    scenario = make_scenario("CCRs", ego_speed=10.0)
    drawn, default = BrakingEnv(DrawnBrakes(FixedScenario(scenario))), BrakingEnv(FixedScenario(scenario))
    for one, other in zip(rollout(drawn, HOLD, 60), rollout(default, HOLD, 60), strict=True):
        np.testing.assert_array_equal(one[0], other[0])
        assert one[-1] == other[-1]


@compiled_only
@pytest.mark.parametrize(("weather", "wet"), [("clear", False), ("rain", True), ("fog", False)])
def test_registered_ids_draw_the_brake_of_the_world(weather, wet):
    env = gym.make("LGMD/CCRs-v0", camera=None, world=12, weather=weather)
    env.reset(seed=0)
    assert env.unwrapped.brake == draw_brake(12, wet)


@compiled_only
def test_the_laboratory_has_the_configured_brake():
    env = gym.make("LGMD/CCRs-v0", camera=None, world="laboratory")
    env.reset(seed=0)
    assert env.unwrapped.brake == BrakeParams()


@compiled_only
def test_configured_keys_replace_those_of_the_world():
    env = gym.make("LGMD/CCRs-v0", camera=None, world=12, config={"max_deceleration": 6.0})
    env.reset(seed=0)
    assert env.unwrapped.brake == replace(draw_brake(12, False), max_deceleration=6.0)
