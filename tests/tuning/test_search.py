"""Search with Optuna on objectives with a known maximum, and the `tune` command."""

import pytest
from support.runs import SMALL_SUITE

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.cli import main as cli
from lgmd_gym.tuning.objective import Objective, ObjectiveValue
from lgmd_gym.tuning.search import sensitivity, tune
from lgmd_gym.tuning.space import SearchSpace, agent_string


class ThresholdObjective:
    """Objective of `spike-threshold` with its maximum at a threshold of 100."""

    def __init__(self):
        self.evaluated = []

    def evaluate(self, agent, sensor_config):
        self.evaluated.append((agent, sensor_config))
        threshold = make_agent(agent).agent.params.threshold
        return ObjectiveValue(1.0 - abs(threshold - 100.0) / 300.0, 0.0, 10, 10)


class SensorObjective:
    """Objective with its maximum at the camera tele and sigma_3 = 1.5."""

    def evaluate(self, agent, sensor_config):
        distance = abs(sensor_config.params["sigma_3"] - 1.5)
        return ObjectiveValue(0.5 * (sensor_config.camera == "tele") - 0.3 * distance, 0.0, 10, 10)


def test_a_study_starts_at_the_defaults_finds_the_maximum_and_resumes(tmp_path):
    pytest.importorskip("optuna")
    space, study, lines = SearchSpace(agent="spike-threshold"), tmp_path / "study.db", []
    train = ThresholdObjective()
    tune(space, study, 3, train, ThresholdObjective(), log=lines.append)
    assert len(train.evaluated) == 3
    assert "threshold=30.0" in train.evaluated[0][0]
    best = tune(space, study, 20, train, ThresholdObjective(), log=lines.append)
    assert len(train.evaluated) == 23
    assert any(line.startswith("trial 22:") for line in lines)
    assert abs(best["threshold"] - 100.0) < 35.0
    assert make_agent(agent_string("spike-threshold", best)).agent.params.threshold == best["threshold"]


@pytest.mark.parametrize(("first", "then"), [(1, 2), pytest.param(5, 9, marks=pytest.mark.slow)])
def test_a_resumed_study_equals_an_uninterrupted_one(first, then, tmp_path):
    """The search is interrupted in its first trial, and again after some; it is random up to trial 10."""
    pytest.importorskip("optuna")
    space, whole, parts = SearchSpace(agent="spike-threshold"), ThresholdObjective(), ThresholdObjective()
    silent = {"validation": ThresholdObjective(), "log": lambda line: None}
    tune(space, tmp_path / "whole.db", first + then, whole, **silent)

    class Interrupted:
        def evaluate(self, agent, sensor_config):
            raise KeyboardInterrupt

    for trials in (0, first):
        tune(space, tmp_path / "parts.db", trials, parts, **silent)
        with pytest.raises(KeyboardInterrupt):
            tune(space, tmp_path / "parts.db", 1, Interrupted(), **silent)
    tune(space, tmp_path / "parts.db", then, parts, **silent)
    assert parts.evaluated == whole.evaluated
    assert len({agent for agent, _ in parts.evaluated}) == first + then


def test_the_file_of_the_result_is_checked_before_the_search(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(Objective, "evaluate", None)
    for best in (tmp_path / "nowhere" / "best.toml", tmp_path / f"{'x' * 300}.toml"):
        assert cli.run(["tune", "--agent", "spike-threshold", "--best", str(best)]) == 2
        printed = capsys.readouterr().err
        assert printed.count("\n") == 1
        assert f"--best '{best}' cannot be created" in printed


@pytest.mark.parametrize("name", ["nowhere/study.db", "text.db"])
def test_an_unusable_study_is_one_line(name, tmp_path):
    pytest.importorskip("optuna")
    (tmp_path / "text.db").write_text("not a database, " * 100)
    objective = ThresholdObjective()
    with pytest.raises(ValueError, match=r"study '.*' cannot be used \([^\n]+\); check the path") as error:
        tune(SearchSpace(agent="spike-threshold"), tmp_path / name, 1, objective, objective)
    assert "\n" not in str(error.value)


def test_an_interrupted_search_is_one_line(tmp_path, capsys, monkeypatch):
    pytest.importorskip("optuna")

    def interrupt(self, agent, sensor_config):
        raise KeyboardInterrupt

    monkeypatch.setattr(Objective, "evaluate", interrupt)
    monkeypatch.chdir(tmp_path)
    assert cli.run(["tune", "--agent", "spike-threshold"]) == 130
    assert capsys.readouterr().err == "interrupted; to resume, repeat the command with --study tune.db\n"
    assert [path.name for path in tmp_path.iterdir()] == ["tune.db"]


def test_validation_chooses_between_the_defaults_and_the_best_trials(tmp_path):
    """The training objective prefers a threshold of 100, the validation objective one of 30."""
    pytest.importorskip("optuna")

    class DefaultIsBest(ThresholdObjective):
        def evaluate(self, agent, sensor_config):
            self.evaluated.append(agent)
            threshold = make_agent(agent).agent.params.threshold
            return ObjectiveValue(1.0 - abs(threshold - 30.0) / 300.0, 0.0, 10, 10)

    validation, space = DefaultIsBest(), SearchSpace(agent="spike-threshold")
    best = tune(space, tmp_path / "study.db", 8, ThresholdObjective(), validation, log=lambda line: None)
    assert len(validation.evaluated) == 4  # the defaults and the best three
    assert best == space.defaults()


@pytest.mark.slow
def test_camera_and_neuron_are_searched_on_request(tmp_path):
    pytest.importorskip("optuna")
    space = SearchSpace(agent="spike-threshold", cameras=("fovea", "tele"), neuron=("sigma_3",))
    study = tmp_path / "study.db"
    best = tune(space, study, 30, SensorObjective(), SensorObjective(), log=lambda line: None)
    assert best["camera"] == "tele"
    assert abs(best["neuron.sigma_3"] - 1.5) < 0.3


def test_sensitivity_evaluates_every_shift():
    objective = ThresholdObjective()
    rows = sensitivity(SearchSpace(agent="spike-threshold", neuron=("sigma_3",)), objective)
    assert [name for name, _, _ in rows] == ["threshold"] * 2 + ["frames"] * 2 + ["neuron.sigma_3"] * 2
    assert objective.evaluated[0] == ("spike-threshold:threshold=24.0", SensorConfig())
    assert objective.evaluated[-1] == ("spike-threshold", SensorConfig(params={"sigma_3": 1.2}))
    assert rows[1][2].avoided_energy == pytest.approx(1.0 - 64.0 / 300.0)


def test_bench_accepts_the_options_that_tune_prints(tmp_path, monkeypatch, capsys):
    pytest.importorskip("optuna")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(SMALL_SUITE)
    small = ["--levels", "2", "--seeds", "0", "--trials", "2", "--jobs", "1"]
    space = ["--agent", "spike-threshold", "--cameras", "tele", "fovea", "--neuron", "sigma_3"]
    assert cli.run(["tune", *small, *space]) == 0
    printed = capsys.readouterr().out.splitlines()[-1].split(": ", 1)[1].split()
    assert printed[0] == "--agents"
    assert "--params" in printed
    quick = ["--jobs", "1", "--no-plots", "--no-report"]
    assert cli.run(["bench", *printed, "--suite", "small.toml", "--seeds", "1", *quick]) == 0
    assert cli.run(["tune", *small, *space]) == 2
    assert "--best 'best.toml' exists; choose another file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("--trials", "0"), "trials must be >= 1, got 0"),
        (("--seeds", "-1"), "seeds must be >= 0, got -1"),
        (("--false-cost", "0"), "false_cost must be > 0, got 0.0"),
    ],
)
def test_invalid_options_are_rejected(option, message, capsys):
    assert cli.run(["tune", *option]) == 2
    assert message in capsys.readouterr().err


def test_the_command_prints_a_sensitivity_table(capsys):
    sizes = ["--levels", "2", "--seeds", "0", "--jobs", "1"]
    assert cli.run(["tune", "--agent", "spike-threshold", "--sensitivity", *sizes]) == 0
    output = capsys.readouterr().out
    assert [output.count(word) for word in ("defaults", "threshold ", "frames ")] == [1, 2, 2]
