"""Comparisons, detector curves, points and the report, against cases worked out by hand and a small run."""

import json
import re
from math import inf

import numpy as np
import pytest

from lgmd_gym.benchmark.analysis import plots as plots_bench
from lgmd_gym.benchmark.analysis.compare import compare_rows, compare_runs
from lgmd_gym.benchmark.analysis.froc import Trace, curves, load_traces, onsets
from lgmd_gym.benchmark.analysis.ncap_points import points_2023, points_2026
from lgmd_gym.benchmark.episode import SERIES
from lgmd_gym.benchmark.rows import KEYS
from lgmd_gym.benchmark.run_cases import Run
from lgmd_gym.benchmark.statistics import cluster_mean
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.cli import main as cli
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.report import write_report

SUITE = """
name = "mine"
[[cases]]
family = "CCRs"
speeds_kmh = [10, 30]
[[cases]]
family = "AdjacentPass"
speeds_kmh = [60]
"""


def row(agent, case, seed=0, **values):
    base = {"agent": agent, "case": case, "seed": seed, "condition": "clear", "threat": True}
    return dict.fromkeys(KEYS) | base | values


def test_cluster_bootstrap():
    """Ten copies of each of four values know no more than the four."""
    values, clusters = [0.0, 1.0, 2.0, 9.0], list("abcd")
    once = cluster_mean(values, clusters)
    copies = cluster_mean(values * 10, clusters * 10)
    assert once.value == copies.value == 3.0
    assert (once.low, once.high) == pytest.approx((copies.low, copies.high))
    loose = cluster_mean(values * 10, range(40))
    assert loose.high - loose.low < 0.5 * (copies.high - copies.low)
    assert cluster_mean(values[::-1], clusters[::-1]) == once
    # Mean of n normal values: the interval has the textbook's width.
    drawn = np.random.default_rng(1).normal(size=400)
    found = cluster_mean(list(drawn), range(400))
    assert found.high - found.low == pytest.approx(2 * 1.96 * drawn.std() / 20, rel=0.05)
    assert cluster_mean([], []).value is None


def test_paired_differences_use_only_pairs():
    a = [row("a", f"s/F/v{n}", avoided=n < 2, speed_reduction=float(n)) for n in range(6)]
    b = [row("b", f"s/F/v{n}", avoided=n < 4, speed_reduction=n + 1.0) for n in range(1, 7)]
    found = compare_rows(a, b, ("a", "b"))
    assert (found.pairs, found.alone) == (5, 2)
    by_name = {line.name: line for line in found.differences}
    avoided, speed = by_name["avoided"], by_name["speed reduction"]
    assert (avoided.a, avoided.b, avoided.change.value) == pytest.approx((20.0, 60.0, 40.0))
    assert (avoided.better, avoided.worse) == (2, 0)
    assert speed.change[:3] == pytest.approx((3.6, 3.6, 3.6))  # every pair differs by 1 m/s
    same = compare_rows(a, a, ("a", "a"))
    assert {line.name: line for line in same.differences}["avoided"].other_high == pytest.approx(
        0.39, abs=0.01
    )


def series(levels, fps=10):
    values = {name: np.zeros(len(levels)) for name in SERIES}
    values["time"], values["ego_speed"] = np.arange(len(levels)) / fps, np.full(len(levels), 10.0)
    values["spike_frequency"] = np.asarray(levels, float)
    return values


def test_alarms_are_events():
    levels = np.zeros(100)
    levels[[10, 11, 15, 40]] = 50  # one from 1.0 to 1.5 s, another at 4.0 s
    assert onsets(series(levels), "spike_frequency", 30) == pytest.approx([1.0, 4.0])
    assert onsets(series(levels), "spike_frequency", 60).size == 0


def test_detector_curve_by_hand():
    early, good, late, quiet = (np.zeros(101) for _ in range(4))
    early[20:] = 40  # contact at 10 s: before 6 s an alarm is false, and then it is no detection
    good[80] = 60
    late[95] = 60
    quiet[[10, 50]] = 35
    threats = [
        Trace("clear", shade, 10.0, series(levels))
        for shade, levels in ((40, early), (100, good), (200, late))
    ]
    found = curves([*threats, Trace("clear", None, inf, series(quiet))], 1.0, (30.0, 50.0))["clear"]
    assert [curve.group for curve in found] == ["all", "dark", "like asphalt", "light"]
    low, high = found[0].points
    assert (low.detected.k, low.detected.n, low.false) == (1, 3, 3)
    assert (high.detected.k, high.false) == (1, 0)
    assert low.distance == pytest.approx(3 * 59 + 100)
    assert low.false_per_km == pytest.approx(3000 / 277)
    assert high.false_low == 0.0
    assert high.false_high == pytest.approx(1000 * 3.689 / 277, rel=1e-3)  # 0 events: Poisson's upper bound
    assert [curve.points[0].detected[:2] for curve in found[1:]] == [(0, 1), (1, 1), (0, 1)]
    assert 0.0 < low.chance < 1.0
    assert high.chance == 0.0


def ncap(suite, agent, contact):
    rows = []
    for case in SUITES[suite].cases:
        speed = case.scenario.ego_speed
        hit = contact(case, round(speed / KMH))
        speeds = {"impact_speed": speed, "relative_impact_speed": speed} if hit else {}
        rows.append(row(agent, case.name, ego_speed=speed, target_speed=0.0, collision=hit, **speeds))
    return rows


def test_points_of_the_perfect_and_the_gated():
    perfect = points_2023(ncap("ncap2023", "a", lambda case, speed: False), "a")
    assert [(item.earned, item.of) for item in perfect] == [(14, 14), (6, 6), (15, 15), (4, 4)]
    assert sum(
        item.earned for item in points_2026(ncap("ncap2026", "a", lambda *_: False), "a")
    ) == pytest.approx(5.2)
    gated = points_2023(ncap("ncap2023", "a", lambda case, speed: speed == 10), "a")
    assert gated[0].earned == 0.0
    assert "no points" in gated[0].note
    # Contact at 40 km/h, aligned: 2 of the row's 6 parts of its 1 point.
    one = points_2023(
        ncap("ncap2023", "a", lambda case, speed: case.name.endswith("CCRs/v40/overlap100")), "a"
    )
    assert one[0].earned == pytest.approx(14 - 2 / 6)
    # A red cell of CCRs' 40 in the standard range, of 1.2 points.
    red = points_2026(
        ncap("ncap2026", "a", lambda case, speed: case.name.endswith("CCRs/v50/location50")), "a"
    )
    assert red[0].earned == pytest.approx(1.2 * 39 / 40)


@pytest.fixture(scope="module")
def small_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    (folder / "mine.toml").write_text(SUITE)
    run = Run(
        str(folder / "mine.toml"),
        ["spike-threshold", "ttc-oracle"],
        2,
        1,
        folder / "run",
        conditions=["clear", "degraded"],
    )
    assert run.play()
    return folder / "run"


def test_traces_answer_what_the_run_did(small_run):
    """The open-loop alarm at T_sf = 30 begins where the neuron's own alert began in the rows."""
    traces = load_traces(small_run)
    assert len(traces) == 3 * 2 * 2
    rows = [json.loads(line) for line in (small_run / "episodes.jsonl").read_text().splitlines()]
    ahead = [trace for trace in traces if trace.contact < inf]
    rows = [item for item in rows if item["agent"] == "no-brake" and item["threat"]]
    rows.sort(key=lambda item: (item["condition"], item["case"], item["seed"]))
    alerts = [item["ttc_at_alert"] for item in rows]
    for trace, ttc in zip(ahead, alerts, strict=True):
        first = onsets(trace.series, "spike_frequency", 30.0)[0]
        assert trace.contact - first == pytest.approx(ttc, abs=0.04)


def test_report_is_one_page_that_needs_no_network(small_run):
    page = write_report(small_run).read_text()
    assert re.findall(r'(?:src|href)="(?!data:)[^"]*"', page) == []
    assert "url(" not in page
    for words in (
        "<h3>clear</h3>",
        "<h3>degraded</h3>",
        "The neuron as a detector",
        "Agents compared",
        "narrowest stop",
    ):
        assert words in page
    assert page.count("data:image/png") >= 4
    assert "ttc-oracle" in page
    escaped = re.sub(r"<[^>]*>", "", page)
    assert "{{" not in escaped


def test_compare_on_the_command_line(small_run, tmp_path, capsys):
    assert cli.run(["compare", str(small_run), "--out", str(tmp_path / "d.png")]) == 0
    assert "A = spike-threshold   B = ttc-oracle   6 pairs degraded" in capsys.readouterr().out
    assert (tmp_path / "d.png").stat().st_size > 5000
    assert cli.run(["compare", str(small_run), str(small_run)]) == 0
    assert "in all pairs" in capsys.readouterr().out
    for arguments, words in [
        ([str(small_run), "--out", str(tmp_path / "d.png")], "exists and is kept"),
        ([str(tmp_path)], "holds no run"),
        ([str(small_run), "--agents", "ttc-oracl", "no-brake"], "did you mean 'ttc-oracle'"),
        ([str(small_run), "--agents", "ttc-oracle"], "takes two"),
    ]:
        assert cli.run(["compare", *arguments]) == 2
        assert words in capsys.readouterr().err


def test_figures_have_a_file_format(small_run, tmp_path):
    found = compare_runs(small_run, None)
    plots_bench.difference_figure(tmp_path / "d.svg", found)
    assert (tmp_path / "d.svg").read_text().startswith("<?xml")


def test_a_run_broken_off_at_once_still_has_its_report(tmp_path):
    (tmp_path / "mine.toml").write_text(SUITE)

    def stop(row):
        raise KeyboardInterrupt

    agents = ["spike-threshold", "ttc-oracle"]
    broken = Run(str(tmp_path / "mine.toml"), agents, 1, 1, tmp_path / "run")
    assert not broken.play(stop)
    text = write_report(tmp_path / "run").read_text()
    assert "no-brake" in text
    assert "Agents compared" not in text
