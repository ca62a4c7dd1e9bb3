"""Loss of whole episodes: targets, log odds of braking, and the smooth maximum."""

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
    episode_loss,
    find_targets,
)
from lgmd_gym.training.offline.episodes import DrivenEpisode

BRAKE = TimeToBrakeParams(full_s=1.2, full_odds=0.3, confirm_odds=0.8)


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


def test_targets():
    threat = [inf, 3.0, 2.0, 1.0, 0.2, 0.0, 0.0]
    data = dataset(
        (threat, [0.0] * 7),
        (threat, [0.0, 0.0, 0.0, 0.0, -1.0, -1.0, -1.0]),  # the fifth decision is the last one before it
        (threat, [0.0, 0.0, -1.0, -1.0, 0.0, 0.0, 0.0]),  # brakes early
        ([inf] * 4, [0.0] * 4),
        ([inf] * 4, [0.0, -0.5, 0.0, 0.0]),
        ([0.0, 0.0], [0.0, 0.0]),  # always too late
        ([2.6, 2.5, 0.3], [0.0, 0.0, 0.0]),
        ([2.6, 2.5, 0.5, 0.4], [0.0, 0.0, 0.0, -1.0]),  # the demand of the last decision has no effect on it
        ([2.6, 2.5, 0.5, 0.4, 0.2], [0.0, 0.0, 0.0, -1.0, -1.0]),
    )
    found = [(target.decisions.tolist(), target.sign) for target in find_targets(data, BRAKE)]
    assert found == [
        ([2, 3, 4], -1.0),
        ([2, 3, 4], -1.0),
        ([], -1.0),
        ([0, 1, 2, 3], 1.0),
        ([0, 1], 1.0),
        ([], -1.0),
        ([1, 2], -1.0),
        ([], -1.0),
        ([], -1.0),
    ]


def test_the_brake_acts_where_the_log_odds_exceed_its_threshold():
    logits = np.random.default_rng(0).normal(0.0, 2.0, (500, 5)).astype(np.float32)
    for brake in (BRAKE, TimeToBrakeParams(full_s=0.6, full_odds=-0.2)):
        evidence, _ = brake.evidence(brake.odds(logits))
        acts = braking_odds(torch.from_numpy(logits), brake).numpy() > brake.full_odds
        assert np.array_equal(acts, evidence == Evidence.FULL)
        assert 50 < acts.sum() < 450


def test_the_loss_is_that_of_the_highest_log_odds():
    logits = torch.randn(9, 5, generator=torch.Generator().manual_seed(0), requires_grad=True)
    odds = braking_odds(logits.detach(), BRAKE).numpy()
    empty = EpisodeTarget(np.arange(0), -1.0)
    targets = [EpisodeTarget(np.arange(4), 1.0), empty, EpisodeTarget(np.array([1, 2]), -1.0)]
    loss = episode_loss(logits, [4, 2, 3], targets, BRAKE)
    smooth = [np.log(np.exp(3.0 * part).sum()) / 3.0 for part in (odds[:4], odds[7:9])]
    assert smooth[0] == pytest.approx(odds[:4].max(), abs=np.log(4.0) / 3.0)
    expected = np.mean([np.log1p(np.exp(smooth[0])), np.log1p(np.exp(-smooth[1]))])
    assert loss.item() == pytest.approx(expected, rel=1e-5)
    loss.backward()
    assert logits.grad[4:7].abs().max() == 0.0  # decisions that do not count
    assert episode_loss(logits, [9], [empty], BRAKE).item() == 0.0
    raised = TimeToBrakeParams(full_s=1.2, full_odds=1.3, confirm_odds=1.8)
    assert episode_loss(logits, [4, 2, 3], targets, raised).item() == pytest.approx(expected, rel=1e-5)
