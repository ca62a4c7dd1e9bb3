"""Driven episodes, and policies that learn the time to brake from them."""

from dataclasses import replace
from math import inf

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium import spaces
from support.recordings import write_yaml

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.card import read_card
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.statistics.ranks import roc_area
from lgmd_gym.training import TrainConfig, train
from lgmd_gym.training.offline.dataset import StateDataset
from lgmd_gym.training.offline.driving import NUM_ENVS, DriveRecorder, PulseDriver
from lgmd_gym.training.offline.episode_loss import EpisodeTarget, episode_losses
from lgmd_gym.training.offline.episodes import DrivenEpisode, load, record_parallel, save
from lgmd_gym.training.offline.networks import Standardisation
from lgmd_gym.training.offline.time_to_brake import TimeToBrakeLearner, leave_out

ARGUMENTS = {"camera": "fovea", "families": ["CCRs", "EmptyRoad"], "world": "laboratory"}


@pytest.fixture(scope="module")
def episodes():
    return [drive for (drive,) in DriveRecorder("LGMD/RandomBraking-v0", ARGUMENTS).record(range(12))]


def test_episodes_do_not_depend_on_what_else_is_recorded(episodes):
    ((alone,),) = DriveRecorder("LGMD/RandomBraking-v0", ARGUMENTS).record(range(7, 8))
    for name, values in episodes[7].observations.items():
        assert np.array_equal(alone.observations[name], values)
    assert np.array_equal(alone.time_to_brake, episodes[7].time_to_brake)
    assert np.array_equal(alone.demands, episodes[7].demands)
    assert "ego_acceleration" in alone.observations


def test_a_single_environment_with_the_same_demands_is_the_same_episode(episodes):
    for seed in (1, 4):
        episode, config = episodes[seed], {"forecast": {"share": 1.0}}
        env = gym.make("LGMD/RandomBraking-v0", config=config, **ARGUMENTS)
        observation, info = env.reset(seed=seed)
        for index, demand in enumerate(episode.demands):
            assert np.float32(info["ttb"]) == episode.time_to_brake[index]
            assert observation["ego_acceleration"] == episode.observations["ego_acceleration"][index]
            observation, _, terminated, truncated, info = env.step([demand])
        assert terminated or truncated


def test_time_to_brake_while_the_speed_is_held(episodes):
    """It falls by one decision per decision; the engine rounds it to whole decisions."""
    threats = [episode for episode in episodes if episode.threat]
    assert 3 <= len(threats) <= 9
    for episode in threats:
        first = int(np.argmax(episode.demands < 0.0)) if (episode.demands < 0.0).any() else len(episode)
        held = episode.time_to_brake[:first]
        expected = np.maximum(held[0] - np.arange(first) / 30.0, 0.0)
        assert held == pytest.approx(expected, abs=1e-4)
    assert all(np.isinf(item.time_to_brake).all() for item in episodes if item.family == "EmptyRoad")


def test_drivers_brake_at_a_time_to_brake_and_release():
    never = braked_at_once = released = partial = 0
    for seed in range(400):
        driver, demands = PulseDriver(seed), []
        for index in range(300):  # 10 s, the last moment after 5 s
            demands.append(driver.act(index / 30.0, max(5.0 - index / 30.0, 0.0)))
        values = np.array(demands)
        assert ((values == 0.0) | (values == -1.0) | ((values >= -0.6) & (values <= -0.2))).all()
        never += (values == 0.0).all()
        braked_at_once += values[0] < 0.0
        onset = int(np.argmax(values < 0.0))
        released += bool((values[onset:] == 0.0).any())
        partial += values[onset] > -1.0 and values[onset] < 0.0
    assert never / 400 == pytest.approx(0.35, abs=0.08)  # three standard deviations
    assert braked_at_once == 0
    assert released > 100
    assert partial / (400 - never) == pytest.approx(0.2, abs=0.08)
    onsets = []  # times to brake at which drivers begin to brake
    for seed in range(400):
        driver = PulseDriver(seed)
        found = (reserve for reserve in np.arange(4.0, 0.0, -1 / 30) if driver.act(0.0, reserve) < 0.0)
        onsets += [next(found, np.nan)]
    onsets = np.array(onsets)[np.isfinite(onsets)]
    assert onsets.max() == pytest.approx(2.3, abs=0.1)
    assert np.median(onsets) == pytest.approx(1.15, abs=0.25)
    first, second = PulseDriver(3), PulseDriver(3)
    for index in range(300):
        assert first.act(index / 30.0, inf) == second.act(index / 30.0, inf)


def test_levels_without_braking_end_at_the_contact():
    """The time to brake falls from the first decision on; frames are those of a single environment."""
    arguments = ARGUMENTS | {"camera": {"name": "wide", "shape": (24, 32)}, "include_frame": True}
    recorder = DriveRecorder("LGMD/RandomBraking-v0", arguments, shrink=2, brakes=False)
    levels = [episode for (episode,) in recorder.record(range(NUM_ENVS + 1))]
    assert {episode.threat for episode in levels} == {False, True}
    for episode in levels:
        assert not episode.demands.any()
        expected = episode.time_to_brake[0] - np.arange(len(episode)) / 30.0
        assert episode.time_to_brake == pytest.approx(np.maximum(expected, 0.0), abs=1e-4)
        assert (episode.time_to_brake[-1] == 0.0) == episode.threat
    env = gym.make("LGMD/RandomBraking-v0", **arguments)
    observation, _ = env.reset(seed=1)
    for frame in levels[1].observations["frame"]:
        blocks = observation["frame"].reshape(12, 2, 16, 2, 1).mean(axis=(1, 3), dtype=np.float32)
        assert np.array_equal(frame, np.round(blocks))
        observation, _, terminated, truncated, info = env.step(np.zeros(1, np.float32))
    assert terminated or truncated
    assert info["collision"] == levels[1].threat


@pytest.mark.slow
def test_number_of_processes_does_not_change_the_episodes(episodes):
    recorder = DriveRecorder("LGMD/RandomBraking-v0", ARGUMENTS)
    for expected, (found,) in zip(episodes, record_parallel(recorder.record, range(12), jobs=2), strict=True):
        assert expected.time_to_brake.tobytes() == found.time_to_brake.tobytes()
        for name, values in expected.observations.items():
            assert values.tobytes() == found.observations[name].tobytes()


@pytest.mark.parametrize("seeds", [range(0), range(2, 3)])
def test_number_of_episodes_is_that_of_the_seeds(seeds):
    assert len(DriveRecorder("LGMD/RandomBraking-v0", ARGUMENTS).record(seeds)) == len(seeds)


def test_files(tmp_path, episodes):
    save([[episode] for episode in episodes[:3]], tmp_path / "a.npz", {})
    ((again,), *_) = load(tmp_path / "a.npz")
    assert isinstance(again, DrivenEpisode)
    assert np.array_equal(again.time_to_brake, episodes[0].time_to_brake)
    assert (again.threat, again.family) == (episodes[0].threat, episodes[0].family)


def speeds(count, seed, repeat=1):
    """Episodes in which the time to brake is a tenth of the speed, and the agent brakes below 1 s."""
    rng, made = np.random.default_rng(seed), []
    for _ in range(count):
        speed = rng.uniform(0.0, 40.0, (10, 1)).astype(np.float32)
        times = speed[:, 0] / 10.0
        demands = np.where(times < 1.0, -1.0, 0.0).astype(np.float32)
        made.append(DrivenEpisode({"ego_speed": speed}, times, demands, True))
    return StateDataset(made, FeatureConfig(inputs=("ego_speed",), history=1, repeat=repeat), (1.0, 2.0))


def test_intervals_and_decisions_of_the_policy():
    dataset = speeds(2, 0, repeat=3)
    assert len(dataset) == 8  # four of ten decisions each
    times = dataset.features[:, 0].astype(float) * 2.0  # the feature is the speed / 20 m/s
    assert dataset.classes.tolist() == [0 if t < 1.0 else 1 if t < 2.0 else 2 for t in times]
    assert not dataset.braking[[0, 4]].any()  # nothing came before


class Blank(gym.Env):
    observation_space = spaces.Dict({"ego_speed": spaces.Box(-5.0, 5.0, (1,))})
    action_space = spaces.Box(-1.0, 1.0, (1,))


BRAKE = {"limits_s": [1.0, 2.0], "full_s": 1.0, "partial_s": 1.0, "warning_s": 2.0, "present_s": 2.0}


def test_units_that_are_left_out():
    units = leave_out(torch.ones(20_000), 0.3, torch.Generator().manual_seed(0))
    assert sorted({round(value, 4) for value in units.tolist()}) == [0.0, 1.4286]
    assert float(units.mean()) == pytest.approx(1.0, abs=0.02)


def test_an_ensemble_learns_the_intervals_with_any_number_of_threads():
    weights, epochs = [], []
    for jobs in (1, 2):
        options = {"n_networks": 2, "n_epochs": 12, "batch_size": 32, "learning_rate": 0.02}
        learner = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, **options)
        model = learner.learn(speeds(60, 0), speeds(20, 1), lambda _, metrics: epochs.append(metrics), jobs)
        weights.append(torch.cat([value.flatten() for value in model.policy.parameters()]))
    assert torch.equal(*weights)
    assert epochs[-1]["loss"] < 0.3 < 1.0 < epochs[0]["train_loss"]
    assert epochs[-1]["area"] > 0.99
    logits = model.policy.get_distribution({"ego_speed": torch.tensor([[0.2], [0.75], [1.8]])}).distribution
    assert logits.logits.argmax(1).tolist() == [0, 1, 2]  # 4, 15 and 36 m/s


def test_a_training_starts_from_a_network():
    """With a learning rate of almost 0, the odds are those of the network."""
    first = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, n_epochs=9, learning_rate=0.02)
    start, data = first.learn(speeds(60, 0), speeds(20, 1)).policy, speeds(30, 2)
    options = {"start": start, "n_epochs": 1, "learning_rate": 1e-9, "seed": 5}
    learner = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, **options)
    learner.learn(speeds(60, 3), speeds(20, 1))
    assert learner.odds(data) == pytest.approx(first.odds(data), abs=1e-3)
    trained = []
    for share in (0.0, 0.5):
        options = {"start": start, "n_epochs": 1, "learning_rate": 0.01, "start_share": share}
        learner = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, **options)
        trained.append(learner.learn(speeds(60, 3), speeds(20, 1)).policy.action_net.weight)
    assert torch.equal(0.5 * trained[0] + 0.5 * start.action_net.weight, trained[1])
    assert not torch.equal(*trained)
    with pytest.raises(ValueError, match=r"start_share 0\.25 requires start, .*; set --start"):
        TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, start_share=0.25)
    with pytest.raises(ValueError, match="start requires one network, got n_networks 2"):
        TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, start=start, n_networks=2)
    with pytest.raises(ValueError, match=r"the layers of start, .* are \[\(64, 1\), .* use its net_arch"):
        TimeToBrakeLearner(
            "MultiInputPolicy", Blank(), brake=BRAKE, start=start, policy_kwargs={"net_arch": {"pi": [9]}}
        )


def test_a_start_with_other_activations_is_refused():
    options = {"policy_kwargs": {"activation_fn": torch.nn.Tanh}}
    start = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, **options).networks[0]
    with pytest.raises(ValueError, match="of start are Tanh, those of the training ReLU; use its"):
        TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, start=start)


def test_decisions_in_traffic_have_a_weight():
    """Nothing distinguishes both kinds of episodes: the odds are those of the weights."""
    speed, times = np.full((30, 1), 20.0, np.float32), np.zeros(30, np.float32)
    threat = DrivenEpisode({"ego_speed": speed}, times, np.zeros(30, np.float32), True)
    traffic = replace(threat, time_to_brake=np.full(30, np.inf, np.float32), threat=False, family="traffic")
    dataset = StateDataset(
        [threat, traffic], FeatureConfig(inputs=("ego_speed",), history=1, repeat=1), (1.0, 2.0)
    )
    assert dataset.in_traffic.tolist() == [False] * 30 + [True] * 30
    options = {
        "n_epochs": 300,
        "batch_size": 60,
        "weight_decay": 0.0,
        "dropout": 0.0,
        "traffic_weight": 3.0,
        "learning_rate": 0.05,
    }
    losses = []
    learner = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, **options)
    learner.learn(dataset, dataset, lambda _, metrics: losses.append(metrics["loss"]))
    assert learner.odds(dataset)[:, 0] == pytest.approx(-np.log(3.0), abs=0.02)
    assert losses[-1] == pytest.approx(-0.25 * np.log(0.25) - 0.75 * np.log(0.75), abs=0.03)


def test_the_loss_of_episodes_makes_the_brake_act_in_time():
    """Half of the decisions before a threat look like those of safe episodes, which are three times as many.

    The cross-entropy alone never brakes at such decisions. The brake need act at one of a threat only.
    """
    rng, made = np.random.default_rng(0), []
    for index in range(80):
        threat = index % 4 == 0
        speed = rng.choice([10.0, 20.0] if threat else [10.0], (10, 1)).astype(np.float32)
        times = np.arange(10, 0, -1) / 10.0 - 0.2 if threat else np.full(10, np.inf)
        made.append(DrivenEpisode({"ego_speed": speed}, times.astype(np.float32), np.zeros(10), threat))
    dataset = StateDataset(made, FeatureConfig(inputs=("ego_speed",), history=1, repeat=1), BRAKE["limits_s"])
    losses, weights, brake = [], [], BRAKE | {"confirm_odds": 1.0}
    for weight in (0.0, 1e-6, 3.0):
        options = {"episode_weight": weight, "n_epochs": 40, "batch_size": 100, "learning_rate": 0.01}
        learner = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=brake, dropout=0.0, **options)
        epochs = []
        learner.learn(dataset, dataset, lambda _, metrics, found=epochs: found.append(metrics))
        losses.append(epochs[-1]["episode_loss"])
        found = []
        for learner.episode_weight, learner.warning_weight in ((0.0, 0.0), (2.5, 0.0), (2.5, 1.5)):
            found.append(learner.evaluate(dataset, Standardisation(torch.zeros(1), torch.ones(1))))
        assert len({item.episode_loss for item in found}) == len({item.warning_loss for item in found}) == 1
        assert found[1].loss - found[0].loss == pytest.approx(2.5 * found[0].episode_loss, rel=1e-6)
        assert found[2].loss - found[1].loss == pytest.approx(1.5 * found[0].warning_loss, rel=1e-6)
        weights.append(learner.model.policy.action_net.weight)
    assert losses[2] < 0.6 * min(losses[:2])
    assert not torch.equal(weights[1], weights[2])


def test_the_loss_of_warnings_makes_the_warning_act_in_time():
    """Half of the decisions 2 to 4 s before the last moment look like those of safe episodes."""
    rng, made, brake = np.random.default_rng(0), [], BRAKE | {"limits_s": [1.0, 2.0, 3.0], "warning_s": 3.0}
    for index in range(80):
        threat = index % 4 == 0
        speed = rng.choice([10.0, 20.0] if threat else [10.0], (10, 1)).astype(np.float32)
        times = np.arange(10, 0, -1) / 10.0 + 1.9 if threat else np.full(10, np.inf)
        made.append(DrivenEpisode({"ego_speed": speed}, times.astype(np.float32), np.zeros(10), threat))
    features = FeatureConfig(inputs=("ego_speed",), history=1, repeat=1)
    dataset, losses = StateDataset(made, features, brake["limits_s"]), []
    for weight in (0.0, 3.0):
        options = {"episode_weight": 0.1, "warning_weight": weight, "n_epochs": 40, "batch_size": 100}
        learner = TimeToBrakeLearner(
            "MultiInputPolicy", Blank(), brake=brake, dropout=0.0, learning_rate=0.01, **options
        )
        learner.learn(
            dataset, dataset, lambda _, metrics, found=losses: found.append(metrics["warning_loss"])
        )
    assert losses[-1] < 0.6 * losses[39]


def test_the_step_weighs_both_losses_of_episodes():
    brake = BRAKE | {"limits_s": [1.0, 2.0, 3.0], "warning_s": 3.0}
    learner = TimeToBrakeLearner(
        "MultiInputPolicy", Blank(), brake=brake, episode_weight=2.5, warning_weight=1.5
    )
    logits, every = torch.randn(4, 4, generator=torch.Generator().manual_seed(0)), np.arange(4)
    targets = [EpisodeTarget(every, every[:2], -1.0)]
    braking, warning = episode_losses(logits, [4], targets, learner.brake)
    loss = learner._episode_loss(logits, [4], targets)
    assert loss.item() == pytest.approx(2.5 * braking.item() + 1.5 * warning.item())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"warning_s": 2.0}, "requires a warning_s above 2, got 2; .* 2 to 4 s before the last moment"),
        ({"warning_odds": 50.0}, "requires warning_odds between -50 .* and 50 .*, got 50"),
        ({"full_odds": -50.0}, "requires full_odds between -50 .* and 50 .*, got -50"),
    ],
)
def test_a_warning_that_the_loss_cannot_train(changes, message):
    brake = BRAKE | {"limits_s": [1.0, 2.0, 3.0], "warning_s": 3.0} | changes
    with pytest.raises(ValueError, match=f"warning_weight {message}"):
        TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=brake, episode_weight=1.0, warning_weight=1.0)
    TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=brake, episode_weight=1.0)


def test_training_in_bfloat16_differs_by_rounding():
    weights = []
    for rounded, jobs in ((False, 1), (True, 1), (True, 2)):
        options = {"n_networks": 2, "n_epochs": 12, "batch_size": 32, "bfloat16": rounded}
        learner = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, **options)
        model = learner.learn(speeds(60, 0), speeds(20, 1), jobs=jobs)
        weights.append(torch.cat([value.flatten() for value in model.policy.parameters()]))
    single, rounded, threads = weights
    assert rounded.dtype == torch.float32
    assert torch.equal(rounded, threads)
    assert 0.0 < float((rounded - single).abs().mean()) < 0.1 * float(single.abs().mean())


@pytest.mark.filterwarnings("ignore:invalid value encountered")
def test_a_training_that_diverges():
    learner = TimeToBrakeLearner("MultiInputPolicy", Blank(), brake=BRAKE, n_epochs=1, learning_rate=1e30)
    with pytest.raises(ValueError, match=r"no epoch has a finite validation loss with learning_rate 1e\+30"):
        learner.learn(speeds(60, 0), speeds(20, 1))


def test_area_under_the_roc_curve_is_the_share_of_ordered_pairs():
    rng = np.random.default_rng(0)
    high, low = rng.integers(0, 9, 40), rng.integers(0, 7, 30)
    pairs = [(a > b) + 0.5 * (a == b) for a in high for b in low]
    assert roc_area(high, low) == pytest.approx(np.mean(pairs))
    assert np.isnan(roc_area(high, low[:0]))


YAML = """
default:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper:
        {inputs: [spike_frequency, ffi, ego_speed, ego_acceleration], history: 1}
  n_timesteps: 6
  n_epochs: 2
  mirror: false
  brake: {full_odds: 1.0, release_s: 0.5}
"""


def config(folder, text=YAML, **options):
    options = {"camera": "fovea", "eval_episodes": 3} | options
    return TrainConfig.from_hyperparams(
        "time-to-brake", "LGMD/RandomBraking-v0", write_yaml(folder, text), **options
    )


def test_training_writes_a_policy_with_a_brake(tmp_path):
    path = train(config(tmp_path, extra_levels=("2:CPNA",), traffic_episodes=1), tmp_path / "run")
    agent = make_agent(f"policy:{path}")
    assert (agent.agent.card.brake.full_odds, agent.agent.card.brake.release_s) == (1.0, 0.5)
    assert agent.agent.card.demands is None
    observation = {name: np.zeros(1, np.float32) for name in ("spike_frequency", "ffi", "ego_speed")}
    observation |= {"ego_acceleration": np.zeros(1, np.float32)}
    assert -1.0 <= agent.act(observation, {})[0] <= 0.0
    assert "best_loss" in (tmp_path / "run" / "log" / "progress.csv").read_text()
    again = train(config(tmp_path, recordings=str(tmp_path / "run"), eval_episodes=2), tmp_path / "again")
    assert again.is_file()
    options = {"recordings": str(tmp_path / "run"), "eval_episodes": 2, "seed": 1}
    third = train(config(tmp_path, **options, start=str(again)), tmp_path / "third")
    card = read_card(third)
    assert (card["config"]["start"], card["config"]["seed"]) == (None, 1)  # no local path
    assert (card["start"]["seed"], card["start"]["start"]) == (0, None)
    page = (tmp_path / "third" / "README.md").read_text()
    assert "It starts from the network of another policy" in page
    assert "again" not in page
    assert "starts from" not in (tmp_path / "again" / "README.md").read_text()
    with pytest.raises(ValueError, match="start 'all-round' has other inputs than the training"):
        train(config(tmp_path, **options, start="all-round"), tmp_path / "fourth")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"demands": (0.0, -1.0)}, "has a brake with stages, got demands .* omit demands"),
        ({"text": YAML.replace("history: 1", "history: 1, latch: true")}, "requires latch: false"),
        ({"text": YAML.replace("n_epochs", "epochs")}, "n_epochs"),
        ({"text": YAML.replace("full_odds", "full_odd")}, "full_odds"),
        (
            {"text": YAML.replace("n_epochs: 2", "traffic_weight: 0")},
            r"traffic_weight must be in \[0.01, 100\], got 0",
        ),
        (
            {"text": YAML.replace("n_epochs: 2", "episode_weight: -1")},
            r"episode_weight must be in \[0, 100\], got -1",
        ),
        (
            {"text": YAML.replace("n_epochs: 2", "warning_weight: 0.5")},
            "warning_weight 0.5 requires an episode_weight above 0",
        ),
        (
            {"text": YAML.replace("n_epochs: 2", "warning_weight: -1")},
            r"warning_weight must be in \[0, 100\], got -1",
        ),
        ({"text": YAML.replace("n_epochs: 2", "bfloat16: 1")}, "bfloat16 must be true or false, got 1"),
        ({"text": YAML.replace("history: 1", "history: 2")}, "requires history: 1"),
        ({"n_envs": 2}, "n_envs has no effect with algo 'time-to-brake', got 2; omit it"),
        ({"text": YAML.replace("history: 1", "history: 1, reward_scale: 0.1")}, "reward_scale has no .*0.1"),
        ({"text": YAML.replace("history: 1", "history: 1, shrink: 4")}, "shrink has no effect .*got 4"),
    ],
)
def test_wrong_options(tmp_path, changes, message):
    with pytest.raises(ValueError, match=message):
        train(config(tmp_path, **changes), tmp_path / "run")
    assert not (tmp_path / "run").exists()
