"""Files of a training run for other tools: `monitor.csv` and the model card."""

from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from stable_baselines3.common.monitor import load_results
from support.recordings import recorded_config, write_yaml

from lgmd_gym.agents import make_agent
from lgmd_gym.cli import main as cli
from lgmd_gym.training import TrainConfig, train
from lgmd_gym.training.callbacks import MonitorLog
from lgmd_gym.training.model_card import best_result, write_model_card
from lgmd_gym.training.returns import ReturnTable

YAML = """
LGMD/CCRs-v0:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper: {history: 1, repeat: 10, latch: true}
  n_envs: 2
  n_timesteps: 32
  n_steps: 8
  batch_size: 8
  policy_kwargs: {net_arch: [4]}
  env_kwargs: {params: {t_sp: 0.6}}
"""


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("training")
    config = TrainConfig.from_hyperparams(
        "ppo",
        "LGMD/CCRs-v0",
        write_yaml(folder, YAML),
        camera="fovea",
        inputs=["ego_speed"],
        eval_freq=16,
        eval_episodes=3,
    )
    train(config, folder / "run")
    return config, folder / "run"


def test_episodes_are_in_the_format_of_stable_baselines3(finished):
    config, folder = finished
    table = load_results(str(folder))
    assert list(table.columns) == ["index", "r", "l", "t", "timesteps"]
    assert len(table) >= 2
    assert table["l"].sum() <= config.n_timesteps
    assert (folder / "monitor.csv").read_text().startswith('#{"t_start": 0.0, "env_id": "LGMD/CCRs-v0"}')


def log_episodes(folder, start, returns):
    """Log an episode at each of the time steps start + 1, start + 2, …, one every half second."""
    log = MonitorLog(folder, "LGMD/CCRs-v0")
    log.model = SimpleNamespace(num_timesteps=start)
    log._on_training_start()
    for index, total in enumerate(returns, 1):
        log.num_timesteps = start + index
        log.locals = {"infos": [{}, {"episode": {"r": total, "l": 4, "t": 0.5 * index}}]}
        log._on_step()
    log._on_training_end()


def test_a_resumed_run_replaces_the_episodes_after_its_checkpoint(tmp_path):
    log_episodes(tmp_path, 0, [1.5, -3.0, 4.0])
    log_episodes(tmp_path, 2, [5.0, 6.0])
    table = load_results(str(tmp_path))
    assert table["r"].tolist() == [1.5, -3.0, 5.0, 6.0]
    assert table["timesteps"].tolist() == [1, 2, 3, 4]
    assert table["t"].tolist() == [0.5, 1.0, 1.5, 2.0]


def test_a_truncated_last_row_is_dropped(tmp_path):
    log_episodes(tmp_path, 0, [1.5])
    with (tmp_path / "monitor.csv").open("a") as file:
        file.write("2.5,4")
    log_episodes(tmp_path, 2, [3.0])
    assert load_results(str(tmp_path))["r"].tolist() == [1.5, 3.0]


def test_the_policy_has_the_neuron_of_its_training(finished):
    _, folder = finished
    assert make_agent(f"policy:{folder / 'policy.zip'}").neuron["t_sp"] == 0.6


def test_model_card_has_the_best_evaluation(finished):
    config, folder = finished
    text = (folder / "README.md").read_text()
    metadata, page = yaml.safe_load(text.split("---\n")[1]), text.split("---\n", 2)[2]
    with np.load(folder / "best" / "evaluations.npz") as log:
        means = log["results"].mean(axis=1)
    (entry,) = metadata["model-index"][0]["results"]
    assert entry["metrics"][0]["value"].startswith(f"{means.max():.2f} +/- ")
    assert entry["dataset"]["name"] == "LGMD/CCRs-v0"
    assert "3 episodes of `validation`" in page
    assert "Its inputs: `ego_speed`." in page
    listed = yaml.safe_load(page.split("```yaml\n")[1].split("```")[0])
    assert listed["algo_kwargs"]["n_steps"] == config.algo_kwargs["n_steps"]
    assert "camera" not in listed


def test_the_best_evaluation_has_the_highest_mean_return(tmp_path):
    (tmp_path / "best").mkdir()
    results = [[1.0, 1.0], [3.0, 1.0], [9.0, -9.0]]
    np.savez(tmp_path / "best" / "evaluations.npz", timesteps=[16, 32, 48], results=results)
    assert str(best_result(tmp_path)) == "2.00 +/- 1.00"


def test_model_card_without_an_evaluation(tmp_path):
    write_model_card(recorded_config(tmp_path), tmp_path, "0.1")
    text = (tmp_path / "README.md").read_text()
    assert "model-index" not in text
    assert "The training had no evaluation." in text


def test_model_card_of_a_training_on_recordings(tmp_path):
    """The second of three epochs has the lowest loss."""
    (tmp_path / "log").mkdir()
    rows = ["loss,train_loss,area", "0.5,0.6,", "0.25,0.4,0.9712345", "0.3,0.2,0.99", ""]
    (tmp_path / "log" / "progress.csv").write_text("\n".join(rows))
    write_model_card(recorded_config(tmp_path), tmp_path, "0.1")
    text = (tmp_path / "README.md").read_text()
    assert "`validation`: loss 0.250, area under the ROC curve 0.9712.\n" in text
    metadata = yaml.safe_load(text.split("---\n")[1])
    assert metadata["tags"] == ["supervised-learning", "stable-baselines3", "LGMD/RandomBraking-v0"]


@pytest.mark.parametrize(
    ("saved", "kept"),
    [
        ("checkpoints/model_64_steps.zip", "to resume"),
        ("episodes/train/000000.npz", "to resume"),
        ("episodes/train/000000.npz.part", "nothing was saved before the first checkpoint; to start again"),
        ("config.json", "nothing was saved before the first checkpoint; to start again"),
    ],
)
def test_an_interrupted_training_states_what_is_kept(saved, kept, tmp_path, monkeypatch, capsys):
    def interrupted(config, folder, **options):
        (folder / saved).parent.mkdir(parents=True)
        (folder / saved).touch()
        raise KeyboardInterrupt

    monkeypatch.setattr("lgmd_gym.training.train", interrupted)
    assert cli.run(["train", "--out", str(tmp_path / "run")]) == 130
    message = f"interrupted; {kept}: lgmd-gym train --resume {tmp_path / 'run'}\n"
    assert capsys.readouterr().err.endswith(message)


def test_a_run_prints_its_mean_returns_in_the_scale_of_the_environment(tmp_path, capsys):
    """64 decisions: a row every 3, and one at each evaluation; the training return is divided by 0.1."""
    text = YAML.replace("latch: true", "latch: true, reward_scale: 0.1").replace(
        "n_timesteps: 32", "n_timesteps: 64"
    )
    config = TrainConfig.from_hyperparams(
        "ppo", "LGMD/CCRs-v0", write_yaml(tmp_path, text), camera="fovea", eval_freq=16, eval_episodes=3
    )
    shown = []
    evaluator = SimpleNamespace(evaluations_timesteps=[], last_mean_reward=-np.inf, best_mean_reward=-np.inf)
    table = ReturnTable(config, evaluator, lambda done, activity: shown.append((done, activity)))
    table.model = SimpleNamespace(ep_info_buffer=[])
    table.num_timesteps = 0
    table._on_training_start()
    for decisions, returns, validation in (
        (2, [], None),
        (4, [-0.2, 0.1], None),
        (6, [1.0], -1.5),
        (8, [1.0], -2.0),
    ):
        table.num_timesteps, table.model.ep_info_buffer = decisions, [{"r": value} for value in returns]
        if validation is not None:
            evaluator.evaluations_timesteps.append(decisions)
            evaluator.last_mean_reward = validation
            evaluator.best_mean_reward = max(validation, evaluator.best_mean_reward)
        table._on_step()
    first, headings, *rows = capsys.readouterr().out.splitlines()
    assert first == ("ppo in 2 environments LGMD/CCRs-v0: 64 decisions, an evaluation of 3 episodes every 16")
    assert headings.split("  ") == ["decisions", "training return", "validation return", "decisions/s"]
    found = [row.split() for row in rows]
    assert [row[:2] for row in found] == [["4", "-0.50"], ["6", "10.00"], ["8", "10.00"]]
    assert [row[2] for row in found[1:]] == ["-1.50", "-2.00"]
    assert [row[4:] for row in found] == [[], ["best", "so", "far"], []]
    assert shown == [(2, "training"), (4, "training"), (6, "training"), (8, "training")]


def test_a_resumed_run_prints_where_it_continues(tmp_path, capsys):
    config = TrainConfig.from_hyperparams(
        "ppo", "LGMD/CCRs-v0", write_yaml(tmp_path, YAML), camera="fovea", eval_freq=16, eval_episodes=1
    )
    evaluator = SimpleNamespace(evaluations_timesteps=[16], last_mean_reward=-1.0, best_mean_reward=-1.0)
    table = ReturnTable(config, evaluator, lambda done, activity: None)
    table.model, table.num_timesteps = SimpleNamespace(ep_info_buffer=None), 16
    table._on_training_start()
    table.num_timesteps = 18
    table._on_step()
    first, _, row = capsys.readouterr().out.splitlines()
    assert first.startswith(
        "ppo in 2 environments LGMD/CCRs-v0: 32 decisions, from 16 on, an evaluation of 1 ep"
    )
    assert row.split()[:2] == ["18", "-"]  # no episode has ended


def test_an_interruption_before_the_folder_exists(tmp_path, monkeypatch, capsys):
    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr("lgmd_gym.engine.first_use.compile_kernels", interrupted)
    assert cli.run(["train", "--out", str(tmp_path / "run")]) == 130
    assert capsys.readouterr().err.endswith("interrupted; nothing was saved\n")
