# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""`TimeToBrakeLearner`: a policy that estimates the time to brake at the decisions of driven episodes."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import gymnasium as gym
import numpy as np
import torch
from gymnasium import spaces
from torch.nn.functional import cross_entropy

from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.aliases import Arguments
from lgmd_gym.errors import check_flag, check_positive, check_whole, check_within
from lgmd_gym.statistics.ranks import roc_area
from lgmd_gym.training.offline.dataset import StateDataset, check_mirror
from lgmd_gym.training.offline.episode_loss import EpisodeTarget, check_warning, episode_losses, find_targets
from lgmd_gym.training.offline.networks import (
    Optimizer,
    Standardisation,
    blend_layers,
    check_layers,
    linear_layers,
    make_model,
    make_optimizer,
    measure,
    merge_networks,
    merged_layers,
    network_arguments,
)

if TYPE_CHECKING:
    from stable_baselines3 import PPO
    from stable_baselines3.common.policies import BasePolicy

SEED_STEP = 1000  # between the seeds of the networks of an ensemble
MEASURED_STATES = 100_000  # at most, for the standardisation of features
EVALUATED_STATES = 4096  # at once


class StateEvaluation(NamedTuple):
    """Results on the decisions of the validation episodes."""

    loss: float  # weighted mean of the cross-entropy, and the weighted `episode_loss` and `warning_loss`
    # see `lgmd_gym.training.offline.episode_loss`
    episode_loss: float
    warning_loss: float
    # areas under the ROC curve for the time to brake below the limit of full braking
    area: float  # of all decisions
    area_braking: float  # of those under braking; NaN without both outcomes


class _Batch(NamedTuple):
    """Decisions of a gradient step."""

    indices: np.ndarray  # int64
    lengths: list[int]  # number of decisions of each whole episode; none for decisions of any episodes
    targets: list[EpisodeTarget]  # of these episodes


class _Spaces(gym.Env[Any, Any]):
    """An environment that has nothing but the spaces of a policy."""

    def __init__(self, observation_space: spaces.Space[Any], num_actions: int) -> None:
        self.observation_space, self.action_space = observation_space, spaces.Discrete(num_actions)


class TimeToBrakeLearner:
    """Trains a stable-baselines3 policy whose actions are intervals of the time to brake.

    It minimises the cross-entropy over the decisions of driven episodes, which are shuffled, see
    `lgmd_gym.training.offline.driving`, and on request a loss of whole episodes in addition.

    Args:
        policy: stable-baselines3's name of the network.
        env: Environment with the observation space of the policy; it is not stepped.
        brake: Fields of `TimeToBrakeParams`.
        seed: Seed of the network and of the order of decisions.
        start: Network that the training starts from, with the same inputs and layers; None for random
            weights.
        start_share: Share of `start` in the weights of the result, in [0, 0.99]: their mean keeps more of
            what `start` had learned from other episodes (Wortsman et al. 2022). Epochs are evaluated and
            selected before it is added.
        n_networks: Number of networks of an ensemble; they are merged into one network whose logits are the
            mean.
        n_epochs: Number of passes over the training decisions.
        batch_size: Number of decisions per gradient step; their mean number with `episode_weight`.
        learning_rate: Maximum of the one-cycle schedule (Smith & Topin 2018).
        weight_decay: Weight decay of AdamW.
        dropout: Share of the hidden units that are left out in each gradient step.
        mirror: Whether each decision is mirrored, left to right, with probability 1/2 in each pass.
        traffic_weight: Weight of a decision in traffic, in [0.01, 100]; one in a level has weight 1.
        episode_weight: Weight of the loss of whole episodes, in [0, 100], see
            `lgmd_gym.training.offline.episode_loss`. Above 0, episodes are shuffled in place of decisions.
        warning_weight: Weight of the same loss of the warning, in [0, 100]; above 0, `episode_weight` must
            be, too.
        bfloat16: Whether matrix products are in bfloat16, which saves time on CPUs with instructions for it
            (AVX-512 BF16) and takes longer than float32 on others.
        policy_kwargs: Further arguments of the network.

    Raises:
        ValueError: If a value is out of range.
    """

    def __init__(
        self,
        policy: str,
        env: gym.Env[Any, Any],
        *,
        brake: Arguments | None = None,
        seed: int = 0,
        start: "BasePolicy | None" = None,
        start_share: float = 0.0,
        n_networks: int = 1,
        n_epochs: int = 6,
        batch_size: int = 1024,
        learning_rate: float = 0.004,
        weight_decay: float = 0.1,
        dropout: float = 0.3,
        mirror: bool = True,
        traffic_weight: float = 1.0,
        episode_weight: float = 0.0,
        warning_weight: float = 0.0,
        bfloat16: bool = False,
        policy_kwargs: Arguments | None = None,
    ) -> None:
        self.brake = TimeToBrakeParams.make(brake)
        self.n_epochs = check_whole("n_epochs", n_epochs, 1)
        self.batch_size = check_whole("batch_size", batch_size, 1)
        self.learning_rate = check_positive("learning_rate", learning_rate)
        self.weight_decay = check_within("weight_decay", weight_decay, 0.0, 1.0)
        self.dropout = check_within("dropout", dropout, 0.0, 0.9)
        self.mirror = check_flag("mirror", mirror)
        self.traffic_weight = check_within("traffic_weight", traffic_weight, 0.01, 100.0)
        self.episode_weight = check_within("episode_weight", episode_weight, 0.0, 100.0)
        self.warning_weight = check_within("warning_weight", warning_weight, 0.0, 100.0)
        if self.warning_weight and not self.episode_weight:
            raise ValueError(
                f"warning_weight {warning_weight:g} requires an episode_weight above 0; set both"
            )
        if self.warning_weight:
            check_warning(self.brake)
        self.bfloat16 = check_flag("bfloat16", bfloat16)
        self._seed, count = seed, check_whole("n_networks", n_networks, 1)
        given: Any = env.observation_space
        if self.mirror:
            check_mirror(given.spaces)
        kwargs, blank = network_arguments(policy_kwargs or {}), _Spaces(given, self.brake.num_actions)
        models = [make_model(policy, blank, seed + SEED_STEP * index, kwargs) for index in range(count)]
        self.networks: list[Any] = [model.policy for model in models]
        self.model = models[0]
        self._start, self._start_share = start, check_within("start_share", start_share, 0.0, 0.99)
        if start is None and start_share > 0.0:
            raise ValueError(
                f"start_share {start_share:g} requires start, the policy to start from; set --start"
            )
        if start is not None:
            if count > 1:
                raise ValueError(f"start requires one network, got n_networks {count}; use n_networks: 1")
            check_layers(start, self.networks[0])
            blend_layers(start, self.networks[0], 1.0)
        if count > 1:
            self.model = make_model(policy, blank, seed, merged_layers(kwargs, count))

    def learn(
        self,
        train: StateDataset,
        validation: StateDataset,
        log: Callable[[int, dict[str, float]], None] = lambda epoch, metrics: None,
        jobs: int = 1,
    ) -> "PPO":
        """Train for all epochs and return the model of the epoch with the lowest validation loss.

        Args:
            train: Training decisions.
            validation: Decisions evaluated after each epoch.
            log: Called after each epoch with its number and its metrics.
            jobs: Number of threads that train the networks of an ensemble, beside the calling thread, which
                prepares batches; it does not change the result.

        Raises:
            ValueError: If no epoch has a finite validation loss.
        """
        standardisation = self._measure(train)
        if self._start is not None:
            standardisation.unfold(linear_layers(self.networks[0])[0])
        steps = self.n_epochs * self._num_batches(train)
        optimizers = [
            make_optimizer(network, self.learning_rate, self.weight_decay, steps) for network in self.networks
        ]
        # One generator for each network, because threads share that of PyTorch.
        generators = [
            torch.Generator().manual_seed(self._seed + index) for index in range(len(self.networks))
        ]
        rng, lowest, best = np.random.default_rng(self._seed), np.inf, list[Any]()
        targets = find_targets(train, self.brake) if self.episode_weight else []
        with ThreadPoolExecutor(check_whole("jobs", jobs, 1)) as executor:
            for epoch in range(1, self.n_epochs + 1):
                batches = self._batches(train, targets, rng)
                loss = self._train_epoch(
                    train, batches, standardisation, optimizers, generators, rng, executor
                )
                found = self.evaluate(validation, standardisation)
                if found.loss < lowest:
                    lowest, best = found.loss, [_copy(network) for network in self.networks]
                metrics = {"train_loss": loss, "best_loss": lowest} | found._asdict()
                log(epoch, {name: value for name, value in metrics.items() if not np.isnan(value)})
        if not best:
            raise ValueError(
                f"no epoch has a finite validation loss with learning_rate {self.learning_rate:g}; lower it"
            )
        for network, weights in zip(self.networks, best, strict=True):
            network.load_state_dict(weights)
            standardisation.fold(linear_layers(network)[0])
        if self._start is not None:
            blend_layers(self._start, self.networks[0], self._start_share)
        if len(self.networks) > 1:
            merge_networks(self.networks, self.model.policy)
        return self.model

    def evaluate(self, dataset: StateDataset, standardisation: Standardisation) -> StateEvaluation:
        """Return the results of the mean logits of all networks."""
        logits = np.concatenate(
            [
                self._logits(standardisation.apply(dataset.batch(part)))
                for part in np.array_split(np.arange(len(dataset)), -(-len(dataset) // EVALUATED_STATES))
            ]
        )
        lengths, targets = np.diff(dataset.bounds).tolist(), find_targets(dataset, self.brake)
        parts = episode_losses(torch.from_numpy(logits), lengths, targets, self.brake)
        of_episodes, of_warnings = map(float, parts)
        limit = self.brake.limits_s.index(self.brake.full_s)
        due, odds, braking = dataset.classes <= limit, self.brake.odds(logits)[:, limit], dataset.braking
        losses = cross_entropy(torch.from_numpy(logits), torch.from_numpy(dataset.classes), reduction="none")
        loss = float(np.average(losses.numpy(), weights=self._weights(dataset.in_traffic)))
        return StateEvaluation(
            loss + self.episode_weight * of_episodes + self.warning_weight * of_warnings,
            of_episodes,
            of_warnings,
            roc_area(odds[due], odds[~due]),
            roc_area(odds[due & braking], odds[~due & braking]),
        )

    @torch.no_grad()
    def odds(self, dataset: StateDataset) -> np.ndarray:
        """Return the log odds of the trained model at all decisions, see `TimeToBrakeParams.odds`."""
        return self.brake.odds(_forward(self.model.policy, dataset.batch(np.arange(len(dataset)))).numpy())

    @torch.no_grad()
    def _logits(self, features: torch.Tensor) -> np.ndarray:
        """Return the mean logits of standardised features, float32, (M, actions)."""
        return torch.stack([_forward(network, features) for network in self.networks]).mean(0).numpy()

    def _measure(self, train: StateDataset) -> Standardisation:
        """Measure the features of some training decisions, and of their mirror images if those are used."""
        chosen = np.random.default_rng(self._seed).permutation(len(train))[:MEASURED_STATES]
        flags = (False, True)[: 1 + self.mirror]
        parts = np.array_split(chosen, -(-len(chosen) // self.batch_size))
        return measure(
            train.batch(part, np.ones(len(part), np.bool_) if flag else None)
            for flag in flags
            for part in parts
        )

    def _train_epoch(
        self,
        train: StateDataset,
        batches: Iterator[_Batch],
        standardisation: Standardisation,
        optimizers: Sequence[Optimizer],
        generators: Sequence[torch.Generator],
        rng: np.random.Generator,
        executor: Executor,
    ) -> float:
        """Train on each decision once, and return the mean loss."""
        losses, weights = list[float](), list[float]()
        running = list[Future[float]]()
        for indices, lengths, targets in batches:
            # This thread prepares a batch while others take the step before.
            mirrored = rng.random(len(indices)) < 0.5 if self.mirror else None
            features = standardisation.apply(train.batch(indices, mirrored))
            given = self._weights(train.in_traffic[indices])
            update = partial(
                _update,
                features=features.bfloat16() if self.bfloat16 else features,
                classes=torch.from_numpy(train.classes[indices]),
                weights=torch.from_numpy(given),
                dropout=self.dropout,
                further_loss=partial(self._episode_loss, lengths=lengths, targets=targets),
            )
            losses += _mean_loss(running)
            running = [
                executor.submit(update, *parts)
                for parts in zip(self.networks, optimizers, generators, strict=True)
            ]
            weights.append(float(given.sum()))
        return float(np.average(losses + _mean_loss(running), weights=weights))

    def _num_batches(self, train: StateDataset) -> int:
        """Return the number of gradient steps of an epoch."""
        count = -(-len(train) // self.batch_size)
        return min(count, len(train.bounds) - 1) if self.episode_weight else count

    def _batches(
        self, train: StateDataset, targets: list[EpisodeTarget], rng: np.random.Generator
    ) -> Iterator[_Batch]:
        """Yield the batches of an epoch: random decisions, or all of random episodes."""
        count, bounds = self._num_batches(train), train.bounds.tolist()
        if not self.episode_weight:
            for indices in np.array_split(rng.permutation(len(train)), count):
                yield _Batch(indices, [], [])
            return
        for episodes in np.array_split(rng.permutation(len(bounds) - 1), count):
            numbers = episodes.tolist()
            parts = [np.arange(bounds[index], bounds[index + 1]) for index in numbers]
            chosen = [targets[index] for index in numbers]
            yield _Batch(np.concatenate(parts), [len(part) for part in parts], chosen)

    def _episode_loss(
        self, logits: torch.Tensor, lengths: list[int], targets: list[EpisodeTarget]
    ) -> torch.Tensor | float:
        """Return the weighted losses of the whole episodes of a batch."""
        if not lengths:
            return 0.0
        braking, warning = episode_losses(logits, lengths, targets, self.brake)
        return self.episode_weight * braking + self.warning_weight * warning

    def _weights(self, in_traffic: np.ndarray) -> np.ndarray:
        """Return the weights of decisions, float32, (M,)."""
        return np.where(in_traffic, np.float32(self.traffic_weight), np.float32(1.0))


def _update(
    network: Any,
    optimizer: Optimizer,
    generator: torch.Generator,
    features: torch.Tensor,
    classes: torch.Tensor,
    weights: torch.Tensor,
    dropout: float,
    further_loss: Callable[[torch.Tensor], torch.Tensor | float],
) -> float:
    """Take one gradient step of a network and return its loss before it."""
    hidden = features
    with torch.autocast("cpu", torch.bfloat16, enabled=features.dtype == torch.bfloat16):
        for layer in network.mlp_extractor.policy_net:
            hidden = layer(hidden)
            if dropout and not isinstance(layer, torch.nn.Linear):  # after the activation
                hidden = leave_out(hidden, dropout, generator)
        logits = network.action_net(hidden).float()
    loss = (cross_entropy(logits, classes, reduction="none") * weights).sum() / weights.sum()
    loss = loss + further_loss(logits)
    optimizer.step(loss)
    return float(loss.detach())


def _mean_loss(running: "Sequence[Future[float]]") -> list[float]:
    """Wait for the steps of all networks, and return their mean loss; nothing for no steps."""
    return [float(np.mean([future.result() for future in running]))] if running else []


def leave_out(units: torch.Tensor, share: float, generator: torch.Generator) -> torch.Tensor:
    """Return units of which a share is 0 and the others are raised, so that their mean stays the same."""
    return units * (torch.rand(units.shape, generator=generator) >= share) / (1.0 - share)


def _forward(network: Any, features: torch.Tensor) -> torch.Tensor:
    return network.action_net(network.mlp_extractor.forward_actor(features))


def _copy(network: torch.nn.Module) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in network.state_dict().items()}
