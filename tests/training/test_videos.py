"""Videos of validation episodes, and the log in Weights & Biases."""

import sys
import zipfile
from contextlib import contextmanager
from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from support.recordings import write_yaml

from lgmd_gym.agents.policies.card import read_card
from lgmd_gym.clips import VideoReader
from lgmd_gym.training import TrainConfig, train
from lgmd_gym.training.videos import STRIP_LENGTH

YAML = """
default:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper: {history: 1, repeat: 10}
  n_timesteps: 32
  learning_starts: 8
  policy_kwargs: {net_arch: [4]}
"""


def config(folder, **options):
    options = {"camera": "fovea", "inputs": ["ego_speed"], "eval_freq": 16, "eval_episodes": 1} | options
    return TrainConfig.from_hyperparams("dqn", "LGMD/RandomBraking-v0", write_yaml(folder, YAML), **options)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("videos")
    for count in (0, 2):
        train(config(folder, videos=count), folder / str(count))
    return folder


def test_videos_do_not_change_the_training(runs):
    for member in ("policy.pth", "policy.optimizer.pth"):
        weights = [zipfile.ZipFile(runs / name / "last.zip").read(member) for name in ("0", "2")]
        assert weights[0] == weights[1]
    logs = [(runs / name / "monitor.csv").read_text().splitlines()[1:] for name in ("0", "2")]
    assert [line.split(",")[:2] for line in logs[0]] == [line.split(",")[:2] for line in logs[1]]
    assert not (runs / "0" / "videos").exists()


def test_the_filmed_episode_is_the_evaluated_one(runs):
    """A decision of the policy lasts ten decisions of the environment, and the film has the first picture."""
    names = [f"step-{steps}-episode-{index}.mp4" for steps in (16, 32) for index in (0, 1)]
    assert sorted(path.name for path in (runs / "2" / "videos").iterdir()) == names
    lengths = np.load(runs / "2" / "best" / "evaluations.npz")["ep_lengths"][:, 0]
    for length, name in zip(lengths, names[::2], strict=True):
        count = len(list(VideoReader(runs / "2" / "videos" / name)))
        assert 10 * (length - 1) < count - 1 <= 10 * length


def test_tensorboard_has_film_strips(runs):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    log = EventAccumulator(str(next((runs / "2" / "tensorboard").iterdir()))).Reload()
    assert log.Tags()["images"] == ["eval/episode_0", "eval/episode_1"]
    strips = log.Images("eval/episode_1")
    assert [strip.step for strip in strips] == [16, 32]
    film = list(VideoReader(runs / "2" / "videos" / "step-16-episode-1.mp4"))
    pictures = np.split(np.array(Image.open(BytesIO(strips[0].encoded_image_string)), int), STRIP_LENGTH)
    for picture, shown in ((pictures[0], film[0]), (pictures[-1], film[-1])):
        assert np.abs(picture - shown).mean() < 3.0  # the video is compressed
    assert (np.abs(pictures[-1] - pictures[0]).max(axis=2) > 50).sum() > 100  # the cars move


@pytest.fixture
def wandb(monkeypatch):
    """A package wandb that keeps what happens to its run."""
    happened = []

    @contextmanager
    def init(**options):
        happened.append(options)
        yield
        happened.append("end")

    monkeypatch.setitem(sys.modules, "wandb", SimpleNamespace(init=init))
    return happened


def test_wandb_gets_the_configuration_and_tensorboard(tmp_path, wandb):
    settings = config(tmp_path, wandb="braking", n_timesteps=16)
    path = train(settings, tmp_path / "run")
    options, end = wandb
    assert options["project"] == "braking"
    assert options["name"] == "run"
    assert options["config"] == settings.to_dict()
    assert options["sync_tensorboard"] is True
    assert end == "end"
    assert read_card(path)["config"]["wandb"] is None  # the project is one of the user, not of the policy
    assert "braking" not in (tmp_path / "run" / "README.md").read_text()


def test_wandb_that_is_not_installed(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "wandb", None)
    with pytest.raises(ValueError, match="requires the package wandb: pip install wandb"):
        train(config(tmp_path, wandb="braking"), tmp_path / "run")
    assert not (tmp_path / "run").exists()
