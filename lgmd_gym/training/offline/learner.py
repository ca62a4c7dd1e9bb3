"""`OfflineLearner`: gradient ascent on the expected return over recorded episodes.

With a latching brake, a policy is a probability p_t of braking at each decision, and the return of every
choice is recorded. The expected return of an episode is therefore a sum over its decisions,

    J = Σ_t s_t (p_t B_t + (1 - p_t) r_t),  s_t = Π_{u<t} (1 - p_u),

of the return B of braking and the reward r of holding the speed until the next decision. No episode is
sampled and no value function is estimated. The gradient is the expectation of REINFORCE's (Williams 1992).
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import torch
from torch.nn.functional import logsigmoid

from lgmd_gym.agents.base import HOLD
from lgmd_gym.errors import check_flag, check_positive, check_whole, check_within
from lgmd_gym.training.offline.dataset import EpisodeBatch, OfflineDataset

if TYPE_CHECKING:
    from stable_baselines3 import PPO
    from stable_baselines3.common.type_aliases import GymEnv

EVAL_BATCH_SIZE = 64  # [episodes]
RETURN_SCALE = 0.1  # factor of the loss


class Evaluation(NamedTuple):
    """Results of the deterministic policy, which brakes where its probability exceeds one half.

    Attributes:
        mean_return: Mean return over levels and traffic segments.
        avoided: Share of threats that end without contact.
        false_activations: Share of levels without a threat in which the policy brakes.
        traffic_activations: Share of traffic segments in which the policy brakes; NaN without any.
    """

    mean_return: float
    avoided: float
    false_activations: float
    traffic_activations: float


class OfflineLearner:
    """Trains a stable-baselines3 policy on recorded episodes.

    Args:
        policy: stable-baselines3's name of the network.
        env: Environment with the spaces of the policy, `gym.Env` or `VecEnv`; it is not stepped.
        demands: Demand of each action: `HOLD`, and a lower one that brakes.
        seed: Seed of the network and of the order of episodes.
        n_epochs: Number of passes over the training episodes.
        batch_size: Number of episodes per gradient step.
        learning_rate: Maximum of the one-cycle schedule (Smith & Topin 2018).
        weight_decay: Weight decay of AdamW.
        false_cost: Factor on the cost of braking in episodes without a threat, in training only. A factor
            of 2 compensates for the few episodes that resemble a threat.
        initial_brake_probability: Probability of braking at a decision before training.
        logit_decay: Weight of the squared log odds of braking, summed over the decisions of an episode.
            Without this penalty a network that learns slowly, for example on frames, saturates at never
            braking and its gradient vanishes.
        mirror: Whether each training episode is mirrored, left to right, with probability 1/2 in each pass.
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
        n_epochs: int = 100,
        batch_size: int = 64,
        learning_rate: float = 0.006,
        weight_decay: float = 0.01,
        false_cost: float = 2.0,
        initial_brake_probability: float = 0.03,
        logit_decay: float = 0.0,
        mirror: bool = False,
        policy_kwargs: dict[str, Any] | None = None,
    ) -> None:
        self.n_epochs = check_whole("n_epochs", n_epochs, 1)
        self.batch_size = check_whole("batch_size", batch_size, 1)
        self.learning_rate = check_positive("learning_rate", learning_rate)
        self.weight_decay = check_within("weight_decay", weight_decay, 0.0, 1.0)
        self.false_cost = check_positive("false_cost", false_cost)
        self.logit_decay = check_within("logit_decay", logit_decay, 0.0, 1.0)
        self.mirror = check_flag("mirror", mirror)
        check_within("initial_brake_probability", initial_brake_probability, 1e-6, 0.999)
        self._seed = seed
        self._hold, self._brake = demands.index(HOLD), demands.index(min(demands))
        self.model = _make_model(policy, env, seed, policy_kwargs or {})
        odds = initial_brake_probability / (1.0 - initial_brake_probability)
        bias: Any = self.model.policy.action_net.bias
        with torch.no_grad():
            bias[self._brake], bias[self._hold] = float(np.log(odds)), 0.0

    def learn(
        self,
        train: OfflineDataset,
        validation: OfflineDataset,
        log: Callable[[int, dict[str, float]], None] = lambda epoch, metrics: None,
    ) -> "PPO":
        """Train for all epochs and return the model with the best mean return on the validation episodes.

        Args:
            train: Training episodes.
            validation: Episodes evaluated after each epoch.
            log: Called after each epoch with its number and its metrics.
        """
        policy = self.model.policy
        trained = [value for name, value in policy.named_parameters() if "value" not in name]
        steps = -(-len(train) // self.batch_size)
        optimizer = torch.optim.AdamW(trained, self.learning_rate, weight_decay=self.weight_decay)
        schedule = torch.optim.lr_scheduler.OneCycleLR(
            optimizer, self.learning_rate, total_steps=self.n_epochs * steps
        )
        rng = np.random.default_rng(self._seed)
        best_return, best_weights = -np.inf, _copy_weights(policy)
        for epoch in range(1, self.n_epochs + 1):
            policy.set_training_mode(True)
            train_return = 0.0
            for indices in np.array_split(rng.permutation(len(train)), steps):
                mirrored = rng.random(len(indices)) < 0.5 if self.mirror else ()
                batch = scale_false_braking_cost(train.batch(indices, mirrored), self.false_cost)
                optimizer.zero_grad()
                loss, mean_return = self._loss(batch)
                loss.backward()
                torch.nn.utils.clip_grad_norm_(trained, 1.0)
                optimizer.step()
                schedule.step()
                train_return += mean_return * len(indices) / len(train)
            evaluation = self.evaluate(validation)
            if evaluation.mean_return > best_return:
                best_return = evaluation.mean_return
                best_weights = _copy_weights(policy)
            metrics = {"train_return": train_return, **evaluation._asdict(), "best_return": best_return}
            log(epoch, {name: value for name, value in metrics.items() if not np.isnan(value)})
        policy.load_state_dict(best_weights)
        return self.model

    def _loss(self, batch: EpisodeBatch) -> tuple[torch.Tensor, float]:
        """Return the loss and the mean expected return."""
        logits = self.logits(batch)
        mean_return = expected_return(logits, batch).mean()
        penalty = (logits * batch.mask).square().sum(1).mean()
        return -RETURN_SCALE * (mean_return - self.logit_decay * penalty), float(mean_return.detach())

    def logits(self, batch: EpisodeBatch) -> torch.Tensor:
        """Return the log odds of braking at each decision, (N, T)."""
        distribution: Any = self.model.policy.get_distribution(batch.inputs).distribution
        action_logits = distribution.logits
        logits = torch.zeros_like(batch.mask)
        logits[batch.indices] = action_logits[:, self._brake] - action_logits[:, self._hold]
        return logits

    def evaluate(self, dataset: OfflineDataset) -> Evaluation:
        """Return the results of the deterministic policy on recorded episodes."""
        self.model.policy.set_training_mode(False)
        parts = [
            self._evaluate_batch(dataset.batch(range(len(dataset))[start : start + EVAL_BATCH_SIZE]))
            for start in range(0, len(dataset), EVAL_BATCH_SIZE)
        ]
        returns, brakes, contacts = (torch.cat(values).numpy() for values in zip(*parts, strict=True))
        threats = np.array([episode.threat for episode in dataset.episodes])
        traffic = np.array([episode.traffic for episode in dataset.episodes])
        return Evaluation(
            mean_return=float(returns.mean()),
            avoided=_mean(~contacts[threats]),
            false_activations=_mean(brakes[~traffic & ~threats]),
            traffic_activations=_mean(brakes[traffic]),
        )

    @torch.no_grad()
    def _evaluate_batch(self, batch: EpisodeBatch) -> tuple[torch.Tensor, ...]:
        """Return for each episode its return, whether the policy brakes, and whether it ends in a contact."""
        wants_brake = (self.logits(batch) > 0.0) & (batch.mask > 0.0)
        brakes = wants_brake.any(1)
        count = torch.cumsum(wants_brake, 1)
        before, onset = count == 0, wants_brake & (count == 1)
        returns = (batch.rewards * before).sum(1) + (batch.braking_returns * onset).sum(1)
        contacts = torch.where(brakes, (batch.braking_contacts & onset).any(1), batch.threats)
        return returns, brakes, contacts


def _make_model(policy: str, env: "GymEnv", seed: int, policy_kwargs: dict[str, Any]) -> "PPO":
    """Return a PPO model; only its network and its file format are used."""
    from stable_baselines3 import PPO

    torch.set_num_threads(1)
    kwargs = {"activation_fn": torch.nn.ReLU, "net_arch": {"pi": [64, 64], "vf": []}} | policy_kwargs
    return PPO(policy, env, 2e-3, 2, 2, seed=seed, device="cpu", policy_kwargs=kwargs)


def _copy_weights(network: torch.nn.Module) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in network.state_dict().items()}


def scale_false_braking_cost(batch: EpisodeBatch, factor: float) -> EpisodeBatch:
    """Return a batch in which braking without a threat costs `factor` times as much, relative to holding."""
    holding_returns = torch.flip(torch.cumsum(torch.flip(batch.rewards, [1]), 1), [1])
    scaled = holding_returns + factor * (batch.braking_returns - holding_returns)
    non_threat = ~batch.threats[:, None] & (batch.mask > 0.0)
    return batch._replace(braking_returns=torch.where(non_threat, scaled, batch.braking_returns))


def expected_return(logits: torch.Tensor, batch: EpisodeBatch) -> torch.Tensor:
    """Return the expected return of each episode, (N,), for the log odds of braking, (N, T)."""
    log_brake = logsigmoid(logits)
    log_hold = logsigmoid(-logits) * batch.mask
    log_reached = torch.cumsum(log_hold, 1) - log_hold
    return (
        torch.exp(log_reached + log_brake) * batch.braking_returns
        + torch.exp(log_reached + log_hold) * batch.rewards
    ).sum(1)


def _mean(flags: np.ndarray) -> float:
    return float(flags.mean()) if len(flags) else float("nan")
