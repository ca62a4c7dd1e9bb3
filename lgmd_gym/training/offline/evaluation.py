"""Evaluation of a deterministic policy on recorded episodes."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import torch

from lgmd_gym.training.offline.dataset import EpisodeBatch, OfflineDataset
from lgmd_gym.training.offline.objective import scale_false_braking_cost

BATCH_SIZE = 64  # [episodes]
MARGINS = tuple(float(margin) for margin in np.arange(-4.0, 4.5, 0.5))  # of log odds


class Evaluation(NamedTuple):
    """Results of the deterministic policy, which brakes where its log odds of braking exceed a margin.

    Attributes:
        mean_return: Mean return over levels and traffic segments.
        weighted_return: The same with the weighted cost of braking in episodes without a threat. Levels and
            traffic segments have half of the weight each, whatever their numbers.
        avoided: Share of threats that end without contact.
        false_activations: Share of levels without a threat in which the policy brakes.
        traffic_activations: Share of traffic segments in which the policy brakes; NaN without any.
    """

    mean_return: float
    weighted_return: float
    avoided: float
    false_activations: float
    traffic_activations: float


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

    Args:
        logits: See `evaluate`.
        dataset: Recorded episodes.
        false_cost: See `evaluate`.
    """
    results = zip(MARGINS, evaluate_margins(logits, dataset, MARGINS, false_cost), strict=True)
    return max(results, key=lambda item: (item[1].weighted_return, -abs(item[0])))


def evaluate_margins(
    logits: Callable[[EpisodeBatch], torch.Tensor],
    dataset: OfflineDataset,
    margins: Sequence[float],
    false_cost: float = 1.0,
) -> list[Evaluation]:
    """Return the results of a policy that brakes where its log odds exceed a margin, for each margin.

    Args:
        logits: See `evaluate`.
        dataset: Recorded episodes.
        margins: Margins of the log odds of braking.
        false_cost: See `evaluate`.
    """
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
                traffic_activations=_mean(brakes[traffic]),
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

    Args:
        wants_brake: Whether the policy would brake at each decision, bool (N, T).
        batch: The episodes.
        weighted: Weighted returns of braking at each decision, (N, T).
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
