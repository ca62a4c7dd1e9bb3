"""Loss of whole episodes: targets, log odds of braking and of the warning, and the smooth maximum."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
import torch

from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.stages import Evidence
from lgmd_gym.training.offline.dataset import StateDataset
from lgmd_gym.training.offline.episode_loss import (
    EpisodeTarget,
    braking_odds,
    episode_losses,
    find_targets,
    shifted_warning_odds,
)
from lgmd_gym.training.offline.episodes import DrivenEpisode

BRAKE = TimeToBrakeParams(full_s=1.2, full_odds=0.3, confirm_odds=0.8, warning_odds=-0.4)


def dataset(*episodes):
    """Episodes of (times to brake, demands)."""
    made = [
        DrivenEpisode(
            {"ego_speed": np.zeros((len(times), 1), np.float32)},
            np.array(times, np.float32),
            np.array(demands, np.float32),
            bool(np.isfinite(times).any()),
        )
        for times, demands in episodes
    ]
    return StateDataset(made, FeatureConfig(inputs=("ego_speed",), history=1, repeat=1), BRAKE.limits_s)


@pytest.mark.parametrize(
    ("times", "demands", "braking", "warning", "sign"),
    [
        ([inf, 4.5, 3.0, 2.1, 1.0, 0.2, 0.0, 0.0], [0.0] * 8, [3, 4, 5], [2, 3], -1.0),
        # the sixth decision is the last one before the braking
        ([inf, 4.5, 3.0, 2.1, 1.0, 0.2, 0.0, 0.0], [0.0] * 5 + [-1.0] * 3, [3, 4, 5], [2, 3], -1.0),
        # brakes early: for the brake, then for both
        ([inf, 4.5, 3.0, 2.1, 1.0, 0.2, 0.0], [0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0], [], [2, 3], -1.0),
        ([inf, 4.5, 3.0, 2.1, 1.0, 0.2, 0.0], [0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 0.0], [], [], -1.0),
        ([inf] * 4, [0.0] * 4, [0, 1, 2, 3], [0, 1, 2, 3], 1.0),
        ([inf] * 4, [0.0, -0.5, 0.0, 0.0], [0, 1], [0, 1], 1.0),
        ([0.0, 0.0], [0.0, 0.0], [], [], -1.0),  # always too late
        ([1.5, 0.5, 0.3], [0.0] * 3, [0, 1, 2], [], -1.0),  # too late for a warning
        ([4.0, 3.9, 2.6, 2.5, 2.01, 2.0, 0.3], [0.0] * 7, [3, 4, 5, 6], [1, 2, 3, 4], -1.0),
        # the demand of the last decision has no effect on it
        ([2.6, 2.5, 0.5, 0.4], [0.0, 0.0, 0.0, -1.0], [], [0, 1], -1.0),
        ([2.6, 2.5, 0.5, 0.4, 0.2], [0.0, 0.0, 0.0, -1.0, -1.0], [], [0, 1], -1.0),
    ],
)
def test_targets(times, demands, braking, warning, sign):
    (target,) = find_targets(dataset((times, demands)), replace(BRAKE, warning_s=1.2))
    assert (target.braking.tolist(), target.warning.tolist(), target.sign) == (braking, warning, sign)


def test_targets_are_those_of_each_episode():
    threat, safe = ([2.4, 1.0, 0.2], [0.0] * 3), ([inf] * 2, [0.0] * 2)
    found = find_targets(dataset(threat, safe, threat), BRAKE)
    assert [target.braking.tolist() for target in found] == [[0, 1, 2], [0, 1], [0, 1, 2]]
    assert [target.sign for target in found] == [-1.0, 1.0, -1.0]


def test_the_stages_act_where_the_log_odds_exceed_the_threshold():
    logits = np.random.default_rng(0).normal(0.0, 2.0, (500, 5)).astype(np.float32)
    early = replace(BRAKE, full_s=0.6, warning_s=1.2)
    for brake in (BRAKE, early, TimeToBrakeParams(full_s=0.6, full_odds=-0.2)):
        evidence, _ = brake.evidence(brake.odds(logits))
        acts = braking_odds(torch.from_numpy(logits), brake).numpy() > brake.full_odds
        assert np.array_equal(acts, evidence == Evidence.FULL)
        warns = shifted_warning_odds(torch.from_numpy(logits), brake).numpy() > brake.full_odds
        assert np.array_equal(warns | acts, evidence >= Evidence.WARNING)
        assert 50 < acts.sum() < 450


def test_no_second_condition():
    logits = torch.tensor([[30.0, 0.0, 0.0, 0.0, 90.0]])
    assert braking_odds(logits, replace(BRAKE, confirm_odds=-50.0)).item() == pytest.approx(-60.0, abs=1e-4)


def test_the_losses_are_those_of_the_highest_log_odds():
    logits = torch.randn(9, 5, generator=torch.Generator().manual_seed(0), requires_grad=True)
    odds = braking_odds(logits.detach(), BRAKE).numpy(), shifted_warning_odds(logits.detach(), BRAKE).numpy()
    none, four = np.arange(0), np.arange(4)
    empty = EpisodeTarget(none, none, -1.0)
    targets = [EpisodeTarget(four, four, 1.0), empty, EpisodeTarget(np.array([1, 2]), np.array([0, 1]), -1.0)]
    losses = episode_losses(logits, [4, 2, 3], targets, BRAKE)
    for found, values, last in zip(losses, odds, (slice(7, 9), slice(6, 8)), strict=True):
        smooth = [np.log(np.exp(3.0 * part).sum()) / 3.0 for part in (values[:4], values[last])]
        assert smooth[0] == pytest.approx(values[:4].max(), abs=np.log(4.0) / 3.0)
        expected = np.mean([np.log1p(np.exp(smooth[0])), np.log1p(np.exp(-smooth[1]))])
        assert found.item() == pytest.approx(expected, rel=1e-5)
    sum(losses).backward()
    assert logits.grad[4:6].abs().max() == 0.0  # decisions that do not count
    assert logits.grad[6:].abs().sum(1).min() > 0.0
    assert [loss.item() for loss in episode_losses(logits, [9], [empty], BRAKE)] == [0.0, 0.0]
    raised = TimeToBrakeParams(full_s=1.2, full_odds=1.3, confirm_odds=1.8, warning_odds=0.6)
    again = episode_losses(logits, [4, 2, 3], targets, raised)
    assert [loss.item() for loss in again] == pytest.approx([loss.item() for loss in losses], rel=1e-5)
