"""The network that a training starts from, with the cameras of the training or fewer of them."""

import zipfile
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
from lgmd_gym.sensing.channel import make_channels
from lgmd_gym.training.offline.networks import linear_layers, make_model
from lgmd_gym.training.offline.start import load_start

FEATURES = FeatureConfig(
    inputs=("columns", "sides_ffi", "ego_speed", "ego_acceleration", "ego_yaw_rate", "known_deceleration"),
    history=1,
    repeat=2,
)
BRAKE = TimeToBrakeParams()
CAMERAS = all_round_cameras()
FEWER = [*CAMERAS[1:8], *CAMERAS[9:]]  # without two of the fields ahead
NUM_SIDE_VALUES = NUM_LEVELS * NUM_SIDE_FIELDS


def count(cameras):
    return sum(channel["columns"] for channel in cameras)


def write_start(path, cameras, trained=FEATURES, **changes):
    """Write a policy with random weights; without a network in its card, it is pickled."""
    sizes = dict.fromkeys(trained.inputs, 1)
    sizes |= {"columns": NUM_LEVELS * count(cameras), "sides_ffi": NUM_SIDE_VALUES}
    boxes = {name: spaces.Box(-5.0, 5.0, (sizes[name],)) for name in trained.inputs}
    env = gym.Env()
    env.observation_space = spaces.Dict(boxes)
    env.action_space = spaces.Discrete(BRAKE.num_actions)
    model = make_model("MultiInputPolicy", env, 3, {"net_arch": {"pi": [16, 8], "vf": []}})
    with torch.no_grad():
        for layer in linear_layers(model.policy):
            layer.bias.normal_()
    model.save(path)
    network = asdict(describe_network(model))
    card = {"algo": "ppo", "camera": cameras, "features": trained.to_dict(), "brake": BRAKE.to_dict()}
    card |= {"network": network} | changes
    write_card(path, {name: value for name, value in card.items() if value is not None})
    return model.policy


def load(path, features=FEATURES, camera=CAMERAS, brake=BRAKE, neuron=None):
    return load_start(str(path), features, camera, brake, neuron)


def outputs(network, features):
    """Return the values of the actions; the features are concatenated in the order of the inputs' names."""
    with torch.no_grad():
        first, second, last = linear_layers(network)
        return last(torch.tanh(second(torch.tanh(first(torch.from_numpy(features)))))).numpy()


def test_columns_of_new_fields_have_no_weight(tmp_path):
    given = write_start(tmp_path / "start.zip", FEWER)
    network = load(tmp_path / "start.zip")
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(5, NUM_LEVELS, count(CAMERAS))).astype(np.float32)
    others = rng.normal(size=(5, 4 + NUM_SIDE_VALUES)).astype(np.float32)
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
    """Cameras are compared as they are, not as they are written."""
    given = write_start(tmp_path / "start.zip", CAMERAS)
    network = load(tmp_path / "start.zip", camera=make_channels(CAMERAS))
    for own, other in zip(linear_layers(network), linear_layers(given), strict=True):
        assert torch.equal(own.weight, other.weight)
        assert torch.equal(own.bias, other.bias)


SIDES_WITHOUT_ONE = [*CAMERAS[:13], *CAMERAS[14:]]  # without near_left_dsn


@pytest.mark.parametrize(
    ("cameras", "features", "name"),
    [
        ([CAMERAS[1], CAMERAS[0], *CAMERAS[3:]], FEATURES, "cameras"),  # another order
        (CAMERAS[:-1], FEATURES, "cameras"),  # fewer at the sides
        (SIDES_WITHOUT_ONE, FEATURES, "cameras"),
        ([*CAMERAS[:5], CAMERAS[5] | {"columns": 5}, *CAMERAS[6:]], FEATURES, "cameras"),
        (FEWER, replace(FEATURES, repeat=1), "inputs"),
    ],
)
def test_other_cameras_and_inputs_are_refused(tmp_path, cameras, features, name):
    write_start(tmp_path / "start.zip", cameras, features)
    with pytest.raises(ValueError, match=f"has other {name} than the training; start from a policy with"):
        load(tmp_path / "start.zip")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"brake": BRAKE.to_dict() | {"limits_s": [0.2, 0.6, 1.2, 2.6]}}, "has other limits_s than"),
        (
            {"brake": None, "demands": [0.0, -0.2, -0.4, -0.6, -1.0]},
            "was not trained with time-to-brake; start",
        ),
        ({"algo": "dqn"}, "was not trained with time-to-brake; start from"),
        ({"neuron": {"t_sp": 0.9}}, "has other neurons than the training"),
        ({"vec_normalize": "start-vecnormalize.npz"}, "was not trained with time-to-brake"),
        ({"network": None}, "has other cameras than the training; .* or of columns with fewer fields ahead"),
    ],
)
def test_other_cards_are_refused(tmp_path, changes, message):
    write_start(tmp_path / "start.zip", FEWER, **changes)
    with pytest.raises(ValueError, match=message):
        load(tmp_path / "start.zip")


def test_a_policy_with_more_cameras_is_refused(tmp_path):
    write_start(tmp_path / "start.zip", CAMERAS)
    with pytest.raises(ValueError, match="has other cameras than the training"):
        load(tmp_path / "start.zip", camera=FEWER)


@pytest.mark.parametrize("inputs", [("columns", "ffi"), ("sides_ffi", "ego_speed"), ("ego_speed",)])
def test_more_cameras_require_columns_and_no_input_of_every_camera(tmp_path, inputs):
    features = FeatureConfig(inputs=inputs, history=1)
    write_start(tmp_path / "start.zip", FEWER, features)
    with pytest.raises(ValueError, match="has other cameras than the training"):
        load(tmp_path / "start.zip", features)


def test_a_network_with_other_inputs_than_its_card_is_refused(tmp_path):
    features = replace(FEATURES, inputs=("columns", "sides_ffi", "ego_speed"))
    write_start(tmp_path / "start.zip", FEWER, features, features=FEATURES.to_dict())
    with pytest.raises(ValueError, match="the network of the card has other inputs than its features"):
        load(tmp_path / "start.zip")
    write_start(tmp_path / "start.zip", FEWER[1:], camera=FEWER)
    with pytest.raises(ValueError, match="the network of the card has other inputs than its features"):
        load(tmp_path / "start.zip")
    write_start(tmp_path / "start.zip", CAMERAS, features, features=FEATURES.to_dict())
    with pytest.raises(ValueError, match="model and card do not belong together"):
        load(tmp_path / "start.zip")


def test_a_damaged_file_is_refused_in_one_line(tmp_path):
    write_start(tmp_path / "start.zip", FEWER)
    with (
        zipfile.ZipFile(tmp_path / "start.zip") as source,
        zipfile.ZipFile(tmp_path / "bad.zip", "w") as target,
    ):
        for name in source.namelist():
            target.writestr(name, b"damaged" if name == "policy.pth" else source.read(name))
    with pytest.raises(ValueError, match="cannot be loaded with algo 'ppo'"):
        load(tmp_path / "bad.zip")
