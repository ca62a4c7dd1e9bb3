"""The scripts in docs/experiments run: one short test each, not a check of their results."""

import os
import subprocess
import sys

import numpy as np
import pytest
from support.examples import EXPERIMENTS, load
from support.openscenario import START, scenario, write
from support.rows import threat_row

from lgmd_gym.benchmark import RunConfig, get_suite
from lgmd_gym.benchmark.case import Case, Suite
from lgmd_gym.benchmark.run_folder import StoredRun


def test_bodies(tmp_path):
    sheet = load("bodies").main(tmp_path / "bodies.png", quick=True)
    assert list(sheet) == ["motorcycle", "small"]
    assert list(sheet["small"]) == ["day, side", "day, rear", "day, front"]
    assert sheet["motorcycle"]["day, front"].max() == 255  # the headlight


@pytest.mark.slow
def test_frame_profile(tmp_path):
    """The script measures in a process of its own, because it compiles the kernels anew."""
    command = [
        sys.executable,
        EXPERIMENTS / "frame_profile.py",
        *["--worlds", "1", "--frames", "3", "--engine", "2"],
    ]
    cache = {"NUMBA_CACHE_DIR": str(tmp_path), "LGMD_GYM_QUIET": "1"}
    done = subprocess.run(command, env=os.environ | cache, capture_output=True, text=True, check=True)
    header, _, *rows = [line.split("|")[1:-1] for line in done.stdout.splitlines() if line.startswith("|")]
    assert [name.strip() for name in header[:2]] == ["µs per frame", "pose"]
    assert [row[0].strip() for row in rows][::8] == ["laboratory", "engine, worlds, clear"]
    for _, *values, total in rows:
        *stages, rest = map(float, values)
        assert sum(stages) + rest == pytest.approx(float(total), abs=1.0)
        assert min(stages[1], *stages[6:8]) > 0.0  # selection, ground, vehicles


def test_cameras_of_the_side_fields():
    channel = load("side_fields").camera_of("far_left")
    assert (channel["camera"]["name"], channel["neuron"]) == ("far_left", "dsn")


@pytest.mark.slow
def test_side_fields(tmp_path):
    """The car comes from the left and the two levels differ by it only: the fields at the right are equal."""
    with_car, without = load("side_fields").main(tmp_path / "fields.png")
    assert np.array_equal(with_car[3:], without[3:])
    assert (np.abs(with_car[0] - without[0]) > 1.0).any()  # grey levels of the far field at the left
    assert 10_000 < (tmp_path / "fields.png").stat().st_size < 200_000


def test_turning_views(tmp_path):
    """Derotation removes most of the change of light before the oncoming car is large."""
    steady, derotated = load("turning_views").main(tmp_path / "views.png")
    assert (derotated[:3] < 0.5 * steady[:3]).all()
    assert derotated[3] > 2.0 * derotated[0]
    assert 10_000 < (tmp_path / "views.png").stat().st_size < 200_000


def test_picture(tmp_path):
    from PIL import Image

    load("picture").main(tmp_path / "view.png", tmp_path / "film.gif", ego_speed=5.0, after=2)
    assert Image.open(tmp_path / "view.png").size == (1280, 720)
    film = Image.open(tmp_path / "film.gif")
    assert film.size == (800, 450)
    assert film.n_frames > 20


@pytest.mark.slow
def test_ablations(tmp_path, capsys):
    example = load("ablations")
    arguments = ["--worlds", "2", "--seeds", "1", "--every", "14", "--to", str(tmp_path / "arms.png")]
    arms = ["complete sensor", "half the pixels per row and column", "60 frames/s"]
    rates = example.main(["stopping-zone", *arguments, "--arms", *arms])
    assert list(rates) == arms
    assert {suite: rate.n for suite, rate in rates[arms[1]].items()} == {"r152": 2, "false-reaction": 3}
    assert capsys.readouterr().out.count("\n") == 5
    assert (tmp_path / "arms.png").stat().st_size > 5_000
    with pytest.raises(ValueError, match="agent 'ttc-oracle' has no cameras of its own"):
        example.main(["ttc-oracle", *arguments])


@pytest.mark.slow
def test_openscenario_coverage(tmp_path, capsys):
    (tmp_path / "some").mkdir()
    write(tmp_path / "some", scenario(START), "good.xosc")
    write(tmp_path / "some", scenario(START.replace('s="160"', 's="far"')), "bad.xosc")
    (tmp_path / "some" / "catalog.xosc").write_text("<OpenSCENARIO><Catalog name='c'/></OpenSCENARIO>")
    script = load("openscenario_coverage")
    found = script.outcomes(tmp_path)
    assert [item.error for item in found] == ["LanePosition s must be a number, got 'far'", ""]
    script.print_tables(found)
    text = capsys.readouterr().out
    assert "| some | 2 | 1 | 50% |" in text
    assert "| 1 | LanePosition s must be a number, got … |" in text


def test_deviations(capsys):
    effects = load("deviations").main()
    assert capsys.readouterr().out.count("\n") == 2 + len(effects)
    default, literal = effects["default"], effects["`literal`"]
    assert (default.silent_gratings, default.frames[2]) == (30, 0)
    assert literal.silent_gratings < 30
    assert literal.peak > effects["spikes from K (eq. 11)"].peak > default.peak


def test_real_cars():
    """A line per agent and run; premature braking and contact are failures."""
    cases = ("CCRs/v10", "CCRs/v80", "CCRm/v70", "CCRm/v60", "CCRb/v80/brake0.5g-gap12")
    impact = {"collision": True, "avoided": False, "relative_impact_speed": 10 / 3.6}
    rows = [threat_row(case=f"fmvss127/{case}", avoided=True) for case in cases]
    rows[1] |= impact
    rows.append(rows[0] | {"seed": 1, "avoided": False, "premature_brake": True})
    config = RunConfig(suite="fmvss127", agents=("a",), seeds=2)
    *_, line = load("real_cars").table([StoredRun(config, rows, False)])
    assert line == "| `a`, worlds | 1/3 (10 km/h) | 1/1 | 0/0 | 1/1 |"


@pytest.mark.slow
def test_frontier(tmp_path, capsys, monkeypatch):
    script, picture = load("frontier"), tmp_path / "frontier.png"
    arguments = ["frontier.py", "--suites", "r152-vru", "--camera", "standard", "--to", str(picture)]
    monkeypatch.setattr("sys.argv", arguments)
    script.main()
    heads, _, bicycle, pedestrian = capsys.readouterr().out.splitlines()
    assert "growth in `standard` [px/frame]" in heads
    assert len({line.count("|") for line in (heads, bicycle, pedestrian)}) == 1
    assert bicycle.startswith("| CBNA | 4 | 4/4 |")
    assert pedestrian.startswith("| CPNA | 4 | 4/4 |")
    assert picture.stat().st_size > 10_000


def test_protocol_counts(tmp_path, monkeypatch):
    """Files of a family with locations or turns in its name count as that family."""
    script = load("protocol_counts")
    for pattern in script.FILES.values():
        file = tmp_path / pattern.replace("*", "x")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    families = ("CPNA-25", "CPTAfs", "CPRA_Cm", "CCRs")
    cells = tuple(Case("x", family, "v10", fcw_driver=family == "CCRs") for family in families)
    monkeypatch.setattr(script, "read", lambda path: Suite(name="x", cases=cells, about=""))
    assert "\n".join(script.case_table()) in (EXPERIMENTS.parent / "protocols.md").read_text()
    lines = script.table(tmp_path)
    assert lines[0] == "| family | ncap2023 | ncap2023-vru | ncap2026 | ncap2026-extended |"
    assert "| CPNA | 0 / 1 | 22 / 1 | 36 / 1 | 24 / 1 |" in lines
    assert "| CPTA | 0 / 1 | 8 / 1 | 0 / 1 | 0 / 1 |" in lines
    assert "| CCRs warned | 30 / 1 | 0 / 1 | 15 / 1 | 6 / 1 |" in lines
    assert lines[-1] == "| all | 177 / 4 | 133 / 4 | 428 / 4 | 435 / 4 |"
    with pytest.raises(ValueError, match=r"no file .*Variation\*.xosc in '.*other'; pass the folder NCAP"):
        script.table(tmp_path / "other")


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


def test_levels_of_the_leaderboard():
    """Held-out levels: each case is one level of the split "test"."""
    cases = [dict(case.arguments) for case in get_suite(str(EXPERIMENTS / "levels.toml")).cases]
    assert [case["start_level"] for case in cases] == list(range(1000, 1400))
    assert all(case["num_levels"] == 1 and case["split"] == "test" for case in cases)


def test_failure_maps(tmp_path, capsys):
    """At 80 km/h, 44 m are left 2 s before contact; braking needs 49 m at 5 m/s² and 26 m at 9.5 m/s²."""
    script, picture = load("failure_maps"), tmp_path / "maps.png"
    options = "--agents ttc-oracle --planes brake curve --worlds 2 --decelerations 5 9.5 --radii 60 inf"
    brake, curve = script.main([*options.split(), "--speeds", "20", "80", "--to", str(picture)])

    def counts(rates):
        return [[rate and (rate.k, rate.n) for rate in row] for row in rates["ttc-oracle"]]

    assert counts(brake) == [[(2, 2), (2, 2)], [(0, 2), (2, 2)]]
    assert counts(curve) == [[(2, 2), (2, 2)], [None, (2, 2)]]
    assert "| 80 | – | 2/2 [34–100] |" in capsys.readouterr().out.splitlines()
    assert picture.stat().st_size > 10_000
    with pytest.raises(SystemExit):
        script.main([*options.split(), "--bound", "stopping-zone"])
    assert "--bound must use no camera, got stopping-zone" in capsys.readouterr().err


def test_traffic_causes():
    """`always-brake` brakes at once; drives with a braking event that is needed are left out."""
    script = load("traffic_causes")
    config = RunConfig(suite="traffic", agents=("always-brake",), seeds=2, worlds=0, conditions=("clear",))
    row = {"agent": "always-brake", "case": "traffic/two-way/s0", "seed": 0, "world": None, "error": None}
    row |= {"condition": "clear", "brakes": 2, "false_activations": 2, "family": "two-way"}
    run = StoredRun(config, [row, row | {"false_activations": 1}], False)
    ((kind, onset),) = script.play(run, "always-brake", 1)
    assert kind == "two-way"
    head, _, line = script.table([(kind, onset), ("merge", onset)])
    assert head == "| in front of the ego | merge | two-way | all | ego speed [m/s] | distance [m] |"
    assert line.startswith(f"| {onset.situation} | 1 | 1 | 2 | {onset.speed:.1f} | ")


def test_which_neuron(tmp_path):
    """The text before the marker stays, the sections are replaced, and figures are beside the page."""
    script, run, page = load("which_neuron"), tmp_path / "run", tmp_path / "which_neuron.md"
    run.mkdir()
    (run / "a.png").write_bytes(b"1")
    (run / "report.md").write_text("# Title\n\nIntroduction.\n\n## One\n\n![text](a.png)\n")
    page.write_text(f"# Page\n\nConclusion.\n\n{script.MARKER}\n\n## Old\n")
    for _ in range(2):
        script.main(run, page)
        assert page.read_text() == (
            f"# Page\n\nConclusion.\n\n{script.MARKER}\n\n## One\n\n![text](which_neuron/a.png)\n"
        )
    assert (tmp_path / "which_neuron" / "a.png").read_bytes() == b"1"
