"""`TrainConfig`: hyperparameter files, defaults, invalid values; errors of `lgmd-gym train`."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from support.recordings import RECORDED_YAML, recorded_config, write_yaml

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.policies.policy import find_policy
from lgmd_gym.camera import PRESETS
from lgmd_gym.cli import main as cli
from lgmd_gym.cli.train import Train, config_of
from lgmd_gym.training import TrainConfig, train
from lgmd_gym.training.config import DEMANDS, VALIDATION_SEED
from lgmd_gym.training.hyperparams import read_hyperparams
from lgmd_gym.training.recordings import recording_sets
from lgmd_gym.training.trainer import check_config

RANDOM_ID = "LGMD/RandomBraking-v0"


@pytest.mark.parametrize("algo", ["ppo", "sac", "dqn"])
def test_packaged_hyperparameters(algo):
    config = TrainConfig.from_hyperparams(algo)
    assert config.n_timesteps >= 96_000
    expected = (6, 3, False) if algo == "sac" else (1, 8, True)
    assert (config.features.history, config.features.repeat, config.features.latch) == expected
    assert config.features == TrainConfig.from_hyperparams(algo, "LGMD/CCRs-v0").features
    check_config(config)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [", "are not valid YAML"),
        ("- 3", "must have one entry per environment id"),
        ("LGMD/CCRm-v0: {}", "did you mean 'LGMD/CCRm-v0'"),
        ("default: {normalize: true}", "normalize is not supported"),
        ("default: {n_timesteps: 1.0e+400}", "n_timesteps must be finite, got inf"),
        ("default: {n_timesteps: true}", "n_timesteps must be a number, got True"),
        (f"default: {{n_envs: 1{'0' * 309}}}", "n_envs must be below 1e308"),
        (f"default: {{learning_rate: 1{'0' * 309}}}", "learning_rate must be below 1e308"),
        ("default: {n_timesteps: many}", "n_timesteps must be a number, got 'many'"),
        ("default: {env_wrapper: gymnasium.wrappers.FlattenObservation}", "env_wrapper must be lgmd_gym"),
        ("default: {env_wrapper: [a, b]}", "PolicyWrapper only, got 2 wrappers"),
        (
            "default: {env_wrapper: [null]}",
            "env_wrapper must be .*PolicyWrapper alone, got None",
        ),
        (
            "default: {env_wrapper: {lgmd_gym.training.PolicyWrapper: {}, gymnasium.wrappers.TimeLimit: {}}}",
            "env_wrapper must be lgmd_gym.training.PolicyWrapper alone",
        ),
        ("default: {n_timesteps: 200.9}", "n_timesteps must be a whole number >= 1, got 200.9"),
        (
            "default: {learning_rate: 3e-4}",
            "learning_rate is the text '3e-4' in YAML.*write for example 3.0",
        ),
    ],
)
def test_invalid_hyperparameter_files_are_rejected(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        read_hyperparams("ppo", RANDOM_ID, write_yaml(tmp_path, text))


def test_options_replace_the_hyperparameters(tmp_path):
    config = recorded_config(tmp_path, inputs=("ffi",), n_timesteps=9, seed=None)
    assert config.features.inputs == ("ffi",)
    assert config.features.repeat == 5
    assert (config.n_timesteps, config.seed) == (9, 0)


def test_a_file_describes_a_training_completely(tmp_path):
    text = """
default:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper: {inputs: [ego_speed], history: 1}
  eval_episodes: 7
  traffic_episodes: 8
  extra_levels: ["40:CPNA,CPFA", "20:StandingBox"]
  error_levels: ["10:CPNA"]
  extra_traffic: ["30:inattentive-highway"]
"""
    file = write_yaml(tmp_path, text)
    config = TrainConfig.from_hyperparams("time-to-brake", file=file)
    assert (config.eval_episodes, config.traffic_episodes) == (7, 8)
    assert config.extra_levels == ("40:CPNA,CPFA", "20:StandingBox")
    assert config.error_levels == ("10:CPNA",)
    assert config.extra_traffic == ("30:inattentive-highway",)
    given = TrainConfig.from_hyperparams("time-to-brake", file=file, traffic_episodes=0, extra_levels=())
    assert (given.traffic_episodes, given.extra_levels) == (0, ())
    wrong = write_yaml(tmp_path, text.replace("CPNA", "CPN"))
    with pytest.raises(ValueError, match="unknown family of random levels 'CPN'"):
        TrainConfig.from_hyperparams("time-to-brake", file=wrong)


@pytest.mark.parametrize("camera", ["wide", {"name": "wide", "shape": [45, 80]}, PRESETS["tele"]])
def test_config_survives_json(camera):
    config = TrainConfig.from_hyperparams("ppo", camera=camera)
    values = json.loads(json.dumps(config.to_dict()))
    restored = TrainConfig.from_dict(values)
    assert restored.features == config.features
    assert json.loads(json.dumps(restored.to_dict())) == values
    restored.make_env("train").close()


def test_cameras_are_presets_or_those_of_an_agent():
    assert TrainConfig.from_hyperparams("sac", camera="wide").camera == "wide"
    assert list(TrainConfig.from_hyperparams("sac").camera) == ["fovea", "tele", "wide"]
    camera = TrainConfig.from_hyperparams("sac", sensors_of="stopping-zone").camera
    assert camera[0]["name"] == "ground0.28"
    with pytest.raises(ValueError, match="agent 'spike-threshold' has no cameras of its own"):
        TrainConfig.from_hyperparams("sac", sensors_of="spike-threshold")
    with pytest.raises(ValueError, match="unknown agent 'allround'; did you mean 'all-round'"):
        TrainConfig.from_hyperparams("sac", sensors_of="allround")
    assert len(TrainConfig.from_hyperparams("sac", sensors_of="all-round").camera) == 25


@pytest.mark.parametrize(
    ("algo", "options", "message"),
    [
        ("dqn", {"demands": ()}, "dqn requires discrete demands"),
        ("sac", {"demands": (0.0, -1.0)}, r"sac requires a continuous demand, got demands \[0.0, -1.0\]"),
        ("ppo", {"demands": (0.0, -2.0)}, "demands"),
        ("dqn", {"recordings": "runs/a"}, "recordings requires algo .*, got 'dqn'"),
        (
            "dqn",
            {"traffic_episodes": 3},
            "traffic_episodes requires algo .*, got 'dqn'",
        ),
        (
            "dqn",
            {"extra_levels": ["3:CCRs"]},
            "extra_levels requires algo .*, got 'dqn'",
        ),
        (
            "time-to-brake",
            {"extra_levels": 3},
            "extra_levels must be a list of texts such as '400:CCRsCurve,",
        ),
        (
            "time-to-brake",
            {"extra_levels": ["CCRs"]},
            "extra_levels must be like '400:CCRsCurve,.*', got 'CCRs'",
        ),
        ("time-to-brake", {"extra_levels": ["-3:CCRs"]}, "extra_levels must be like .*, got '-3:CCRs'"),
        (
            "time-to-brake",
            {"extra_levels": ["0:CCRs"]},
            r"of extra_levels must be a whole number in \[1, 100000\], got 0",
        ),
        ("time-to-brake", {"extra_levels": ["3:CCRs,"]}, "unknown family of random levels ''"),
        ("time-to-brake", {"extra_levels": ["3:"]}, "extra_levels must be like .*, got '3:'"),
        (
            "time-to-brake",
            {"extra_levels": ["3:CCRs,CCRs"]},
            "extra_levels names a family twice: '3:CCRs,CCRs'",
        ),
        (
            "time-to-brake",
            {"extra_levels": ["3:CCRs", "3:CCRsCurv"]},
            "unknown family of random levels 'CCRsCurv'; did you mean 'CCRsCurve'",
        ),
        (
            "time-to-brake",
            {"env_id": "LGMD/CCRs-v0", "extra_levels": ["3:CCRs"]},
            "extra_levels requires env 'LGMD/RandomBraking-v0', got 'LGMD/CCRs-v0'",
        ),
        (
            "dqn",
            {"extra_traffic": ["3:highway"]},
            "extra_traffic requires algo .*, got 'dqn'",
        ),
        (
            "time-to-brake",
            {"extra_traffic": "3:highway"},
            "extra_traffic must be a list of texts such as '400:inter",
        ),
        (
            "time-to-brake",
            {"extra_traffic": ["3"]},
            "extra_traffic must be like '400:intersection,.*', got '3'",
        ),
        (
            "time-to-brake",
            {"extra_traffic": ["0:highway"]},
            "extra_traffic must be a whole number in .*, got 0",
        ),
        (
            "time-to-brake",
            {"extra_traffic": ["3:merge, merge"]},
            "extra_traffic names a kind twice: '3:merge, merge'",
        ),
        (
            "time-to-brake",
            {"extra_traffic": ["3:merge", "3:roundabot"]},
            "unknown kind of traffic 'roundabot'; did you mean 'roundabout'",
        ),
        (
            "time-to-brake",
            {"extra_traffic": ["3:inattentive-merge,inattentive-highwy"]},
            "unknown kind of traffic 'inattentive-highwy'; did you mean 'inattentive-highway'",
        ),
        ("time-to-brake", {"traffic_episodes": -1}, r"traffic_episodes must be in \[0, inf\), got -1"),
        (
            "time-to-brake",
            {"traffic_episodes": 3, "env_kwargs": {"config": {"reward": {"brake": 5.0}}}},
            "traffic episodes have the default reward, got others in config of env_kwargs",
        ),
        (
            "time-to-brake",
            {"extra_traffic": ["3:merge"], "env_kwargs": {"config": {"brake": {"jerk": 5.0}}}},
            "traffic episodes have the default brake, got others in config of env_kwargs",
        ),
        (
            "time-to-brake",
            {"extra_levels": ["5:CCRsCurve", "3:StandingBox,CCRsCurve"]},
            "extra_levels names 'CCRsCurve' in two sets, which would contain the same levels",
        ),
        ("dqn", {"error_levels": ["3:CCRs"]}, "error_levels requires algo .*, got 'dqn'"),
        ("time-to-brake", {"error_levels": ["100001:CCRs"]}, "number of error_levels must be .*, got 100001"),
        ("time-to-brake", {"error_levels": ["CCRs"]}, "error_levels must be like .*, got 'CCRs'"),
        (
            "time-to-brake",
            {"env_id": "LGMD/CCRs-v0", "error_levels": ["3:CCRs"]},
            "error_levels requires env 'LGMD/RandomBraking-v0', got 'LGMD/CCRs-v0'",
        ),
        (
            "ppo",
            {"env_kwargs": {"neuron": "dsn"}},
            "env_kwargs contains the neuron 'dsn'; use the option --neu",
        ),
        ("ppo", {"env_kwargs": {"fps": 15}}, "fps in env_kwargs must be 30 Hz, the rate of agents, got 15"),
        (
            "ppo",
            {"env_kwargs": {"config": {"policy_frequency": 10}}},
            "policy_frequency in env_kwargs must be 30 Hz, the rate of agents, got 10",
        ),
        ("ppo", {"demands": (0.5,)}, r"demands must be distinct, with one below 0 that brakes, got \[0.5\]"),
        ("dqn", {"demands": (0.0, 0.0, -1.0)}, "demands must be distinct"),
        ("ppo", {"seed": 2**32}, r"seed must be in \[0, 4294967295\], got 4294967296"),
        ("ppo", {"algo_kwargs": {"policy_kwargs": "dict()"}}, "policy_kwargs must be dict or NoneType"),
        ("ppo", {"inputs": ("ffi", "ego_speed", "ffi")}, "each policy input once, got 'ffi' twice"),
        ("ppo", {"n_timestep": 3}, "unknown training option 'n_timestep'; did you mean 'n_timesteps'"),
    ],
)
def test_invalid_options_are_rejected(algo, options, message):
    with pytest.raises(ValueError, match=message):
        TrainConfig.from_hyperparams(algo, **options)


@pytest.mark.parametrize(
    ("env_id", "expected"),
    [
        (RANDOM_ID, {"split": "validation"}),
        ("LGMD/RandomBrakingEasy-v0", {"split": "validation"}),
        ("LGMD/Traffic-Highway-v0", {"split": "validation"}),
        ("LGMD/CCRs-v0", {}),
    ],
)
def test_ids_with_splits_are_evaluated_on_validation(env_id, expected):
    config = TrainConfig.from_hyperparams("dqn", env_id, env_kwargs={}, inputs=("ffi",), camera="fovea")
    arguments = config.env_arguments("validation")
    assert {key: value for key, value in arguments.items() if key not in ("camera", "config")} == expected
    given = replace(config, env_kwargs={"split": "test"})
    assert given.env_arguments("train")["split"] == "test"
    config.make_env("validation").close()


@pytest.mark.parametrize(("env_id", "first"), [
    (RANDOM_ID, 2_000_000), ("LGMD/Traffic-Merge-v0", 3_000_000), ("LGMD/CCRs-v0", 3_000_000),
])  # fmt: skip
def test_training_without_levels_leaves_out_the_seeds_of_validation_and_test(env_id, first):
    config = TrainConfig.from_hyperparams("ppo", env_id, inputs=("ffi",), camera="fovea", seed=2)
    assert config.first_seed == first
    assert replace(config, seed=0).first_seed == first - 2_000_000
    if "Traffic" not in env_id:
        config = TrainConfig.from_hyperparams(
            "time-to-brake", env_id, inputs=("ffi",), camera="fovea", seed=2
        )
        seeds = [recording_sets(config, split)[0].seeds[0] for split in ("train", "validation")]
        assert seeds == [first, VALIDATION_SEED]


def test_unknown_keys_in_a_stored_config_are_rejected():
    values = TrainConfig.from_hyperparams("ppo").to_dict()
    with pytest.raises(ValueError, match="unknown training option 'sed'; did you mean 'seed'"):
        TrainConfig.from_dict(values | {"sed": 1})


@pytest.mark.parametrize(
    ("algo", "algo_kwargs", "message"),
    [
        ("ppo", {"seed": 3}, "unknown hyperparameter of ppo 'seed'"),
        ("time-to-brake", {"seed": 3}, "unknown hyperparameter of time-to-brake 'seed'"),
        (
            "time-to-brake",
            {"mirror": True},
            "mirror .* input 'ffi'; set mirror: false in the file of --hyper",
        ),
        ("ppo", {"learning_rat": 0.1}, "hyperparameter of ppo 'learning_rat'; did you mean 'learning_rate'"),
        (
            "time-to-brake",
            {"epochs": 3},
            "unknown hyperparameter of time-to-brake 'epochs'; did you mean 'n_epochs'",
        ),
        ("time-to-brake", {"batch_size": 0}, "batch_size must be a whole number >= 1, got 0"),
        ("time-to-brake", {"weight_decay": -1.0}, r"weight_decay must be in \[0, 1\]"),
        ("time-to-brake", {"dropout": 1.0}, r"dropout must be in \[0, 0.9\]"),
        ("time-to-brake", {"mirror": -1}, "mirror must be true or false, got -1"),
        ("time-to-brake", {"learning_rate": 0.0}, "learning_rate must be a number > 0"),
    ],
)
def test_invalid_algorithm_arguments_are_rejected(tmp_path, algo, algo_kwargs, message):
    config = TrainConfig.from_hyperparams(algo, inputs=("ffi",), camera="fovea", algo_kwargs=algo_kwargs)
    with pytest.raises(ValueError, match=message):
        train(config, tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--algo", "pppo"], "unknown algorithm 'pppo'; did you mean 'ppo'?"),
        (["--inputs", "spikes"], "unknown policy input 'spikes'"),
        (["--camera", "fovae"], "did you mean 'fovea'?"),
        (["--hyperparams", "missing.yml"], "hyperparameters 'missing.yml' cannot be read"),
        (["--resume", "missing"], "'missing' contains no training to resume"),
        (["--inputs", "zones", "--camera", "wide"], "train with --sensors-of stopping-zone"),
        (["--sensors-of", "stopping-zone", "--camera", "wide"], "use either camera or sensors_of"),
        (["--n-timesteps", "0"], "n_timesteps must be in [1, inf), got 0"),
        (["--jobs", "0"], "jobs must be a whole number >= 1, got 0"),
        (["--extra-levels", "3:CCRs"], "extra_levels requires algo 'time-to-brake', got 'dqn'"),
        (["--error-levels", "3:CCRs"], "error_levels requires algo 'time-to-brake', got 'dqn'"),
        (
            ["--extra-traffic", "3:merge"],
            "extra_traffic requires algo 'time-to-brake', got 'dqn'",
        ),
        (
            ["--traffic-episodes", "3"],
            "traffic_episodes requires algo 'time-to-brake', got 'dqn'",
        ),
        (["--eval-episodes", "0"], "eval_episodes must be in [1, inf), got 0"),
    ],
)
def test_command_prints_one_line_for_invalid_options(arguments, message, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["train", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error
    assert list(tmp_path.iterdir()) == []


def test_command_rejects_unknown_hyperparameters_in_a_file(tmp_path, capsys):
    file = write_yaml(tmp_path, RECORDED_YAML.replace("batch_size", "batchsize"))
    out = tmp_path / "run"
    assert cli.run(["train", "--algo", "time-to-brake", "--hyperparams", str(file), "--out", str(out)]) == 2
    assert "did you mean 'batch_size'" in capsys.readouterr().err
    assert not out.exists()


EXTRACTOR = {"features_extractor_class": "x"}
WITHOUT_LAYERS = {"mirror": False, "n_networks": 2, "policy_kwargs": {"net_arch": {"vf": [8]}}}


@pytest.mark.parametrize(
    ("algo", "options", "message"),
    [
        ("ppo", {"policy": "MlpPolicyX"}, "cannot make ppo .*MlpPolicyX"),
        ("ppo", {"algo_kwargs": {"learning_rate": "lin_abc"}}, "cannot make ppo .*abc"),
        ("dqn", {"algo_kwargs": {"train_freq": "often"}}, "cannot make dqn "),
        (
            "time-to-brake",
            {"algo_kwargs": {"policy_kwargs": {"foo": 1}}},
            "cannot make time-to-brake .*'foo'",
        ),
        (
            "time-to-brake",
            {"algo_kwargs": {"policy_kwargs": {"activation_fn": "ReLU"}}},
            "cannot make time-to",
        ),
        (
            "time-to-brake",
            {"algo_kwargs": {"policy_kwargs": {"net_arch": "abc"}}},
            "cannot make time-to-brake",
        ),
        ("time-to-brake", {"algo_kwargs": {"policy_kwargs": EXTRACTOR}}, "cannot make time-to-brake "),
        ("time-to-brake", {"algo_kwargs": WITHOUT_LAYERS}, "net_arch of an ensemble must contain 'pi'"),
    ],
)
def test_an_algorithm_that_cannot_be_made_is_rejected_before_the_training(algo, options, message):
    features = FeatureConfig(inputs=("ego_speed",), history=1)
    options |= {"features": features, "demands": DEMANDS[algo]}
    config = TrainConfig(algo=algo, env_id="LGMD/CCRs-v0", camera="fovea", **options)
    with pytest.raises(ValueError, match=message) as caught:
        check_config(config)
    assert "\n" not in str(caught.value)


def test_traffic_is_recorded_with_the_neuron_of_the_levels(tmp_path):
    config = replace(recorded_config(tmp_path), traffic_episodes=1, env_kwargs={"params": {"t_sp": 0.6}})
    _, traffic = recording_sets(config, "train")
    assert traffic.record.__self__.params == {"t_sp": 0.6}


def test_reused_recordings_have_an_absolute_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert config_of(Train(algo="time-to-brake", recordings=Path("other"))).recordings == str(
        tmp_path / "other"
    )


@pytest.mark.parametrize("text", ["all-round", "policy:all-round", "own.zip", "policy:own.zip"])
def test_start_is_a_policy_as_for_agents(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    shutil.copy(find_policy("all-round"), "own.zip")
    expected = tmp_path / "own.zip" if "own" in text else find_policy("all-round").resolve()
    assert config_of(Train(algo="time-to-brake", start=text)).start == str(expected)
