# pyright: standard
# Not strict: torch states few types.
"""Loss of whole episodes: whether the brake and the warning act in time, or not at all.

A benchmark asks once per episode whether the brake acts. The cross-entropy asks at every decision how long it
can wait, and most of these questions are easy. This loss asks that of the benchmark: it is the logistic loss
of the highest log odds of full braking in an episode, as a smooth maximum, and the same for the warning.
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
# Time to brake [s] within which a warning is of use. Euro NCAP's driver brakes by 4 m/s², 1.2 s after the
# warning (AEB C2C v4.3.1, 8.4.6). Before a standing car, this is early enough if full braking by 9 m/s² could
# still wait for 1.2 s + v / 14.4 m/s²: 1.8 s at 30 km/h, 2.7 s at 80 km/h, less with weaker brakes.
WARNING_S = (2.0, 4.0)


def check_warning(brake: TimeToBrakeParams) -> None:
    """Raise ValueError for a warning that the loss cannot train."""
    if brake.warning_s <= WARNING_S[0]:
        raise ValueError(
            f"warning_weight requires a warning_s above {WARNING_S[0]:g}, got {brake.warning_s:g}; the loss "
            f"asks for warnings {WARNING_S[0]:g} to {WARNING_S[1]:g} s before the last moment"
        )
    for name in ("warning_odds", "full_odds"):
        if abs(getattr(brake, name)) == MAX_ODDS:
            raise ValueError(
                f"warning_weight requires {name} between -{MAX_ODDS:g} (always) and {MAX_ODDS:g} (never), "
                f"got {getattr(brake, name):g}"
            )


class EpisodeTarget(NamedTuple):
    """What the brake and the warning should do in an episode."""

    # indices of the decisions that count within the episode, int64; none if the episode has no such loss
    braking: np.ndarray
    warning: np.ndarray
    sign: float  # -1 if they should act at one of them, 1 if at none


def find_targets(dataset: StateDataset, brake: TimeToBrakeParams) -> list[EpisodeTarget]:
    """Return the target of every episode.

    Only decisions before the first braking of the recorded agent count. Without a threat, neither should act
    at any of them. With one, the brake should act at one with a time to brake above 0 and below `present_s`,
    and the warning at one with a time to brake within `WARNING_S`. An episode with a threat has no target of
    the brake if the agent brakes while the time to brake is above the first limit, because a brake that waits
    is right as well, and none of the warning if the agent brakes while it is above 2 s, or the episode begins
    later. Whether the threat is visible is not considered.
    """
    targets: list[EpisodeTarget] = []
    for first, last in zip(dataset.bounds[:-1].tolist(), dataset.bounds[1:].tolist(), strict=True):
        times, braking = dataset.times[first:last], dataset.braking[first:last]
        held = times[: int(braking.argmax()) if braking.any() else None]
        if not np.isfinite(times).any():
            every = np.arange(len(held))
            targets.append(EpisodeTarget(every, every, 1.0))
            continue
        timely = _decisions_within(held, 0.0, brake.present_s, brake.limits_s[0])
        early = _decisions_within(held, *WARNING_S, WARNING_S[0])
        targets.append(EpisodeTarget(timely, early, -1.0))
    return targets


def _decisions_within(times: np.ndarray, above: float, below: float, reached: float) -> np.ndarray:
    """Return the indices of the times within the limits, none if no time is at most `reached`."""
    return np.flatnonzero((times > above) & (times < below) & bool((times <= reached).any()))


def episode_losses(
    logits: torch.Tensor, lengths: Sequence[int], targets: Sequence[EpisodeTarget], brake: TimeToBrakeParams
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the mean losses of braking and of the warning over the episodes with such a target, or 0.

    Args:
        logits: Logits of the decisions of whole episodes, one after the other, float32, (M, actions).
        lengths: Number of decisions of each episode.
        targets: Target of each episode.
        brake: See `braking_odds` and `shifted_warning_odds`.
    """
    signs = [target.sign for target in targets]
    return (
        _logistic_loss(braking_odds(logits, brake), lengths, [target.braking for target in targets], signs),
        _logistic_loss(
            shifted_warning_odds(logits, brake), lengths, [target.warning for target in targets], signs
        ),
    )


def braking_odds(logits: torch.Tensor, brake: TimeToBrakeParams) -> torch.Tensor:
    """Return log odds that exceed `full_odds` where the brake acts fully if the driver does not brake, (M,).

    They are the smaller ones of those of both conditions, with the second threshold raised or lowered to the
    first one. So they depend on the difference of the thresholds only: these can be chosen after a training.
    With a second threshold of -50, they are those of the first condition.
    """
    return torch.minimum(
        _odds_below(logits, brake, brake.full_s),
        _odds_below(logits, brake, brake.present_s) - (brake.confirm_odds - brake.full_odds),
    )


def shifted_warning_odds(logits: torch.Tensor, brake: TimeToBrakeParams) -> torch.Tensor:
    """Return log odds that exceed `full_odds` where the policy warns, (M,), as those of `braking_odds`."""
    return _odds_below(logits, brake, brake.warning_s) - (brake.warning_odds - brake.full_odds)


def _odds_below(logits: torch.Tensor, brake: TimeToBrakeParams, limit_s: float) -> torch.Tensor:
    """Return the log odds of a time to brake below one of `limits_s`, (M,)."""
    count = brake.limits_s.index(limit_s) + 1
    return logits[:, :count].logsumexp(1) - logits[:, count:].logsumexp(1)


def _logistic_loss(
    odds: torch.Tensor, lengths: Sequence[int], decisions: Iterable[np.ndarray], signs: Iterable[float]
) -> torch.Tensor:
    """Return the mean logistic loss of the highest log odds at the decisions of each episode that has any."""
    losses = [
        softplus(sign * torch.logsumexp(SHARPNESS * part[chosen], 0) / SHARPNESS)
        for part, chosen, sign in zip(odds.split(list(lengths)), decisions, signs, strict=True)
        if len(chosen)
    ]
    return torch.stack(losses).mean() if losses else odds.new_zeros(())
