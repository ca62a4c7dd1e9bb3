"""Policies whose actions are intervals of the time to brake, and their brake with stages."""

import json
from math import log

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces

from lgmd_gym.agents import make_agents
from lgmd_gym.agents.policies import PolicyCard
from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.agents.policies.network import describe_network
from lgmd_gym.agents.stages import Evidence

CLEAR, PRESENT, WARNING, PARTIAL, FULL = Evidence
BRAKE = {"limits_s": [0.5, 1.0, 2.0], "full_s": 0.5, "partial_s": 1.0, "warning_s": 2.0, "present_s": 2.0}


def test_log_odds_of_a_time_to_brake_below_each_limit():
    """Probabilities 1/2, 1/4, 1/8, 1/8: 1/2, 3/4 and 7/8 below the limits."""
    params = TimeToBrakeParams.make(BRAKE)
    odds = params.odds(np.log([[8.0, 4.0, 2.0, 2.0], [1.0, 1.0, 1.0, 1.0]]))  # of any scale
    assert odds[0] == pytest.approx([0.0, log(3.0), log(7.0)])
    assert odds[1] == pytest.approx([-log(3.0), 0.0, log(3.0)])
    assert params.odds(np.array([[900.0, 0.0, 0.0, -900.0]]))[0] == pytest.approx([900 - log(2), 900, 1800])


@pytest.mark.parametrize(
    ("confirm_odds", "odds", "evidence"),
    [
        (-50.0, [3.1, 3.1, 3.1], FULL),
        (-50.0, [2.9, 2.9, 2.9], PARTIAL),  # full_odds are 3
        (-50.0, [-9.0, 2.1, 2.1], PARTIAL),
        (-50.0, [-9.0, 1.9, 1.1], WARNING),
        (-50.0, [-9.0, -9.0, 0.9], PRESENT),
        (-50.0, [-9.0, -9.0, -2.1], CLEAR),
        (4.0, [3.1, 3.1, 4.1], FULL),
        (4.0, [3.1, 3.1, 3.9], WARNING),
        (4.0, [-9.0, 2.1, 4.1], PARTIAL),
        (4.0, [-9.0, 2.1, 3.9], WARNING),
        (4.0, [3.1, 3.1, -2.5], CLEAR),
    ],
)
def test_evidence(confirm_odds, odds, evidence):
    thresholds = {"full_odds": 3.0, "partial_odds": 2.0, "warning_odds": 1.0, "present_odds": -2.0}
    params = TimeToBrakeParams.make(BRAKE | thresholds | {"confirm_odds": confirm_odds})
    found, safe = params.evidence(np.array([odds]))
    assert (found[0], safe[0]) == (evidence, True)
    assert params.evidence(np.array([odds]) + 5.0, margin=5.0)[0][0] == evidence
    assert not params.evidence(np.array([[3.0005, -9.0, -9.0]]))[1][0]
    near = params.evidence(np.array([[9.0, 9.0, confirm_odds + 0.0005]]))[1][0]
    assert near == (confirm_odds == -50.0)  # there is no distance from a condition that is always met


def test_a_driver_who_brakes_raises_the_thresholds_of_braking():
    thresholds = {"full_odds": 3.0, "partial_odds": 2.0, "warning_odds": 1.0, "confirm_odds": 4.0}
    params = TimeToBrakeParams.make(BRAKE | thresholds | {"driver_odds": 1.5})
    brakes = np.array([False, True, True, True, True, True])
    odds = [
        [3.1, 3.1, 4.1],
        [4.4, 3.4, 9.0],
        [4.4, 3.6, 9.0],
        [4.6, 4.6, 5.4],
        [4.6, 4.6, 5.6],
        [0.0, 0.0, 1.1],
    ]
    found, safe = params.evidence(np.array(odds), 0.0, brakes)
    assert found.tolist() == [FULL, WARNING, PARTIAL, WARNING, FULL, WARNING]
    assert safe.all()
    assert not params.evidence(np.array([[4.5005, 9.0, 9.0]]), 0.0, np.array([True]))[1][0]


@pytest.mark.parametrize(("partial_odds", "expected"), [(49.0, PARTIAL), (50.0, CLEAR)])
def test_a_threshold_of_50_is_never_reached(partial_odds, expected):
    params = TimeToBrakeParams.make(BRAKE | {"partial_odds": partial_odds})
    for odds, margin in ((31.0, -20.0), (900.0, 0.0)):
        evidence, safe = params.evidence(np.array([[-90.0, odds, -90.0]]), margin)
        assert (evidence[0], safe[0]) == (expected, True)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"full_s": 0.6}, r"full_s must be one of limits_s, 0\.5, 1, 2, got 0\.6"),
        ({"limits_s": [1.0, 0.5, 2.0]}, "limits_s must be ascending numbers, at least one, got "),
        ({"full_odd": 1.0}, "full_odds"),
        ({"release_s": -1.0}, "release_s must be in"),
    ],
)
def test_wrong_parameters(changes, message):
    with pytest.raises(ValueError, match=message):
        TimeToBrakeParams.make(BRAKE | changes)


def test_a_card_has_demands_or_a_brake():
    with pytest.raises(ValueError, match="a card with brake must have no demands, and no latch"):
        PolicyCard(algo="ppo", camera="fovea", brake=BRAKE, demands=(0.0, -1.0))
    with pytest.raises(ValueError, match="a card with brake must have no demands, and no latch"):
        PolicyCard(algo="ppo", camera="fovea", brake=BRAKE, features={"latch": True})


@pytest.fixture
def policy(tmp_path):
    """A policy whose log odds of a time to brake below 0.5 s are 10 · (speed / 20 m/s) - 5."""
    pytest.importorskip("stable_baselines3")
    import torch
    from stable_baselines3 import PPO

    class Blank(gym.Env):
        observation_space = spaces.Dict({"ego_speed": spaces.Box(-5.0, 5.0, (1,))})
        action_space = spaces.Discrete(4)

    model = PPO("MultiInputPolicy", Blank(), policy_kwargs={"net_arch": []}, device="cpu")
    with torch.no_grad():
        model.policy.action_net.weight[:] = torch.tensor([[10.0], [0.0], [0.0], [0.0]])
        model.policy.action_net.bias[:] = torch.tensor([-5.0, -30.0, -30.0, 0.0])
    model.save(tmp_path / "policy.zip")
    brake = BRAKE | {"full_odds": 1.0, "warning_odds": -1.0, "present_odds": -2.0, "release_s": 0.1}
    brake |= {"driver_odds": 1.0, "driver_deceleration": 2.5}
    features = {"inputs": ["ego_speed"], "history": 1, "repeat": 2}
    card = PolicyCard(
        algo="ppo", camera="fovea", brake=brake, features=features, network=describe_network(model)
    )
    (tmp_path / "policy.json").write_text(json.dumps(card.to_dict()))
    return f"policy:{tmp_path / 'policy.zip'}"


def test_a_policy_warns_brakes_and_releases(policy):
    agent = make_agents(policy, 2)
    log_odds = [-5.0, -5.0, -0.5, -0.5, 1.5, 1.5, -1.5, -1.5, *[-3.0] * 6]
    found, alerts = [], []
    for value in log_odds:
        speeds = np.array([[20.0 * (value + 5.0) / 10.0], [2.0]], np.float32)
        accelerations = np.array([[-9.0 if found and found[-1] else 0.0], [0.0]], np.float32)
        demands = agent.act({"ego_speed": speeds, "ego_acceleration": accelerations}, {})
        found.append(float(demands[0]))
        alerts.append(bool(agent.alerts[0]))
        assert demands[1] == 0.0  # log odds of -4
    # Decisions of the policy are every second one; 0.1 s without evidence are three decisions.
    assert alerts == [False] * 2 + [True] * 8 + [False] * 4
    assert found == [0.0] * 4 + [-1.0] * 6 + [0.0] * 4


def test_a_margin_moves_all_stages(policy):
    observation = {"ego_speed": np.full((1, 1), 20.0 * 6.5 / 10.0, np.float32)}  # log odds of 1.5
    observation["ego_acceleration"] = np.full((1, 1), -2.4, np.float32)
    assert make_agents(policy, 1).act(observation, {}) == [-1.0]
    later = make_agents(f"{policy}:margin=1", 1)
    assert later.act(observation, {}) == [0.0]
    assert later.alerts == [True]


def drive(agent, log_odds, accelerations):
    """Return the demands of one decision."""
    speeds = np.float32(2.0 * (np.array(log_odds) + 5.0))[:, None]
    return agent.act(
        {"ego_speed": speeds, "ego_acceleration": np.float32(accelerations)[:, None]}, {}
    ).tolist()


def test_a_policy_leaves_braking_to_the_driver_unless_it_is_surer(policy):
    agent = make_agents(policy, 4)
    for _ in range(4):
        assert drive(agent, [1.5, 1.5, 1.5, 2.5], [-2.4, -2.5, -2.6, -2.6]) == [-1.0, 0.0, 0.0, -1.0]
        assert agent.alerts.all()
    # The driver counts as braking for 0.3 s after the deceleration, nine decisions.
    found = [drive(agent, [1.5] * 4, [0.0] * 4)[1] for _ in range(12)]
    assert found.index(-1.0) in (9, 10)  # the policy decides every second time
    agent.reset(np.array([False, True, False, False]))
    assert drive(agent, [1.5] * 4, [0.0] * 4)[1] == -1.0


def test_the_fading_brake_of_the_agent_is_not_that_of_the_driver(policy):
    """The agent brakes, releases, and brakes again while the car still decelerates."""
    agent = make_agents(policy, 1)
    log_odds = [1.5] * 4 + [-3.0] * 6 + [1.5] * 4
    demands = [drive(agent, [value], [-9.0 if index else 0.0])[0] for index, value in enumerate(log_odds)]
    assert demands == [-1.0] * 6 + [0.0] * 4 + [-1.0] * 4
    agent.reset()
    log_odds = [1.5] * 4 + [-3.0] * 24 + [1.5] * 4  # a deceleration that lasts is that of the driver
    demands = [drive(agent, [value], [-9.0 if index else 0.0])[0] for index, value in enumerate(log_odds)]
    assert demands == [-1.0] * 6 + [0.0] * 26


def test_drivers_are_those_of_the_environments_that_decide(policy):
    agent = make_agents(policy, 2)
    observation = {
        "ego_speed": np.full((2, 1), 13.0, np.float32),  # log odds of 1.5
        "ego_acceleration": np.float32([[0.0], [-3.0]]),
    }
    assert agent.act(observation, {}, np.array([True, False]))[0] == -1.0
    assert agent.act(observation, {}).tolist() == [-1.0, 0.0]  # the second one decides
    agent.reset()
    agent._independent = False  # log odds near a threshold are calculated for each environment by itself
    observation["ego_speed"][:] = 2.0 * (1.9995 + 5.0)
    assert agent.act(observation, {}).tolist() == [-1.0, 0.0]
