# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""The objective of `OfflineLearner`, and the evaluation of a deterministic policy, on recorded episodes.

With a latching brake, a policy is a probability p_t of braking at each decision, and the return of every
choice is recorded. The expected return of an episode is therefore a sum over its decisions,

    J = Σ_t s_t (p_t B_t + (1 - p_t) r_t),  s_t = Π_{u<t} (1 - p_u),

of the return B of braking and the reward r of holding the speed until the next decision. No episode is
sampled and no value function is estimated. The gradient is the expectation of REINFORCE's (Williams 1992).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch.nn.functional import logsigmoid

from lgmd_gym.training.offline.dataset import EpisodeBatch, OfflineDataset

BATCH_SIZE = 64  # [episodes]
MARGINS = tuple(float(margin) for margin in np.arange(-4.0, 4.5, 0.5))  # of log odds


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


class Evaluation(NamedTuple):
    """Results of the deterministic policy, which brakes where its log odds of braking exceed a margin."""

    mean_return: float  # mean return over levels and traffic segments
    # the same with the weighted cost of braking in episodes without a threat. Levels and traffic segments
    # have half of the weight each, whatever their numbers
    weighted_return: float
    avoided: float  # share of threats that end without contact
    false_activations: float  # share of levels without a threat in which the policy brakes
    traffic_activations: float  # share of traffic segments without a threat with a brake; NaN without any


def evaluate(
    logits: Callable[[EpisodeBatch], torch.Tensor], dataset: OfflineDataset, false_cost: float = 1.0
) -> Evaluation:
    """Return the results of a policy on recorded episodes.

    Args:
        logits: Returns the log odds of braking at each decision of a batch, (N, T).
        dataset: Recorded episodes.
        false_cost: Factor on the cost of braking in episodes without a threat, for `weighted_return`.
    """
    return evaluate_margins(logits, dataset, (0.0,), false_cost)[0]


def select_margin(
    logits: Callable[[EpisodeBatch], torch.Tensor], dataset: OfflineDataset, false_cost: float = 1.0
) -> tuple[float, Evaluation]:
    """Return the margin of `MARGINS` with the highest weighted return, and its results.

    Of margins with the same return, the one closest to 0 is returned.
    """
    results = zip(MARGINS, evaluate_margins(logits, dataset, MARGINS, false_cost), strict=True)
    return max(results, key=lambda item: (item[1].weighted_return, -abs(item[0])))


def evaluate_margins(
    logits: Callable[[EpisodeBatch], torch.Tensor],
    dataset: OfflineDataset,
    margins: Sequence[float],
    false_cost: float = 1.0,
) -> list[Evaluation]:
    """Return the results of a policy that brakes where its log odds exceed a margin, for each margin."""
    parts = []
    for start in range(0, len(dataset), BATCH_SIZE):
        batch = dataset.batch(range(len(dataset))[start : start + BATCH_SIZE])
        parts.append(_evaluate_batch(logits, batch, margins, false_cost))
    threats = np.array([episode.threat for episode in dataset.episodes])
    traffic = np.array([episode.traffic for episode in dataset.episodes])
    results = []
    for by_batch in zip(*parts, strict=True):
        returns, weighted, brakes, contacts = (
            torch.cat(values).numpy() for values in zip(*by_batch, strict=True)
        )
        results.append(
            Evaluation(
                mean_return=float(returns.mean()),
                weighted_return=_balanced_mean(weighted, traffic),
                avoided=_mean(~contacts[threats]),
                false_activations=_mean(brakes[~traffic & ~threats]),
                traffic_activations=_mean(brakes[traffic & ~threats]),
            )
        )
    return results


@torch.no_grad()
def _evaluate_batch(
    logits: Callable[[EpisodeBatch], torch.Tensor],
    batch: EpisodeBatch,
    margins: Sequence[float],
    false_cost: float,
) -> list[tuple[torch.Tensor, ...]]:
    """Return the results of `_first_braking` for each margin."""
    log_odds = logits(batch)
    weighted = scale_false_braking_cost(batch, false_cost).braking_returns
    return [_first_braking(log_odds > margin, batch, weighted) for margin in margins]


def _first_braking(
    wants_brake: torch.Tensor, batch: EpisodeBatch, weighted: torch.Tensor
) -> tuple[torch.Tensor, ...]:
    """Return for each episode its return, its weighted return, whether the policy brakes, and the contact.

    `wants_brake` and `weighted`, the weighted returns of braking, have the shape (N, T).
    """
    wants_brake = wants_brake & (batch.mask > 0.0)
    brakes = wants_brake.any(1)
    count = torch.cumsum(wants_brake, 1)
    before, onset = count == 0, wants_brake & (count == 1)
    holding = (batch.rewards * before).sum(1)
    returns = holding + (batch.braking_returns * onset).sum(1)
    weighted_returns = holding + (weighted * onset).sum(1)
    contacts = torch.where(brakes, (batch.braking_contacts & onset).any(1), batch.threats)
    return returns, weighted_returns, brakes, contacts


def _balanced_mean(returns: np.ndarray, traffic: np.ndarray) -> float:
    """Return the mean over the groups, levels and traffic segments, of the mean return of each."""
    groups = (returns[~traffic], returns[traffic])
    return float(np.mean([group.mean() for group in groups if len(group)]))


def _mean(flags: np.ndarray) -> float:
    return float(flags.mean()) if len(flags) else float("nan")
