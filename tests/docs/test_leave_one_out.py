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
  n_timesteps: 1
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
        family, low = (("Slow", 0.0), ("Empty", 12.0), ("Fast", 30.0), ("Empty", 12.0))[number % 4]
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
    return module


def test_a_family_is_recognised_with_training_only(script, tmp_path, capsys):
    found = script.main([str(tmp_path), "--families", "Fast", "--epochs", "20", "--jobs", "2"])
    complete, without = found["Fast"]
    assert (complete.k, complete.n) == (30, 30)  # every second of sixty
    assert (without.k, without.n) == (0, 30)
    assert "| Fast | 30/30 [89–100] | 0/30 [0–11] |" in capsys.readouterr().out


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
    with pytest.raises(ValueError, match="unknown family of the recordings 'Fas'.*'Fast'"):
        script.main([str(tmp_path), "--families", "Fas"])
