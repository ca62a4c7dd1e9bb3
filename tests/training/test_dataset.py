"""`StateDataset`: policy inputs, decision rate and classes of recorded episodes."""

import numpy as np
import pytest
from support.recordings import recorded_config, synthetic_episode

from lgmd_gym.agents.policies.features import SCALES, ZONE_INPUTS, FeatureConfig, FeatureHistory
from lgmd_gym.agents.sides import NUM_ALL_ROUND, NUM_COLUMNS
from lgmd_gym.agents.zones import NUM_FIELDS
from lgmd_gym.training.offline.dataset import StateDataset, mirror_input, policy_inputs
from lgmd_gym.training.offline.driving import DriveRecorder


def test_batches_equal_the_observations_of_the_policy_wrapper(tmp_path):
    config = recorded_config(tmp_path)
    recorder = DriveRecorder(config.env_id, config.env_arguments("train"), brakes=False)
    episodes = [episode for (episode,) in recorder.record(range(2))]
    dataset = StateDataset(episodes, config.features, (1.0,))
    env, row = config.make_policy_env("train"), 0
    for seed in (0, 1):
        observation, _ = env.reset(seed=seed)
        done = False
        while not done:
            expected = np.concatenate([observation[name] for name in dataset.names])
            assert dataset.batch(np.array([row]))[0].numpy() == pytest.approx(expected, abs=2e-3)  # float16
            observation, _, terminated, truncated, _ = env.step(np.zeros(1, np.float32))
            row, done = row + 1, terminated or truncated
    assert row == len(dataset)


def test_decisions_of_many_episodes_are_in_their_order():
    features = FeatureConfig(inputs=("ego_speed", "ego_yaw_rate"), history=1, repeat=2)
    episodes = [synthetic_episode(1 + 7 * (number % 9), seed=number) for number in range(50)]
    data = StateDataset(iter(episodes), features, (0.1,))
    single = [StateDataset([episode], features, (0.1,)) for episode in episodes]
    for name in ("features", "classes", "braking", "in_traffic"):
        assert np.array_equal(getattr(data, name), np.concatenate([getattr(item, name) for item in single]))
    assert data.features.shape == (sum(map(len, single)), 2)
    assert np.diff(data.bounds).tolist() == [len(item) for item in single]
    assert np.array_equal(data.times, np.concatenate([item.time_to_brake[::2] for item in episodes]))


def test_a_lower_decision_rate_uses_every_third_decision():
    episode = synthetic_episode(11)
    features = FeatureConfig(inputs=("ego_speed",), history=1, repeat=3)
    data = StateDataset([synthetic_episode(4, seed=1), episode], features, (0.1, 0.25))
    assert len(data) == 2 + 4
    assert data.features[2:, 0] == pytest.approx(episode.observations["ego_speed"][::3, 0] / 20.0, abs=1e-3)
    assert data.classes.tolist() == [1, 0, 2, 1, 1, 0]  # times of 0.1, 0, and 10, 7, 4, 1 thirtieths
    before = np.concatenate([[0.0], episode.demands])[:11:3]
    assert data.braking[2:].tolist() == (before < 0.0).tolist()


def test_inputs_of_fields_are_side_by_side_with_the_others():
    """The 17 fields of `stopping-zone`: four values each."""
    episode = synthetic_episode(5)
    potential = np.random.default_rng(0).uniform(0.5, 1.0, (5, 17)).astype(np.float32)
    episode.observations["membrane_potential"] = potential
    data = StateDataset([episode], FeatureConfig(inputs=("zones", "ego_speed"), history=1, repeat=1), (1.0,))
    assert (data.names, data.sizes) == (["ego_speed", "zones"], [1, 68])
    assert data.features.shape == (5, 69)
    assert data.features.dtype == np.float16


@pytest.mark.parametrize("repeat", [1, 3])
@pytest.mark.parametrize("fields", [("zones", "zones_spikes", "zones_ffi"), ("columns", "sides_ffi")])
def test_inputs_of_an_episode_equal_those_of_a_feature_history(fields, repeat):
    rng = np.random.default_rng(0)
    sizes = dict.fromkeys(SCALES, 1) | {"ffi": NUM_ALL_ROUND, "column_potential": NUM_COLUMNS}
    if "zones" in fields:
        sizes |= dict.fromkeys(("spike_frequency", "membrane_potential", "ffi"), NUM_FIELDS)
    observations = {name: rng.random((40, size), np.float32) for name, size in sizes.items()}
    inputs = (*SCALES, "speed_change", "spike_peak", *fields)
    features = FeatureConfig(inputs=inputs, history=1, repeat=repeat)
    (found,), history = policy_inputs([observations], features), FeatureHistory(features)
    assert set(found) == set(inputs)
    for time in range(40):
        history.update({name: values[time : time + 1] for name, values in observations.items()})
        if time % repeat == 0:
            for name, expected in history.stack().items():
                rounded = name in ZONE_INPUTS
                assert found[name].dtype == (np.float16 if rounded else np.float32)
                tolerance = 5e-4 if rounded else 1e-6
                assert found[name][time // repeat] == pytest.approx(expected[0], abs=tolerance)


def test_mirrored_decisions_of_a_batch():
    """The yaw rate and the direction-selective neurons of one of two decisions change their sign."""
    episode = synthetic_episode(2)
    episode.observations["column_potential"] = np.random.default_rng(2).uniform(0.01, 0.99, (2, NUM_COLUMNS))
    episode.observations["ego_yaw_rate"] = np.full((2, 1), 0.1)
    data = StateDataset(
        [episode], FeatureConfig(inputs=("columns", "ego_yaw_rate"), history=1, repeat=1), (1.0,)
    )
    plain = data.batch(np.arange(2)).numpy()
    mirrored = data.batch(np.arange(2), np.array([False, True])).numpy()
    assert np.array_equal(mirrored[0], plain[0])
    assert mirrored[1, -1] == -plain[1, -1]
    expected = mirror_input("columns", plain[1:, :-1])
    assert np.array_equal(mirrored[1:, :-1], expected)
    assert not np.array_equal(expected, plain[1:, :-1])
