"""`start_time.py`: levels without a first part."""

from dataclasses import replace

import numpy as np
import pytest
from support.examples import load

from lgmd_gym.agents.policies.policy import Policy
from lgmd_gym.training.offline.episodes import DrivenEpisode


def level(frames, threat=True):
    """Return a level whose last moment is its last frame, with the number of each frame as its speed."""
    numbers = np.arange(frames, dtype=np.float32)
    times = numbers[::-1] / 30.0 if threat else np.full(frames, np.inf, np.float32)
    return DrivenEpisode({"ego_speed": numbers[:, None]}, times, np.zeros(frames, np.float32), threat, "CCRs")


@pytest.mark.parametrize(("frames", "longest"), [(120, 60), (80, 34), (30, 0)])
def test_the_first_part_leaves_the_time_to_react(frames, longest):
    script, rng = load("start_time"), np.random.default_rng(0)
    cut = [script.without_start(level(frames), rng, 2) for _ in range(400)]
    firsts = {int(item.observations["ego_speed"][0, 0]) for item in cut}
    assert firsts == set(range(0, longest + 1, 2))  # decisions of the policy
    for item in cut:
        assert item.time_to_brake[0] * 30.0 == pytest.approx(len(item) - 1)
        assert len(item.demands) == len(item.observations["ego_speed"]) == len(item)


def test_one_in_fifty_levels_without_a_threat_exceeds_the_threshold():
    script = load("start_time")
    harmless = [script.Judged(False, False, float(odds)) for odds in range(100)]
    threats = [
        script.Judged(True, waits, odds) for waits, odds in ((True, 98.5), (True, 97.0), (False, 99.0))
    ]
    rate = script.recognised(harmless + threats)
    assert (rate.k, rate.n) == (1, 2)


def test_odds_count_while_braking_avoids_the_contact_and_before_the_driver_brakes(monkeypatch):
    script, policy = load("start_time"), Policy("all-round")
    odds = np.arange(20.0)  # one per decision
    monkeypatch.setattr(script, "policy_inputs", lambda episodes, features: [{}])
    monkeypatch.setattr(script, "action_values", lambda network, inputs: odds[:, None])
    monkeypatch.setattr(type(policy.card.brake), "odds", lambda self, logits: np.tile(logits, 4))
    assert policy.features.repeat == 2
    assert script.judge(policy, level(40)) == (True, True, 19.0)
    late = replace(level(40), time_to_brake=np.maximum(level(40).time_to_brake - 0.5, 0.0))
    assert script.judge(policy, late).odds == 11.0  # 0 s from frame 24 on
    braking = replace(level(40), demands=np.where(np.arange(40) >= 20, -1.0, 0.0).astype(np.float32))
    assert script.judge(policy, braking) == (True, False, 10.0)
    assert not script.judge(policy, level(40, threat=False)).threat
