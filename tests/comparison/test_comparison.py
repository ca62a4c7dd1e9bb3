"""Comparison of neuron models: values by hand of its parts, and the command."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from support.clips import write_lossless

from lgmd_gym import neuron
from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.analysis.froc import OpenLoopTrace
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.player import run_task
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.benchmark.task import Task
from lgmd_gym.cli import main as cli
from lgmd_gym.comparison import clips, simulation, stimuli
from lgmd_gym.comparison.clips import ClipResponse
from lgmd_gym.comparison.models import PAGE_MODELS, checked_models, step_models
from lgmd_gym.comparison.simulation import Recording, Worlds
from lgmd_gym.report.document import DataTable, Document, Figure, Section
from lgmd_gym.statistics.intervals import exact_sign_test


def trace(model, frequency, contact=math.inf, case="quick/CCRs/v20", world=1):
    """A recording at 10 Hz and 10 m/s."""
    values = np.array(frequency, float)
    time = np.arange(len(values)) / 10.0
    series = {"time": time, "ego_speed": np.full(len(values), 10.0), "spike_frequency": values}
    found = OpenLoopTrace(model, case, world, 50.0, contact, series)
    task = Task("no-brake", SUITES["quick"].cases[0], 0, SensorConfig())
    return Recording(task, found, Counterfactual(contact < math.inf, contact, 5.0))


def threat(model, alarm_at, level=50.0):
    """A contact after 8 s, with an alarm of half a second from a time [s] on."""
    frequency = np.zeros(80)
    frequency[round(10 * alarm_at) : round(10 * alarm_at) + 5] = level
    return trace(model, frequency, 8.0)


def quiet(model, level=0.0):
    """100 m without contact, with one alarm of a level."""
    return trace(model, [0.0] * 50 + [level] * 5 + [0.0] * 46)


@pytest.mark.parametrize(
    ("gained", "lost", "p"), [(0, 0, 1.0), (6, 0, 0.03125), (3, 1, 0.625), (1, 3, 0.625)]
)
def test_exact_sign_test(gained, lost, p):
    assert exact_sign_test(gained, lost) == pytest.approx(p)


def test_thresholds_are_chosen_by_detections_under_the_cap():
    """At 30 one false alarm in 180 m without threat, at 50 none, at 60 one detection less."""
    recordings = {
        "a": [threat("a", 5.0, 60.0), threat("a", 6.0, 50.0), threat("a", 7.5, 99.0), quiet("a", 30.0)]
    }
    curves = simulation.curves(recordings)
    assert [point.threshold for point in curves["a"]][:4] == [30.0, 50.0, 60.0, 99.0]
    assert [point.detected.k for point in curves["a"]] == [2, 2, 1, 0, 0]
    assert [point.false_alarms for point in curves["a"]] == [1, 0, 0, 0, 0]
    assert curves["a"][0].distance == pytest.approx(3 * 39.0 + 100.0)  # up to 4 s before contact
    chosen = simulation.choose(curves, (0.0, 5.0))
    assert [(item.cap, item.threshold, item.point.detected.k) for item in chosen] == [
        (0.0, 50.0, 2),
        (5.0, 50.0, 2),
    ]
    (applied,) = simulation.apply(chosen[:1], {"a": [threat("a", 5.0, 40.0), quiet("a", 80.0)]})
    assert (applied.point.detected.k, applied.point.detected.n, applied.point.false_alarms) == (0, 1, 1)


def test_levels_include_one_without_alarms():
    assert simulation.levels([quiet("a", 30.0).trace]) == [30.0, pytest.approx(30.03)]
    assert simulation.levels([quiet("a").trace]) == [pytest.approx(1.001)]
    many = trace("a", np.arange(500.0)).trace
    assert len(simulation.levels([many])) == simulation.MAX_LEVELS + 1


def test_pairs_count_the_threats_that_only_one_model_detects():
    found = {
        "a": [threat("a", 5.0), threat("a", 7.5), threat("a", 7.5), threat("a", 5.0), quiet("a")],
        "b": [threat("b", 5.0), threat("b", 5.0), threat("b", 5.0), threat("b", 7.5), quiet("b")],
    }
    assert simulation.detections(found["a"], 50.0) == [True, False, False, True]
    chosen = simulation.choose(simulation.curves(found), (0.0,))
    (pair,) = simulation.pairs(chosen, found)
    assert (pair.model, pair.reference, pair.gained, pair.lost) == ("b", "a", 2, 1)
    assert pair.difference.value == 0.25
    assert pair.p_value == pair.p_adjusted == 1.0


def test_the_closed_loop_is_that_of_the_rule_behind_the_model():
    worlds = Worlds(suites=("r152",), seeds=1, worlds=3)
    recordings = simulation.record(worlds, ["lgmd", "off-only"])
    (channel,) = (trace.trace.series["spike_frequency"] for trace in recordings["lgmd"][:1])
    task = recordings["lgmd"][0].task
    alone = run_task(
        Task(
            "no-brake",
            task.case,
            task.seed,
            SensorConfig("fovea"),
            condition=task.condition,
            world=task.world,
        )
    )
    assert (channel == alone.series["spike_frequency"]).all()
    chosen = simulation.choose(simulation.curves(recordings), (1.0,))
    (lgmd, _) = simulation.closed_loop(chosen, recordings, "fovea")
    rows = [
        run_task(
            Task(
                f"spike-threshold:threshold={chosen[0].threshold:.6g}",
                *(item.task.case, item.task.seed, SensorConfig("fovea"), item.counterfactual),
                condition=item.task.condition,
                world=item.task.world,
            )
        ).row
        for item in recordings["lgmd"]
    ]
    assert lgmd.avoided.k == sum(bool(row["avoided"]) for row in rows)
    assert make_agent("spike-threshold").name == "spike-threshold"


def test_every_model_gets_the_same_frames():
    rng = np.random.default_rng(0)
    frames = [rng.integers(0, 256, (20, 24)).astype(np.uint8) for _ in range(6)]
    signals = step_models(["difference", "difference:sigma=8"], iter(frames), 30.0)
    model = neuron.make("difference:sigma=8", (20, 24))
    expected = [model.step(frame).membrane_potential for frame in frames]
    assert signals["difference:sigma=8"]["membrane_potential"].tolist() == expected
    assert checked_models(["lgmd", "lgmd"], (8, 8)) == ("lgmd",)
    with pytest.raises(ValueError, match="a neuron model is required"):
        checked_models([], (8, 8))


def test_selectivity_by_hand():
    names = ("dark square approaches", "dark square recedes", "passes at 0.108 m/s", "passes at 0.3 m/s")
    chosen = {item.name: item for item in stimuli.stimuli()}
    frequency = {"dark square approaches": 30.0, "dark square recedes": 10.0, "passes at 0.3 m/s": 20.0}
    results = [
        stimuli.StimulusResult(
            "a", chosen[name], np.array([0.0]), np.array([frequency.get(name, 0.0)]), np.array([0.7])
        )
        for name in names
    ]
    (index,) = stimuli.selectivity(results)
    assert index == ("a", 0.5, 0.5, 0.0, 0.0)
    assert results[0].lead == 3.0
    assert math.isnan(results[1].lead)


def response(clip, crash_s, frequency):
    return ClipResponse(clip, 10.0, crash_s, {"a": np.array(frequency, float), "b": np.zeros(len(frequency))})


def test_clips_get_the_threshold_of_the_others():
    """Earlier frames: from 0.3 s on, up to 1.5 s before the crash; settled frames do not count."""
    crash = response("crash", 4.0, [0.0] * 30 + [40.0] * 10 + [0.0] * 10)
    noisy = response("noisy", None, [99.0] * 3 + [20.0] * 5 + [10.0] * 15 + [0.0] * 30)
    calm = response("calm", None, [0.0] * 53)
    a, b = clips.score_clips([crash, noisy, calm], cap=0.1)
    assert a.thresholds[0] == 20.0  # 5 of 100 earlier frames of the others at 20, 20 of 100 at 10
    assert a.thresholds[2] == 20.0  # 5 of 72
    assert a.detections[0].lead_s == pytest.approx(1.0)
    assert (a.summary.hits.k, a.summary.hits.n, a.gained, a.lost) == (1, 1, 0, 0)
    assert (b.summary.hits.k, b.gained, b.lost, b.thresholds[0]) == (0, 0, 1, math.inf)


@pytest.mark.parametrize(("cap", "level"), [(0.0, math.inf), (0.25, 20.0), (0.5, 10.0), (1.0, 5.0)])
def test_lowest_threshold(cap, level):
    assert clips.lowest_threshold(np.array([0.0, 5.0, 10.0, 20.0]), cap) == level


def test_document_as_markdown_csv_json_and_html(tmp_path):
    table = DataTable(
        "t", ("name", "x | y"), [("a<b", 1.25), ("c", math.nan), ("d", math.inf)], ("", ".1f"), "Note."
    )
    hidden = DataTable("h", ("n",), [(3,)], hidden=True)
    section = Section("One", "First.\n\nSecond.", (table, Figure("f.png", "A figure."), hidden))
    (tmp_path / "f.png").write_bytes(b"PNG")
    Document("Title", "Text of `a<b`.", (section,)).write(tmp_path)
    assert "| a<b | 1.2 |" in (tmp_path / "report.md").read_text()
    assert "| name | x \\| y |\n| --- | ---: |" in (tmp_path / "report.md").read_text()
    page = (tmp_path / "report.html").read_text()
    assert "a&lt;b" in page
    assert '<img src="data:image/png;base64,UE5H" alt="A figure."' in page
    assert "<p>Second.</p>" in page
    assert "<p>Text of <code>a&lt;b</code>.</p>" in page
    assert page.count("<section") == page.count("</section>") == 1
    with (tmp_path / "t.csv").open() as file:
        assert list(csv.reader(file)) == [["name", "x | y"], ["a<b", "1.25"], ["c", ""], ["d", ""]]
    assert json.loads((tmp_path / "results.json").read_text())["h"] == [{"n": 3}]
    assert "| n |" not in (tmp_path / "report.md").read_text()


def test_the_models_of_the_page_exist():
    assert checked_models(PAGE_MODELS, (32, 40)) == PAGE_MODELS


def test_the_command_writes_a_report(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("clips").mkdir()
    rng = np.random.default_rng(0)
    for name in ("one", "two"):
        frames = list(rng.integers(0, 256, (60, 32, 40), np.uint8))
        write_lossless(tmp_path / "clips" / f"{name}.mkv", frames)
    Path("crashes.csv").write_text("clip,crash_frame\none,50\ntwo,\n")
    Path("mine.toml").write_text("shape = [45, 80]\nhfov_deg = 25.0\n")
    text = (
        "neurons compare difference edges --quick --suites r152 --seeds 1 --clips clips "
        "--crashes crashes.csv --camera mine.toml --test-world 6200 --out run"
    )
    command = text.split()
    assert cli.run(command) == 0
    output = capsys.readouterr().out
    assert "report: run/report.html" in output
    report = Path("run/report.md").read_text()
    for title in (
        "Stimuli",
        "Video clips",
        "Simulation, validation worlds",
        "Simulation, test worlds",
        "Cost",
    ):
        assert f"\n## {title}\n" in report
    assert report.count("through the camera `mine`") == 2
    camera = {"name": "mine", "shape": [45, 80], "hfov_deg": 25.0}
    assert json.loads(Path("run/run.json").read_text())["camera"] == camera
    results = json.loads(Path("run/results.json").read_text())
    assert {row["neuron"] for row in results["froc_validation"]} == {"difference", "edges"}
    assert len(results["closed_loop_test"]) == 2
    for figure in ("stimuli", "approaches", "clips", "froc_validation", "closed_loop_test"):
        assert Path(f"run/{figure}.png").stat().st_size > 5000
    assert cli.run(command) == 2
    assert "run folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "neurons requires a subcommand: compare, "),
        (["compar"], "unknown subcommand of neurons 'compar'; did you mean 'compare'?"),
        (["compare", "lgmd", "off-onli"], "unknown neuron 'off-onli'; did you mean 'off-only'?"),
        (["compare", "--parts", "cots"], "unknown part 'cots'; did you mean 'cost'?"),
        (["compare", "--crashes", "x.csv"], "--clips and --crashes must be used together"),
        (["compare", "--camera", "fova"], "did you mean 'fovea'?"),
        (["compare", "--camera", "none.toml"], "camera file 'none.toml' cannot be read"),
        (
            ["compare", "--camera", "two.toml"],
            "--camera 'two.toml' has 2 cameras, but all models are behind one",
        ),
        (["compare", "--camera", "columns.toml"], "columns"),
        (["compare", "--quik"], "did you mean --quick?"),
        (["list", "--module", "no_such_module"], "cannot be imported"),
    ],
)
def test_wrong_arguments_are_one_line(arguments, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("two.toml").write_text("[[camera]]\nname = 'a'\n[[camera]]\nname = 'b'\n")
    Path("columns.toml").write_text("columns = 8\ncamera = 'fovea'\n")
    assert cli.run(["neurons", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_list_has_models_presets_and_options(capsys):
    assert cli.run(["neurons", "list"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "off-only LGMD without its ON path; responds to dark objects. options: as of lgmd" in text
    assert "radius_px" in text
