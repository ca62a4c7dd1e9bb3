"""The scripts of docs/examples on reinforcement learning."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.examples import EXAMPLES, load
from support.recordings import synthetic_episode

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.sides import NUM_ALL_ROUND, NUM_COLUMNS, all_round_cameras
from lgmd_gym.benchmark import get_suite
from lgmd_gym.camera.spec import plain_values
from lgmd_gym.envs.registration import RANDOM, RANDOM_TASKS, make_source
from lgmd_gym.training.offline.storage import save
from lgmd_gym.training.recordings import FORMAT


@pytest.mark.slow
def test_rl_training(capsys):
    """DQN updates its parameters, which stay finite, after its 640 first decisions."""
    torch = pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    model = load("rl_training").main(720, num_envs=4, episodes=4)
    assert model.num_timesteps == 720
    assert model._n_updates == 2 * (720 - 640) / 4
    assert all(bool(torch.isfinite(weight).all()) for weight in model.policy.parameters())
    assert "720 decisions: return" in capsys.readouterr().out


def test_learning_curves(capsys, tmp_path):
    for name, returns in (("dqn0", [[1.0, 2.0], [2.0, 4.0], [0.0, 1.0]]), ("dqn1", [[-1.0, 0.0]] * 3)):
        (tmp_path / name / "best").mkdir(parents=True)
        np.savez(tmp_path / name / "best" / "evaluations.npz", timesteps=[100, 200, 300], results=returns)
    load("learning_curves").main(tmp_path / "curves.png", [tmp_path / "dqn0", tmp_path / "dqn1"])
    assert capsys.readouterr().out.splitlines() == [
        "dqn0: best return 3.00 at 200 decisions, n = 2",
        "dqn1: best return -0.50 at 100 decisions, n = 2",
    ]
    assert (tmp_path / "curves.png").stat().st_size > 5_000


def recorded_decisions(example, false_cost=1.0):
    episodes = [synthetic_episode(length, seed=length, threat=length > 5) for length in (4, 5, 6, 9)]
    features = FeatureConfig(inputs=("ego_speed",), history=1, repeat=2)
    return episodes, example.Decisions([episodes[:3], episodes[3:]], features, false_cost)


def test_recorded_levels_replay_episodes():
    """An episode pays its rewards until it ends or the policy brakes; then another one starts."""
    pytest.importorskip("stable_baselines3")
    example = load("recorded_levels")
    episodes, table = recorded_decisions(example)
    envs = example.RecordedLevels(table, num_envs=1, scale=0.5)
    envs.seed(3)
    envs.reset()
    for brake_at in (None, 1):
        index = int(np.flatnonzero(table.starts == envs._position[0])[0])
        episode, rewards, done, decision = episodes[index], [], False, 0
        while not done:
            _, reward, ends, infos = envs.step(np.array([int(decision == brake_at)]))
            rewards.append(reward[0])
            done, decision = bool(ends[0]), decision + 1
        expected = np.add.reduceat(episode.rewards, range(0, len(episode), 2))
        if brake_at is not None:
            expected = [expected[0], episode.braking_returns[2 * brake_at]]
        assert rewards == pytest.approx([0.5 * value for value in expected])
        assert infos[0]["terminal_observation"]["ego_speed"].shape == (1,)


@pytest.mark.parametrize(("share", "expected"), [(None, 0.5), (0.25, 0.25), (1.0, 1.0)])
def test_share_of_threats_in_recorded_levels(share, expected):
    pytest.importorskip("stable_baselines3")
    example = load("recorded_levels")
    _, table = recorded_decisions(example)  # two of four levels are threats
    envs = example.RecordedLevels(table, num_envs=4000, scale=1.0, threat_share=share)
    envs.seed(0)
    envs.reset()
    starts = np.searchsorted(table.starts, envs._position)
    assert np.mean(table.threats[starts]) == pytest.approx(expected, abs=0.03)


def test_results_of_recorded_levels():
    example = load("recorded_levels")
    episodes, table = recorded_decisions(example)
    never = SimpleNamespace(predict=lambda inputs, deterministic: (np.zeros(len(table.hold), int), None))
    returns, contacts, braked = example.evaluate(never, table)
    assert returns == pytest.approx([episode.rewards.sum() for episode in episodes], abs=1e-6)
    assert contacts.tolist() == [False, False, True, True]
    assert not braked.any()
    first = SimpleNamespace(predict=lambda inputs, deterministic: (np.ones(len(table.hold), int), None))
    returns, contacts, braked = example.evaluate(first, table)
    assert returns == pytest.approx([episode.braking_returns[0] for episode in episodes])
    assert not contacts.any()
    assert braked.all()


def test_false_braking_costs_more_with_the_factor():
    """The return of braking moves away from that of holding, in episodes without a threat only."""
    example = load("recorded_levels")
    episodes, table = recorded_decisions(example, false_cost=3.0)
    for index, episode in enumerate(episodes):
        hold, brake = episode.rewards.sum(), episode.braking_returns[0]
        expected = brake if episode.threat else hold + 3.0 * (brake - hold)
        assert table.cost[table.starts[index]] == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("name", ["offline", "frames"])
def test_arms_are_trained_on_recorded_levels(name, tmp_path, monkeypatch, capsys):
    """The offline arm uses the first levels only; the other arms share their tables with the workers."""
    pytest.importorskip("stable_baselines3")
    example = load("rl_ablations")
    features = {"inputs": ("ego_speed",) if name == "offline" else ("frame", "ego_speed"), "repeat": 2}
    few = {"buffer_size": 200, "learning_starts": 64, "batch_size": 16}
    arm = replace(example.ARMS[name], features=features, algo_kwargs=few)
    monkeypatch.setitem(example.ARMS, name, arm)
    for split, lengths in (("train", range(4, 24)), ("validation", range(4, 8))):
        (tmp_path / "episodes" / split).mkdir(parents=True)
        episodes = [[synthetic_episode(n, seed=n, threat=n % 2 == 0, frames=True)] for n in lengths]
        save(episodes, tmp_path / "episodes" / split / "000000.npz", {"format": FORMAT})
    trained = []
    offline = example.OfflineDataset
    monkeypatch.setattr(
        example, "OfflineDataset", lambda *args: trained.append(len(args[0])) or offline(*args)
    )
    example.main(tmp_path, [name], seeds=1, levels=10, budget=0.002)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "n = 1 seeds, 2 threats and 2 other validation levels"
    assert lines[-1].startswith(f"| {arm.title} | ")
    assert "nan" not in lines[-1]
    assert trained == ([9, 1] if name == "offline" else [])


def test_table_of_ablations_has_the_mean_over_seeds():
    example = load("rl_ablations")
    threats = np.array([True, True, False, False])
    results = np.zeros((5, 3, 4))
    results[:, 0] = 2.0
    results[:, 1, 0] = 1.0  # one of two threats ends in a contact
    results[2:, 2, 3] = 1.0  # three of five seeds brake in one of two non-threats
    row = example.table_row("arm", results, threats)
    assert row == "| arm | 2.00 [2.00, 2.00] | 50 (50–50) | 33 (0–50) |"


def test_leaderboard_prints_a_row_per_agent(monkeypatch, tmp_path, capsys):
    """A run that exists is not repeated."""
    example = load("leaderboard")
    suite = tmp_path / "mine.toml"
    suite.write_text('name = "mine"\n[[cases]]\nfamily = "CCRs"\nspeeds_kmh = [20]\n')
    monkeypatch.setitem(example.RUNS, "levels", {"suite": str(suite), "seeds": 1, "worlds": 0})
    for _ in range(2):
        example.main(["ttc-oracle"], tmp_path / "board", ["levels"])
        lines = capsys.readouterr().out.splitlines()[-3:]
        heading = "mine: avoided, 1 case in the laboratory, clear | levels: false activations"
        assert lines[0] == f"| agent | {heading} |"
        assert lines[2].startswith("| ttc-oracle | 1/1 ")
    assert [path.name for path in (tmp_path / "board").iterdir()] == ["levels"]
    with pytest.raises(ValueError, match="levels' has ttc-oracle, not no-brake; choose another --out"):
        example.main(["no-brake"], tmp_path / "board", ["levels"])
    rows = tmp_path / "board" / "levels" / "episodes.jsonl"
    rows.write_text("".join(rows.read_text().splitlines(keepends=True)[:1]))
    with pytest.raises(ValueError, match="lacks 1 episode; complete it with lgmd-gym bench --resume"):
        example.main(["ttc-oracle"], tmp_path / "board", ["levels"])


def test_easy_levels_are_those_of_the_easy_task():
    """Each case is one validation level, with the default arguments of the id, and is drawn as such."""
    cases = get_suite(str(EXAMPLES / "easy_levels.toml")).cases
    task = RANDOM_TASKS["RandomBrakingEasy"].arguments
    for number, case in enumerate(cases):
        level = {"split": "validation", "start_level": number, "num_levels": 1}
        expected = task | {name: list(task[name]) for name in ("families", "conditions")} | level
        given = dict(case.arguments)
        assert given | {name: list(given[name]) for name in ("families", "conditions")} == expected
        assert case.scenario == make_source(RANDOM, given).first
    assert {case.scenario.family for case in cases} == set(task["families"])
    assert len(cases) == 200


def test_levels_of_the_leaderboard():
    """Held-out levels: each case is one level of the split "test"."""
    cases = [dict(case.arguments) for case in get_suite(str(EXAMPLES / "levels.toml")).cases]
    assert [case["start_level"] for case in cases] == list(range(1000, 1400))
    assert all(case["num_levels"] == 1 and case["split"] == "test" for case in cases)


def test_frontier_of_a_policy():
    """Braking at decision 2 of 8 avoids the contact, at 6 it does not; lead times are 6 and 2 decisions."""
    pytest.importorskip("stable_baselines3")
    example = load("policy_frontier")
    odds = np.array([-1.0, 0.5, 2.0, 3.0])
    assert [example.first_braking(odds, margin, repeat=2) for margin in (0.0, 1.0, 3.0)] == [2, 4, None]
    threats = [synthetic_episode(8, seed=seed) for seed in range(3)]
    others = [synthetic_episode(5, threat=False), synthetic_episode(5, threat=False, traffic=True)]
    row = example.frontier_row(1.0, threats + others, [2, 6, None, 0, None], rate_hz=10.0)
    # Wilson's interval of 1/3: (p + z²/2n ± z √(p (1 - p) / n + z²/4n²)) / (1 + z²/n) with z = 1.96.
    assert row == "| 1 | 1/3 [6.1–79.2] | 0.40 | 1/1 [20.7–100.0] | 0/1 [0.0–79.3] |"


def test_frontier_of_the_shipped_policy(tmp_path, capsys):
    """A margin that every log odds exceed brakes at once, and one that none exceeds never; in all sets."""
    pytest.importorskip("stable_baselines3")
    shapes = dict.fromkeys(("spike_frequency", "membrane_potential", "ffi"), NUM_ALL_ROUND)
    shapes |= {"ego_speed": 1, "ego_yaw_rate": 1, "known_deceleration": 1, "column_potential": NUM_COLUMNS}
    observations = {name: np.full((8, size), 0.5, np.float32) for name, size in shapes.items()}
    threat = replace(synthetic_episode(8), observations=observations)
    segment = replace(synthetic_episode(8, threat=False, traffic=True), observations=observations)
    sets = {"validation": [threat], "extra1-validation": [threat], "extra-traffic1-validation": [segment]}
    for name, episodes in sets.items():
        folder = tmp_path / "episodes" / name
        folder.mkdir(parents=True)
        origin = {"format": FORMAT, "camera": json.loads(json.dumps(plain_values(all_round_cameras())))}
        save([episodes], folder / "000000.npz", origin)
    script = load("policy_frontier")
    script.main(tmp_path, "policy:all-round", margins=(-1000.0, 1000.0))
    rows = capsys.readouterr().out.splitlines()[2:]
    assert [row.split(" | ")[1].split(" ")[0] for row in rows] == ["2/2", "0/2"]
    assert [row.split(" | ")[4].split(" ")[0] for row in rows] == ["1/1", "0/1"]
    with pytest.raises(ValueError, match="were recorded with another camera"):
        script.main(tmp_path, "policy:zones")
