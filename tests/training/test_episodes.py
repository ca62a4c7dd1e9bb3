"""Recording of episodes and the outcomes of braking in them."""

from functools import partial

import pytest
from support.recordings import offline_config

from lgmd_gym.training import PolicyWrapper
from lgmd_gym.training.offline.episodes import record_parallel
from lgmd_gym.training.offline.recorder import TOLERANCE, BrakingOutcome, EpisodeRecorder, braking_outcomes


@pytest.mark.parametrize("demands", [(0.0, -1.0), (-0.6, 0.0)])
def test_recorded_outcomes_equal_closed_loop_episodes(tmp_path, demands):
    config = offline_config(tmp_path, demands=demands)
    hold, brake = demands.index(0.0), demands.index(min(demands))
    recorder = EpisodeRecorder(partial(config.make_env, "train"), hold, brake)
    episodes = [episode for (episode,) in recorder.record(range(3, 6))]
    assert {episode.threat for episode in episodes} == {False, True}
    features = config.features.to_dict() | {"repeat": 1, "reward_scale": 1.0}
    env = PolicyWrapper(config.make_env("train"), **features)
    for seed, episode in zip(range(3, 6), episodes, strict=True):
        for onset in (0, 17, 24, len(episode) - 2):
            env.reset(seed=seed)
            rewards = [env.step(hold)[1] for _ in range(onset)]
            assert rewards == pytest.approx(episode.rewards[:onset].tolist(), abs=1e-4)
            _, episode_return, _, _, info = env.step(brake)
            assert episode_return == pytest.approx(episode.braking_returns[onset], abs=3 * TOLERANCE)
            assert info["collision"] == episode.braking_contacts[onset]


@pytest.mark.slow
def test_number_of_processes_does_not_change_the_episodes(tmp_path):
    recorder = EpisodeRecorder(partial(offline_config(tmp_path).make_env, "validation"), hold=0, brake=1)
    parallel = record_parallel(recorder.record, range(6), jobs=2)
    for (left,), (right,) in zip(recorder.record(range(6)), parallel, strict=True):
        assert left.braking_returns.tobytes() == right.braking_returns.tobytes()
        for name in left.observations:
            assert left.observations[name].tobytes() == right.observations[name].tobytes()


def test_outcomes_are_found_with_few_replays():
    replayed = []

    def outcome(onset):
        contact = onset >= 37
        return BrakingOutcome(-12.0 - onset * 0.1 if contact else -3.0 + 0.05 * onset, contact)

    def replay(onset):
        replayed.append(onset)
        return outcome(onset)

    (outcomes,) = braking_outcomes([60], lambda pairs: [replay(onset) for _, onset in pairs])
    # 6 on the grid, 5 midpoints, and 5 halvings between 36 and 48, where contacts begin: 39, 45, 37, 40, 38
    assert len(replayed) == len(set(replayed)) == 16
    for onset, found in enumerate(outcomes):
        assert found.contact == outcome(onset).contact
        assert found.episode_return == pytest.approx(outcome(onset).episode_return, abs=TOLERANCE)


def test_outcome_of_a_single_decision():
    outcome = BrakingOutcome(-1.0, True)
    assert braking_outcomes([1], lambda pairs: [outcome]) == [[outcome]]
