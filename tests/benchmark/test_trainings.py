"""Arms of a run: what is averaged over trainings, and how sure one can be."""

import json
import re

import numpy as np
import pytest

from lgmd_gym.benchmark.analysis.trainings import RETURN, interquartile_mean, judge_rows, judge_run
from lgmd_gym.cli import main as cli


def row(agent, number, value, threat=True, **more):
    told = {"avoided": True if threat else None, "premature_brake": False, "false_activation": False}
    named = {"agent": agent, "case": f"c/{number}", "seed": 0, "condition": "clear", "threat": threat}
    return named | told | {"episode_return": value} | more


def test_interquartile_mean_leaves_out_the_outer_quarters():
    assert interquartile_mean([5.0, -100.0, 1.0, 100.0, 3.0]) == 3.0
    assert interquartile_mean([1.0, 2.0, 6.0]) == 3.0  # too few to leave any out
    assert interquartile_mean([[0, 1, 3, 9], [9, 5, 5, 0]]).tolist() == [2.0, 5.0]


def test_arms_of_hand_worked_rows():
    rows = [
        row("a", 0, 4.0),
        row("a", 1, -2.0, avoided=False),
        row("a", 2, 1.0, False, false_activation=True),
    ]
    rows += [row("b", 0, 6.0), row("b", 1, 6.0), row("b", 2, 3.0, False)]
    one, both = judge_rows(rows, [("one", ["a"]), ("both", ["a", "b"])], "clear")
    assert (one.trainings, one.returned.value, one.less_first) == (1, 1.0, None)
    assert one.returned.low < 1.0 < one.returned.high
    assert (both.name, both.trainings, both.returned, both.spread) == (
        "both",
        2,
        (3.0, None, None, 3),
        (1.0, 5.0),
    )
    assert both.less_first == (2.0, None, None, 3)
    assert both.shares["avoided"] == (0.75, None, None, 2)
    assert both.shares["false_activation"] == (0.5, None, None, 1)
    assert one.shares["avoided"].low < 0.5 < one.shares["avoided"].high
    quiet = judge_rows([row("a", 2, 1.0, False)], [("quiet", ["a"])], "clear")[0]
    assert list(quiet.shares) == ["false_activation"]


def test_copies_of_cases_know_no_more_than_the_cases():
    rng = np.random.default_rng(0)
    values = rng.normal(size=30)
    rows = [row("a", k, float(value), avoided=value > 0) for k, value in enumerate(values)]
    copies = [item | {"seed": seed} for item in rows for seed in range(10)]
    once, often = (judge_rows(item, [("a", ["a"])], "clear")[0] for item in (rows, copies))
    assert often.returned == pytest.approx(once.returned)
    assert often.shares["avoided"] == pytest.approx(once.shares["avoided"])


def test_the_interval_holds_the_truth_nearly_as_often_as_it_says():
    """And for few trainings it gives none."""
    rng = np.random.default_rng(5)
    hits = 0
    for _ in range(60):
        level, skill = 5.0 + rng.normal(0, 3, 40), rng.normal(0, 0.7, 8)
        rows = [
            row(f"p{t}", k, float(level[k] + skill[t] + rng.normal())) for t in range(8) for k in range(40)
        ]
        arm = judge_rows(rows, [("p", [f"p{t}" for t in range(8)])], "clear")[0]
        hits += arm.returned.low <= 5.0 <= arm.returned.high
    assert 53 <= hits <= 60
    assert judge_rows(rows, [("p", ["p0", "p1", "p2"])], "clear")[0].returned.low is None


def test_differences_are_paired():
    """Two arms over very different cases, one always better by a little: the difference is sure."""
    rows = [row("a", k, 10.0 * k) for k in range(20)] + [row("b", k, 10.0 * k + 1 + k % 2) for k in range(20)]
    _, better = judge_rows(rows, [("a", ["a"]), ("b", ["b"])], "clear")
    assert better.less_first.value == 1.5
    assert 1.0 <= better.less_first.low < better.less_first.high <= 2.0
    assert better.returned.high - better.returned.low > 20


def test_arms_whose_agents_played_different_roads_are_refused():
    rows = [row("a", 0, 1.0), row("b", 1, 1.0)]
    for members in ([("x", ["a", "b"])], [("a", ["a"]), ("b", ["b"])]):
        with pytest.raises(ValueError, match="agent 'b' has not played all that 'a' has; resume the run"):
            judge_rows(rows, members, "clear")


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
    assert re.search(r"^ +rule +2 ", text, re.MULTILINE)
    assert re.search(r"ttc-oracle +1 .* 100 \[21, 100\]", text)
    assert [arm.name for arm in judge_run(out)] == ["no-brake", *agents]
    assert cli.run(["judge", str(out), "--arms", "rule=spike-treshold"]) == 2
    assert "did you mean 'spike-threshold'?" in capsys.readouterr().err
    assert cli.run(["judge", str(out), "--arms", "spike-threshold:frames=3"]) == 2
    assert "'spike-threshold:frames=3'; did you mean 'spike-threshold:frames=2'?" in capsys.readouterr().err
    rows = [json.loads(line) for line in (out / "episodes.jsonl").read_text().splitlines()]
    for spoilt, words in (
        ({"error": "oh"}, "1 episodes failed; go on with"),
        ({RETURN: None}, "older version"),
    ):
        lines = [json.dumps(item | (spoilt if k == 3 else {})) for k, item in enumerate(rows)]
        (out / "episodes.jsonl").write_text("".join(line + "\n" for line in lines))
        assert cli.run(["judge", str(out)]) == 2
        assert words in capsys.readouterr().err
