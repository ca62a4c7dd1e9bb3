"""The shipped policies, and errors for policy files."""

import re
import zipfile

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym.agents import make_agent, make_agents
from lgmd_gym.agents.policies.card import read_card
from lgmd_gym.agents.policies.policy import action_values, find_policy
from lgmd_gym.agents.registry import outside_code
from lgmd_gym.agents.sides import NUM_COLUMNS, all_round_cameras
from lgmd_gym.agents.zones import zone_cameras
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.hyperparams import read_hyperparams

CAMERAS = {"zones": zone_cameras, "all-round": all_round_cameras}
OTHER_HYPERPARAMETERS = {  # as in its card
    "all-round": {
        "n_networks": 5,
        "n_epochs": 24,
        "weight_decay": 0.1,
        "standardise": True,
        "mirror": True,
        "select_margin": True,
        "bfloat16": True,
        "policy_kwargs": {"net_arch": {"pi": [256, 64], "vf": []}},
    }
}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("policy:zone", "did you mean 'zones'"),
        ("policy:missing.zip", "policy 'missing.zip' cannot be read: No such file"),
        ("policy:pyproject.toml", "pyproject.toml' is no"),
        ("no-brake,ttc-oracle", "separate agents by spaces"),
        ("policy:zones:margn=1", "unknown option of agent policy 'margn'; did you mean 'margin'"),
        ("policy:zones:margin=x", "margin must be a number, got 'x'"),
        ("policy:zones:margin=21", r"margin must be in \[-20, 20\], got 21"),
        ("policy:zones:path=a.zip", "unknown option of agent policy 'path'"),
    ],
)
def test_invalid_policy_names_are_rejected(text, message):
    with pytest.raises(ValueError, match=message):
        make_agent(text)


@pytest.mark.parametrize("name", CAMERAS)
def test_file_is_small_and_contains_no_local_path(name):
    path = find_policy(name)
    assert path.stat().st_size < 6_000_000
    with zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            assert not re.search(rb"/(tmp|home|root|work)/", archive.read(member)), member


@pytest.mark.parametrize("name", CAMERAS)
def test_card_matches_the_packaged_hyperparameters_and_cameras(name):
    stored = read_card(find_policy(name))["config"]  # may have options of earlier versions
    fields = TrainConfig.__dataclass_fields__
    config = TrainConfig.from_dict({key: value for key, value in stored.items() if key in fields})
    assert config.camera == CAMERAS[name]()
    packaged = read_hyperparams("offline", config.env_id)["algo_kwargs"]
    assert config.algo_kwargs == packaged | OTHER_HYPERPARAMETERS.get(name, {})


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("scenario", ["CCRs", "EmptyRoad"])
def test_policy_brakes_for_a_car_and_not_on_an_empty_road(scenario, name):
    agent = make_agent(f"policy:{name}")
    env = gym.make(f"LGMD/{scenario}-v0", ego_speed=11.0, camera=agent.camera, world="laboratory")
    observation, info = env.reset(seed=1)
    agent.reset(1)
    braked = done = False
    while not done:
        action = agent.act(observation, info)
        braked = braked or bool(action[0] < 0)
        assert agent.alert is bool(action[0] < 0)  # independent of the neurons' alerts
        observation, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    assert braked is (scenario == "CCRs")
    assert not info["collision"]


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("acceleration", [3.0, 0.5, -3.0])
def test_policy_does_not_react_to_own_acceleration(acceleration, name):
    """Recorded levels contain no acceleration, so that a policy with the input `speed_change` braked here."""
    agent, cameras = make_agent(f"policy:{name}"), len(CAMERAS[name]())
    times = np.arange(0.0, 8.0, 1 / 30)
    for speed in (0.0 if acceleration > 0 else 24.0) + acceleration * times:
        observation = {
            "membrane_potential": np.full(cameras, 0.55, np.float32),
            "ffi": np.ones(cameras, np.float32),
            "column_potential": np.full(NUM_COLUMNS, 0.5, np.float32),
            "ego_speed": np.array([speed], np.float32),
            "ego_yaw_rate": np.zeros(1, np.float32),
            "known_deceleration": np.array([7.5], np.float32),
        }
        assert agent.act(observation, {})[0] == 0.0


def test_a_margin_shifts_the_log_odds_of_braking():
    steady, later = make_agents("policy:zones", 1), make_agents("policy:zones:margin=2.5", 1)
    assert (later.name, outside_code(later.name)) == ("policy:zones:margin=2.5", None)
    rng = np.random.default_rng(0)
    inputs = {
        name: rng.normal(size=(50, *box.shape)).astype(np.float32)
        for name, box in steady.network.observation_space.spaces.items()
    }
    brake = int(np.argmin(steady.card.demands))
    odds = []
    for policy in (steady, later):
        values = action_values(policy.network, inputs)
        odds.append(values[:, brake] - values[:, 1 - brake])
    np.testing.assert_allclose(odds[1], odds[0] - 2.5, atol=1e-4)
    values = action_values(make_agents("policy:zones", 1).network, inputs)
    np.testing.assert_array_equal(values[:, brake] - values[:, 1 - brake], odds[0])
    for index in range(50):
        row = {name: values[index : index + 1] for name, values in inputs.items()}
        assert (later.decide(row)[0] < 0.0) == (odds[1][index] > 0.0)
