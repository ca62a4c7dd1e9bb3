"""Tests of the paper's experiments and claims."""

import csv
import dataclasses
import re

import numpy as np
import pytest

from lgmd_gym.cli import main as cli
from lgmd_gym.clips.detection import detect
from lgmd_gym.paper import experiments
from lgmd_gym.paper.backgrounds import Grating
from lgmd_gym.paper.claims import FAILS, HOLDS, LOCUST_SLOPE, PARTLY, evaluate_claims, write_claims


def stimulus_response(frequency):
    """The same spike frequency for every model."""
    frequency = np.asarray(frequency, float)
    models = dict.fromkeys([*experiments.MODELS, "T_sp = 0.78", "sigma_3 = 2"], frequency)
    time = np.arange(len(frequency)) / experiments.FPS
    return experiments.StimulusResponse(time, models, models, models, np.full(len(time), 9.0), [])


def grating_response(contrast, temporal, k):
    """K of the paper's model; the other models spike."""
    models = [*experiments.MODELS, "neither adaptation nor silencing", "no warm start"]
    grating = Grating(contrast=contrast, temporal=temporal)
    return experiments.GratingResponse(grating, {**dict.fromkeys(models, 1.0), "paper": k}, 12.0)


def looming(contrast, response):
    return experiments.LoomingInGrating(contrast, 40.0, 20.0, response)


def approaches(slope):
    response = stimulus_response([0.0])
    return [experiments.Approach(x, slope * x, slope * x, response) for x in experiments.L_OVER_V]


def spike_counts(approach):
    """The same number of spikes for every model, by kind of motion."""
    return {
        model: {"approach": approach, "recede": 20, "pass at 0.108 m/s": 0, "pass at 0.3 m/s": 5}
        for model in experiments.MODELS
    }


@pytest.fixture
def results():
    """Results for which every claim holds."""
    late = stimulus_response(np.where(np.arange(90) > 75, 100, 0))
    early = stimulus_response(np.where((np.arange(90) > 12) & (np.arange(90) < 20), 100, 0))
    silent = stimulus_response(np.zeros(90))
    weaker = {**late.frequency, "fixed inhibition": late.frequency["paper"] / 2}
    return experiments.ExperimentResults(
        gratings=[grating_response(1.0, 2.0, 0.5)],
        low_contrast=[grating_response(0.1, 2.0, 0.5)],
        looming=[looming(0.2, late), looming(1.0, dataclasses.replace(late, frequency=weaker))],
        light_dark=[experiments.LuminanceLeads(60.0, 0.5, 1.0)],
        panorama={
            "panorama alone": silent,
            **{
                f"{motion}, {shade}": response
                for shade in experiments.SHADES
                for motion, response in (("approaching", late), ("receding", early),
                                         ("passing at 0.108 m/s", silent), ("passing at 0.3 m/s", silent))
            },
        },
        approaches=approaches(LOCUST_SLOPE),
        selectivity=spike_counts(approach=90),
    )  # fmt: skip


def result_of(results, start, clips=None):
    return next(row.result for row in evaluate_claims(results, clips) if row.claim.startswith(start))


def test_every_claim_can_hold(results):
    assert {row.result for row in evaluate_claims(results)} == {HOLDS}


@pytest.mark.parametrize(
    ("start", "change", "expected"),
    [
        ("gratings alone: K stays 0.5 (full", {"gratings": [grating_response(1.0, 2.0, 0.9)]}, FAILS),
        ("gratings alone: K stays 0.5 (contrast",
         {"low_contrast": [grating_response(0.1, 2.0, 0.5), grating_response(0.1, 7.0, 1.0)]}, PARTLY),
        ("looming in gratings", {"looming": [looming(1.0, stimulus_response(np.zeros(90)))]}, FAILS),
        ("a light object", {"light_dark": [experiments.LuminanceLeads(60.0, 0.5, 1.0),
                                           experiments.LuminanceLeads(195.0, 1.0, 0.5)]}, PARTLY),
        ("locust: the peak", {"approaches": approaches(slope=3.0)}, PARTLY),
        ("locust: approach", {"selectivity": spike_counts(approach=20)}, FAILS),
    ],
)  # fmt: skip
def test_a_claim_fails_with_its_measurement(results, start, change, expected):
    assert result_of(dataclasses.replace(results, **change), start) == expected


def test_claims_about_the_panorama_depend_on_the_times_of_the_alarms(results):
    continuous = stimulus_response(np.full(90, 50.0))
    for name, start, expected in (
        ("receding, light", "receding", PARTLY),
        ("passing at 0.3 m/s, dark", "translating", PARTLY),
        ("passing at 0.108 m/s, light", "translating", FAILS),
        ("approaching, dark", "approaching", PARTLY),
    ):
        changed = dataclasses.replace(results, panorama={**results.panorama, name: continuous})
        assert result_of(changed, start) == expected
    both = dict.fromkeys(("receding, dark", "receding, light"), continuous)
    changed = dataclasses.replace(results, panorama={**results.panorama, **both})
    assert result_of(changed, "receding") == FAILS


def test_the_claim_about_crash_clips_requires_more_hits_than_by_chance(results):
    alarm = np.arange(300) >= 270
    crashes = [detect(f"c{n}", 100.0 * alarm, alarm, 30.0, 9.7) for n in range(7)]
    near_miss = [detect("n", np.zeros(300), np.zeros(300, bool), 30.0, None)]
    assert result_of(results, "crash clips", crashes + near_miss) == HOLDS
    assert result_of(results, "near-miss", crashes + near_miss) == HOLDS
    assert result_of(results, "crash clips", crashes[:1]) == PARTLY  # one hit may be chance
    continuous = [detect("c", np.full(300, 90.0), np.ones(300, bool), 30.0, 9.7)]
    assert result_of(results, "crash clips", continuous) == FAILS


def test_claims_are_written_as_csv_and_markdown(results, tmp_path):
    rows = evaluate_claims(results)
    write_claims(rows, tmp_path)
    with (tmp_path / "claims.csv").open(newline="", encoding="utf-8") as file:
        assert list(csv.DictReader(file)) == [row._asdict() for row in rows]
    lines = (tmp_path / "claims.md").read_text(encoding="utf-8").splitlines()
    cells = [re.split(r"(?<!\\)\|", line)[1:-1] for line in lines[2:]]
    assert [[cell.strip().replace("\\|", "|") for cell in row] for row in cells] == [
        list(row) for row in rows
    ]


def test_line_fit_of_an_exact_line():
    x = np.linspace(0.0, 1.0, 10)
    slope, intercept, half_width = experiments.line_fit(x, 3.0 * x + 2.0)
    assert (slope, intercept, half_width) == pytest.approx((3.0, 2.0, 0.0), abs=1e-9)


def test_a_fast_grating_saturates_k_at_low_contrast_only():
    """Below F̂ = 10 the inhibition does not adapt."""
    full = experiments.grating_response(Grating(spatial=40.0, temporal=7.0))
    low = experiments.grating_response(Grating(spatial=40.0, temporal=7.0, contrast=0.1))
    assert full.potential["paper"] == pytest.approx(0.5, abs=1e-4)
    assert full.potential["neither adaptation nor silencing"] > 0.9
    assert low.potential["paper"] > 0.9
    assert low.ffi < 10.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--crashes", "my.csv"], "--crashes my.csv annotates clips: add --clips with their folder"),
        (["--clips", "."], "folder '.' contains no video file"),
        (["--picture", "nowhere.png"], "picture 'nowhere.png' cannot be read"),
        (["--out", "/proc/nowhere/run"], "cannot be created"),
        (["--clips", "nowhere", "--crashes", "nowhere.csv"], "clip 'nowhere' does not exist"),
    ],
)
def test_invalid_input_gives_one_line_and_writes_nothing(arguments, message, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["paper", *arguments]) == 2
    printed = capsys.readouterr().err
    assert printed.startswith("lgmd-gym: ")
    assert printed.count("\n") == 1
    assert message in printed
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_command_writes_claims_and_figures(tmp_path, capsys):
    out = tmp_path / "run"
    assert cli.run(["paper", "--out", str(out)]) == 0
    assert "holds" in capsys.readouterr().out
    assert len(list(out.glob("*.png"))) == 4
    with (out / "claims.csv").open(newline="", encoding="utf-8") as file:
        results = {row["claim"]: row["result"] for row in csv.DictReader(file)}
    assert len(results) == 10
    assert results["gratings alone: K stays 0.5 (full contrast)"] == HOLDS
    assert results["receding: only at the start"] == HOLDS
    assert cli.run(["paper", "--out", str(out)]) == 2
    assert "already exists" in capsys.readouterr().err
