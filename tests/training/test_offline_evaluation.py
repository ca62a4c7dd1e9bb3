"""Evaluation on recorded episodes, and the selection of the epoch and the margin."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch
from support.recordings import dataset, learner, offline_config, spike_episodes, synthetic_episode

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.training.offline import learner as learner_module
from lgmd_gym.training.offline.evaluation import Evaluation, evaluate, select_margin
from lgmd_gym.training.offline.recorder import TOLERANCE, EpisodeRecorder


def test_evaluation_ends_each_episode_at_the_first_braking_decision():
    episodes = [
        synthetic_episode(4),
        synthetic_episode(3, seed=1, threat=False),
        synthetic_episode(5, seed=2),
    ]
    logits = torch.tensor([[-1.0, 2, -1, 3, 0], [-1, -1, -1, 9, 9], [-1, -1, -1, 1, -1]])
    evaluation = evaluate(lambda batch: logits, dataset(episodes))
    returns = [
        episodes[0].rewards[0] + episodes[0].braking_returns[1],
        episodes[1].rewards.sum(),  # the logits after its end are padding
        episodes[2].rewards[:3].sum() + episodes[2].braking_returns[3],
    ]
    assert evaluation.mean_return == pytest.approx(np.mean(returns), abs=1e-6)
    assert (evaluation.avoided, evaluation.false_activations) == (0.5, 0.0)


def test_evaluation_separates_levels_and_traffic():
    levels = [synthetic_episode(4), synthetic_episode(3, seed=1, threat=False)]
    segments = [synthetic_episode(3, seed=seed, threat=False, traffic=True) for seed in (2, 3)]
    logits = torch.tensor([[-1.0] * 4, [-1.0] * 4, [-1.0, 1, -1, -1], [-1.0] * 4])
    evaluation = evaluate(lambda batch: logits, dataset(levels + segments))
    assert evaluation[2:] == (0.0, 0.0, 0.5)
    returns = [episode.rewards.sum() for episode in (*levels, segments[1])]
    returns.append(segments[0].rewards[0] + segments[0].braking_returns[1])
    assert evaluation.mean_return == pytest.approx(np.mean(returns), abs=1e-6)


@pytest.mark.slow
def test_evaluation_equals_closed_loop_returns(tmp_path):
    features = FeatureConfig(inputs=("spike_peak", "ffi", "ego_speed"), history=3, repeat=5, latch=True)
    config, seeds = replace(offline_config(tmp_path), features=features), range(5)
    recorder = EpisodeRecorder(partial(config.make_env, "validation"), hold=0, brake=1)
    recorded = dataset([episode for (episode,) in recorder.record(seeds)], features)
    offline = learner(tmp_path, features, batch_size=5)
    model = offline.learn(recorded, recorded)
    env, returns, onsets = config.make_policy_env("validation"), [], []
    for seed in seeds:
        observation, _ = env.reset(seed=seed)
        total, done, onset = 0.0, False, 0
        while not done:
            action = model.predict(observation, deterministic=True)[0]
            observation, reward, terminated, truncated, _ = env.step(action)
            total, done, onset = total + float(reward), terminated or truncated, onset + int(action == 0)
        returns.append(total)
        onsets.append(onset)
    assert len(set(onsets)) > 3
    assert evaluate(offline.logits, recorded).mean_return == pytest.approx(
        np.mean(returns), abs=3 * TOLERANCE
    )


def test_the_margin_with_the_highest_return_is_selected():
    """Braking avoids the contact in the second of three decisions; at the first one it does not."""
    contacts, rewards = np.array([True, False, True]), np.zeros(3, np.float32)
    braking_returns = np.array([-5.0, 5.0, -5.0], np.float32)
    threat = replace(
        synthetic_episode(3), rewards=rewards, braking_returns=braking_returns, braking_contacts=contacts
    )
    log_odds = torch.tensor([[-3.2, -0.7, 2.0]])
    margin, evaluation = select_margin(lambda batch: log_odds, dataset([threat]))
    assert margin == -1.0  # the one closest to 0 of -3 to -1
    assert (evaluation.mean_return, evaluation.avoided) == (5.0, 1.0)
    assert evaluate(lambda batch: log_odds, dataset([threat])).avoided == 0.0


def threat_and_other():
    """Two episodes with the same observations; braking returns 5 in the threat and -3 in the other one."""
    threat, other = (replace(synthetic_episode(1), rewards=np.zeros(1, np.float32)) for _ in range(2))
    avoided = {"braking_returns": np.array([5.0], np.float32), "braking_contacts": np.array([False])}
    false = {"braking_returns": np.array([-3.0], np.float32), "threat": False}
    return dataset([replace(threat, **avoided), replace(other, **false)])


def test_a_higher_cost_of_false_braking_selects_a_higher_margin():
    log_odds = torch.tensor([[0.7], [0.7]])
    results = [select_margin(lambda batch: log_odds, threat_and_other(), cost) for cost in (1.0, 2.0)]
    assert [margin for margin, _ in results] == [0.0, 1.0]
    assert [evaluation.mean_return for _, evaluation in results] == [1.0, 0.0]
    assert [evaluation.weighted_return for _, evaluation in results] == [1.0, 0.0]
    assert evaluate(lambda batch: log_odds, threat_and_other(), 2.0).weighted_return == -0.5


@pytest.mark.parametrize("n_segments", [1, 4])
def test_the_weighted_return_does_not_depend_on_the_number_of_traffic_segments(n_segments):
    """Half of the weight is that of the threat with a return of 5, half that of the segments with -6 each."""
    threat, other = threat_and_other().episodes
    episodes = [threat] + [replace(other, traffic=True)] * n_segments
    inputs = synthetic_episode(1).observations
    data = dataset([replace(episode, observations=inputs) for episode in episodes])
    log_odds = torch.full((1 + n_segments, 1), 0.7)
    evaluation = evaluate(lambda batch: log_odds, data, 2.0)
    assert evaluation.weighted_return == (5.0 - 6.0) / 2.0
    assert evaluation.mean_return == pytest.approx((5.0 - 3.0 * n_segments) / (1.0 + n_segments))
    assert evaluation.traffic_activations == 1.0


def test_the_learner_selects_the_margin_with_its_cost_of_false_braking(tmp_path):
    episodes, margins = threat_and_other(), []
    arguments = {"n_epochs": 1, "learning_rate": 1e-7, "initial_brake_probability": 0.6}
    for false_cost in (1.0, 2.0):
        offline = learner(tmp_path, **arguments, select_margin=True, false_cost=false_cost)
        logs = []
        offline.learn(episodes, episodes, lambda epoch, values, rows=logs: rows.append(values))
        margins.append(logs[-1]["margin"])
    assert margins[0] < margins[1]


def test_each_epoch_has_its_own_margin(tmp_path, monkeypatch):
    """The first epoch is the best one, at a margin of 2; at a margin of 0 the second one would be."""
    validation, evaluations = threat_and_other(), []
    results = iter([(2.0, Evaluation(1.0, 3.0, 1.0, 0.0, 0.0)), (0.0, Evaluation(2.0, 2.0, 1.0, 0.0, 0.0))])
    monkeypatch.setattr(learner_module, "select_margin", lambda *_: next(results))
    offline = learner(tmp_path, n_epochs=2, select_margin=True)

    def log(epoch, metrics):
        odds = offline.logits(validation.batch(range(2)))
        evaluations.append((metrics["margin"], metrics["best_return"], odds))

    offline.learn(validation, validation, log)
    assert [row[:2] for row in evaluations] == [(2.0, 3.0), (0.0, 3.0)]
    torch.testing.assert_close(offline.logits(validation.batch(range(2))), evaluations[0][2] - 2.0)


@pytest.mark.parametrize("n_networks", [1, 2])
def test_the_saved_policy_brakes_above_the_selected_margin(tmp_path, n_networks):
    """A policy that brakes at the first decision has a higher return with a margin at which it holds."""
    train, validation = dataset(spike_episodes(40, 0)), dataset(spike_episodes(20, 1))
    batch, odds, logs = validation.batch(range(20)), {}, {}
    arguments = {"n_networks": n_networks, "n_epochs": 1, "learning_rate": 1e-4}
    for selects in (False, True):
        logs[selects] = []
        offline = learner(tmp_path, **arguments, initial_brake_probability=0.9, select_margin=selects)
        model = offline.learn(
            train, validation, lambda epoch, values, rows=logs[selects]: rows.append(values)
        )
        odds[selects] = offline._logits_of(model.policy, batch)[batch.mask > 0]
    (selected,), (unselected,) = logs[True], logs[False]
    assert selected["margin"] > 1.0
    assert unselected["margin"] == 0.0
    assert selected["best_return"] == selected["weighted_return"] > unselected["weighted_return"]
    torch.testing.assert_close(odds[True], odds[False] - selected["margin"], atol=1e-4, rtol=1e-4)
    assert evaluate(offline.logits, validation).mean_return == pytest.approx(selected["mean_return"])
