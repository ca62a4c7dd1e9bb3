"""Networks of `TimeToBrakeLearner`: standardisation, ensembles and their merging."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium import spaces
from support.recordings import synthetic_episode

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.training.offline.dataset import StateDataset
from lgmd_gym.training.offline.networks import measure
from lgmd_gym.training.offline.time_to_brake import SEED_STEP, TimeToBrakeLearner

LIMITS = (0.3, 0.6, 1.2, 2.6)  # the default of `TimeToBrakeParams`


class Blank(gym.Env):
    observation_space = spaces.Dict(
        {name: spaces.Box(-5.0, 5.0, (1,)) for name in ("ego_speed", "ego_yaw_rate")}
    )
    action_space = spaces.Discrete(2)


def dataset(seed, count=12):
    episodes = [synthetic_episode(30, seed=seed + index, threat=index % 2 == 0) for index in range(count)]
    features = FeatureConfig(inputs=("ego_speed", "ego_yaw_rate"), history=1, repeat=1)
    return StateDataset(episodes, features, LIMITS)


def learner(**options):
    options = {
        "n_epochs": 2,
        "batch_size": 32,
        "policy_kwargs": {"net_arch": {"pi": [8], "vf": []}},
    } | options
    return TimeToBrakeLearner("MultiInputPolicy", Blank(), **options)


def logits_of(network, features):
    return network.action_net(network.mlp_extractor.forward_actor(features))


@pytest.mark.parametrize("layers", [[], [8], [8, 6]])
def test_an_ensemble_is_merged_into_one_network_with_the_mean_of_the_logits(layers):
    policy_kwargs = {"net_arch": {"pi": layers, "vf": []}}
    made = learner(n_networks=3, policy_kwargs=policy_kwargs)
    model = made.learn(dataset(0), dataset(100))
    features = dataset(100).batch(np.arange(50))
    separate = torch.stack([logits_of(network, features) for network in made.networks])
    assert (separate.std(0) > 1e-4).all()  # the networks differ
    torch.testing.assert_close(logits_of(model.policy, features), separate.mean(0), atol=1e-4, rtol=1e-3)
    odds = made.brake.odds(separate.mean(0).detach().numpy())
    np.testing.assert_allclose(made.odds(dataset(100))[:50], odds, atol=1e-3, rtol=1e-3)


def test_each_network_of_an_ensemble_learns_for_itself():
    """The first network learns as without the others, and the next one begins as with its seed."""
    ensemble, alone = learner(n_networks=2, n_epochs=1), learner(n_epochs=1)
    fresh = learner(seed=SEED_STEP).networks[0].state_dict()
    second = {name: value.clone() for name, value in ensemble.networks[1].state_dict().items()}
    assert all(torch.equal(value, second[name]) for name, value in fresh.items())
    train, validation = dataset(0), dataset(100)
    ensemble.learn(train, validation)
    model = alone.learn(train, validation)
    for name, value in model.policy.state_dict().items():
        torch.testing.assert_close(ensemble.networks[0].state_dict()[name], value)


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


@pytest.mark.parametrize("mirror", [False, True])
def test_standardisation_includes_mirror_images(mirror):
    """The yaw rates of decisions and their mirror images have mean 0."""
    standardisation = learner(mirror=mirror)._measure(dataset(0))
    assert (abs(float(standardisation.mean[1])) < 1e-6) == mirror


def test_the_saved_policy_reads_features_that_are_not_standardised():
    """Its loss is the lowest one of the training."""
    losses = []
    made = learner(n_networks=2, n_epochs=4)
    validation = dataset(100)
    model = made.learn(dataset(0), validation, lambda epoch, metrics: losses.append(metrics["loss"]))
    logits = logits_of(model.policy, validation.batch(np.arange(len(validation))))
    found = torch.nn.functional.cross_entropy(logits, torch.from_numpy(validation.classes))
    assert float(found.detach()) == pytest.approx(min(losses), abs=1e-3)
