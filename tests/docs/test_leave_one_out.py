"""`leave_one_out.py`: a family that the training lacks."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.examples import load
from support.recordings import write_yaml

from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.episodes import DrivenEpisode

YAML = """
default:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper: {inputs: [ego_speed], history: 1, repeat: 2}
  n_timesteps: 240
  n_epochs: 1
  batch_size: 64
  learning_rate: 0.02
  brake: {full_odds: 1.0, release_s: 0.5}
  policy_kwargs: {net_arch: {pi: [16, 16], vf: []}}
"""


def episodes(seed):
    """Levels at one speed each: Slow ones below 10 m/s and Fast ones above 30 m/s are threats."""
    rng = np.random.default_rng(seed)
    for number in range(240):
        family, low = (("Slow", 0.0), ("Empty", 12.0), ("Fast", 30.0))[number % 3]
        speed = np.full((20, 1), rng.uniform(low, low + (10.0 if family != "Empty" else 16.0)), np.float32)
        threat = family != "Empty"
        times = np.arange(20, dtype=np.float32)[::-1] / 30.0 if threat else np.full(20, np.inf, np.float32)
        yield DrivenEpisode({"ego_speed": speed}, times, np.zeros(20, np.float32), threat, family)


@pytest.fixture
def script(tmp_path, monkeypatch):
    config = TrainConfig.from_hyperparams(
        "time-to-brake", "LGMD/RandomBraking-v0", write_yaml(tmp_path, YAML), camera="fovea", eval_episodes=1
    )
    (tmp_path / "config.json").write_text(json.dumps(config.to_dict()))
    module = load("leave_one_out")
    monkeypatch.setattr(module, "load_or_record", lambda config, split, folder: episodes(split == "train"))
    monkeypatch.setattr(module, "check_recordings", lambda config: None)
    return module


def test_a_family_is_recognised_with_training_only(script, tmp_path, monkeypatch, capsys):
    parts, part = [], script.Levels.part
    monkeypatch.setattr(
        script.Levels, "part", lambda self, chosen: parts.append(chosen) or part(self, chosen)
    )
    found = script.main([str(tmp_path), "--families", "Fast", "--epochs", "20"])
    complete, without = found["Fast"]
    assert (complete.k, complete.n) == (40, 40)  # the odd seeds of eighty
    assert (without.k, without.n) == (0, 40)
    assert "| Fast | 40/40 [91–100] | 0/40 [0–9] |" in capsys.readouterr().out
    trained, selecting, trained_without, selecting_without = map(set, parts)
    fast, tested = set(range(2, 240, 3)), set(range(5, 240, 6))
    assert trained == set(range(240)) - tested
    assert selecting == set(range(240))
    assert trained_without == selecting_without == set(range(240)) - fast


def test_threads_do_not_change_the_result(script, tmp_path):
    found = [
        script.main([str(tmp_path), "--families", "Fast", "Slow", "--epochs", "2", "--jobs", jobs])
        for jobs in ("1", "2")
    ]
    assert found[0] == found[1]


def test_one_in_twenty_levels_exceeds_the_threshold(script):
    odds = np.random.default_rng(0).permutation(100).astype(float)
    assert (odds > script.threshold_of(odds)).sum() == 5


def test_levels_whose_driver_brakes_early(script, tmp_path):
    config = TrainConfig.from_dict(json.loads((tmp_path / "config.json").read_text()))
    (slow, *_) = episodes(0)
    early, late = (
        replace(slow, demands=np.where(np.arange(20) >= first, -1.0, 0.0).astype(np.float32))
        for first in (5, 15)
    )
    levels = script.Levels(iter([early, late]), config, [0.3, 1.2]).levels
    assert [item.waits for item in levels] == [False, True]  # 14 and 4 decisions before the last moment
    assert [len(item.in_time) for item in levels] == [3, 8]


def test_an_unknown_family(script, tmp_path):
    with pytest.raises(ValueError, match=r"unknown family of the recordings 'Fas'.*'Fast'"):
        script.main([str(tmp_path), "--families", "Fas"])
    with pytest.raises(ValueError, match="unknown family of the recordings 'Empty'"):
        script.main([str(tmp_path), "--families", "Empty"])  # without a threat
