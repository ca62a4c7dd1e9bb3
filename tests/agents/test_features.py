"""Inputs of policies: scaling, history, and the fields of `stopping-zone` relative to the ego speed."""

import numpy as np
import pytest
from support.agents import to_potential

from lgmd_gym.agents.policies.features import CLIP, PEAK_DECAY, FeatureConfig, FeatureHistory, shrink_frame
from lgmd_gym.agents.policies.zone_features import ZONE_INPUTS
from lgmd_gym.agents.zones import FIELDS, NUM_ZONES, SPEEDS_KMH

ZEROS = ([0.0] * 6, [0.0] * 5)


def observe(frequency, speed=10.0):
    return {"spike_frequency": np.array([frequency], np.float32), "ego_speed": np.array([speed], np.float32)}


def stack(history, *observations):
    """Pass observations of the environment, then return the features of one decision of the policy."""
    for observation in observations:
        history.update(observation)
    return history.stack()


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


def observe_zones(fields, speed=10.0, yaw_rate=0.0):
    """Return an observation of the cameras of `stopping-zone`.

    `fields` maps (design speed [km/h], kind of field) to an excitation.
    """
    excitation = np.zeros(2 * NUM_ZONES)
    for (zone, kind), value in fields.items():
        excitation[SPEEDS_KMH.index(zone) + NUM_ZONES * list(FIELDS).index(kind)] = value
    return {
        "membrane_potential": to_potential(excitation),
        "spike_frequency": 10.0 * excitation,
        "ffi": excitation,
        "ego_speed": np.array([speed], np.float32),
        "ego_yaw_rate": np.array([yaw_rate], np.float32),
    }


# Fields at 10 m/s (36 km/h), with the feature that each one is expected in.
ZONE_FIELDS = {
    (40, "ground"): 3.0,  # zone for the speed
    (40, "upright"): 1.5,
    (50, "ground"): 6.0,  # next farther zone
    (30, "upright"): 9.0,  # nearer zone with an inactive ground field: does not count
    (25, "ground"): 0.9,  # nearer zone: the smaller value counts
    (25, "upright"): 1.2,
    (10, "ground"): 9.0,  # zone for less than half the speed: does not count
    (10, "upright"): 9.0,
}


def zone_features(history, *observations, name="zones"):
    """Return the confirmed values (the last one twice: two and four frames) and the peaks, before tanh."""
    scale = ZONE_INPUTS[name][1]
    features = scale * np.arctanh(stack(history, *observations)[name].astype(np.float64))
    return features[:6].round(2).tolist(), features[6:].round(2).tolist()


def zone_history(name="zones"):
    return FeatureHistory(FeatureConfig(inputs=(name,), history=1))


@pytest.mark.parametrize("name", ZONE_INPUTS)
def test_zone_features_are_ordered_by_the_ego_speed(name):
    factor = 10.0 if name == "zones_spikes" else 1.0
    selected = np.array([3.0, 1.5, 6.0, 0.0, 0.9]) * factor
    confirmed, peak = zone_features(zone_history(name), observe_zones(ZONE_FIELDS), name=name)
    assert confirmed == pytest.approx([*selected, selected[-1]], abs=0.01)  # the first frame is confirmed
    assert peak == pytest.approx(selected.tolist(), abs=0.01)


def test_above_the_last_design_speed_the_last_zone_is_also_the_farther_one():
    confirmed, _ = zone_features(zone_history(), observe_zones({(90, "ground"): 3.0}, speed=40.0))
    assert confirmed[:4] == pytest.approx([3.0, 0.0, 3.0, 0.0], abs=0.01)


def test_zone_features_are_confirmed_by_consecutive_frames():
    history = zone_history()
    empty, ground = observe_zones({}), observe_zones({(40, "ground"): 3.0})
    near = observe_zones({(30, "ground"): 2.0, (30, "upright"): 4.0})
    assert zone_features(history, empty) == ZEROS
    confirmed, peak = zone_features(history, ground, empty, empty)  # one frame gives only a peak
    assert confirmed == [0.0] * 6
    assert peak[0] == pytest.approx(3.0 * PEAK_DECAY**2, abs=0.01)
    confirmed, _ = zone_features(history, ground, ground, empty)  # two earlier frames confirm
    assert confirmed == pytest.approx([3.0, 0, 0, 0, 0, 0], abs=0.01)
    assert zone_features(history, empty)[0] == [0.0] * 6  # cleared by the last decision
    assert zone_features(history, near, near, near)[0] == pytest.approx([0, 0, 0, 0, 2.0, 0], abs=0.01)
    assert zone_features(history, near)[0] == pytest.approx([0, 0, 0, 0, 2.0, 2.0], abs=0.01)


def test_zone_features_are_zero_during_and_after_turns():
    history, fields = zone_history(), {(40, "ground"): 3.0}
    assert zone_features(history, observe_zones(fields, yaw_rate=0.02))[1][0] == pytest.approx(3.0, abs=0.01)
    assert zone_features(history, observe_zones(fields, yaw_rate=-0.04)) == ZEROS
    assert zone_features(history, *[observe_zones(fields)] * 14) == ZEROS  # half a second
    assert zone_features(history, *[observe_zones(fields)] * 2)[0][0] == pytest.approx(3.0, abs=0.01)


def test_zone_features_are_zero_at_a_crawl():
    history, fields = zone_history(), {(10, "ground"): 3.0, (10, "upright"): 3.0}
    assert zone_features(history, *[observe_zones(fields, speed=2.4)] * 3) == ZEROS
    active = zone_features(history, *[observe_zones(fields, speed=2.6)] * 2)
    assert active[0][0] == pytest.approx(3.0, abs=0.01)


def test_missing_or_other_observations_are_rejected():
    two_cameras = observe(1.0) | {"membrane_potential": np.array([0.5, 0.6]), "ego_yaw_rate": np.zeros(1)}
    with pytest.raises(ValueError, match="requires the 20 cameras of stopping-zone, got 2; train with"):
        zone_history().update(two_cameras)
    with pytest.raises(ValueError, match="requires the observation 'ffi', got"):
        FeatureHistory(FeatureConfig(inputs=("ffi",))).update(observe(1.0))


def test_shrink_frame_averages_blocks():
    frame = np.zeros((4, 6, 1), np.uint8)
    frame[:2, 2:4] = 100
    small = shrink_frame(frame, 2)
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
        ({"histry": 3}, "unknown policy feature 'histry'; did you mean 'history'"),
        ({"history": 0}, "history must be a whole number in \\[1, 1000\\], got 0"),
        ({"latch": 1}, "latch must be true or false, got 1"),
        ({"reward_scale": 0.0}, "reward_scale must be a number > 0, got 0.0"),
    ],
)
def test_invalid_features_are_rejected(values, message):
    with pytest.raises(ValueError, match=message):
        FeatureConfig.from_dict(values)
