"""Training with stable-baselines3: policies, seeds, checkpoints."""

import json
import shutil
import zipfile

import gymnasium as gym
import numpy as np
import pytest
from support.recordings import write_yaml

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.card import read_card
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.envs.base import EgoBrakeEnv
from lgmd_gym.training import TrainConfig, resume, train
from lgmd_gym.training.callbacks import checkpoints_of, load_checkpoint, save_model

DEMANDS = (0.0, -0.4, -1.0)
TINY = {"name": "wide", "shape": [9, 16]}
YAML = """
LGMD/CCRs-v0:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper: {history: 2, repeat: 4}
  n_envs: 2
  n_timesteps: 64
  learning_rate: lin_0.001
  n_steps: 16
  batch_size: 16
  policy_kwargs: {net_arch: [8]}
"""


def online_config(folder, algo="ppo", text=YAML, **options):
    options = {"camera": "fovea", "eval_freq": 32, "eval_episodes": 1} | options
    return TrainConfig.from_hyperparams(algo, "LGMD/CCRs-v0", write_yaml(folder, text), **options)


@pytest.mark.parametrize(
    ("demands", "latch"),
    [((), False), pytest.param(DEMANDS, False, marks=pytest.mark.slow), ((-1.0, 0.0), True)],
)
def test_trained_policy_acts_as_the_model_predicts(tmp_path, capsys, demands, latch):
    """With a latch, the first demand is full braking: an untrained network chooses it within 6 decisions."""
    from stable_baselines3 import PPO

    text = YAML.replace("repeat: 4", "repeat: 4, latch: true") if latch else YAML
    config = online_config(tmp_path, text=text, demands=demands, seed=1)
    path = train(config, tmp_path / "run", progress=True)
    rows = capsys.readouterr().out.splitlines()[2:]
    with np.load(tmp_path / "run" / "best" / "evaluations.npz") as log:
        means = [f"{mean:.2f}" for mean in log["results"].mean(axis=1)]
    assert [row.split()[2] for row in rows if int(row.split()[0]) in (32, 64)] == means
    assert path.stat().st_size < 1_000_000
    card = read_card(path)
    assert card["camera"] == "fovea"
    assert card["features"]["repeat"] == 4
    agent = make_agent(f"policy:{path}")
    assert capsys.readouterr().err == ""  # the card describes the network, so that nothing is unpickled
    model = PPO.load(path, device="cpu")
    policy_env = config.make_policy_env("train")
    env = gym.make("LGMD/CCRs-v0", camera=agent.camera)
    policy_observation, _ = policy_env.reset(seed=3)
    observation, info = env.reset(seed=3)
    agent.reset(3)
    for _ in range(6):
        action, _ = model.predict(policy_observation, deterministic=True)
        policy_observation, _, terminated, *_ = policy_env.step(action)
        for _ in range(40 if terminated else 4):
            demand = agent.act(observation, info)
            assert demand == np.float32(demands[action] if demands else action)
            observation, *_, info = env.step(demand)
        if terminated:
            break
    assert terminated is latch
    with pytest.raises(ValueError, match="run' already exists"):
        train(config, tmp_path / "run")


def test_neighbouring_seeds_share_no_environment_seeds(tmp_path, monkeypatch):
    """The constructor of stable-baselines3 seeds environment i with seed + i; the last seeding counts.

    CCRs has no levels, so that the seeds below 1,000,000 are those of evaluations.
    """
    from lgmd_gym.training.policy_env import PolicyVecEnv

    seeds, seed_envs = [], PolicyVecEnv.seed
    monkeypatch.setattr(
        PolicyVecEnv, "seed", lambda self, seed: (seeds.append(seed), seed_envs(self, seed))[1]
    )
    for seed in (0, 1):
        seeds.clear()
        train(online_config(tmp_path, n_timesteps=32, eval_freq=10_000, seed=seed), tmp_path / f"{seed}")
        assert seeds[-1] == 1_000_000 * (seed + 1)


def test_traffic_trains_in_training_worlds_and_is_evaluated_in_those_of_validation(tmp_path, monkeypatch):
    """The first seeds follow the rules of the leaderboard, and so do the worlds."""
    resets, reset = [], EgoBrakeEnv.reset

    def noted_reset(self, *, seed=None, options=None):
        observation, info = reset(self, seed=seed, options=options)
        resets.append((self.appearance.split, seed, info["world"]))
        return observation, info

    monkeypatch.setattr(EgoBrakeEnv, "reset", noted_reset)
    text = YAML.replace("LGMD/CCRs-v0", "default").replace("n_steps: 16", "n_steps: 4")
    config = TrainConfig.from_hyperparams(
        "ppo", "LGMD/Traffic-Merge-v0", write_yaml(tmp_path, text), camera=TINY, n_timesteps=8,
        env_kwargs={"config": {"duration": 2}}, eval_freq=8, eval_episodes=1,
    )  # fmt: skip
    train(config, tmp_path / "run")
    for split, first in (("train", 1_000_000), ("validation", 10_000)):
        chosen = [item for item in resets if item[0] == split]
        assert {seed for _, seed, _ in chosen if seed is not None} == {first, first + 1}
        assert {world for *_, world in chosen} <= set(SPLIT_WORLDS[split])
    assert len(resets) > 4


def test_resume_continues_from_the_newest_checkpoint(tmp_path):
    folder = tmp_path / "run"
    train(online_config(tmp_path, n_timesteps=32), folder)
    values = json.loads((folder / "config.json").read_text()) | {"n_timesteps": 96}
    (folder / "config.json").write_text(json.dumps(values))
    first_result = np.load(folder / "best" / "evaluations.npz")["results"].mean()
    write_yaml(tmp_path, "default: {n_envs: 7}")  # only the stored configuration counts
    assert checkpoints_of(folder)[0].name == "model_32_steps.zip"
    policy = resume(folder)
    assert checkpoints_of(folder)[0].name == "model_96_steps.zip"
    assert read_card(policy)["config"] == values
    evaluations = np.load(folder / "best" / "evaluations.npz")
    assert evaluations["timesteps"].tolist() == [32, 64, 96]
    assert evaluations["results"][0].mean() == first_result


def interrupted(folder, source, *truncated):
    """Copy a finished training, truncate files of the copy and ask for 32 more decisions."""
    shutil.copytree(source, folder)
    for name in truncated:
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: len(data) // 2])
    values = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps(values | {"n_timesteps": values["n_timesteps"] + 32}))
    return folder


@pytest.mark.slow
def test_resume_survives_truncated_files(tmp_path, capsys):
    source = tmp_path / "run"
    train(online_config(tmp_path), source)
    assert [path.name for path in (source / "best").iterdir()].count("unfinished") == 0
    newest, older = (f"checkpoints/model_{steps}_steps.zip" for steps in (64, 32))
    first = np.load(source / "best" / "evaluations.npz")["results"].tolist()
    for name, truncated, messages, start in (
        ("a", [newest], ["model_64_steps.zip' is damaged; training resumes"], 32),
        ("b", [newest, older], ["model_64_steps.zip' is damaged", "model_32_steps.zip' is damaged"], 0),
        ("c", ["best/evaluations.npz"], ["evaluations.npz' is damaged"], 64),
        ("d", ["best/best_model.zip"], ["best_model.zip' is damaged; the next evaluation"], 64),
    ):
        folder = interrupted(tmp_path / name, source, *truncated)
        capsys.readouterr()
        assert make_agent(f"policy:{resume(folder)}").name
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == len(messages), lines
        assert all(message in line for message, line in zip(messages, lines, strict=True))
        log = np.load(folder / "best" / "evaluations.npz")
        kept = [] if name == "c" else [32, 64][: start // 32]
        assert log["timesteps"].tolist() == kept + list(range(start + 32, 97, 32))
        assert log["results"].tolist()[: len(kept)] == first[: len(kept)]


def test_the_newest_checkpoint_that_opens_is_loaded(tmp_path, capsys):
    class Algorithm:
        load = staticmethod(lambda path, envs, device: path.name)

    for steps in (8, 16, 100):
        path = tmp_path / "checkpoints" / f"model_{steps}_steps.zip"
        path.parent.mkdir(exist_ok=True)
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("data", "x" * 99)
    assert load_checkpoint(Algorithm, tmp_path, None) == "model_100_steps.zip"
    path.write_bytes(path.read_bytes()[:-1])
    flipped = tmp_path / "checkpoints" / "model_16_steps.zip"
    flipped.write_bytes(flipped.read_bytes().replace(b"xx", b"xy", 1))
    assert load_checkpoint(Algorithm, tmp_path, None) == "model_8_steps.zip"
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "model_100_steps.zip' is damaged; training resumes from an earlier state" in lines[0]


def test_an_interrupted_write_keeps_the_old_checkpoint(tmp_path):
    """The model writes half of its file and is then interrupted."""

    class HalfSaved:
        def save(self, path):
            path.write_text("half")
            raise KeyboardInterrupt

    (tmp_path / "model.zip").write_text("old")
    with pytest.raises(KeyboardInterrupt):
        save_model(HalfSaved(), tmp_path / "model.zip")
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("model.zip", "old")]


@pytest.mark.slow
def test_a_checkpoint_without_its_whole_replay_buffer_is_not_used(tmp_path, capsys):
    text = "default: {n_envs: 2, n_timesteps: 64, learning_starts: 100, buffer_size: 200}"
    source = tmp_path / "run"
    train(online_config(tmp_path, "dqn", text), source)
    resume(interrupted(tmp_path / "a", source, "checkpoints/model_replay_buffer_64_steps.pkl"))
    assert "model_64_steps.zip' is damaged; training resumes" in capsys.readouterr().err
    steps = np.load(tmp_path / "a" / "best" / "evaluations.npz")["timesteps"].tolist()
    assert steps == [32, 64, 96]


@pytest.mark.slow
@pytest.mark.parametrize("algo", ["sac", "dqn"])
def test_off_policy_algorithms_train(tmp_path, algo):
    text = "default: {n_envs: 2, n_timesteps: 400, learning_starts: 100, policy_kwargs: {net_arch: [8]}}"
    config = online_config(tmp_path, algo, text, eval_freq=200)
    agent = make_agent(f"policy:{train(config, tmp_path / 'run')}")
    observation, info = gym.make("LGMD/CCRs-v0", camera=agent.camera).reset(seed=0)
    demand = agent.act(observation, info)
    assert demand.shape == (1,)
    assert algo == "sac" or float(demand[0]) in np.float32(DEMANDS)
