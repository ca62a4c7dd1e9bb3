"""The shipped policy, and errors for policy files."""

import json
import re
import zipfile
from importlib.resources import files
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from support.policies import random_inputs, write_policy

from lgmd_gym.agents import make_agent, make_agents
from lgmd_gym.agents.policies.card import read_card
from lgmd_gym.agents.policies.policy import action_values, find_policy
from lgmd_gym.agents.sides import all_round_cameras
from lgmd_gym.training import TrainConfig


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("policy:all-rond", "did you mean 'all-round'"),
        ("policy:missing.zip", "policy 'missing.zip' cannot be read: No such file"),
        ("policy:pyproject.toml", "pyproject.toml' is no"),
        ("no-brake,ttc-oracle", "separate agents by spaces"),
        ("policy:all-round:margn=1", "unknown option of agent policy 'margn'; did you mean 'margin'"),
        ("policy:all-round:margin=x", "margin must be a number, got 'x'"),
        ("policy:all-round:margin=21", r"margin must be in \[-20, 20\], got 21"),
        ("policy:all-round:path=a.zip", "unknown option of agent policy 'path'"),
    ],
)
def test_invalid_policy_names_are_rejected(text, message):
    with pytest.raises(ValueError, match=message):
        make_agent(text)


def test_file_is_small_and_contains_no_local_path():
    path = find_policy("all-round")
    assert path.stat().st_size < 6_000_000
    with zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            assert not re.search(rb"/(tmp|home|root|work)/", archive.read(member)), member


def test_card_matches_the_packaged_hyperparameters_and_cameras():
    """One file describes the training; it started from a policy without low fields."""
    card = read_card(find_policy("all-round"))
    file = Path(str(files("lgmd_gym.training") / "all-round.yml"))
    expected = TrainConfig.from_hyperparams("time-to-brake", file=file, seed=2)
    assert card["config"] == json.loads(json.dumps(expected.to_dict()))
    cameras = all_round_cameras()
    assert card["config"]["camera"] == cameras
    fewer = [channel for channel in cameras if not channel["camera"]["name"].startswith("low")]
    assert card["start"]["camera"] == card["start"]["start"]["camera"] == fewer
    assert len(fewer) == len(cameras) - 3


def test_page_states_the_thresholds_of_the_brake():
    brake = read_card(find_policy("all-round"))["brake"]
    text = {
        name: f"{value:g}".replace("-", "\N{MINUS SIGN}")
        for name, value in brake.items()
        if name != "limits_s"
    }
    page = (Path(__file__).parents[2] / "docs" / "cards" / "all-round.md").read_text()
    assert "below {warning_s} s above {warning_odds} |".format(**text) in page
    full = "below {full_s} s above {full_odds}, and of one below {present_s} s above {confirm_odds} |"
    assert full.format(**text) in page
    assert "by {driver_deceleration} m/s² or more | {driver_odds} more".format(**text) in page
    assert "below {present_s} s at most {present_odds} for {release_s} s;".format(**text) in page


@pytest.mark.parametrize("scenario", ["CCRs", "EmptyRoad"])
def test_policy_brakes_for_a_car_and_not_on_an_empty_road(scenario):
    agent = make_agent("policy:all-round")
    env = gym.make(f"LGMD/{scenario}-v0", ego_speed=11.0, camera=agent.camera, world="laboratory")
    observation, info = env.reset(seed=1)
    agent.reset(1)
    braked = done = False
    while not done:
        action = agent.act(observation, info)
        braked = braked or bool(action[0] < 0)
        assert agent.alert or action[0] == 0.0  # the warning is the first stage
        observation, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    assert braked is (scenario == "CCRs")
    assert not info["collision"]


def test_policy_does_not_react_to_own_braking():
    """The driver brakes for the traffic of a merge."""
    agent = make_agent("policy:all-round")
    env = gym.make("LGMD/Traffic-Merge-v0", camera=agent.camera, split="test")
    observation, info = env.reset(seed=1)
    agent.reset(1)
    accelerations: list[float] = []
    for _ in range(450):
        action = agent.act(observation, info)
        assert action[0] == 0.0
        observation, _, terminated, _, info = env.step(action)
        assert not terminated
        accelerations.append(float(observation["ego_acceleration"][0]))
    assert min(accelerations) < -2.0


def test_a_margin_shifts_the_log_odds_of_braking(tmp_path):
    file = write_policy(tmp_path / "small.zip")
    steady, later = make_agents(f"policy:{file}", 1), make_agents(f"policy:{file}:margin=2.5", 1)
    assert later.name == f"policy:{file}:margin=2.5"
    inputs = random_inputs(50)
    brake = int(np.argmin(steady.card.demands))
    odds = []
    for policy in (steady, later):
        values = action_values(policy.network, inputs)
        odds.append(values[:, brake] - values[:, 1 - brake])
    np.testing.assert_allclose(odds[1], odds[0] - 2.5, atol=1e-3)
    values = action_values(make_agents(f"policy:{file}", 1).network, inputs)
    np.testing.assert_array_equal(values[:, brake] - values[:, 1 - brake], odds[0])
    assert 5 < np.sum(odds[1] > 0.0) < 45
    for index in range(50):
        row = {name: values[index : index + 1] for name, values in inputs.items()}
        assert (later.decide(row)[0] < 0.0) == (odds[1][index] > 0.0)
