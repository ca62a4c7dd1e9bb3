"""Arms of a run: what is averaged over trainings, and how sure one can be."""

import numpy as np
import pytest

from lgmd_gym import cli
from lgmd_gym.benchmark.judge import interquartile_mean, interval, judge, judge_run


def row(agent, number, value, threat=True, **more):
    told = {"avoided": True if threat else None, "premature_brake": False, "false_brake": False}
    named = {"agent": agent, "case": f"c/{number}", "seed": 0, "condition": "clear", "threat": threat}
    return named | told | {"episode_return": value} | more


def test_interquartile_mean_leaves_out_the_outer_quarters():
    assert interquartile_mean([5.0, -100.0, 1.0, 100.0, 3.0]) == 3.0
    assert interquartile_mean([1.0, 2.0, 6.0]) == 3.0  # too few to leave any out
    assert interquartile_mean([[0, 1, 3, 9], [9, 5, 5, 0]]).tolist() == [2.0, 5.0]


def test_arm_of_hand_worked_rows():
    rows = [row("a", 0, 4.0), row("a", 1, -2.0, avoided=False), row("a", 2, 1.0, False, false_brake=True)]
    rows += [row("b", 0, 6.0), row("b", 1, 6.0), row("b", 2, 3.0, False)]
    arm = judge("both", ["a", "b"], rows)
    assert (arm.name, arm.trainings, arm.value, arm.spread) == ("both", 2, 3.0, (1.0, 5.0))
    assert arm.low < 3.0 < arm.high
    assert (arm.avoided.value, arm.avoided.n) == (0.75, 2)
    assert (arm.false_brakes.value, arm.false_brakes.n) == (0.5, 1)
    assert arm.avoided.low < 0.75 < arm.avoided.high  # n = 2 roads, not 4
    quiet = judge("quiet", ["a"], [row("a", 2, 1.0, False)])
    assert quiet.avoided is None
    assert (quiet.low, quiet.high) == (1.0, 1.0)


def test_the_interval_holds_the_truth_as_often_as_it_says():
    rng = np.random.default_rng(5)
    strata, hits = np.arange(60) < 30, 0
    for _ in range(200):
        levels, skill = rng.normal(0, 4, 60) + 10 * strata, rng.normal(0, 0.7, (5, 1))
        low, high = interval(5.0 + skill + levels - 5.0 + rng.normal(0, 1, (5, 60)), strata, draws=400)
        hits += low <= 5.0 <= high
    assert 170 <= hits <= 198  # 95 % asked; five trainings make it a little narrow


def test_an_arm_whose_agents_played_different_roads_is_refused():
    with pytest.raises(ValueError, match="agent 'b' has not played all that 'a' has; resume the run"):
        judge("x", ["a", "b"], [row("a", 0, 1.0), row("b", 1, 1.0)])


def test_judge_on_the_command_line(tmp_path, capsys):
    out = tmp_path / "run"
    agents = ["spike-threshold", "spike-threshold:frames=2", "ttc-oracle"]
    suite = tmp_path / "mine.toml"
    suite.write_text('name = "mine"\n[[cases]]\nfamily = "CCRs"\nspeeds_kmh = [20]\n'
                     '[[cases]]\nfamily = "EmptyRoad"\nspeeds_kmh = [20]\n')  # fmt: skip
    flags = ["--suite", str(suite), "--seeds", "1", "--jobs", "1", "--no-plots", "--no-report"]
    assert cli.run(["bench", *flags, "--out", str(out), "--agents", *agents]) == 0
    capsys.readouterr()
    assert cli.run(["judge", str(out), "--arms", "rule=spike-threshold*", "ttc-oracle"]) == 0
    text = capsys.readouterr().out
    assert "rule" in text
    assert "ttc-oracle" in text
    assert "100.0 % of 1" in text
    assert [arm.name for arm in judge_run(out, ())] == ["no-brake", *agents]
    assert cli.run(["judge", str(out), "--arms", "rule=spike-treshold"]) == 2
    assert "did you mean 'spike-threshold'?" in capsys.readouterr().err
