# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""`OfflineLearner`: gradient ascent on the expected return over recorded episodes, see `evaluation`."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import torch

from lgmd_gym.agents.base import HOLD
from lgmd_gym.aliases import Arguments
from lgmd_gym.errors import check_flag, check_positive, check_whole, check_within
from lgmd_gym.training.offline.dataset import EpisodeBatch, OfflineDataset, check_mirror
from lgmd_gym.training.offline.evaluation import (
    Evaluation,
    evaluate,
    expected_return,
    scale_false_braking_cost,
    select_margin,
)
from lgmd_gym.training.offline.networks import (
    Standardisation,
    check_without_frames,
    extracts_features,
    linear_layers,
    make_model,
    measure,
    merge_networks,
    merged_layers,
    network_arguments,
)

if TYPE_CHECKING:
    from stable_baselines3 import PPO
    from stable_baselines3.common.type_aliases import GymEnv

SEED_STEP = 1000  # between the seeds of the networks of an ensemble
RETURN_SCALE = 0.1  # factor of the loss
MEASURED_EPISODES = 2000  # at most, for the standardisation of features


class Optimizer(NamedTuple):
    """Trained parameters of a network, their optimizer and the schedule of its learning rate."""

    trained: list[torch.nn.Parameter]
    optimizer: torch.optim.Optimizer
    schedule: torch.optim.lr_scheduler.LRScheduler

    def step(self, loss: torch.Tensor) -> None:
        """Take one step down the gradient of a loss."""
        self.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.trained, 1.0)
        self.optimizer.step()
        self.schedule.step()


def make_optimizer(network: Any, learning_rate: float, weight_decay: float, steps: int) -> Optimizer:
    """Return AdamW with a one-cycle schedule for the parameters of a network without its value function."""
    trained = [value for name, value in network.named_parameters() if "value" not in name]
    optimizer = torch.optim.AdamW(trained, learning_rate, weight_decay=weight_decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, learning_rate, total_steps=steps)
    return Optimizer(trained, optimizer, schedule)


class OfflineLearner:
    """Trains a stable-baselines3 policy on recorded episodes.

    Args:
        policy: stable-baselines3's name of the network.
        env: Environment with the spaces of the policy, `gym.Env` or `VecEnv`; it is not stepped.
        demands: Demand of each action: `HOLD`, and a lower one that brakes.
        seed: Seed of the network and of the order of episodes.
        n_networks: Number of networks of an ensemble, which differ in their initial weights. They learn on
            the same batches, each for itself, and are merged into one network whose log odds are the mean.
            Not for frames.
        n_epochs: Number of passes over the training episodes.
        batch_size: Number of episodes per gradient step.
        learning_rate: Maximum of the one-cycle schedule (Smith & Topin 2018).
        weight_decay: Weight decay of AdamW.
        false_cost: Factor on the cost of braking in episodes without a threat, in training and in the
            selection of the margin. A factor of 2 compensates for the few episodes that resemble a threat.
        initial_brake_probability: Probability of braking at a decision before training.
        logit_decay: Weight of the squared log odds of braking, summed over the decisions of an episode.
            Without this penalty a network that learns slowly, for example on frames, saturates at never
            braking and its gradient vanishes.
        standardise: Whether the network learns on features with mean 0 and standard deviation 1 over the
            training episodes, see `networks`. It learns in fewer epochs. Not for frames.
        mirror: Whether each training episode is mirrored, left to right, with probability 1/2 in each pass.
        select_margin: Whether the policy brakes where its log odds exceed the margin, of -4, -3.5, ..., 4,
            with the highest weighted return (see `Evaluation`) on the validation episodes, in place of 0.
            It also selects the epoch, each at its own margin. The margin is subtracted from the bias: the
            saved policy brakes above 0.
        bfloat16: Whether matrix products in training have bfloat16 operands, see `torch.autocast`. Weights
            and evaluation remain in float32. It saves time on CPUs with AVX-512 BF16 or AMX only.
        policy_kwargs: Further arguments of the network.

    Raises:
        ValueError: If a value is out of range.
    """

    def __init__(
        self,
        policy: str,
        env: "GymEnv",
        demands: Sequence[float],
        *,
        seed: int = 0,
        n_networks: int = 1,
        n_epochs: int = 100,
        batch_size: int = 64,
        learning_rate: float = 0.006,
        weight_decay: float = 0.01,
        false_cost: float = 2.0,
        initial_brake_probability: float = 0.03,
        logit_decay: float = 0.0,
        standardise: bool = False,
        mirror: bool = False,
        select_margin: bool = False,
        bfloat16: bool = False,
        policy_kwargs: Arguments | None = None,
    ) -> None:
        self.n_epochs = check_whole("n_epochs", n_epochs, 1)
        self.batch_size = check_whole("batch_size", batch_size, 1)
        self.learning_rate = check_positive("learning_rate", learning_rate)
        self.weight_decay = check_within("weight_decay", weight_decay, 0.0, 1.0)
        self.false_cost = check_positive("false_cost", false_cost)
        self.logit_decay = check_within("logit_decay", logit_decay, 0.0, 1.0)
        self.standardise = check_flag("standardise", standardise)
        self.mirror = check_flag("mirror", mirror)
        self.select_margin = check_flag("select_margin", select_margin)
        self.bfloat16 = check_flag("bfloat16", bfloat16)
        check_within("initial_brake_probability", initial_brake_probability, 1e-6, 0.999)
        self._seed = seed
        self._hold, self._brake = demands.index(HOLD), demands.index(min(demands))
        kwargs = network_arguments(policy_kwargs or {})
        seeds = [seed + SEED_STEP * index for index in range(check_whole("n_networks", n_networks, 1))]
        models = [make_model(policy, env, item, kwargs) for item in seeds]
        self._standardisation: Standardisation | None = None
        self.networks: list[Any] = [model.policy for model in models]
        self.model = models[0]
        if n_networks > 1:
            check_without_frames(self.networks[0], "n_networks", 1)
            self.model = make_model(policy, env, seed, merged_layers(kwargs, n_networks))
        if self.mirror:
            check_mirror(self.networks[0].observation_space.spaces)
        if self.standardise:
            check_without_frames(self.networks[0], "standardise", False)
        odds = initial_brake_probability / (1.0 - initial_brake_probability)
        for network in self.networks:
            with torch.no_grad():
                bias = network.action_net.bias
                bias[self._brake], bias[self._hold] = float(np.log(odds)), 0.0

    def learn(
        self,
        train: OfflineDataset,
        validation: OfflineDataset,
        log: Callable[[int, dict[str, float]], None] = lambda epoch, metrics: None,
        jobs: int = 1,
    ) -> "PPO":
        """Train for all epochs and return the model of the best one on the validation episodes.

        The best epoch has the highest mean return, with `select_margin` the highest weighted return.

        Args:
            train: Training episodes.
            validation: Episodes evaluated after each epoch.
            log: Called after each epoch with its number and its metrics, among them `best_return`, the return
                of the best epoch so far.
            jobs: Number of threads that train the networks of an ensemble; it does not change the result.
        """
        with ThreadPoolExecutor(check_whole("jobs", jobs, 1)) as executor:
            return self._learn(train, validation, log, executor)

    def _learn(
        self,
        train: OfflineDataset,
        validation: OfflineDataset,
        log: Callable[[int, dict[str, float]], None],
        executor: Executor,
    ) -> "PPO":
        steps = self.n_epochs * -(-len(train) // self.batch_size)
        optimizers = [
            make_optimizer(network, self.learning_rate, self.weight_decay, steps) for network in self.networks
        ]
        rng = np.random.default_rng(self._seed)
        if self.standardise:
            self._standardisation = self._measure(train)
        best_return, best_margin = -np.inf, 0.0
        best_weights = [_copy_weights(network) for network in self.networks]
        for epoch in range(1, self.n_epochs + 1):
            train_return = self._train_epoch(train, optimizers, rng, executor)
            margin, evaluation = self._evaluate(validation)
            epoch_return = evaluation.weighted_return if self.select_margin else evaluation.mean_return
            if epoch_return > best_return:
                best_return, best_margin = epoch_return, margin
                best_weights = [_copy_weights(network) for network in self.networks]
            others = {"train_return": train_return, "margin": margin, "best_return": best_return}
            log(epoch, _metrics(evaluation, **others))
        for network, weights in zip(self.networks, best_weights, strict=True):
            network.load_state_dict(weights)
            if self._standardisation is not None:
                self._standardisation.fold(linear_layers(network)[0])
        self._standardisation = None
        self._subtract_margin(best_margin)
        if len(self.networks) > 1:
            merge_networks(self.networks, self.model.policy)
        return self.model

    def _evaluate(self, validation: OfflineDataset) -> tuple[float, Evaluation]:
        """Return the margin of the log odds, and the results at this margin."""
        if self.select_margin:
            return select_margin(self.logits, validation, self.false_cost)
        return 0.0, evaluate(self.logits, validation, self.false_cost)

    def _train_epoch(
        self,
        train: OfflineDataset,
        optimizers: list[Optimizer],
        rng: np.random.Generator,
        executor: Executor,
    ) -> float:
        """Train on each episode once, and return the mean return with the weighted cost of false braking."""
        mean_return = 0.0
        batches = -(-len(train) // self.batch_size)
        for indices in np.array_split(rng.permutation(len(train)), batches):
            mirrored = rng.random(len(indices)) < 0.5 if self.mirror else ()
            batch = scale_false_braking_cost(train.batch(indices, mirrored), self.false_cost)
            features = self._shared_features(batch)
            if self.bfloat16 and features is not None:
                features = features.bfloat16()  # once for all networks
            update = partial(self._update, batch=batch, features=features)
            returns = list(executor.map(update, self.networks, optimizers))
            mean_return += float(np.mean(returns)) * len(indices) / len(train)
        return mean_return

    @torch.no_grad()
    def _subtract_margin(self, margin: float) -> None:
        for network in self.networks:
            network.action_net.bias[self._brake] -= margin

    def _measure(self, train: OfflineDataset) -> Standardisation:
        """Measure the features of some training episodes, and of their mirror images if those are used."""
        rng = np.random.default_rng(self._seed)
        chosen = rng.permutation(len(train))[:MEASURED_EPISODES]
        return measure(
            self.networks[0].extract_features(train.batch(part, [mirrored] * len(part)).inputs)
            for mirrored in (False, True)[: 1 + self.mirror]
            for part in np.array_split(chosen, -(-len(chosen) // self.batch_size))
        )

    def _update(
        self, network: Any, optimizer: Optimizer, batch: EpisodeBatch, features: torch.Tensor | None
    ) -> float:
        """Take one gradient step of a network and return its mean expected return before it."""
        network.set_training_mode(True)
        with torch.autocast("cpu", torch.bfloat16, enabled=self.bfloat16, cache_enabled=False):
            logits = self._logits_of(network, batch, features)
        mean_return = expected_return(logits, batch).mean()
        penalty = (logits * batch.mask).square().sum(1).mean()
        optimizer.step(-RETURN_SCALE * (mean_return - self.logit_decay * penalty))
        return float(mean_return.detach())

    def _shared_features(self, batch: EpisodeBatch) -> torch.Tensor | None:
        """Return the features that all networks read; None if each network extracts its own from frames."""
        if extracts_features(self.networks[0]):
            return None
        features = self.networks[0].extract_features(batch.inputs)
        return features if self._standardisation is None else self._standardisation.apply(features)

    def _logits_of(
        self, network: Any, batch: EpisodeBatch, features: torch.Tensor | None = None
    ) -> torch.Tensor:
        """Return a network's log odds of braking at each decision, (N, T)."""
        features = network.extract_features(batch.inputs) if features is None else features
        action_logits = network.action_net(network.mlp_extractor.forward_actor(features))
        logits = torch.zeros_like(batch.mask)
        logits[batch.indices] = action_logits[:, self._brake].float() - action_logits[:, self._hold].float()
        return logits

    def logits(self, batch: EpisodeBatch) -> torch.Tensor:
        """Return the log odds of braking at each decision, the mean of all networks, (N, T)."""
        for network in self.networks:
            network.set_training_mode(False)
        features = self._shared_features(batch)
        parts = [self._logits_of(network, batch, features) for network in self.networks]
        return torch.stack(parts).mean(0)


def _copy_weights(network: torch.nn.Module) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in network.state_dict().items()}


def _metrics(evaluation: Evaluation, **others: float) -> dict[str, float]:
    """Return the metrics of an evaluation and others, without NaN."""
    metrics = others | evaluation._asdict()
    return {name: value for name, value in metrics.items() if not np.isnan(value)}
