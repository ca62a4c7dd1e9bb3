"""Mirrored policy inputs: those of the mirrored fields, columns and motion."""

import numpy as np
import pytest

from lgmd_gym.agents.policies.features import NUM_LEVELS, ZONE_INPUTS, FeatureConfig, FeatureHistory
from lgmd_gym.agents.sides import (
    NUM_ALL_ROUND,
    NUM_COLUMNS,
    NUM_FORWARD_FIELDS,
    NUM_SIDE_FIELDS,
    all_round_cameras,
)
from lgmd_gym.sensing.channel import make_channels
from lgmd_gym.training.offline.dataset import mirror_input, mirror_of


def mirrored(name, values):
    """Return the mirror image of four equal groups of values."""
    return mirror_input(name, np.tile(values, 4)[None])[0, : len(values)]


def opposite(name):
    return name.replace("_left_", "_?_").replace("_right_", "_left_").replace("_?_", "_right_")


def test_columns_of_the_mirror_image():
    """Each column has a value of its own, at its place in the mirrored camera from right to left."""
    channels = make_channels(all_round_cameras())
    parts, start = {}, 0
    for channel in channels:
        parts[channel.name] = np.arange(start, start + channel.columns) + 1.0
        start += channel.columns
    assert start == NUM_COLUMNS
    expected = [
        parts[opposite(channel.name)][::-1] * (-1.0 if channel.neuron == "dsn" else 1.0)
        for channel in channels
    ]
    assert np.array_equal(mirrored("columns", np.concatenate(list(parts.values()))), np.concatenate(expected))


def test_strengths_of_the_mirror_image():
    channels = make_channels(all_round_cameras())[NUM_FORWARD_FIELDS:][:NUM_SIDE_FIELDS]
    values = {channel.name: 1.0 + index for index, channel in enumerate(channels)}
    expected = [values[opposite(channel.name)] for channel in channels]
    assert mirrored("sides_ffi", np.array(list(values.values()))).tolist() == expected


@pytest.mark.parametrize("name", ["columns", "sides_ffi"])
def test_features_of_a_mirrored_sequence_are_the_mirrored_features(name):
    """All four groups, of which the first one compares two frames, also if motion changes its direction."""
    rng = np.random.default_rng(0)
    field = ZONE_INPUTS[name]
    single = mirror_of(name, field.size)
    count = field.size // NUM_LEVELS
    order, signs = single.order[:count], single.signs[:count]
    length = NUM_COLUMNS if name == "columns" else NUM_ALL_ROUND
    config = FeatureConfig(inputs=(name,))
    original, image = FeatureHistory(config), FeatureHistory(config)
    for _ in range(20):
        response = rng.normal(size=count) if name != "sides_ffi" else rng.uniform(0.0, 3.0, count)
        response[signs > 0] = np.abs(response[signs > 0])
        for features, values in ((original, response), (image, response[order] * signs)):
            signal = np.full(length, 0.5)
            signal[field.first : field.last] = (
                values if name == "sides_ffi" else 1.0 / (1.0 + np.exp(-values))
            )
            features.update({field.source: signal[None]})
        expected = mirror_input(name, original.stack()[name])
        assert np.allclose(image.stack()[name], expected, atol=1e-6)


def test_ego_motion_and_forward_fields():
    assert mirrored("zones", np.arange(17.0)).tolist() == list(range(17))
    assert mirrored("ego_speed", np.array([2.0])).tolist() == [2.0]
    assert mirrored("known_deceleration", np.array([0.5])).tolist() == [0.5]
    assert mirrored("ego_yaw_rate", np.array([2.0])).tolist() == [-2.0]
    assert mirrored("speed_change", np.array([-0.5])).tolist() == [-0.5]
    with pytest.raises(ValueError, match="mirror does not support the input 'frame'; set mirror: false in"):
        mirror_input("frame", np.zeros((1, 4)))
