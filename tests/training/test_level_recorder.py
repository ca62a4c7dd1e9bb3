"""`LevelRecorder`: the same episodes as `EpisodeRecorder`, recorded with the engine."""

from functools import partial

import pytest
from support.recordings import offline_config

from lgmd_gym.training.offline.recorder import NUM_ENVS, EpisodeRecorder, LevelRecorder

SMALL = {"name": "wide", "shape": (24, 32)}


def check_equal(left, right):
    assert (left.threat, left.traffic, left.family) == (right.threat, right.traffic, right.family)
    for name in ("rewards", "braking_returns", "braking_contacts"):
        first, second = getattr(left, name), getattr(right, name)
        assert first.dtype == second.dtype
        assert first.tobytes() == second.tobytes()
    assert left.observations.keys() == right.observations.keys()
    for name, first in left.observations.items():
        second = right.observations[name]
        assert (first.dtype, first.shape) == (second.dtype, second.shape)
        assert first.tobytes() == second.tobytes()


def recorders(config, split, shrink=None):
    hold, brake = config.demands.index(0.0), config.demands.index(min(config.demands))
    reference = EpisodeRecorder(partial(config.make_env, split), hold, brake, shrink)
    return reference, LevelRecorder(config.env_id, config.env_arguments(split), min(config.demands), shrink)


def test_episodes_of_the_engine_equal_those_of_single_environments(tmp_path):
    seeds = range(3, 9)
    assert len(seeds) > NUM_ENVS  # environments start another episode
    reference, recorder = recorders(offline_config(tmp_path, camera=[SMALL, "fovea"]), "train")
    expected, recorded = ([episode for (episode,) in item.record(seeds)] for item in (reference, recorder))
    assert {episode.threat for episode in expected} == {False, True}
    assert len({episode.family for episode in expected}) > 3
    for left, right in zip(expected, recorded, strict=True):
        check_equal(left, right)


def test_frames_and_a_partial_brake_equal_those_of_single_environments(tmp_path):
    config = offline_config(tmp_path, "LGMD/CCRs-v0", inputs=["frame"], camera=SMALL, demands=(-0.6, 0.0))
    reference, recorder = recorders(config, "validation", shrink=2)
    ((left,),), ((right,),) = reference.record(range(1)), recorder.record(range(1))
    assert left.observations["frame"].shape[1:] == (12, 16, 1)
    assert left.family == "CCRs"
    check_equal(left, right)


@pytest.mark.parametrize("seeds", [range(0), range(2, 3)])
def test_number_of_episodes_is_that_of_the_seeds(tmp_path, seeds):
    _, recorder = recorders(offline_config(tmp_path, camera=SMALL), "train")
    assert len(recorder.record(seeds)) == len(seeds)
