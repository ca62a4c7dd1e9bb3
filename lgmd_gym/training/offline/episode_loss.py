# pyright: standard
# Not strict: torch states few types.
"""Loss of whole episodes: whether the brake acts in time, or not at all.

A benchmark asks once per episode whether the brake acts. The cross-entropy asks at every decision how long it
can wait, and most of these questions are easy. This loss asks that of the benchmark: it is the logistic loss
of the highest log odds of full braking in an episode, as a smooth maximum.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch.nn.functional import softplus

from lgmd_gym.agents.policies.evidence import MAX_ODDS, TimeToBrakeParams
from lgmd_gym.training.offline.dataset import StateDataset

# Of the smooth maximum log(Σ exp(3 m)) / 3. It exceeds the maximum, by log(T) / 3 if T log odds are equal.
SHARPNESS = 3.0


class EpisodeTarget(NamedTuple):
    """What the brake should do in an episode."""

    # indices of the decisions that count within the episode, int64; none if the episode has no loss
    decisions: np.ndarray
    sign: float  # -1 if the brake should act at one of them, 1 if at none


def find_targets(dataset: StateDataset, brake: TimeToBrakeParams) -> list[EpisodeTarget]:
    """Return the target of every episode.

    Only decisions before the first braking of the recorded agent count. Without a threat, the brake should
    act at none of them. With one, it should act at one with a time to brake above 0 and below `present_s`. An
    episode with a threat has no target if the agent brakes while the time to brake is above the first limit,
    because a brake that waits is right as well.
    """
    targets: list[EpisodeTarget] = []
    for first, last in zip(dataset.bounds[:-1].tolist(), dataset.bounds[1:].tolist(), strict=True):
        times, braking = dataset.times[first:last], dataset.braking[first:last]
        held = times[: int(braking.argmax()) if braking.any() else None]
        if not np.isfinite(times).any():
            targets.append(EpisodeTarget(np.arange(len(held)), 1.0))
            continue
        waits = bool((held <= brake.limits_s[0]).any())
        timely = np.flatnonzero((held > 0.0) & (held < brake.present_s) & waits)
        targets.append(EpisodeTarget(timely, -1.0))
    return targets


def episode_loss(
    logits: torch.Tensor, lengths: Sequence[int], targets: Iterable[EpisodeTarget], brake: TimeToBrakeParams
) -> torch.Tensor:
    """Return the mean loss of the episodes with a target, 0 without any.

    Args:
        logits: Logits of the decisions of whole episodes, one after the other, float32, (M, actions).
        lengths: Number of decisions of each episode.
        targets: Target of each episode.
        brake: See `braking_odds`.
    """
    parts = braking_odds(logits, brake).split(list(lengths))
    losses = [
        softplus(target.sign * torch.logsumexp(SHARPNESS * odds[target.decisions], 0) / SHARPNESS)
        for odds, target in zip(parts, targets, strict=True)
        if len(target.decisions)
    ]
    return torch.stack(losses).mean() if losses else logits.new_zeros(())


def braking_odds(logits: torch.Tensor, brake: TimeToBrakeParams) -> torch.Tensor:
    """Return log odds that exceed `full_odds` where the brake acts fully if the driver does not brake, (M,).

    They are the smaller ones of those of both conditions, with the second threshold raised or lowered to the
    first one. So they depend on the difference of the thresholds only: these can be chosen after a training.
    """
    below, above = logits.logcumsumexp(1)[:, :-1], logits.flip(1).logcumsumexp(1).flip(1)[:, 1:]
    odds = below - above
    full = odds[:, brake.limits_s.index(brake.full_s)]
    if brake.confirm_odds == -MAX_ODDS:
        return full
    present = odds[:, brake.limits_s.index(brake.present_s)]
    return torch.minimum(full, present - (brake.confirm_odds - brake.full_odds))
