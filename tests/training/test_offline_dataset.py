"""`OfflineDataset`: policy inputs, decision rate and history of recorded episodes."""

from functools import partial

import numpy as np
import pytest
from support.recordings import offline_config, synthetic_episode

from lgmd_gym.agents.policies.features import SCALES, ZONE_INPUTS, FeatureConfig, FeatureHistory
from lgmd_gym.agents.sides import NUM_ALL_ROUND, NUM_COLUMNS
from lgmd_gym.agents.zones import NUM_FIELDS
from lgmd_gym.training.offline.dataset import OfflineDataset, mirror_input, policy_inputs
from lgmd_gym.training.offline.recorder import EpisodeRecorder


def test_batches_equal_the_observations_of_the_policy_wrapper(tmp_path):
    config = offline_config(tmp_path)
    recorder = EpisodeRecorder(partial(config.make_env, "train"), hold=0, brake=1)
    episodes = [episode for (episode,) in recorder.record(range(2))]
    batch = OfflineDataset(episodes, config.features).batch([1, 0])
    env = config.make_policy_env("train")
    row = 0
    for index, seed in enumerate((1, 0)):
        observation, _ = env.reset(seed=seed)
        done, decision = False, 0
        while not done:
            assert [int(values[row]) for values in batch.indices] == [index, decision]
            for name, value in observation.items():
                assert batch.inputs[name][row].tolist() == pytest.approx(value.tolist(), abs=1e-6)
            observation, reward, terminated, truncated, _ = env.step(0)
            expected = config.features.reward_scale * float(batch.rewards[index, decision])
            assert reward == pytest.approx(expected)
            row, decision, done = row + 1, decision + 1, terminated or truncated
    assert row == len(batch.inputs["ego_speed"])
    assert batch.mask.sum() == row
    assert batch.threats.tolist() == [episodes[1].threat, episodes[0].threat]


def test_a_lower_decision_rate_uses_every_third_decision():
    episode = synthetic_episode(11, frames=True)
    features = FeatureConfig(inputs=("frame", "ego_speed"), history=1, repeat=3, shrink=1)
    batch = OfflineDataset([synthetic_episode(4, seed=1, frames=True), episode], features).batch([1])
    assert batch.mask.tolist() == [[1.0] * 4]
    assert batch.braking_returns[0].tolist() == episode.braking_returns[::3].tolist()
    assert batch.braking_contacts[0].tolist() == episode.braking_contacts[::3].tolist()
    sums = [episode.rewards[first : first + 3].sum() for first in (0, 3, 6, 9)]
    assert batch.rewards[0].tolist() == pytest.approx(sums, abs=1e-6)
    assert np.array_equal(
        np.moveaxis(batch.inputs["frame"].numpy(), 1, -1), episode.observations["frame"][::3]
    )


def test_zone_inputs_have_no_history():
    """The 17 fields of `stopping-zone`: four values each, whatever the history of the other inputs."""
    episode = synthetic_episode(5)
    potential = np.random.default_rng(0).uniform(0.5, 1.0, (5, 17)).astype(np.float32)
    episode.observations["membrane_potential"] = potential
    features = FeatureConfig(inputs=("zones", "ego_speed"), history=3, repeat=1)
    inputs = OfflineDataset([episode], features).batch([0]).inputs
    assert {name: tuple(values.shape) for name, values in inputs.items()} == {
        "zones": (5, 68),
        "ego_speed": (5, 3),
    }


def test_frames_have_their_history_in_the_channels():
    features = FeatureConfig(inputs=("frame", "ego_speed"), history=3, repeat=1)
    episodes = [synthetic_episode(2, frames=True), synthetic_episode(4, seed=1, frames=True)]
    frames = OfflineDataset(episodes, features).batch([1]).inputs["frame"]
    assert frames.shape == (4, 6, 40, 40)
    expected = np.concatenate([episodes[1].observations["frame"][index] for index in (1, 2, 3)], axis=-1)
    assert np.array_equal(frames[3].numpy(), np.moveaxis(expected, -1, 0))


@pytest.mark.parametrize("repeat", [1, 3])
def test_inputs_of_an_episode_equal_those_of_a_feature_history(repeat):
    rng = np.random.default_rng(0)
    sizes = dict.fromkeys(SCALES, 1) | dict.fromkeys(("membrane_potential", "ffi"), NUM_ALL_ROUND)
    sizes |= {"spike_frequency": NUM_FIELDS, "column_potential": NUM_COLUMNS}
    observations = {name: rng.random((40, size), np.float32) for name, size in sizes.items()}
    inputs = (*SCALES, "speed_change", "spike_peak", *(name for name in ZONE_INPUTS if name != "zones"))
    features = FeatureConfig(inputs=inputs, history=1, repeat=repeat)
    (found,), history = policy_inputs([observations], features, np.float32), FeatureHistory(features)
    assert set(found) == set(inputs)
    for time in range(40):
        history.update({name: values[time : time + 1] for name, values in observations.items()})
        if time % repeat == 0:
            for name, expected in history.stack().items():
                assert found[name][time // repeat] == pytest.approx(expected[0], abs=1e-6)
    for name, rounded in policy_inputs([observations], features)[0].items():
        assert rounded.dtype == (np.float16 if name in ZONE_INPUTS else np.float32)
        assert rounded == pytest.approx(found[name], abs=5e-4)


def test_dataset_drops_observations_of_episodes_that_it_reads_once():
    episodes = [synthetic_episode(length, seed=length, threat=length == 4) for length in (4, 7)]
    features = FeatureConfig(inputs=("ego_speed",), history=2, repeat=1)
    dataset = OfflineDataset(iter(episodes), features)
    assert [len(episode) for episode in dataset.episodes] == [4, 7]
    assert [episode.family for episode in dataset.episodes] == ["CCRs", "EmptyRoad"]
    assert all(episode.observations == {} for episode in dataset.episodes)
    inputs = dataset.batch([1, 0, 1]).inputs["ego_speed"].numpy()
    assert inputs.dtype == np.float32
    assert np.array_equal(inputs[:7], inputs[11:])
    assert np.array_equal(inputs[7:11], OfflineDataset(episodes[:1], features).batch([0]).inputs["ego_speed"])


def test_mirrored_episodes_of_a_batch():
    """The yaw rate and the direction-selective neurons of one of two episodes change their sign."""
    episodes = [synthetic_episode(4, seed=seed) for seed in (0, 1)]
    for episode in episodes:
        episode.observations["column_potential"] = np.random.default_rng(2).uniform(0.01, 0.99, (4, 260))
        episode.observations["ego_yaw_rate"] = np.full((4, 1), 0.1)
    features = FeatureConfig(inputs=("columns", "ego_yaw_rate"), history=2, repeat=1)
    data = OfflineDataset(episodes, features)
    plain, mirrored = data.batch([0, 1]).inputs, data.batch([0, 1], [False, True]).inputs
    for name, values in plain.items():
        assert np.array_equal(mirrored[name][:4], values[:4])
    assert np.array_equal(mirrored["ego_yaw_rate"][4:], -plain["ego_yaw_rate"][4:])
    expected = mirror_input("columns", plain["columns"][4:].numpy())
    assert np.array_equal(mirrored["columns"][4:], expected)
    assert not np.array_equal(expected, plain["columns"][4:])
