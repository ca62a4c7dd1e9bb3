"""Time to brake: values computed by hand, and forks against the episodes that they predict."""

from math import floor, inf

import gymnasium as gym
import numpy as np
import pytest
from numba import config

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.agents import make_agent
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.families import make_scenario
from lgmd_gym.envs.families.scenario import Actor, Scenario
from lgmd_gym.envs.forecast import ForecastParams

pytestmark = pytest.mark.skipif(config.DISABLE_JIT, reason="an environment needs compilation")
DELAY = 1 / 30 + 0.1  # [s], latency and dead time


def stopping_distance(speed, deceleration=9.0, build_up=0.2):
    """Return the stopping distance with a delay and a linear build-up [m]."""
    return speed * (DELAY + build_up / 2) + speed**2 / (2 * deceleration) - deceleration * build_up**2 / 24


def forecasting(made, **params):
    """Return an environment with a forecast, and its first info."""
    env = BrakingEnv(made, config={"forecast": {"share": 1.0} | params})
    return env, env.reset(seed=0)[1]


def brake_after(made, decisions):
    """Return the last info of an episode in which the ego brakes fully after some decisions."""
    env = BrakingEnv(made)
    env.reset(seed=0)
    for decision in range(2000):
        demand = -1.0 if decision >= decisions else 0.0
        *_, terminated, truncated, info = env.step(np.array([demand], np.float32))
        if terminated or truncated:
            return info
    raise AssertionError("the episode does not end")


@pytest.mark.parametrize("speed", [5.0, 10.0, 20.0])
@pytest.mark.parametrize("share", [1.0, 0.5])
def test_time_to_brake_of_a_standing_car(speed, share):
    """5 s before the contact, less the time for the stopping distance; half a brake builds up in 0.1 s."""
    distance = stopping_distance(speed, 9.0 * share, 0.2 * share)
    _, info = forecasting(make_scenario("CCRs", ego_speed=speed), share=share)
    assert info["ttb"] == pytest.approx(floor(30 * (5.0 - distance / speed)) / 30)


def test_time_to_brake_of_a_slower_car():
    """Only the relative speed counts: 12 m/s less 4 m/s."""
    _, info = forecasting(make_scenario("CCRm", ego_speed=12.0, target_speed=4.0))
    assert info["ttb"] == pytest.approx(floor(30 * (5.0 - stopping_distance(8.0) / 8.0)) / 30)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("CCRs", {}), ("CCRm", {}), ("CPNA", {}), ("CPFA", {}), ("CCCscp", {}), ("CBNAO", {}), ("CMCscp", {}),
        ("CCFtap", {}), ("AnimalCrossing", {"animal_speed": 8.0}), ("CPLA", {"towards": True}),
        ("CutIn", {"excess": -5.0, "end_ttc": 1.0}), ("CCFhos", {"target_speed": 2.0, "yields": True}),
    ],
)  # fmt: skip
def test_braking_one_decision_later_has_contact(name, arguments):
    """What a fork predicts is what the episode does, also for targets that cross."""
    made = make_scenario(name, **arguments)
    env, info = forecasting(made, foresight=True)
    last = round(30 * info["ttb"])
    assert 30 < last < 230
    assert not brake_after(made, last)["collision"]
    assert brake_after(made, last + 1)["collision"]
    for _ in range(10):
        *_, info = env.step(np.zeros(1, np.float32))
    assert info["ttb"] == pytest.approx((last - 10) / 30)


def test_without_a_contact_there_is_no_time_to_brake():
    for name in ("EmptyRoad", "Following", "CutIn", "CrossingClears", "SteelPlate"):
        assert forecasting(make_scenario(name))[1]["ttb"] == inf


def test_a_lead_car_is_known_to_brake_once_it_has_begun():
    """It begins after 3 s; with foresight, its braking is known before."""
    made = make_scenario("CCRb", ego_speed=20.0, headway=0.8, deceleration=8.0, build_up=0.3)
    env, info = forecasting(made)
    known, known_info = forecasting(made, foresight=True)
    assert info["ttb"] == inf
    assert known_info["ttb"] < 4.0
    for decision in range(1, 92):
        *_, info = env.step(np.zeros(1, np.float32))
        *_, known_info = known.step(np.zeros(1, np.float32))
        assert (info["ttb"] < inf) == (decision > 90)
    assert info["ttb"] == pytest.approx(known_info["ttb"])


def test_an_unavoidable_contact_requires_braking_at_once():
    standing = Actor(gap=10.0)
    made = Scenario(family="x", ego_speed=20.0, duration=9.0, actors=(standing,))
    assert forecasting(made)[1]["ttb"] == 0.0


def test_the_ego_stands_when_an_oncoming_car_reaches_it():
    """20 m/s against 20 m/s, 200 m: the ego stops after d/v later than without its deceleration."""
    made = make_scenario("CCFhos", ego_speed=20.0, target_speed=20.0)
    _, info = forecasting(made)
    # Until it stands, the other covers 20 m/s times this time, and the ego its stopping distance.
    taken = DELAY + 0.1 + 20.0 / 9.0
    latest = (200.0 - stopping_distance(20.0) - 20.0 * taken) / 40.0
    assert info["ttb"] == pytest.approx(floor(30 * latest) / 30)


def test_after_a_release_the_time_to_brake_is_that_of_the_present_motion():
    """An ego that has braked needs less distance, and regains its speed in the forks."""
    made = make_scenario("CCRs", ego_speed=10.0)
    env, info = forecasting(made)
    first = info["ttb"]
    for decision in range(60):
        *_, info = env.step(np.array([-1.0 if 30 <= decision < 45 else 0.0], np.float32))
    assert env.ego.speed < 10.0
    assert info["ttb"] > first - 2.0 + 0.3
    assert not brake_after(made, round(30 * first))["collision"]


def test_the_oracle_brakes_at_the_last_moment_and_releases():
    agent = make_agent("last-moment-oracle")
    times = (0.1, 1 / 30, 0.0, 1.9, 2.0, inf, 0.0)
    demands = [agent.act({}, {"ttb": ttb, "ego_speed": 9.0})[0] for ttb in times]
    assert demands == [0.0, 0.0, -1.0, -1.0, 0.0, 0.0, -1.0]
    assert agent.alert
    with pytest.raises(ValueError, match=r"requires info\['ttb'\], which traffic does not have; make the"):
        agent.act({}, {"ttc": 1.0})


def test_options_of_the_oracle():
    agent = make_agent("last-moment-oracle:foresight=1")
    assert agent.config == {"forecast": {"share": 1.0, "foresight": True}}
    with pytest.raises(ValueError, match=r"foresight must be"):
        make_agent("last-moment-oracle:foresight=2")
    with pytest.raises(ValueError, match=r"share must be in \(0, 1\], got 0"):
        make_agent("last-moment-oracle:share=0")


def test_vector_environments_forecast_as_single_ones():
    agent = make_agent("last-moment-oracle:share=0.8")
    assert agent.config == {"forecast": {"share": 0.8, "foresight": False}}
    single = gym.make("LGMD/CPNA-v0", camera=None, world=3, config=agent.config)
    envs = gym.make_vec("LGMD/CPNA-v0", num_envs=3, camera=None, world=3, config=agent.config)
    _, info = single.reset(seed=1)
    _, infos = envs.reset(seed=[0, 1, 2])
    assert "ttb" not in gym.make("LGMD/CPNA-v0", camera=None).reset(seed=0)[1]
    for _ in range(20):
        assert infos["ttb"][1] == info["ttb"]
        *_, info = single.step(np.zeros(1, np.float32))
        *_, infos = envs.step(np.zeros((3, 1), np.float32))


@pytest.mark.parametrize(
    ("forecast", "message"),
    [
        ({"shares": 1.0}, "unknown key of config.*did you mean 'share'"),
        ({"share": 0.0}, r"share must be in \(0, 1\]"),
        (1.0, "forecast"),
    ],
)
def test_invalid_forecasts_raise(forecast, message):
    with pytest.raises((TypeError, ValueError), match=message):
        BrakingEnv(make_scenario("CCRs"), config={"forecast": forecast})
    assert ForecastParams() == ForecastParams(share=1.0, foresight=False)
