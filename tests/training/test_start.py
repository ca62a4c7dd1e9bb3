"""The network that a training starts from, with the cameras of the training or fewer of them."""

from dataclasses import asdict, replace

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium import spaces

from lgmd_gym.agents.policies.card import write_card
from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.agents.policies.features import NUM_LEVELS, FeatureConfig
from lgmd_gym.agents.policies.network import describe_network
from lgmd_gym.agents.sides import NUM_SIDE_FIELDS, all_round_cameras
from lgmd_gym.training.offline.networks import linear_layers, make_model
from lgmd_gym.training.offline.start import load_start

FEATURES = FeatureConfig(inputs=("columns", "sides_ffi", "ego_speed"), history=1, repeat=2)
BRAKE = TimeToBrakeParams()
CAMERAS = all_round_cameras()
FEWER = [*CAMERAS[1:8], *CAMERAS[9:]]  # without two of the fields ahead


def count(cameras):
    return sum(channel["columns"] for channel in cameras)


def write_start(path, cameras, features=FEATURES):
    """Write a policy with random weights."""
    sizes = {
        "columns": NUM_LEVELS * count(cameras),
        "sides_ffi": NUM_LEVELS * NUM_SIDE_FIELDS,
        "ego_speed": 1,
    }
    env = gym.Env()
    boxes = {name: spaces.Box(-5.0, 5.0, (size,)) for name, size in sizes.items()}
    env.observation_space = spaces.Dict(boxes)
    env.action_space = spaces.Discrete(BRAKE.num_actions)
    model = make_model("MultiInputPolicy", env, 3, {"net_arch": {"pi": [16, 8], "vf": []}})
    model.save(path)
    network = asdict(describe_network(model))
    card = {"algo": "ppo", "camera": cameras, "features": features.to_dict(), "brake": BRAKE.to_dict()}
    write_card(path, card | {"network": network})
    return model.policy


def outputs(network, features):
    """Return the values of the actions; the features are concatenated in the order of the inputs' names."""
    with torch.no_grad():
        first, second, last = linear_layers(network)
        return last(torch.tanh(second(torch.tanh(first(torch.from_numpy(features)))))).numpy()


def test_columns_of_new_fields_have_no_weight(tmp_path):
    given = write_start(tmp_path / "start.zip", FEWER)
    network = load_start(str(tmp_path / "start.zip"), FEATURES, CAMERAS, BRAKE)
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(5, NUM_LEVELS, count(CAMERAS))).astype(np.float32)
    others = rng.normal(size=(5, 1 + NUM_LEVELS * NUM_SIDE_FIELDS)).astype(np.float32)
    known = np.concatenate([np.full(channel["columns"], channel in FEWER) for channel in CAMERAS])
    assert known.sum() == count(FEWER) == count(CAMERAS) - 20

    def joined(values):
        return np.concatenate([values.reshape(5, -1), others], axis=1)

    expected = outputs(given, joined(columns[:, :, known]))
    assert outputs(network, joined(columns)) == pytest.approx(expected, abs=1e-5)
    assert np.abs(expected).max() > 0.01
    new = linear_layers(network)[0].weight[:, : columns[0].size].reshape(16, NUM_LEVELS, -1)
    assert not new[:, :, ~known].any()


def test_the_network_of_the_same_cameras_is_the_one_in_the_file(tmp_path):
    given = write_start(tmp_path / "start.zip", CAMERAS)
    network = load_start(str(tmp_path / "start.zip"), FEATURES, CAMERAS, BRAKE)
    for own, other in zip(linear_layers(network), linear_layers(given), strict=True):
        assert torch.equal(own.weight, other.weight)


@pytest.mark.parametrize(
    ("cameras", "name"),
    [
        ([CAMERAS[1], CAMERAS[0], *CAMERAS[2:]], "cameras"),  # another order
        ([CAMERAS[1], CAMERAS[0], *CAMERAS[3:]], "cameras"),
        (CAMERAS[:-1], "cameras"),  # fewer at the sides
        ([*CAMERAS[:5], CAMERAS[5] | {"columns": 5}, *CAMERAS[6:]], "cameras"),
        (FEWER, "inputs"),
        (FEWER, "limits_s"),
    ],
)
def test_other_cameras_inputs_and_intervals_are_refused(tmp_path, cameras, name):
    features = replace(FEATURES, repeat=1) if name == "inputs" else FEATURES
    write_start(tmp_path / "start.zip", cameras, features)
    limits = (0.2, 0.6, 1.2, 2.6) if name == "limits_s" else BRAKE.limits_s
    with pytest.raises(ValueError, match=f"has other {name} than the training; start from a policy with"):
        load_start(str(tmp_path / "start.zip"), FEATURES, CAMERAS, replace(BRAKE, limits_s=limits))


def test_a_policy_with_more_cameras_is_refused(tmp_path):
    write_start(tmp_path / "start.zip", CAMERAS)
    with pytest.raises(ValueError, match="has other cameras than the training"):
        load_start(str(tmp_path / "start.zip"), FEATURES, FEWER, BRAKE)


def test_inputs_of_every_camera_require_the_same_cameras(tmp_path):
    features = FeatureConfig(inputs=("columns", "ffi"), history=1)
    write_start(tmp_path / "start.zip", FEWER, features)
    with pytest.raises(ValueError, match="has other cameras than the training"):
        load_start(str(tmp_path / "start.zip"), features, CAMERAS, BRAKE)
