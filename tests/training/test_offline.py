"""Learning from recorded drives: that records tell what driving does, and that the sums are right."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from support.recordings import YAML, made_up, order

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.policies.policy import read_card
from lgmd_gym.cli import main as cli
from lgmd_gym.training.config import Order
from lgmd_gym.training.offline.episodes import Drive, record
from lgmd_gym.training.offline.hyperparameters import Recipe
from lgmd_gym.training.offline.onsets import STRAIGHT
from lgmd_gym.training.trainer import Training

torch = pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from lgmd_gym.training.offline.dataset import Lessons  # noqa: E402
from lgmd_gym.training.offline.learner import Learner, dearer, expected_return  # noqa: E402


def test_lessons_show_what_the_policys_view_shows(tmp_path):
    """History is put together from indices: compared with the wrapper itself, step by step."""
    plan = order(tmp_path).plan()
    drives = record(plan, "train", range(2), 1, lambda count: None)
    batch = Lessons(drives, FeatureConfig.from_dict(plan.features)).batch([1, 0])
    view = plan.make_env("train")
    row = 0
    for seed in (1, 0):
        shown, _ = view.reset(seed=seed)
        done, moment = False, 0
        while not done:
            assert (int(batch.place[0][row]), int(batch.place[1][row])) == (1 - seed, moment)
            for name, value in shown.items():
                assert batch.shown[name][row].tolist() == pytest.approx(value.tolist(), abs=1e-6)
            shown, reward, terminated, truncated, _ = view.step(0)
            assert plan.features["reward_scale"] * float(batch.rewards[1 - seed, moment]) == pytest.approx(
                reward
            )
            row, moment, done = row + 1, moment + 1, terminated or truncated
    assert row == len(batch.shown["ego_speed"])
    assert batch.valid.sum() == row
    assert batch.threats.tolist() == [drives[1].threat, drives[0].threat]


def test_a_policy_of_three_decisions_each_learns_from_every_third():
    drive = made_up(11, frame=True)
    shown = Lessons([made_up(4, seed=1, frame=True), drive], FeatureConfig(("frame", "ego_speed"), 1, 3, 1))
    batch = shown.batch([1])
    assert batch.valid.tolist() == [[1.0] * 4]
    assert batch.returns[0].tolist() == drive.returns[::3].tolist()
    assert batch.contacts[0].tolist() == drive.contacts[::3].tolist()
    sums = [drive.rewards[first : first + 3].sum() for first in (0, 3, 6, 9)]
    assert batch.rewards[0].tolist() == pytest.approx(sums, abs=1e-6)
    assert np.array_equal(np.moveaxis(batch.shown["frame"].numpy(), 1, -1), drive.frames[::3])


def test_frames_have_their_history_in_the_channels():
    features = FeatureConfig(inputs=("frame", "ego_speed"), history=3, repeat=1)
    drives = [made_up(2, frame=True), made_up(4, seed=1, frame=True)]
    shown = Lessons(drives, features).batch([1]).shown["frame"]
    assert shown.shape == (4, 6, 40, 40)
    wanted = np.concatenate([drives[1].frames[index] for index in (1, 2, 3)], axis=-1)
    assert np.array_equal(shown[3].numpy(), np.moveaxis(wanted, -1, 0))


def test_the_expected_return_is_that_of_drawn_episodes():
    drives = [made_up(5), made_up(3, seed=1, threat=False)]
    batch = Lessons(drives, FeatureConfig(inputs=("ego_speed",), history=1, repeat=1)).batch([0, 1])
    logits = torch.randn(2, 5, generator=torch.Generator().manual_seed(0))
    told = expected_return(logits, batch)
    rng = np.random.default_rng(0)
    for index, drive in enumerate(drives):
        chance = 1 / (1 + np.exp(-logits[index].numpy()))
        drawn = []
        for _ in range(20_000):
            total = 0.0
            for moment in range(len(drive)):
                if rng.random() < chance[moment]:
                    total += drive.returns[moment]
                    break
                total += drive.rewards[moment]
            drawn.append(total)
        error = np.std(drawn) / np.sqrt(len(drawn))
        assert float(told[index]) == pytest.approx(np.mean(drawn), abs=4 * error)


def test_false_braking_gets_dearer_and_nothing_else():
    drives = [made_up(5), made_up(3, seed=1, threat=False)]
    batch = Lessons(drives, FeatureConfig(inputs=("ego_speed",), history=1, repeat=1)).batch([0, 1])
    dear = dearer(batch, 3.0)
    assert torch.equal(dear.returns[0], batch.returns[0])
    for moment in range(3):
        held = float(drives[1].rewards[moment:].sum())
        wanted = held + 3.0 * (float(drives[1].returns[moment]) - held)
        assert float(dear.returns[1, moment]) == pytest.approx(wanted, abs=1e-5)
    assert dear.returns[1, 3:].tolist() == [0.0, 0.0]
    assert torch.allclose(dearer(batch, 1.0).returns, batch.returns, atol=1e-6)


def learner(tmp_path, drives, judges, **changes):
    plan = order(tmp_path).plan()
    features = {**plan.features, "inputs": ["spike_frequency", "ego_speed"], "repeat": 1}
    model = {"n_epochs": 60, "batch_size": 8, "learning_rate": 0.03, **changes}
    return Learner(replace(plan, features=features, model=model), drives, judges)


def told_apart(count, seed):
    """Drives in which a spike says that it is time: braking there is worth 5, anywhere else it costs 5."""
    rng, drives = np.random.default_rng(seed), []
    for number in range(count):
        length, threat = int(rng.integers(5, 9)), number % 2 == 0
        when = int(rng.integers(1, length - 1))
        drive = made_up(length, seed=number, threat=threat)
        spikes = np.zeros((length, 1), np.float32)
        returns = np.full(length, -5.0, np.float32)
        if threat:
            spikes[when], returns[when] = 200.0, 5.0
        contacts = np.arange(length) != when if threat else np.zeros(length, bool)
        seen = {**drive.seen, "spike_frequency": spikes}
        drives.append(Drive(seen, None, np.full(length, -0.1, np.float32), returns, contacts, threat))
    return drives


def test_it_learns_what_can_be_learnt(tmp_path):
    taught = learner(tmp_path, told_apart(40, 0), told_apart(20, 1))
    before = taught.look()
    assert (before.avoided, before.false) == (0.0, 0.0)  # it does not brake before it has learnt to
    logged = []
    taught.learn(lambda number, reached: logged.append((number, reached)))
    assert [number for number, _ in logged] == list(range(1, 61))
    after = taught.look()
    assert (after.avoided, after.false) == (1.0, 0.0)
    assert after.ret == pytest.approx(taught.best.ret) == pytest.approx(logged[-1][1]["best"])
    threats = [drive for drive in told_apart(20, 1) if drive.threat]
    wanted = [5.0 - 0.1 * int(drive.returns.argmax()) for drive in threats]
    wanted += [-0.1 * len(drive) for drive in told_apart(20, 1) if not drive.threat]
    assert after.ret == pytest.approx(np.mean(wanted), abs=1e-4)


def test_certainty_has_its_price(tmp_path):
    """Where braking is always wrong, one that pays for being sure goes on trying it."""
    quiet = [made_up(8, seed=seed, threat=False) for seed in range(12)]
    drives = [replace(drive, returns=np.full(8, -5.0, np.float32)) for drive in quiet]
    best, reached = np.mean([drive.rewards.sum() for drive in drives]), []
    for decay in (0.0, 0.05):
        learner(tmp_path, drives, drives, logit_decay=decay).learn(
            lambda number, told: reached.append(told["train"])
        )
    assert reached[59] == pytest.approx(best, abs=0.1)
    assert reached[119] < best - 0.5


def test_a_look_plays_each_drive_to_its_first_braking(tmp_path):
    drives = [made_up(4), made_up(3, seed=1, threat=False), made_up(5, seed=2)]
    taught = learner(tmp_path, drives, drives)
    table = torch.tensor([[-1.0, 2, -1, 3, 0], [-1, -1, -1, 9, 9], [-1, -1, -1, 1, -1]])
    taught.logits = lambda batch: table
    look = taught.look()
    ends = [
        drives[0].rewards[0] + drives[0].returns[1],
        drives[1].rewards.sum(),  # what lies beyond its end is no decision
        drives[2].rewards[:3].sum() + drives[2].returns[3],
    ]
    assert look.ret == pytest.approx(np.mean(ends), abs=1e-6)
    assert (look.avoided, look.false) == (0.5, 0.0)


def test_a_look_tells_levels_from_traffic(tmp_path):
    levels = [made_up(4), made_up(3, seed=1, threat=False)]
    pieces = [made_up(3, seed=seed, threat=False) for seed in (2, 3)]
    plan = replace(order(tmp_path).plan(), eval_episodes=2)
    features = {**plan.features, "inputs": ["ego_speed"], "repeat": 1}
    plan = replace(plan, features=features, model={"n_epochs": 1})
    taught = Learner(plan, levels, levels + pieces, pieces=2)
    table = torch.tensor([[-1.0] * 4, [-1.0] * 4, [-1.0, 1, -1, -1], [-1.0] * 4])
    taught.logits = lambda batch: table
    look = taught.look()
    assert (look.avoided, look.false, look.traffic) == (0.0, 0.0, 0.5)
    ends = [drive.rewards.sum() for drive in (*levels, pieces[1])]
    ends.append(pieces[0].rewards[0] + pieces[0].returns[1])
    assert look.ret == pytest.approx(np.mean(ends), abs=1e-6)


def test_a_look_at_records_tells_what_driving_returns(tmp_path):
    plan, seeds = order(tmp_path, inputs=("spike_peak", "ffi", "ego_speed")).plan(), range(5)
    drives = record(plan, "validation", seeds, 1, lambda count: None)
    plan = replace(plan, model={"n_epochs": 60, "batch_size": 5, "learning_rate": 0.03})
    taught = Learner(plan, drives, drives)
    taught.learn(lambda number, reached: None)  # by heart
    view, driven, onsets = plan.make_env("validation"), [], []
    for seed in seeds:
        shown, _ = view.reset(seed=seed)
        total, done, onset = 0.0, False, 0
        while not done:
            action = taught.model.predict(shown, deterministic=True)[0]
            shown, reward, terminated, truncated, _ = view.step(action)
            total, done, onset = total + float(reward), terminated or truncated, onset + int(action == 0)
        driven.append(total)
        onsets.append(onset)
    assert len(set(onsets)) > 3
    assert taught.look().ret == pytest.approx(np.mean(driven), abs=3 * STRAIGHT)


def test_it_learns_the_same_twice(tmp_path):
    weights = []
    for _ in range(2):
        taught = learner(tmp_path, told_apart(12, 0), told_apart(6, 1), n_epochs=3)
        taught.learn(lambda number, reached: None)
        weights.append([value.numpy().tobytes() for value in taught.model.policy.state_dict().values()])
    assert weights[0] == weights[1]


def test_drives_are_kept_and_learnt_from_again(tmp_path, monkeypatch):
    """The whole way by the command; a second training takes the first one's drives and other inputs."""
    hyper = str(order(tmp_path).hyperparams)
    common = ["train", "--algo", "recorded", "--camera", "fovea", "--hyperparams", hyper, "--jobs", "1"]
    first, second = tmp_path / "first", tmp_path / "second"
    assert cli.run([*common, "--eval-episodes", "4", "--out", str(first)]) == 0
    monkeypatch.setattr("lgmd_gym.training.offline.splits.record", None)  # nothing is recorded anew
    again = [*common, "--eval-episodes", "3", "--steps", "5", "--inputs", "ffi", "ego_speed"]
    assert cli.run([*again, "--drives", str(first), "--out", str(second)]) == 0
    assert not (second / "drives").exists()
    assert len((second / "log" / "progress.csv").read_text().splitlines()) == 1 + 3
    card = read_card(second / "policy.zip")
    assert card["algo"] == "ppo"
    assert card["config"]["algo"] == "recorded"
    assert card["config"]["drives"] is None  # a path is nobody's business
    agent = make_agent(f"policy:{second / 'policy.zip'}")
    observation, info = gym.make("LGMD/CCRs-v0", camera=agent.camera).reset(seed=0)
    assert agent.act(observation, info).shape == (1,)
    assert cli.run(["train", "--resume", str(first)]) == 0  # goes on from the drives


@pytest.mark.parametrize("demands", [(0.0, -0.4), (0.0, -0.5, -1.0), (-1.0,), (), (0.3, -1.0)])
def test_it_takes_holding_and_hard_braking_only(demands):
    with pytest.raises(ValueError, match=r"demands must be 0 and -0\.5 or less, as 0 -1"):
        Order("recorded", demands=demands)


def test_orders_that_cannot_be_are_refused(tmp_path):
    with pytest.raises(ValueError, match="'recorded' learns from; dqn drives itself"):
        Order("dqn", demands=(0.0, -1.0), drives=tmp_path)
    wanted = order(tmp_path)
    with pytest.raises(ValueError, match="'speed_change' teaches little and misleads"):
        replace(wanted, inputs=("zones", "speed_change")).plan()
    wanted.hyperparams.write_text(YAML.replace("latch: true", "latch: false"))
    with pytest.raises(ValueError, match="need latch: true"):
        wanted.plan()
    with pytest.raises(ValueError, match="did you mean 'n_epochs'"):
        Recipe.from_dict({"epochs": 3})
    with pytest.raises(ValueError, match="batch_size must be a whole number >= 1, got 0"):
        Recipe.from_dict({"batch_size": 0})
    with pytest.raises(ValueError, match=r"logit_decay must be in \[0, 1\]"):
        Recipe.from_dict({"logit_decay": -1.0})
    with pytest.raises(ValueError, match="first_chance"):
        Recipe.from_dict({"first_chance": 1.0})
    wanted.hyperparams.write_text(YAML.replace("batch_size", "batchsize"))
    with pytest.raises(ValueError, match="did you mean 'batch_size'"):
        Training.start(wanted, tmp_path / "run")
    assert not (tmp_path / "run").exists()
