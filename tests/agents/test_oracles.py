"""Oracles at their thresholds, with hand-computed values."""

from math import atan, exp, inf

import pytest
from support.agents import make_step

from lgmd_gym.agents import make_agent


def brakes(agent, **truth):
    return agent.act(*make_step(0.0, **truth))[0] < 0.0


def test_ttc_oracle_brakes_at_its_threshold_and_latches():
    agent = make_agent("ttc-oracle:ttc=2")
    assert not brakes(agent, ttc=inf)
    assert not brakes(agent, ttc=2.01)
    assert brakes(agent, ttc=2.0)
    assert brakes(agent, ttc=inf)
    agent.reset(0)
    assert not brakes(agent, ttc=inf)


def test_stopping_distance_oracle_brakes_at_the_stopping_distance_plus_margin():
    """At 18 m/s: 18² / (2 · 9) + 18 · 0.5 + 1 = 28 m."""
    text = "stopping-distance-oracle:deceleration=9,reaction=0.5,margin=1"
    assert not brakes(make_agent(text), gap=28.01, ego_speed=18.0, target_speed=0.0)
    assert brakes(make_agent(text), gap=28.0, ego_speed=18.0, target_speed=0.0)
    assert not brakes(make_agent(text), gap=5.0, ego_speed=18.0, target_speed=18.0)


def test_stopping_distance_oracle_accounts_for_a_decelerating_target():
    """Target from 18.2 to 18 m/s in 1/30 s: 6 m/s², 27 m to standstill; the ego requires 27 m."""
    text = "stopping-distance-oracle:deceleration=9,reaction=0.5,margin=1"
    braking, constant = make_agent(text), make_agent(text)
    brakes(braking, gap=30.0, ego_speed=20.0, target_speed=18.2)
    brakes(constant, gap=30.0, ego_speed=20.0, target_speed=18.0)
    # Ego: 20² / 18 + 10 = 32.2 m; required: 32.2 - 27 + 1 = 6.2 m, at constant speed 2.2 m.
    assert brakes(braking, gap=6.0, ego_speed=20.0, target_speed=18.0)
    assert not brakes(constant, gap=6.0, ego_speed=20.0, target_speed=18.0)


def test_looming_oracles_brake_at_the_values_of_their_models():
    """A target 1.712 m wide, 20 m before the lens, approached at 10 m/s."""
    theta = 2 * atan(0.856 / 20.0)
    rate = 1.712 * 10.0 / (20.0**2 + 0.856**2)
    eta, tau = rate * exp(-2.0 * theta), theta / rate
    truth = {"gap": 20.0 - 1.7, "ego_speed": 10.0, "target_speed": 0.0}
    for factor, expected in ((0.999, True), (1.001, False)):
        assert brakes(make_agent(f"eta-oracle:threshold={factor * eta}"), **truth) == expected
        assert brakes(make_agent(f"tau-oracle:tau={tau / factor}"), **truth) == expected


@pytest.mark.parametrize("name", ["eta-oracle", "tau-oracle", "stopping-distance-oracle"])
def test_without_a_target_oracles_do_not_brake(name):
    assert not brakes(make_agent(name), ego_speed=20.0)
    assert not brakes(make_agent(name), ego_speed=20.0, gap=inf)
