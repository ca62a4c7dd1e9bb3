"""Fit of neuron parameters to clips: proposals, values, leave-one-clip-out, and `tune --clips`."""

import numpy as np
import pytest
from golden.sequences import looming
from support.clips import write_lossless

from lgmd_gym.cli import main as cli
from lgmd_gym.clips.batch import make_jobs
from lgmd_gym.clips.detection import detect
from lgmd_gym.clips.playback import ClipRun, PlaybackConfig
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.tuning import clips as clips_module
from lgmd_gym.tuning.clips import ClipsValue, detections, fit_clips, propose
from lgmd_gym.tuning.space import SearchSpace, neuron_range

FRAMES, CRASH = 90, 89


def detection(lead_s, alarms, crash_s=3.0, frames=100):
    """Return a detection with a lead time and a number of alarm frames among the earlier frames."""
    alarm = np.zeros(8 + frames + 45, bool)
    alarm[8 : 8 + alarms] = True
    found = detect("clip", alarm * 60.0, alarm, 30.0, None if crash_s is None else (8 + frames + 45) / 30.0)
    assert found.alarm_frames.k == alarms
    return clips_module.ClipDetection(
        "clip", crash_s, lead_s, found.alarm_frames, found.chance, found.peak, found.fps
    )


def test_the_value_is_the_share_of_hits_minus_the_cost_of_earlier_alarms():
    """Two of four crashes with a lead of 0.3 s; 10 + 30 + 20 of 300 + 145 frames in alarm."""
    found = [detection(0.3, 10), detection(1.0, 30), detection(0.29, 20), detection(None, 0)]
    value = ClipsValue.of([*found[:3], detection(None, 0, crash_s=None)])
    assert (value.hits, value.crashes, value.alarm_frames) == (2, 3, 60)
    assert value.frames == 300 + 145
    assert value.total(2.0) == pytest.approx(2 / 3 - 2.0 * 60 / 445)
    assert ClipsValue.of(found, lead_s=0.0).hits == 3


def test_proposals_are_a_latin_hypercube_within_the_bounds():
    start = LGMDParams(n_p=1)
    rows = propose(start, ["sigma_3", "t_sp"], 10, seed=3)
    assert rows == propose(start, ["sigma_3", "t_sp"], 10, seed=3)
    assert rows != propose(start, ["sigma_3", "t_sp"], 10, seed=4)
    assert {row.n_p for row in rows} == {1}
    for name in ("sigma_3", "t_sp"):
        low, high = neuron_range(name)
        share = np.log([getattr(row, name) / low for row in rows]) / np.log(high / low)
        assert sorted((10 * share).astype(int)) == list(range(10))
    assert neuron_range("sigma_3") == (0.5, 2.0)
    assert neuron_range("t_sp") == (0.35, 1.0)


def test_a_search_of_a_rule_stays_within_the_bounds_of_the_neuron():
    class Trial:
        def suggest_float(self, name, low, high, log=False):
            return high

        suggest_int = suggest_float

    proposal = SearchSpace(agent="spike-threshold", neuron=("t_sp",)).propose(Trial())
    assert proposal["neuron.t_sp"] == 1.0


def write_clips(folder):
    """Write two approaches, of a dark and of a light square, and a static scene; return the CSV file."""
    for name, target in (("dark", 20), ("light", 240)):
        write_lossless(folder / f"{name}.mkv", list(looming((40, 60), FRAMES, target=target)))
    write_lossless(folder / "static.mkv", [np.full((40, 60), 90, np.uint8)] * 60)
    (folder / "crashes.csv").write_text(f"clip,crash_frame\ndark,{CRASH}\nlight,{CRASH}\nstatic,\n")
    return folder / "crashes.csv"


def test_each_clip_is_judged_by_the_parameters_of_the_others(tmp_path, monkeypatch):
    """Proposal 1 is best for the first two clips, proposal 2 for the third, and the start for none."""
    jobs = make_jobs([tmp_path], write_clips(tmp_path))
    outcomes = {
        "dark": [detection(None, 0), detection(1.0, 0), detection(None, 0)],
        "light": [detection(None, 0), detection(1.0, 10), detection(None, 0)],
        "static": [detection(None, 0, None), detection(None, 90, None), detection(None, 0, None)],
    }
    seen = []

    def fake(job, config, proposals):
        seen.append(proposals)
        return outcomes[job.clip.stem]

    monkeypatch.setattr(clips_module, "detections", fake)
    fit = fit_clips(jobs, ["sigma_3"], 2, PlaybackConfig(params=LGMDParams(t_sf=20.0)))
    start, first, second = seen[0]
    assert start == LGMDParams(t_sf=20.0)
    assert {first.t_sf, second.t_sf} == {20.0}
    assert fit.best == first
    assert fit.chosen == (first, first, first)
    assert fit.left_out == fit.fitted == tuple(rows[1] for rows in outcomes.values())
    assert fit.default == tuple(rows[0] for rows in outcomes.values())
    costly = fit_clips(jobs, ["sigma_3"], 2, PlaybackConfig(params=LGMDParams(t_sf=20.0)), false_cost=10.0)
    assert costly.best == start
    assert costly.chosen == (start, start, first)  # without the static clip, alarms cost little
    assert costly.left_out[2] == outcomes["static"][1]


def test_detections_equal_those_of_a_run_of_the_neuron(tmp_path):
    jobs = make_jobs([tmp_path], write_clips(tmp_path))
    config = PlaybackConfig(drop_duplicates=0.2)
    for job in jobs[:2]:
        for params, found in zip(
            (LGMDParams(), LGMDParams(sigma_3=0.5)),
            detections(job, config, [LGMDParams(), LGMDParams(sigma_3=0.5)]),
            strict=True,
        ):
            frames = list(ClipRun(job.clip, PlaybackConfig(params=params, drop_duplicates=0.2)))
            frequency = [frame.response.spike_frequency for frame in frames]
            alerts = [frame.response.alert for frame in frames]
            assert found == detect(job.clip.stem, frequency, alerts, 30.0, CRASH / 30.0)
            assert found.peak > 0.0


def test_the_command_writes_parameters_that_video_reads(tmp_path, capsys):
    crashes = write_clips(tmp_path)
    options = ["--crashes", str(crashes), "--neuron", "sigma_3", "--trials", "3", "--jobs", "1"]
    best = tmp_path / "fit.toml"
    assert cli.run(["tune", "--clips", str(tmp_path), *options, "--best", str(best)]) == 0
    printed = capsys.readouterr().out
    assert "earlier frames" in printed
    assert "of 2" in printed
    assert printed.splitlines()[-1] == f"options of lgmd-gym video for them: --params {best}"
    assert 0.5 <= LGMDParams.from_toml(best).sigma_3 <= 2.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--clips", "CLIPS"], "--clips needs --crashes FILE, a CSV file with the columns clip,crash_frame"),
        (["--clips", "CLIPS", "--crashes", "CSV"], "no neuron parameter to fit; name some"),
        (["--clips", "CLIPS", "--crashes", "CSV", "--neuron", "sigma3"], "did you mean 'sigma_3'?"),
        (["--clips", "CLIPS/dark.mkv", "--crashes", "ONE", "--neuron", "t_sp"], "got 1 of 1; pass more"),
        (["--clips", "CLIPS", "--agent", "zones", "--levels", "9"], "--agent, --levels would have no effect"),
        (
            ["--fps", "18", "--lead", "0.5"],
            "without --clips, --fps, --lead would have no effect; remove them",
        ),
        (["--clips", "CLIPS", "--crashes", "CSV", "--neuron", "t_sp", "--lead", "2"], "lead_s must be in"),
    ],
)
def test_invalid_options_are_one_line(options, message, tmp_path, capsys):
    crashes = write_clips(tmp_path)
    (tmp_path / "one.csv").write_text(f"clip,crash_frame\ndark,{CRASH}\n")
    names = {"CLIPS": str(tmp_path), "CSV": str(crashes), "ONE": str(tmp_path / "one.csv")}
    given = [option.replace("CLIPS", names["CLIPS"]) if "CLIPS" in option else names.get(option, option)
             for option in options]  # fmt: skip
    assert cli.run(["tune", *given, "--best", str(tmp_path / "best.toml")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
