"""Damaged policy files are refused in one line."""

import json
import zipfile

import pytest
from gymnasium import spaces
from support import policies

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.card import CARD
from lgmd_gym.agents.zones import zone_cameras

pytest.importorskip("stable_baselines3")


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    return policies.write_policy(tmp_path_factory.mktemp("policy") / "small.zip")


def copy_with_card(policy, path, **values):
    """Copy a policy with changed values of its card; None deletes a value."""
    with zipfile.ZipFile(policy) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            data = source.read(name)
            if name == CARD:
                card = json.loads(data) | values
                data = json.dumps({key: value for key, value in card.items() if value is not None}).encode()
            target.writestr(name, data)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"algo": None, "camera": None}, r"the card is damaged \(algo, camera missing\)"),
        ({"camera": "nix"}, "unknown camera"),
        ({"camera": 7}, "the card is damaged"),
        ({"features": {"inputs": ["zone"]}}, "did you mean 'zones'"),
        ({"camera": zone_cameras()[1:]}, "input 'zones' requires the 17 cameras of stopping-zone, got 16"),
        ({"features": {"inputs": ["columns"]}}, "'columns' requires the 190 columns of all-round, got 0"),
        ({"demands": [0.0, -1.5]}, r"demand must be in \[-1, 1\], got -1.5"),
        (
            {"demands": [0.0]},
            r"the weights action_net.weight have the shape \(2, 64\), those of the card \(1, 64\)",
        ),
        ({"demands": [0.0], "network": None}, "model and card do not belong together"),
        ({"algo": "nix"}, "cannot be loaded with algo 'nix' .*; correct its card"),
    ],
)
def test_damaged_card(policy, tmp_path, values, words):
    path = tmp_path / "policy.zip"
    copy_with_card(policy, path, **values)
    with pytest.raises(ValueError, match=words) as caught:
        make_agent(f"policy:{path}")
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_network_for_other_fields(tmp_path, monkeypatch):
    boxes = {name: spaces.Box(-5.0, 5.0, (64,) if name == "zones" else (1,)) for name in policies.INPUTS}
    monkeypatch.setattr(policies._Spaces, "observation_space", spaces.Dict(boxes))
    file = policies.write_policy(tmp_path / "other.zip")
    with pytest.raises(ValueError, match="the model has 64 values of zones instead of 68; correct the card"):
        make_agent(f"policy:{file}")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_file_that_is_cut_off(policy, tmp_path, share):
    path, data = tmp_path / "policy.zip", policy.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(ValueError, match="is not a policy file"):
        make_agent(f"policy:{path}")


def test_damaged_weights(policy, tmp_path):
    path = tmp_path / "policy.zip"
    with zipfile.ZipFile(policy) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            data = source.read(name)
            target.writestr(name, data[: len(data) // 2] if name == "policy.pth" else data)
    with pytest.raises(ValueError, match="cannot be loaded"):
        make_agent(f"policy:{path}")
