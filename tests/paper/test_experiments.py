"""The paper's experiments and the verdicts on them."""

import csv
import dataclasses

import numpy as np
import pytest

from lgmd_gym.cli import main as cli
from lgmd_gym.paper import experiments as paper
from lgmd_gym.paper.claims import FAILS, HOLDS, LOCUST_SLOPE, PART, verdicts, write_claims
from lgmd_gym.video.clips.detection import detect


def trial(name, rates, ffi=9.0):
    """A trial in which every model answers alike."""
    rates = np.asarray(rates, float)
    same = dict.fromkeys([*paper.MODELS, "T_sp = 0.78", "sigma_3 = 2"], rates)
    time = np.arange(len(rates)) / paper.FPS
    return paper.Trial(name, time, same, same, same, np.full(len(rates), ffi), [])


def answer(contrast, temporal, k, others=1.0):
    models = [*paper.MODELS, "neither adaptation nor silencing", "no warm start"]
    grating = paper.Grating(contrast=contrast, temporal=temporal)
    return paper.GratingAnswer(grating, {**dict.fromkeys(models, others), "paper": k}, 12.0)


def counts(approach):
    """Spikes by kind of motion, the same for every model."""
    return {
        model: {"approach": approach, "recede": 20, "pass at 0.108 m/s": 0, "pass at 0.3 m/s": 5}
        for model in paper.MODELS
    }


@pytest.fixture
def found():
    """Findings in which everything is as the paper has it."""
    late = trial("late", np.where(np.arange(90) > 75, 100, 0))
    early = trial("early", np.where((np.arange(90) > 12) & (np.arange(90) < 20), 100, 0))
    silent = trial("silent", np.zeros(90))
    return paper.Findings(
        gratings=[answer(1.0, 2.0, 0.5)],
        faint=[answer(0.1, 2.0, 0.5)],
        looming=[(0.2, 40.0, 20.0, late), (1.0, 40.0, 20.0, dataclasses.replace(late, frequency={
            **late.frequency, "fixed inhibition": late.frequency["paper"] / 2}))],
        light_dark=[(60.0, 0.5, 1.0)],
        panorama={
            "panorama alone": silent, "approaching, dark": late, "approaching, light": late,
            "receding": early, "passing at 0.108 m/s": silent, "passing at 0.3 m/s": silent,
        },
        approaches=[paper.Approach(x, LOCUST_SLOPE * x, LOCUST_SLOPE * x, late) for x in paper.L_OVER_V],
        selectivity=counts(approach=90),
    )  # fmt: skip


def verdict_of(found, start, clips=None):
    return next(row.verdict for row in verdicts(found, clips) if row.claim.startswith(start))


def test_what_is_as_the_paper_has_it_holds(found):
    assert {row.verdict for row in verdicts(found)} == {HOLDS}


@pytest.mark.parametrize(
    ("start", "change", "verdict"),
    [
        ("gratings alone: K stays 0.5 (full", {"gratings": [answer(1.0, 2.0, 0.9)]}, FAILS),
        ("gratings alone: K stays 0.5 (contrast",
         {"faint": [answer(0.1, 2.0, 0.5), answer(0.1, 7.0, 1.0)]}, PART),
        ("looming in gratings", {"looming": [(1.0, 40.0, 20.0, trial("none", np.zeros(90)))]}, FAILS),
        ("a light object", {"light_dark": [(60.0, 0.5, 1.0), (195.0, 1.0, 0.5)]}, PART),
        ("locust: the peak", {"approaches": [paper.Approach(x, 3.0 * x, 3.0 * x, trial("", [0.0]))
                                             for x in paper.L_OVER_V]}, PART),
        ("locust: approach", {"selectivity": counts(approach=20)}, FAILS),
    ],
)  # fmt: skip
def test_what_is_otherwise_does_not(found, start, change, verdict):
    assert verdict_of(dataclasses.replace(found, **change), start) == verdict


def test_passing_and_receding_are_judged_by_where_the_alarms_lie(found):
    loud = trial("loud", np.full(90, 50.0))
    for name, start, verdict in (
        ("receding", "receding", FAILS),
        ("passing at 0.3 m/s", "translating", PART),
        ("passing at 0.108 m/s", "translating", FAILS),
        ("approaching, dark", "approaching", PART),
    ):
        changed = dataclasses.replace(found, panorama={**found.panorama, name: loud})
        assert verdict_of(changed, start) == verdict


def test_clips_are_judged_against_chance(found):
    quiet, alarm = np.zeros(300, bool), np.arange(300) >= 270
    crash = [detect(f"c{n}", 100.0 * alarm, alarm, 30.0, 9.7) for n in range(7)]
    calm = [detect("n", 0.0 * quiet, quiet, 30.0, None)]
    assert verdict_of(found, "crash clips", crash + calm) == HOLDS
    assert verdict_of(found, "near-miss", crash + calm) == HOLDS
    always = [detect("c", np.full(300, 90.0), np.ones(300, bool), 30.0, 9.7)]
    assert verdict_of(found, "crash clips", always) == FAILS


def test_claims_are_written(found, tmp_path):
    rows = verdicts(found)
    write_claims(rows, tmp_path)
    with (tmp_path / "claims.csv").open(newline="", encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    lines = (tmp_path / "claims.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) == len(rows) + 2
    assert all(line.replace("\\|", "").count("|") == 5 for line in lines)


def test_line_fit():
    x = np.linspace(0.0, 1.0, 10)
    slope, intercept, half = paper.line_fit(x, 3.0 * x + 2.0)
    assert (slope, intercept, half) == pytest.approx((3.0, 2.0, 0.0), abs=1e-9)


def test_full_contrast_gratings_are_silent_and_faint_fast_ones_are_not():
    """The measured exception: below F = 10 nothing adapts, so a faint fast grating saturates K."""
    full = paper._grating(paper.Grating(spatial=40.0, temporal=7.0), lambda: None)
    faint = paper._grating(paper.Grating(spatial=40.0, temporal=7.0, contrast=0.1), lambda: None)
    assert full.potential["paper"] == pytest.approx(0.5, abs=1e-4)
    assert full.potential["neither adaptation nor silencing"] > 0.9
    assert faint.potential["paper"] > 0.9
    assert faint.ffi < 10.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--clips", "."], "--clips and --crashes go together"),
        (["--picture", "nowhere.png"], "picture 'nowhere.png' cannot be read"),
        (["--out", "/proc/nowhere/run"], "cannot be made"),
        (["--clips", "nowhere", "--crashes", "nowhere.csv"], "clip 'nowhere' does not exist"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(arguments, words, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["paper", *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith("lgmd-gym: ")
    assert said.count("\n") == 1
    assert words in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_paper_command(tmp_path, capsys):
    out = tmp_path / "run"
    assert cli.run(["paper", "--out", str(out)]) == 0
    assert "holds" in capsys.readouterr().out
    assert len(list(out.glob("*.png"))) == 4
    with (out / "claims.csv").open(newline="", encoding="utf-8") as file:
        given = {row["claim"]: row["verdict"] for row in csv.DictReader(file)}
    assert len(given) == 10
    assert given["gratings alone: K stays 0.5 (full contrast)"] == HOLDS
    assert given["receding: only at the start"] == HOLDS
    assert cli.run(["paper", "--out", str(out)]) == 2
    assert "exists and is kept" in capsys.readouterr().err
