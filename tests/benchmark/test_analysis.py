"""Paired comparisons, detection curves and the report, on hand-made rows and on a small run."""

import json
import re
from math import inf

import numpy as np
import pytest
from support.rows import threat_row

from lgmd_gym import benchmark
from lgmd_gym.benchmark.analysis.compare import (
    change_text,
    compare_rows,
    compare_runs,
    comparison_table,
    difference_figure,
)
from lgmd_gym.benchmark.analysis.froc import (
    OpenLoopTrace,
    alarm_onsets,
    froc_curves,
    froc_figure,
    load_traces,
)
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.cli import main as cli
from lgmd_gym.plotting.figures import trace_figure
from lgmd_gym.report import write_report
from lgmd_gym.statistics.intervals import wilson

AGENTS = ("spike-threshold", "ttc-oracle")
SUITE = """
name = "three-cases"
[[cases]]
family = "CCRs"
speeds_kmh = [10, 30]
[[cases]]
family = "AdjacentPass"
speeds_kmh = [60]
"""


def by_name(comparison):
    return {item.name: item for item in comparison.differences}


def test_differences_are_over_common_episodes():
    a = [threat_row("a", f"s/F/v{n}", avoided=n < 2, speed_reduction=float(n)) for n in range(6)]
    b = [threat_row("b", f"s/F/v{n}", avoided=n < 4, speed_reduction=n + 1.0) for n in range(1, 7)]
    comparison = compare_rows(a, b, ("a", "b"))
    assert (comparison.pairs, comparison.unpaired) == (5, 2)
    avoided, speed = by_name(comparison)["avoided"], by_name(comparison)["speed reduction"]
    assert (avoided.mean_a, avoided.mean_b, avoided.change.value) == pytest.approx((20.0, 60.0, 40.0))
    assert (avoided.higher, avoided.lower, avoided.change.n) == (2, 0, 5)
    assert speed.change[:3] == pytest.approx((3.6, 3.6, 3.6))  # every pair differs by 1 m/s


def test_pairs_with_equal_differences_have_a_wilson_bound():
    rows = [threat_row("a", f"s/F/v{n}", avoided=True) for n in range(6)]
    (avoided,) = compare_rows(rows, rows, ("a", "a")).differences
    assert avoided.deviating_high == pytest.approx(0.39, abs=0.01)
    assert change_text(avoided) == "+0.00 in all pairs (95 %: at most 39 % of pairs differ)"


def test_pairs_of_several_worlds_cluster_by_world():
    """Ten seeds of two cases in the laboratory are two trials, in ten worlds twenty."""
    bounds = {}
    for name in ("laboratory", "worlds"):
        rows = [
            threat_row("a", f"s/F/v{n % 2}", seed=n, world=n // 2 if name == "worlds" else None, avoided=True)
            for n in range(20)
        ]
        comparison = compare_rows(rows, rows, ("a", "a"))
        (avoided,) = comparison.differences
        bounds[str(comparison.sample)] = avoided.deviating_high
        assert str(comparison.sample) in comparison_table(comparison).caption
    assert bounds == {"2 cases in the laboratory": wilson(0, 2)[1], "2 cases in 10 worlds": wilson(0, 20)[1]}


def test_one_case_has_no_interval():
    a, b = (
        [threat_row("a", seed=seed, speed_reduction=x + seed * y) for seed in (0, 1)]
        for x, y in ((0, 0), (1, 1))
    )
    (speed,) = compare_rows(a, b, ("a", "b")).differences
    assert change_text(speed) == "+5.40 (one case, no interval)"


def test_episodes_that_are_a_threat_to_one_agent_only_are_unpaired():
    a, b = threat_row("a", avoided=True), threat_row("b", threat=False, false_activation=False)
    comparison = compare_rows([a], [b], ("a", "b"))
    assert (comparison.pairs, comparison.unpaired, comparison.differences) == (0, 1, ())


def make_series(levels, fps=10):
    """Time series of an ego at 10 m/s with the given spike frequencies."""
    levels = np.asarray(levels, float)
    return {
        "time": np.arange(levels.size) / fps,
        "ego_speed": np.full(levels.size, 10.0),
        "spike_frequency": levels,
    }


def test_alarms_are_events():
    levels = np.zeros(100)
    levels[[10, 11, 15, 40]] = 50  # one alarm from 1.0 to 1.5 s, another at 4.0 s
    assert alarm_onsets(make_series(levels), 30) == pytest.approx([1.0, 4.0])
    assert alarm_onsets(make_series(levels), 60).size == 0


@pytest.fixture
def curves():
    """Curves of three threats with contact at 10 s and of one non-threat, at two thresholds."""
    early, timely, late, non_threat = (np.zeros(101) for _ in range(4))
    early[20:] = 40
    timely[80] = 60
    late[95] = 60
    non_threat[[10, 50]] = 35
    threats = ((40, early), (100, timely), (200, late))
    traces = [
        OpenLoopTrace("clear", f"case{number}", None, shade, 10.0, make_series(levels))
        for number, (shade, levels) in enumerate(threats)
    ]
    traces.append(OpenLoopTrace("clear", "empty", None, None, inf, make_series(non_threat)))
    return froc_curves(traces, 1.0, (50.0, 30.0))


def test_detection_curve_of_hand_made_traces(curves):
    every, dark, asphalt, light = curves["clear"]
    assert [curve.contrast for curve in curves["clear"]] == ["all", "dark", "like asphalt", "light"]
    low, high = every.points
    assert (low.threshold, low.detected.k, low.detected.n, low.false_alarms) == (30.0, 1, 3, 3)
    assert (high.threshold, high.detected.k, high.false_alarms) == (50.0, 1, 0)
    assert low.distance == pytest.approx(3 * 59 + 100)
    assert low.false_per_km == pytest.approx(3000 / 277)
    assert high.false_low == 0.0
    assert high.false_high == pytest.approx(1000 * 3.689 / 277, rel=1e-3)  # Poisson bound of 0 events
    assert [curve.points[0].detected[:2] for curve in (dark, asphalt, light)] == [(0, 1), (1, 1), (0, 1)]
    assert 0.0 < low.chance < 1.0
    assert high.chance == 0.0


@pytest.mark.parametrize(("worlds", "trials"), [((None,) * 4, 1), ((1, 2, 3, 4), 4), ((1, 1, 2, 2), 2)])
def test_detections_cluster_by_case_and_world(worlds, trials):
    levels = np.zeros(101)
    levels[80] = 60
    traces = [OpenLoopTrace("clear", "case", world, 40, 10.0, make_series(levels)) for world in worlds]
    (point,) = froc_curves(traces, 1.0, (50.0,))["clear"][0].points
    assert point.detected == (4, 4, *wilson(trials, trials))


def test_lead_time_of_4_seconds_is_rejected():
    with pytest.raises(ValueError, match=r"lead_time must be in \[0, 4\) s, got 4.0"):
        froc_curves([], lead_time=4.0)


def test_froc_figure_plots_detections_and_chance(curves, tmp_path):
    figure = froc_figure(tmp_path / "froc.svg", curves, lead_time=1.0)
    (axis,) = figure.axes
    assert axis.get_title() == "clear; 0.28 km without threat"
    labels = [text.get_text() for text in axis.get_legend().get_texts()]
    assert labels == [
        "all (n = 3)",
        "chance: random windows",
        "dark (n = 1)",
        "like asphalt (n = 1)",
        "light (n = 1)",
    ]
    np.testing.assert_allclose(axis.lines[0].get_xydata(), [[3000 / 277, 1 / 3], [0.0, 1 / 3]])
    assert [text.get_text() for text in axis.texts] == ["30"]
    assert (tmp_path / "froc.svg").read_text().startswith("<?xml")


def test_difference_figure_plots_every_quantity(tmp_path):
    a = [threat_row("a", f"s/F/v{n}", avoided=n < 2, speed_reduction=float(n)) for n in range(6)]
    b = [threat_row("b", f"s/F/v{n}", avoided=n < 4, speed_reduction=n + 1.0) for n in range(6)]
    comparison = compare_rows(a, b, ("a", "b"))
    figure = difference_figure(tmp_path / "d.png", [comparison])
    assert [axis.get_title() for axis in figure.axes] == ["avoided", "speed reduction"]
    assert [axis.get_xlabel() for axis in figure.axes] == ["B − A [% of threats]", "B − A [km/h]"]
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["b\n− a"]
    zero, interval, mean = figure.axes[0].lines
    change = by_name(comparison)["avoided"].change
    assert list(interval.get_xdata()) == [change.low, change.high]
    assert list(mean.get_xdata()) == [change.value]
    assert list(zero.get_xdata()) == [0.0, 0.0]


def test_trace_figure_plots_frequency_and_speed(tmp_path):
    figure = trace_figure(
        tmp_path / "t.svg", {"a": make_series([0, 40, 80]), "b": make_series([0, 0, 0])}, 30.0
    )
    frequency, speed = figure.axes
    assert list(frequency.lines[0].get_ydata()) == [0, 40, 80]
    assert list(frequency.lines[2].get_ydata()) == [30.0, 30.0]
    assert speed.lines[1].get_ydata() == pytest.approx(36.0)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["a", "b"]


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """Run of two agents, two seeds and two conditions on three cases."""
    folder = tmp_path_factory.mktemp("report")
    (folder / "three-cases.toml").write_text(SUITE)
    config = benchmark.RunConfig(
        suite=str(folder / "three-cases.toml"), agents=AGENTS, seeds=2, conditions=("clear", "rain"), worlds=0
    )
    benchmark.run(config, folder / "run", plots=False)
    return folder / "run"


def test_open_loop_alarms_match_the_alerts_in_the_rows(run_folder):
    """The alarm at T_sf = 30 begins at the alert of `no-brake`, which the neuron raises."""
    traces = load_traces(run_folder)
    assert len(traces) == 3 * 2 * 2
    rows = [json.loads(line) for line in (run_folder / "episodes.jsonl").read_text().splitlines()]
    threats = [row for row in rows if row["agent"] == "no-brake" and row["threat"]]
    threats.sort(key=lambda row: (row["condition"], row["case"], row["seed"]))
    for trace, row in zip([trace for trace in traces if trace.contact_time < inf], threats, strict=True):
        first = alarm_onsets(trace.series, 30.0)[0]
        assert trace.contact_time - first == pytest.approx(row["ttc_at_alert"], abs=0.04)


def test_report_is_one_page_without_external_files(run_folder):
    page = (run_folder / "report.html").read_text()
    links = set(re.findall(r'(?:src|href)="((?!data:)[^"]*)"', page))
    assert all((run_folder / link).is_file() for link in links)
    assert {"episodes.csv", "figures/froc.svg", "figures/froc.csv", "figures/avoidance-rain.svg"} < links
    assert any(re.fullmatch(r"figures/episode-(clear|rain)-[a-z-]+\.csv", link) for link in links)
    assert "url(" not in page
    assert "{{" not in page
    assert re.findall(r"<h2>(.*?)</h2>", page) == [
        "Conclusion",
        "Scores",
        "Scenario",
        "Figures",
        "Open-loop detection",
        "Paired differences",
        "Selected episodes",
        "False activations",
        "Results per case",
        "Configuration",
    ]
    scores = page.split("<h2>")[2]
    headings = [f"{condition}: 3 cases in the laboratory" for condition in ("clear", "rain")]
    assert re.findall(r"<h3>(.*?)</h3>", scores) == headings
    assert "k/n [95 % interval, clustered by case and world, in %]" in scores
    assert scores.count('<tr data-agent="ttc-oracle"><td>ttc-oracle</td>') == 2
    assert "<h3>smallest stopping margin: three-cases/CCRs/v" in page
    assert page.count("data:image/jpeg") >= 4


def test_report_of_an_interrupted_run_states_that_it_is_incomplete(tmp_path):
    (tmp_path / "three-cases.toml").write_text(SUITE)

    def interrupt(row):
        raise KeyboardInterrupt

    config = benchmark.RunConfig(suite=str(tmp_path / "three-cases.toml"), agents=AGENTS, seeds=1)
    run = Run.new(config, tmp_path / "run")
    assert not run.play(interrupt)
    page = write_report(tmp_path / "run").read_text()
    assert "The run is incomplete." in page
    assert "Episodes: 1; agents: 3; seeds: 1; camera:" in page
    assert "Paired differences" not in page


def test_command_compares_agents_within_a_run(run_folder, tmp_path, capsys):
    assert cli.run(["compare", str(run_folder), "--out", str(tmp_path / "d.png")]) == 0
    text = capsys.readouterr().out
    assert "A = spike-threshold   B = ttc-oracle   6 pairs rain" in text
    assert re.search(r"TTC at braking \[s\] .* of \d", text)
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")


def test_command_compares_two_runs(run_folder, capsys):
    assert cli.run(["compare", str(run_folder), str(run_folder)]) == 0
    text = capsys.readouterr().out
    assert "A = run: ttc-oracle   B = run: ttc-oracle" in text
    assert "+0.00 in all pairs" in text
    assert {item.pairs for item in compare_runs(run_folder, run_folder)} == {6}


def test_command_rejects_invalid_options(run_folder, tmp_path, capsys):
    (tmp_path / "d.png").touch()
    for arguments, message in [
        ([str(run_folder), "--out", str(tmp_path / "d.png")], "exists; choose another"),
        ([str(tmp_path)], "no run"),
        ([str(run_folder), "--agents", "ttc-oracl", "no-brake"], "did you mean 'ttc-oracle'"),
        ([str(run_folder), "--agents", "ttc-oracle"], "agents must be two, one of A and one of B, got 1"),
    ]:
        assert cli.run(["compare", *arguments]) == 2
        assert message in capsys.readouterr().err
