"""`OfflineLearner`: expected return, evaluation and convergence on synthetic episodes."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch
from support.recordings import offline_config, synthetic_episode

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.training.offline.braking_outcomes import TOLERANCE
from lgmd_gym.training.offline.dataset import OfflineDataset
from lgmd_gym.training.offline.ensemble import check_without_frames
from lgmd_gym.training.offline.episodes import EpisodeRecorder, RecordedEpisode
from lgmd_gym.training.offline.evaluation import evaluate, select_margin
from lgmd_gym.training.offline.learner import SEED_STEP, OfflineLearner
from lgmd_gym.training.offline.objective import expected_return, scale_false_braking_cost
from lgmd_gym.training.offline.standardisation import measure

FEATURES = FeatureConfig(inputs=("spike_frequency", "ego_speed"), history=3, repeat=1, latch=True)
NETWORK = {"net_arch": {"pi": [8], "vf": []}}


def dataset(episodes, features=FEATURES):
    return OfflineDataset(episodes, features)


def learner(folder, features=FEATURES, **algo_kwargs):
    config = replace(offline_config(folder), features=features)
    defaults = {"n_epochs": 60, "batch_size": 8, "learning_rate": 0.03, "policy_kwargs": NETWORK}
    env = config.make_policy_env("train")
    return OfflineLearner("MultiInputPolicy", env, config.demands, **(defaults | algo_kwargs))


def spike_episodes(count, seed):
    """Episodes in which braking returns 5 at a spike and -5 at any other decision."""
    rng, episodes = np.random.default_rng(seed), []
    for number in range(count):
        length, threat = int(rng.integers(5, 9)), number % 2 == 0
        spike = int(rng.integers(1, length - 1))
        episode = synthetic_episode(length, seed=number, threat=threat)
        spikes = np.zeros((length, 1), np.float32)
        braking_returns = np.full(length, -5.0, np.float32)
        if threat:
            spikes[spike], braking_returns[spike] = 200.0, 5.0
        contacts = np.arange(length) != spike if threat else np.zeros(length, bool)
        observations = {**episode.observations, "spike_frequency": spikes}
        rewards = np.full(length, -0.1, np.float32)
        episodes.append(RecordedEpisode(observations, rewards, braking_returns, contacts, threat))
    return episodes


def test_expected_return_equals_the_mean_of_sampled_episodes():
    episodes = [synthetic_episode(5), synthetic_episode(3, seed=1, threat=False)]
    batch = dataset(episodes).batch([0, 1])
    logits = torch.randn(2, 5, generator=torch.Generator().manual_seed(0))
    expected = expected_return(logits, batch)
    rng = np.random.default_rng(0)
    for index, episode in enumerate(episodes):
        probabilities = 1 / (1 + np.exp(-logits[index].numpy()))
        returns = []
        for _ in range(20_000):
            total = 0.0
            for decision in range(len(episode)):
                if rng.random() < probabilities[decision]:
                    total += episode.braking_returns[decision]
                    break
                total += episode.rewards[decision]
            returns.append(total)
        standard_error = np.std(returns) / np.sqrt(len(returns))
        assert float(expected[index]) == pytest.approx(np.mean(returns), abs=4 * standard_error)


def test_cost_factor_scales_braking_without_a_threat_only():
    episodes = [synthetic_episode(5), synthetic_episode(3, seed=1, threat=False)]
    batch = dataset(episodes).batch([0, 1])
    scaled = scale_false_braking_cost(batch, 3.0)
    assert torch.equal(scaled.braking_returns[0], batch.braking_returns[0])
    for decision in range(3):
        holding = float(episodes[1].rewards[decision:].sum())
        expected = holding + 3.0 * (float(episodes[1].braking_returns[decision]) - holding)
        assert float(scaled.braking_returns[1, decision]) == pytest.approx(expected, abs=1e-5)
    assert scaled.braking_returns[1, 3:].tolist() == [0.0, 0.0]
    unscaled = scale_false_braking_cost(batch, 1.0)
    assert torch.allclose(unscaled.braking_returns, batch.braking_returns, atol=1e-6)


def test_learner_converges_to_the_optimum(tmp_path):
    validation_episodes = spike_episodes(20, 1)
    train, validation = dataset(spike_episodes(40, 0)), dataset(validation_episodes)
    offline = learner(tmp_path)
    before = evaluate(offline.logits, validation)
    assert (before.avoided, before.false_activations) == (0.0, 0.0)  # the untrained policy never brakes
    epochs = []
    offline.learn(train, validation, lambda epoch, metrics: epochs.append((epoch, metrics)))
    assert [epoch for epoch, _ in epochs] == list(range(1, 61))
    assert set(epochs[0][1]) == {"train_return", "mean_return", "avoided", "false_activations", "best_return"}
    after = evaluate(offline.logits, validation)
    assert (after.avoided, after.false_activations) == (1.0, 0.0)
    assert after.mean_return == pytest.approx(epochs[-1][1]["best_return"])
    threats = [episode for episode in validation_episodes if episode.threat]
    optimum = [5.0 - 0.1 * int(episode.braking_returns.argmax()) for episode in threats]
    optimum += [-0.1 * len(episode) for episode in validation_episodes if not episode.threat]
    assert after.mean_return == pytest.approx(np.mean(optimum), abs=1e-4)


@pytest.mark.slow
def test_logit_decay_keeps_the_braking_probability_above_zero(tmp_path):
    """Where braking is always wrong, the penalty keeps the expected return below that of never braking."""
    non_threats = [synthetic_episode(8, seed=seed, threat=False) for seed in range(12)]
    episodes = [replace(item, braking_returns=np.full(8, -5.0, np.float32)) for item in non_threats]
    optimum, returns = np.mean([episode.rewards.sum() for episode in episodes]), []

    def log(epoch, metrics):
        returns.append(metrics["train_return"])

    for logit_decay in (0.0, 0.05):
        learner(tmp_path, logit_decay=logit_decay).learn(dataset(episodes), dataset(episodes), log)
    assert returns[59] == pytest.approx(optimum, abs=0.1)
    assert returns[119] < optimum - 0.5


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
    assert evaluation[1:] == (0.0, 0.0, 0.5)
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


def test_same_seed_gives_the_same_weights(tmp_path):
    weights = []
    for _ in range(2):
        model = learner(tmp_path, n_epochs=3).learn(
            dataset(spike_episodes(12, 0)), dataset(spike_episodes(6, 1))
        )
        weights.append([value.numpy().tobytes() for value in model.policy.state_dict().values()])
    assert weights[0] == weights[1]


@pytest.mark.parametrize("layers", [[], [8], [8, 6]])
def test_an_ensemble_is_merged_into_one_network_with_the_mean_of_the_log_odds(tmp_path, layers):
    train, validation = dataset(spike_episodes(24, 0)), dataset(spike_episodes(12, 1))
    kwargs = {"n_networks": 3, "n_epochs": 4, "policy_kwargs": {"net_arch": {"pi": layers, "vf": []}}}
    offline = learner(tmp_path, **kwargs)
    model = offline.learn(train, validation)
    batch = validation.batch(range(12))
    separate = torch.stack([offline._logits_of(network, batch) for network in offline.networks])
    assert (separate.std(0)[batch.mask > 0] > 1e-4).all()  # the networks differ
    merged = offline._logits_of(model.policy, batch)
    torch.testing.assert_close(merged, separate.mean(0), atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(offline.logits(batch), separate.mean(0))


def test_each_network_of_an_ensemble_learns_for_itself(tmp_path):
    """The first network learns as without the others, and the next one as with its seed."""
    train, validation = dataset(spike_episodes(24, 0)), dataset(spike_episodes(12, 1))
    ensemble = learner(tmp_path, n_networks=2, n_epochs=1)
    ensemble.learn(train, validation)
    alone = learner(tmp_path, n_epochs=1)
    model = alone.learn(train, validation)
    for name, value in model.policy.state_dict().items():
        torch.testing.assert_close(ensemble.networks[0].state_dict()[name], value)
    fresh, second = learner(tmp_path, seed=SEED_STEP), learner(tmp_path, n_networks=2)
    for name, value in fresh.networks[0].state_dict().items():
        assert torch.equal(second.networks[1].state_dict()[name], value)


def test_an_ensemble_converges(tmp_path):
    validation = dataset(spike_episodes(20, 1))
    offline = learner(tmp_path, n_networks=3)
    offline.learn(dataset(spike_episodes(40, 0)), validation)
    after = evaluate(offline.logits, validation)
    assert (after.avoided, after.false_activations) == (1.0, 0.0)


def test_threads_do_not_change_the_weights(tmp_path):
    train, validation = dataset(spike_episodes(40, 0)), dataset(spike_episodes(20, 1))
    single, threaded = (
        learner(tmp_path, n_networks=3, n_epochs=4, standardise=True).learn(train, validation, jobs=jobs)
        for jobs in (1, 3)
    )
    expected = single.policy.state_dict()
    assert all(torch.equal(value, expected[name]) for name, value in threaded.policy.state_dict().items())


@pytest.mark.parametrize("n_networks", [1, 2])
def test_bfloat16_converges_to_float32_weights(tmp_path, n_networks):
    train, validation = dataset(spike_episodes(40, 0)), dataset(spike_episodes(20, 1))
    offline = learner(tmp_path, n_networks=n_networks, bfloat16=True)
    model = offline.learn(train, validation)
    after = evaluate(offline.logits, validation)
    assert (after.avoided, after.false_activations) == (1.0, 0.0)
    assert {value.dtype for value in model.policy.state_dict().values()} == {torch.float32}
    logits = offline.logits(validation.batch([0]))
    assert not torch.equal(logits, logits.bfloat16().float())  # evaluated in float32


@pytest.mark.parametrize(("name", "required"), [("n_networks", 1), ("standardise", False)])
def test_a_network_on_frames_does_not_share_its_features(name, required):
    class OnFrames:
        features_extractor = torch.nn.Conv2d(1, 1, 3)

    message = f"{name} must be {str(required).lower()} for a policy on frames; set {name}: "
    with pytest.raises(ValueError, match=message):
        check_without_frames(OnFrames(), name, required)


def test_standardised_features_have_mean_zero_and_deviation_one():
    rng = np.random.default_rng(0)
    features = torch.from_numpy(rng.normal([3.0, -1.0, 5.0], [0.5, 20.0, 0.0], (4000, 3))).float()
    standardisation = measure([features[:1000], features[1000:]])
    values = standardisation.apply(features.clone())
    torch.testing.assert_close(values.mean(0), torch.zeros(3), atol=1e-4, rtol=0.0)
    torch.testing.assert_close(values.std(0), torch.tensor([1.0, 1.0, 0.0]), atol=3e-3, rtol=0.0)
    layer = torch.nn.Linear(3, 2)
    expected = layer(values)
    standardisation.fold(layer)
    torch.testing.assert_close(layer(features), expected, atol=1e-3, rtol=1e-3)


@pytest.mark.parametrize("n_networks", [1, 2])
def test_the_saved_policy_reads_features_that_are_not_standardised(tmp_path, n_networks):
    train, validation = dataset(spike_episodes(40, 0)), dataset(spike_episodes(20, 1))
    offline = learner(tmp_path, n_networks=n_networks, standardise=True)
    returns = []
    model = offline.learn(train, validation, lambda epoch, metrics: returns.append(metrics["mean_return"]))
    batch = validation.batch(range(20))
    torch.testing.assert_close(
        offline._logits_of(model.policy, batch), offline.logits(batch), atol=1e-3, rtol=1e-3
    )
    after = evaluate(offline.logits, validation)
    assert after.mean_return == pytest.approx(max(returns))
    assert (after.avoided, after.false_activations) == (1.0, 0.0)


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
    assert [evaluation.mean_return for _, evaluation in results] == [1.0, 0.0]  # not weighted


def test_the_learner_selects_the_margin_with_its_cost_of_false_braking(tmp_path):
    episodes, margins = threat_and_other(), []
    arguments = {"n_epochs": 1, "learning_rate": 1e-7, "initial_brake_probability": 0.6}
    for false_cost in (1.0, 2.0):
        offline = learner(tmp_path, **arguments, select_margin=True, false_cost=false_cost)
        logs = []
        offline.learn(episodes, episodes, lambda epoch, values, rows=logs: rows.append(values))
        margins.append(logs[-1]["margin"])
    assert margins[0] < margins[1]


@pytest.mark.parametrize("n_networks", [1, 2])
def test_the_saved_policy_brakes_above_the_selected_margin(tmp_path, n_networks):
    """A policy that brakes at the first decision has a higher return with a margin at which it holds."""
    train, validation = dataset(spike_episodes(40, 0)), dataset(spike_episodes(20, 1))
    batch, odds, logs = validation.batch(range(20)), {}, {}
    arguments = {"n_networks": n_networks, "n_epochs": 2, "learning_rate": 1e-4}
    for selects in (False, True):
        logs[selects] = []
        offline = learner(tmp_path, **arguments, initial_brake_probability=0.9, select_margin=selects)
        model = offline.learn(
            train, validation, lambda epoch, values, rows=logs[selects]: rows.append((epoch, values))
        )
        odds[selects] = offline._logits_of(model.policy, batch)[batch.mask > 0]
    (epoch, selected), best = logs[True][-1], logs[False][-1][1]["best_return"]
    assert logs[True][:-1] == logs[False]
    assert epoch == 2
    assert selected["margin"] > 1.0
    assert selected["mean_return"] == selected["best_return"] > best
    torch.testing.assert_close(odds[True], odds[False] - selected["margin"], atol=1e-4, rtol=1e-4)
    assert evaluate(offline.logits, validation).mean_return == pytest.approx(selected["mean_return"])


@pytest.mark.parametrize("mirror", [False, True])
def test_standardisation_includes_mirror_images(tmp_path, mirror):
    """The yaw rates of episodes and their mirror images have mean 0."""
    features = replace(FEATURES, inputs=("ego_yaw_rate",))
    offline = learner(tmp_path, features, mirror=mirror, standardise=True)
    standardisation = offline._measure(
        dataset([synthetic_episode(5, seed=seed) for seed in range(4)], features)
    )
    assert (standardisation.mean.abs() < 1e-6).all() == mirror
