"""Published clips: annotation, recognition by hash, compact traces, groups and tables."""

import csv
import hashlib
import re

import numpy as np
import pytest
from support.clips import write_lossless

from lgmd_gym.cli import main as cli
from lgmd_gym.clips import playback, published, study
from lgmd_gym.clips.playback import PLAYBACK_CONFIGS
from lgmd_gym.clips.published import NEW, USED, PublishedClip, find_published, published_clips
from lgmd_gym.clips.study import ClipTrace, Crash, detections_of, groups_of, read_traces, write_traces
from lgmd_gym.clips.tables import config_row
from lgmd_gym.paper import experiments, plots

CONFIGS = ("paper", "paper-18hz", "paper-18hz-30")


def test_the_annotation_of_sixteen_clips():
    clips = published_clips()
    assert len({clip.name for clip in clips}) == len({clip.sha256 for clip in clips}) == 16
    for group, crashes, without in ((USED, 7, 2), (NEW, 6, 1)):
        found = [clip.crash_s for clip in clips if clip.group == group]
        assert (len(found) - found.count(None), found.count(None)) == (crashes, without)
    for clip in clips:
        assert re.fullmatch("[0-9a-f]{64}", clip.sha256)
        assert clip.source.startswith("github.com/fuqinbing/")
        assert (clip.tolerance_frames > 0) == (clip.crash_frame is not None)
    assert next(clip.crash_s for clip in clips if clip.name == "c01") == pytest.approx(65 / 30)


@pytest.fixture
def folder(tmp_path, monkeypatch, clip, looming):
    """A folder with two of three published clips under other names, and another video."""
    folder = tmp_path / "clips"
    folder.mkdir()
    (folder / "my square.mkv").write_bytes(clip.read_bytes())
    write_lossless(folder / "still.mkv", looming[:1] * 60)
    write_lossless(folder / "other.mkv", looming[:2] * 20)
    annotated = [
        PublishedClip("loom", 42, 3, USED, digest(folder / "my square.mkv"), "here", ""),
        PublishedClip("absent", 10, 3, USED, "0" * 64, "there", ""),
        PublishedClip("still", None, 0, NEW, digest(folder / "still.mkv"), "here", ""),
    ]
    for module in (published, study):
        monkeypatch.setattr(module, "published_clips", lambda: tuple(annotated))
    return folder


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_clips_are_recognised_by_their_contents(folder):
    files = find_published(folder)
    assert [(job.name, job.clip.name, job.crash_frame) for job in files.jobs] == [
        ("loom", "my square.mkv", 42), ("still", "still.mkv", None)
    ]  # fmt: skip
    assert [clip.name for clip in files.missing] == ["absent"]
    assert files.unknown == [folder / "other.mkv"]
    assert all(job.annotated for job in files.jobs)


def test_a_folder_without_a_published_clip_is_refused(tmp_path, clip, capsys):
    (tmp_path / "my.mkv").write_bytes(clip.read_bytes())
    assert cli.run(["paper", "--clips", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr().err
    assert "has none of the 16 published clips (by SHA-256); for other clips, add --crashes" in printed
    assert printed.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.fixture
def short_paper(monkeypatch):
    """`lgmd-gym paper` with three configurations and without its experiments on stimuli."""
    monkeypatch.setattr(playback, "PLAYBACK_CONFIGS", {name: PLAYBACK_CONFIGS[name] for name in CONFIGS})
    monkeypatch.setattr(experiments, "run_experiments", lambda *_: None)
    monkeypatch.setattr(plots, "paper_figures", lambda *_: [])
    claims = {}
    monkeypatch.setattr(
        "lgmd_gym.paper.claims.evaluate_claims", lambda _, clips: claims.update(all=clips) or []
    )
    return claims


def test_the_command_evaluates_published_clips(folder, short_paper, tmp_path, capsys):
    out = tmp_path / "run"
    assert cli.run(["paper", "--clips", str(folder), "--out", str(out)]) == 0
    printed = capsys.readouterr()
    assert "other.mkv is none of the published clips (by SHA-256); left out" in printed.err
    assert "1 of 3 published clips are missing: absent" in printed.err
    for title in ("1 clip used for earlier choices", "1 new clip", "all 2 clips"):
        assert title in printed.out
    assert [item.clip for item in short_paper["all"]] == ["loom", "still"]
    traces = read_traces(out / "clip_traces.csv")
    assert {(trace.configuration, trace.clip) for trace in traces} == {
        (name, clip) for name in CONFIGS for clip in ("loom", "still")
    }
    with (out / "my square" / "trace-paper-18hz.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    trace = next(item for item in traces if (item.configuration, item.clip) == ("paper-18hz", "loom"))
    assert trace.fps == 18.0
    np.testing.assert_allclose(trace.spike_frequency, [float(row["spike_frequency"]) for row in rows])
    np.testing.assert_allclose(
        trace.membrane_potential, [float(row["membrane_potential"]) for row in rows], atol=6e-4
    )
    text = (out / "clips.md").read_text(encoding="utf-8")
    assert text == study.results_text(traces, study.published_crashes(["loom", "still"]))
    assert text.count("| `paper-18hz-30` | T_sf = 30 spikes/s at 18 Hz | 1/1 |") == 2  # used and all
    assert sorted(path.name for path in out.glob("*.png")) == ["5-crashes.png", "6-near-misses.png"]


def test_the_command_evaluates_clips_of_the_user(folder, short_paper, tmp_path, capsys):
    (tmp_path / "crashes.csv").write_text("clip,crash_frame\nmy square,42\nother,\n")
    out = tmp_path / "run"
    arguments = ["--clips", str(folder), "--crashes", str(tmp_path / "crashes.csv"), "--out", str(out)]
    assert cli.run(["paper", *arguments]) == 0
    printed = capsys.readouterr()
    assert "still.mkv has no row in" in printed.err
    assert "2 clips" in printed.out
    assert [item.clip for item in short_paper["all"]] == ["my square", "other"]
    assert (
        (out / "clips.md").read_text(encoding="utf-8").startswith("### 2 clips: 1 with a crash, 1 without\n")
    )


def trace(configuration, clip, alarms, frames=90, fps=18.0):
    frequency = np.zeros(frames)
    frequency[list(alarms)] = 15.0
    potential = np.full(frames, 0.5) if configuration == study.HEADLINE else np.zeros(0)
    return ClipTrace(configuration, clip, fps, frequency, potential)


def test_an_alarm_reaches_the_level_of_its_configuration():
    frequency = np.array([0.0, 14.9, 15.0, 29.9, 30.0])
    alarms = {
        name: ClipTrace(name, "c", 18.0, frequency, frequency).alarm.tolist()
        for name in ("paper-18hz", "paper-18hz-30")
    }
    assert alarms["paper-18hz"] == [False, False, True, True, True]
    assert alarms["paper-18hz-30"] == [False, False, False, False, True]


def test_hits_depend_on_the_crash_within_its_tolerance():
    """An onset at frame 50; the windows of 27 frames end 5 frames before, at, and 5 frames after frame 52."""
    crash = Crash("a", 52 / 18, 5 / 18, USED)
    traces = [trace("paper-18hz", "a", [50])]
    leads = [detections_of(traces, [crash], shift)["paper-18hz"][0].lead_s for shift in (-1, 0, 1)]
    assert leads == [None, pytest.approx(2 / 18), pytest.approx(7 / 18)]
    late = Crash("a", 88 / 18, 10 / 18, USED)  # moved, it is at the end of the clip
    assert detections_of(traces, [late], 1)["paper-18hz"][0].crash_s == pytest.approx(90 / 18)


def test_clips_without_a_trace_or_a_crash_are_left_out():
    found = detections_of(
        [trace("paper", "a", []), trace("paper-18hz", "a", []), trace("paper", "b", [])],
        [Crash("a", 4.0), Crash("absent", 4.0)],
    )
    assert list(found) == ["paper-18hz", "paper"]
    assert [item.clip for item in found["paper"]] == ["a"]


def test_groups_of_clips():
    crashes = [Crash("a", 1.0, 0.0, USED), Crash("b", None, 0.0, NEW), Crash("c", 2.0, 0.0, USED)]
    assert {title: [crash.clip for crash in items] for title, items in groups_of(crashes).items()} == {
        "2 clips used for earlier choices": ["a", "c"],
        "1 new clip": ["b"],
        "all 3 clips": ["a", "b", "c"],
    }
    assert list(groups_of(crashes[:1])) == ["1 clip used for earlier choices"]


def test_p_is_multiplied_by_the_number_of_configurations():
    """No earlier onset in 8 clips of 58 frames: the upper bound of the mean number of onsets is 3.689."""
    crashes = [Crash(str(number), 90 / 18) for number in range(8)]
    found = detections_of([trace("paper-18hz", crash.clip, [70]) for crash in crashes], crashes)["paper-18hz"]
    total = study.summarize_detections(found)
    chance = 1.0 - np.exp(-3.688879 * 1.5 / (8 * 58 / 18))
    assert total.p_value == pytest.approx(chance**8)
    assert config_row(total, 10)[2] == f"{10 * chance**8:.1g}"
    assert config_row(total, 10**9)[2] == "1"


def test_traces_are_written_and_read(tmp_path):
    path = tmp_path / "traces.csv"
    written = [
        ClipTrace("released", "c01", 30.0, np.array([0.0, 1000 / 33, 5.0]), np.zeros(0)),
        ClipTrace("paper-18hz", "c01", 18.0, np.array([3.0, 54.0]), np.array([0.5, 0.98765])),
    ]
    write_traces(path, written)
    for one, other in zip(read_traces(path), written, strict=True):
        assert one[:3] == other[:3]
        np.testing.assert_allclose(one.spike_frequency, other.spike_frequency, rtol=1e-5)
        np.testing.assert_allclose(one.membrane_potential, other.membrane_potential, atol=5e-4)
    (tmp_path / "other.csv").write_text("clip,fps\na,soon\n")
    for name, message in (("other.csv", "does not have the columns"), ("none.csv", "cannot be read")):
        with pytest.raises(ValueError, match=message):
            read_traces(tmp_path / name)
