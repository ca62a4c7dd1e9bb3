"""Inputs of policies: scaling, history, and the fields of `stopping-zone`."""

import pickle

import numpy as np
import pytest
from support.agents import to_potential, zone_levels

from lgmd_gym.agents.policies.features import (
    CLIP,
    PEAK_DECAY,
    TIME_CONSTANTS_S,
    ZONE_INPUTS,
    FeatureConfig,
    FeatureHistory,
    shrink_frames,
)
from lgmd_gym.agents.sides import (
    NUM_ALL_ROUND,
    NUM_COLUMNS,
    NUM_FORWARD_COLUMNS,
    NUM_FORWARD_FIELDS,
    NUM_SIDE_FIELDS,
    all_round_cameras,
)
from lgmd_gym.agents.zones import NUM_FIELDS, NUM_ZONES, REACHES
from lgmd_gym.sensing.channel import make_channels


def observe(frequency, speed=10.0):
    return {"spike_frequency": np.array([frequency], np.float32), "ego_speed": np.array([speed], np.float32)}


def stack(history, *observations):
    """Pass observations of the environment, then return the features of one decision of the policy."""
    for observation in observations:
        update(history, observation)
    return {name: values[0] for name, values in history.stack().items()}


def update(history, observation):
    history.update({name: values[None] for name, values in observation.items()})


def test_features_are_scaled_clipped_and_stacked():
    history = FeatureHistory(FeatureConfig(inputs=("spike_frequency", "ego_speed"), history=3))
    first = stack(history, observe(50.0))
    assert first["spike_frequency"].tolist() == [0.5, 0.5, 0.5]
    assert first["ego_speed"].tolist() == [0.5, 0.5, 0.5]
    stack(history, observe(100.0))
    assert stack(history, observe(9e9))["spike_frequency"].tolist() == [0.5, 1.0, CLIP]
    history.reset()
    assert stack(history, observe(0.0))["spike_frequency"].tolist() == [0.0, 0.0, 0.0]


def test_peaks_decay_per_observation_and_speed_changes_span_a_decision():
    history = FeatureHistory(FeatureConfig(inputs=("spike_peak", "speed_change"), history=1))
    features = [
        stack(history, observe(0, 10.0)),
        stack(history, observe(200, 9.7), observe(0, 9.5)),
        stack(history, observe(0, 9.0), observe(0, 8.6)),
    ]
    peaks = [float(item["spike_peak"][0]) for item in features]
    changes = [float(item["speed_change"][0]) for item in features]
    assert peaks == pytest.approx([0.0, 2 * PEAK_DECAY, 2 * PEAK_DECAY**3])
    assert changes == pytest.approx([0.0, -0.5, -0.9], abs=1e-6)


def observe_zones(levels):
    """Return an observation of the cameras of `stopping-zone` for excitations, shape (17,)."""
    return {"membrane_potential": to_potential(levels), "spike_frequency": 20.0 * levels, "ffi": levels}


def zone_history(name="zones"):
    return FeatureHistory(FeatureConfig(inputs=(name,), history=1))


def zone_features(history, *levels, name="zones"):
    """Return the features after frames with these excitations: levels, then averages, (4, fields)."""
    features = stack(history, *(observe_zones(level) for level in levels))[name]
    assert features.shape == (4 * NUM_FIELDS,)
    return features.reshape(-1, NUM_FIELDS)


@pytest.mark.parametrize("name", ["zones", "zones_spikes", "zones_ffi"])
def test_zone_features_are_the_logarithm_of_the_signal(name):
    """Each input has the same scale here: 20 spikes/s count as an excitation or an F̂ of 1."""
    levels = zone_levels(ground=7.0, upright=1.0, low={1.35: 3.0})
    first = zone_features(zone_history(name), levels, name=name)[0]
    assert first == pytest.approx(np.log1p(2.0 * levels) / 3.4, abs=1e-6)
    assert first.max() == pytest.approx(np.log(15.0) / 3.4, abs=1e-6)


def test_zone_features_have_no_history():
    features = FeatureConfig(inputs=("zones", "ego_speed"), history=3)
    history, observation = FeatureHistory(features), observe_zones(zone_levels()) | observe(0.0)
    stacked = stack(history, observation)
    sizes = features.box_arguments({name: value.shape for name, value in observation.items()})
    for name, size in (("zones", 4 * NUM_FIELDS), ("ego_speed", 3)):
        assert stacked[name].shape == sizes[name][2] == (size,)


def test_zone_features_take_the_smaller_level_of_two_frames():
    history, low, high = zone_history(), zone_levels(ground=1.0), zone_levels(ground=5.0)
    zone = REACHES.index(1.0)
    single = np.log1p(2.0 * 1.0) / 3.4
    assert zone_features(history, low)[0, zone] == pytest.approx(single, abs=1e-6)
    assert zone_features(history, high, low)[0, zone] == pytest.approx(single, abs=1e-6)
    assert zone_features(history, high)[0, zone] == pytest.approx(single, abs=1e-6)
    assert zone_features(history, high, high)[0, zone] == pytest.approx(np.log1p(10.0) / 3.4, abs=1e-6)


def test_averages_approach_the_level_with_their_time_constants():
    """The gain of each frame is dt / (dt + τ), once that many frames have passed."""
    history, levels, zone = zone_history(), zone_levels(upright=4.0), NUM_ZONES + REACHES.index(1.0)
    zone_features(history, *[np.zeros(NUM_FIELDS)] * 200)
    averages = zone_features(history, *[levels] * 12)[1:, zone] / (np.log1p(8.0) / 3.4)
    expected = [1.0 - (1.0 - 1.0 / (1.0 + 30.0 * tau)) ** 12 for tau in TIME_CONSTANTS_S]
    assert averages == pytest.approx(expected, abs=1e-6)
    history.reset()
    assert np.all(zone_features(history, np.zeros(NUM_FIELDS)) == 0.0)


def test_averages_do_not_depend_on_the_time_since_the_start():
    history, levels, zone = zone_history(), zone_levels(upright=4.0), NUM_ZONES + REACHES.index(1.0)
    for _ in range(30):
        assert zone_features(history, levels)[1:, zone] == pytest.approx(np.log1p(8.0) / 3.4, abs=1e-6)
    # 1 s at one level, then two frames without: the mean of all frames for the longest average
    averages = zone_features(history, *[np.zeros(NUM_FIELDS)] * 2)[1:, zone] / (np.log1p(8.0) / 3.4)
    assert averages[2] == pytest.approx(30 / 32, abs=1e-6)
    assert averages[0] == pytest.approx((1.0 - 1.0 / 4.0) ** 2, abs=1e-6)


def test_a_pickle_contains_no_kernel():
    """A kernel of a pickle has no cache on disk: each process would compile it."""
    history, levels = zone_history(), zone_levels(upright=4.0)
    zone_features(history, levels)
    data = pickle.dumps(history)
    assert b"numba" not in data
    restored = pickle.loads(data)
    assert np.array_equal(zone_features(restored, 2.0 * levels), zone_features(history, 2.0 * levels))


def test_features_of_columns_have_the_sign_of_the_motion():
    responses = np.linspace(-6.0, 5.0, NUM_COLUMNS)
    observation = {"column_potential": (1.0 / (1.0 + np.exp(-responses))).astype(np.float32)}
    features = stack(zone_history("columns"), observation)["columns"].reshape(4, NUM_COLUMNS)
    expected = np.sign(responses) * np.log1p(2.0 * np.abs(responses)) / 3.4
    assert features[0] == pytest.approx(expected, abs=1e-5)
    assert features[1] == pytest.approx(features[0], abs=1e-6)  # the first frame


def test_features_of_mean_strengths_at_the_sides():
    strengths = np.linspace(0.0, 9.0, NUM_ALL_ROUND)
    features = stack(zone_history("sides_ffi"), {"ffi": strengths})["sides_ffi"].reshape(4, -1)
    expected = np.log1p(2.0 * strengths[13:19]) / 3.4  # after those of 5 + 5 + 3 forward fields
    assert features[0] == pytest.approx(expected, abs=1e-5)


def test_cameras_of_all_round_are_in_the_order_of_the_features():
    channels = make_channels(all_round_cameras())
    names = [channel.name for channel in channels]
    assert len(set(names)) == NUM_ALL_ROUND
    assert names[4:6] == ["ground2.5", "upright0.28"]
    assert names[9:11] == ["upright2.5", "low0.75"]
    assert {channel.neuron for channel in channels[:NUM_FORWARD_FIELDS]} == {"dsn"}
    assert names[13:16] == ["near_left_dsn", "near_right_dsn", "middle_left_dsn"]
    sides = channels[NUM_FORWARD_FIELDS:]
    for first, others in ((sides[k], sides[k::NUM_SIDE_FIELDS]) for k in range(NUM_SIDE_FIELDS)):
        assert [channel.neuron for channel in others] == ["dsn", "edges"]
        assert all((channel.camera, channel.columns) == (first.camera, first.columns) for channel in others)
    columns = [channel.columns for channel in channels]
    assert sum(columns[:NUM_FORWARD_FIELDS]) == NUM_FORWARD_COLUMNS == 130
    assert sum(columns) == NUM_COLUMNS == 190
    assert ZONE_INPUTS["columns"].size == 4 * NUM_COLUMNS


def test_missing_or_other_observations_are_rejected():
    two_cameras = observe(1.0) | {"membrane_potential": np.array([0.5, 0.6]), "ego_yaw_rate": np.zeros(1)}
    with pytest.raises(ValueError, match="requires the 17 cameras of stopping-zone, got 2; train with"):
        update(zone_history(), two_cameras)
    with pytest.raises(ValueError, match="'sides_ffi' requires the 25 cameras of all-round, got 17; train"):
        update(zone_history("sides_ffi"), observe_zones(zone_levels()))
    with pytest.raises(ValueError, match="requires the observation 'ffi', got"):
        update(FeatureHistory(FeatureConfig(inputs=("ffi",))), observe(1.0))


def test_shrink_frame_averages_blocks():
    frame = np.zeros((4, 6, 1), np.uint8)
    frame[:2, 2:4] = 100
    small = shrink_frames(frame[None], 2)[0]
    assert small.shape == (2, 3, 1)
    assert small[0, 1, 0] == 100
    assert small.sum() == 100


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"inputs": ["spike_frequncy"]},
            "unknown policy input 'spike_frequncy'; did you mean 'spike_frequency'",
        ),
        ({"inputs": []}, "inputs must contain at least one policy input, got none"),
        (
            {"inputs": ["zones", "ffi", "columns"]},
            "the same cameras: 'zones' those of stopping-zone and 'columns' those of all-round; omit one",
        ),
        ({"histry": 3}, "unknown policy field 'histry'; did you mean 'history'"),
        ({"history": 0}, "history must be in \\[1, 1000\\], got 0"),
        ({"latch": 1}, "latch must be true or false, got 1"),
        ({"reward_scale": 0.0}, "reward_scale must be in \\(0, inf\\), got 0.0"),
    ],
)
def test_invalid_features_are_rejected(values, message):
    with pytest.raises(ValueError, match=message):
        FeatureConfig.make(values)


def test_blocks_larger_than_the_frame_are_rejected():
    features = FeatureConfig(inputs=("frame",), shrink=91)
    with pytest.raises(ValueError, match="at most the shorter side of the frame, 90 px, got 91"):
        features.box_arguments({"frame": (90, 160, 1)})


def test_columns_require_the_cameras_of_all_round():
    features = FeatureConfig(inputs=("columns",), history=1)
    with pytest.raises(ValueError, match="requires the 190 columns of all-round, got 0; train with"):
        features.box_arguments({"membrane_potential": (17,)})
