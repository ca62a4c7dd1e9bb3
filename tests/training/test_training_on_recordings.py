"""Training on recorded episodes with the command, from recording to the policy file."""

import csv
import json
import os
from functools import partial

import gymnasium as gym
import pytest
from support.recordings import recorded_config, write_yaml

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.card import read_card
from lgmd_gym.cli import main as cli
from lgmd_gym.processes.files import FolderLock
from lgmd_gym.training.offline import traffic
from lgmd_gym.training.offline.driving import DriveRecorder
from lgmd_gym.training.offline.episodes import load
from lgmd_gym.training.recordings import load_or_record

LOSSES = ("train_loss", "loss", "best_loss", "episode_loss", "warning_loss")


def arguments(folder, out, *options):
    common = ["train", "--algo", "time-to-brake", "--camera", "fovea", "--jobs", "1"]
    return [*common, "--hyperparams", str(write_yaml(folder)), "--out", str(out), *options]


@pytest.mark.slow
def test_second_training_reuses_the_recordings_of_the_first(tmp_path, monkeypatch):
    first, second = tmp_path / "first", tmp_path / "second"
    assert cli.run(arguments(tmp_path, first, "--eval-episodes", "4")) == 0
    monkeypatch.setattr(DriveRecorder, "record", None)  # any recording raises
    options = ["--eval-episodes", "3", "--n-timesteps", "5", "--inputs", "ffi", "ego_speed"]
    command = arguments(tmp_path, second, *options, "--recordings", str(first))
    assert cli.run(command) == 0
    assert not (second / "episodes").exists()
    rows = [*csv.DictReader((second / "log" / "progress.csv").open())]
    assert rows[-1]["best_loss"] == min((row["loss"] for row in rows), key=float)
    assert f"`validation`: loss {float(rows[-1]['best_loss']):.3f}" in (second / "README.md").read_text()
    card = read_card(second / "policy.zip")
    assert card["algo"] == "ppo"
    assert card["config"]["algo"] == "time-to-brake"
    assert card["config"]["recordings"] is None  # no local path in a policy file
    agent = make_agent(f"policy:{second / 'policy.zip'}")
    observation, info = gym.make("LGMD/CCRs-v0", camera=agent.camera).reset(seed=0)
    assert agent.act(observation, info).shape == (1,)
    assert cli.run(["train", "--resume", str(first)]) == 0  # from the recorded episodes


def test_second_process_in_a_training_folder_is_refused(tmp_path, capsys):
    (tmp_path / "config.json").write_text(json.dumps(recorded_config(tmp_path).to_dict()))
    lock = FolderLock(tmp_path)
    assert cli.run(["train", "--resume", str(tmp_path)]) == 2
    assert f"training folder {str(tmp_path)!r} is in use by process {os.getpid()};" in capsys.readouterr().err
    lock.release()


@pytest.mark.slow
def test_training_with_traffic_and_reuse_of_its_recordings(tmp_path, monkeypatch):
    make_traffic = partial(traffic.make_traffic, config={"duration": 12})
    monkeypatch.setattr(traffic, "make_traffic", make_traffic)
    monkeypatch.setattr(traffic, "MAX_LENGTH", 5.0)
    first, second = tmp_path / "first", tmp_path / "second"
    options = ["--eval-episodes", "3", "--n-timesteps", "3", "--traffic-episodes"]
    assert cli.run(arguments(tmp_path, first, *options, "2")) == 0
    levels, by_seed = (load(first / "episodes" / name / "000000.npz") for name in ("train", "traffic-train"))
    assert [len(episodes) for episodes in levels] == [1, 1, 1]
    assert len(by_seed) == 2
    segments = [segment for episodes in by_seed for segment in episodes]
    assert len(segments) > 2
    assert all(segment.family == "traffic" and not segment.threat for segment in segments)
    monkeypatch.setattr(traffic.TrafficRecorder, "record", None)  # any recording raises
    assert cli.run(arguments(tmp_path, second, *options, "1", "--recordings", str(first))) == 0
    columns = (second / "log" / "progress.csv").read_text().splitlines()[0].split(",")
    assert {*LOSSES} <= set(columns) <= {*LOSSES, "area", "area_braking"}
    config = recorded_config(tmp_path, n_timesteps=3, traffic_episodes=1, recordings=str(first))
    assert len([*load_or_record(config, "train", tmp_path)]) == 3 + len(by_seed[0])


@pytest.mark.slow
def test_policy_with_fields_at_the_sides(tmp_path):
    options = ["--sensors-of", "all-round", "--inputs", "columns", "sides_ffi", "ego_speed"]
    command = arguments(tmp_path, tmp_path / "run", *options, "--eval-episodes", "4")
    command.remove("--camera")
    command.remove("fovea")
    assert cli.run(command) == 0
    agent = make_agent(f"policy:{tmp_path / 'run' / 'policy.zip'}")
    env = gym.make("LGMD/CPNA-v0", ego_speed=8.0, camera=agent.camera)
    observation, info = env.reset(seed=0)
    assert observation["membrane_potential"].shape == (25,)
    assert observation["column_potential"].shape == (190,)
    agent.reset(0)
    for _ in range(10):
        observation, _, _, _, info = env.step(agent.act(observation, info))
    assert observation["membrane_potential"][13:19].min() < 0.5  # motion to the left
