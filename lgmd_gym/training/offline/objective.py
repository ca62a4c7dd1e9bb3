"""The objective of `OfflineLearner`: the expected return of an episode.

With a latching brake, a policy is a probability p_t of braking at each decision, and the return of every
choice is recorded. The expected return of an episode is therefore a sum over its decisions,

    J = Σ_t s_t (p_t B_t + (1 - p_t) r_t),  s_t = Π_{u<t} (1 - p_u),

of the return B of braking and the reward r of holding the speed until the next decision. No episode is
sampled and no value function is estimated. The gradient is the expectation of REINFORCE's (Williams 1992).
"""

import torch
from torch.nn.functional import logsigmoid

from lgmd_gym.training.offline.dataset import EpisodeBatch


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
