"""`OfflineLearner`: expected return and convergence on synthetic episodes."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from support.recordings import FEATURES, dataset, learner, spike_episodes, synthetic_episode

from lgmd_gym.training.offline.evaluation import evaluate, expected_return, scale_false_braking_cost
from lgmd_gym.training.offline.learner import SEED_STEP
from lgmd_gym.training.offline.networks import check_without_frames, measure


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
    results = {"mean_return", "weighted_return", "avoided", "false_activations"}
    assert set(epochs[0][1]) == results | {"train_return", "margin", "best_return"}
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


@pytest.mark.parametrize("mirror", [False, True])
def test_standardisation_includes_mirror_images(tmp_path, mirror):
    """The yaw rates of episodes and their mirror images have mean 0."""
    features = replace(FEATURES, inputs=("ego_yaw_rate",))
    offline = learner(tmp_path, features, mirror=mirror, standardise=True)
    standardisation = offline._measure(
        dataset([synthetic_episode(5, seed=seed) for seed in range(4)], features)
    )
    assert (standardisation.mean.abs() < 1e-6).all() == mirror
