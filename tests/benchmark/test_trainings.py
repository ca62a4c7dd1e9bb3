"""Comparison of arms: interquartile mean, bootstrap intervals, and `lgmd-gym compare --arms`."""

import json
import re

import numpy as np
import pytest
from support.rows import threat_row

from lgmd_gym import benchmark
from lgmd_gym.benchmark.analysis.arms import Arm, arm_results, arm_table, compare_arms, parse_arm
from lgmd_gym.cli import main as cli
from lgmd_gym.statistics.bootstrap import interquartile_mean
from lgmd_gym.statistics.intervals import wilson

AGENTS = ("spike-threshold", "spike-threshold:frames=2", "ttc-oracle")
SUITE = """
name = "two-cases"
[[cases]]
family = "CCRs"
speeds_kmh = [20]
[[cases]]
family = "EmptyRoad"
speeds_kmh = [20]
"""


def return_row(agent, number, episode_return, threat=True, **values):
    """Return a row of case `number` with a return, avoided if it is a threat."""
    flags = {"avoided": True if threat else None, "premature_brake": False, "false_activation": False}
    flags |= {"threat": threat, "episode_return": episode_return}
    return threat_row(agent, f"suite/case{number}", **(flags | values))


def results_of(rows, *arms):
    return arm_results(rows, [Arm(name, list(agents)) for name, *agents in arms], "clear")


def test_interquartile_mean_drops_the_outer_quarters():
    assert interquartile_mean([5.0, -100.0, 1.0, 100.0, 3.0]) == 3.0
    assert interquartile_mean([1.0, 2.0, 6.0]) == 3.0
    assert interquartile_mean([[0, 1, 3, 9], [9, 5, 5, 0]]).tolist() == [2.0, 5.0]


def test_shares_cluster_by_case_and_world():
    """All shares are equal, so the interval is Wilson's for one trial per case and world."""
    rows = [
        return_row("a", case, 1.0) | {"seed": seed, "world": seed} for case in (0, 1) for seed in range(5)
    ]
    (worlds,) = results_of(rows, ("a", "a"))
    (laboratory,) = results_of([row | {"world": None} for row in rows], ("a", "a"))
    assert [str(arm.sample) for arm in (worlds, laboratory)] == [
        "2 cases in 5 worlds",
        "2 cases in the laboratory",
    ]
    assert worlds.shares["avoided"].low == pytest.approx(wilson(10, 10)[0])
    assert laboratory.shares["avoided"].low == pytest.approx(wilson(2, 2)[0])
    assert arm_table([worlds], "title").caption.startswith("2 cases in 5 worlds; ")


def test_results_of_one_and_two_trainings():
    rows = [
        return_row("a", 0, 4.0),
        return_row("a", 1, -2.0, avoided=False),
        return_row("a", 2, 1.0, threat=False, false_activation=True),
        return_row("b", 0, 6.0),
        return_row("b", 1, 6.0),
        return_row("b", 2, 3.0, threat=False),
    ]
    one, two = results_of(rows, ("one", "a"), ("two", "a", "b"))
    assert (one.name, one.condition, one.trainings, one.difference) == ("one", "clear", 1, None)
    assert one.mean_return.value == 1.0
    assert one.mean_return.low < 1.0 < one.mean_return.high
    assert one.shares["avoided"].low < 0.5 < one.shares["avoided"].high
    # Two trainings are too few for an interval.
    assert (two.trainings, two.mean_return, two.return_range) == (2, (3.0, None, None, 3), (1.0, 5.0))
    assert two.difference == (2.0, None, None, 3)
    assert two.shares["avoided"] == (0.75, None, None, 2)
    assert two.shares["premature_brake"] == (0.0, None, None, 2)
    assert two.shares["false_activation"] == (0.5, None, None, 1)


def test_shares_without_a_case_are_left_out():
    (result,) = results_of([return_row("a", 2, 1.0, threat=False)], ("only", "a"))
    assert list(result.shares) == ["false_activation"]


def test_further_seeds_of_a_case_do_not_narrow_the_interval():
    values = np.random.default_rng(0).normal(size=30)
    rows = [return_row("a", k, float(value), avoided=bool(value > 0)) for k, value in enumerate(values)]
    copies = [row | {"seed": seed} for row in rows for seed in range(10)]
    (once,), (repeated,) = results_of(rows, ("arm", "a")), results_of(copies, ("arm", "a"))
    assert repeated.mean_return == pytest.approx(once.mean_return)
    assert repeated.shares["avoided"] == pytest.approx(once.shares["avoided"])


@pytest.mark.slow
def test_interval_contains_the_true_return_with_its_nominal_frequency():
    rng, trainings = np.random.default_rng(5), [f"p{index}" for index in range(8)]
    hits = 0
    for _ in range(60):
        level, skill = 5.0 + rng.normal(0, 3, 40), rng.normal(0, 0.7, 8)
        rows = [
            return_row(agent, k, float(level[k] + skill[index] + rng.normal()))
            for index, agent in enumerate(trainings)
            for k in range(40)
        ]
        (result,) = results_of(rows, ("policy", *trainings))
        hits += result.mean_return.low <= 5.0 <= result.mean_return.high
    assert 53 <= hits <= 60  # 57 expected, standard deviation 1.7


@pytest.mark.parametrize(("trainings", "has_interval"), [(1, True), (2, False), (4, False), (5, True)])
def test_two_to_four_trainings_have_no_interval(trainings, has_interval):
    agents = [f"p{index}" for index in range(trainings)]
    rows = [return_row(agent, k, float(k)) for agent in agents for k in range(3)]
    (result,) = results_of(rows, ("policy", *agents))
    assert (result.mean_return.low is not None) is has_interval
    assert (result.shares["avoided"].high is not None) is has_interval


def test_differences_are_paired_by_case():
    """A small but constant gain has a narrow interval although the cases vary widely."""
    rows = [return_row("a", k, 10.0 * k) for k in range(20)]
    rows += [return_row("b", k, 10.0 * k + 1 + k % 2) for k in range(20)]
    _, better = results_of(rows, ("a", "a"), ("b", "b"))
    assert better.difference.value == 1.5
    assert 1.0 <= better.difference.low < better.difference.high <= 2.0
    assert better.mean_return.high - better.mean_return.low > 20


@pytest.mark.parametrize("arms", [[("x", "a", "b")], [("a", "a"), ("b", "b")]])
def test_agents_with_different_episodes_are_rejected(arms):
    rows = [return_row("a", 0, 1.0), return_row("b", 1, 1.0)]
    with pytest.raises(ValueError, match="agents 'b' and 'a' have different episodes; resume the run"):
        results_of(rows, *arms)


def test_arm_of_names_patterns_and_single_agents():
    agents = ["rule:a=1,b=2", "policy:x0.zip", "policy:x1.zip", "oracle"]
    assert parse_arm("oracle", agents) == ("oracle", ["oracle"])
    assert parse_arm("rule:a=1,b=2", agents) == ("rule:a=1,b=2", ["rule:a=1,b=2"])
    assert parse_arm("rule=rule:a=1,b=?", agents) == ("rule", ["rule:a=1,b=2"])
    assert parse_arm("lgmd=policy:*", agents) == ("lgmd", ["policy:x0.zip", "policy:x1.zip"])
    assert parse_arm("both=oracle,policy:x0.zip", agents) == ("both", ["policy:x0.zip", "oracle"])
    for text in ("oracel", "=oracle", "arm=", "arm=oracle,policy:y*"):
        with pytest.raises(
            ValueError,
            match=re.escape(f"unknown arm (an agent of the run, or NAME=AGENT,AGENT,...) {text!r}"),
        ):
            parse_arm(text, agents)


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arms")
    suite = folder / "two-cases.toml"
    suite.write_text(SUITE)
    config = benchmark.RunConfig(suite=str(suite), agents=AGENTS, seeds=1)
    benchmark.run(config, folder / "run", plots=False, report=False)
    return folder / "run"


def test_command_prints_one_line_per_arm(run_folder, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    assert cli.run(["compare", str(run_folder), "--arms", "rule=spike-threshold*", "ttc-oracle"]) == 0
    text = capsys.readouterr().out
    assert re.search(r"^rule +2 ", text, re.MULTILINE)
    assert re.search(r"ttc-oracle +1 .* 100 \[21,100\]", text)


def test_command_makes_every_agent_an_arm_by_default(run_folder, capsys):
    assert cli.run(["compare", str(run_folder), "--arms"]) == 0
    text = capsys.readouterr().out
    assert all(agent.split(":")[0] in text for agent in ("no-brake", *AGENTS))
    assert [result.name for result in compare_arms(run_folder)] == ["no-brake", *AGENTS]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--arms", "rule=spike-treshold"], "did you mean 'spike-threshold'?"),
        (["--arms", "spike-threshold:frames=3"], "did you mean 'spike-threshold:frames=2'?"),
        (
            ["--arms", "ttc-oracle", "--agents", "a", "b"],
            "--arms compares agents of one run; remove --agents",
        ),
        (["--arms", "ttc-oracle", "--out", "a.png"], "remove --out"),
    ],
)
def test_command_rejects_invalid_arms(run_folder, capsys, arguments, message):
    assert cli.run(["compare", str(run_folder), *arguments]) == 2
    assert message in capsys.readouterr().err


def test_run_with_failed_episodes_is_rejected(run_folder, tmp_path):
    rows = [json.loads(line) for line in (run_folder / "episodes.jsonl").read_text().splitlines()]
    rows[3]["error"] = "Traceback"
    (tmp_path / "episodes.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    for name in ("run.toml", "suite.toml"):
        (tmp_path / name).write_text((run_folder / name).read_text())
    with pytest.raises(ValueError, match="1 episode failed; resume it with lgmd-gym bench --resume"):
        compare_arms(tmp_path)
