"""End-to-end tests of `lgmd-gym video`."""

import csv
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PIL import Image
from support.clips import ffmpeg, make_test_clip, truncate, write_lossless

from lgmd_gym.cli import main as cli
from lgmd_gym.clips import VideoReader
from lgmd_gym.clips.batch import make_jobs
from lgmd_gym.clips.playback import PLAYBACK_CONFIGS, ClipRun, PlaybackConfig


def run(*arguments):
    return cli.run(["video", *map(str, arguments)])


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_command_writes_trace_figure_and_overlay(tmp_path, clip, capsys):
    out = tmp_path / "run"
    assert run(clip, "--crash-frame", "42", "--overlay", "--out", out) == 0
    printed = capsys.readouterr()
    assert "T_sf = 30 spikes/s at 30 Hz" in printed.out
    assert "paper" in printed.err  # the progress bar
    rows = rows_of(out / "loom" / "trace.csv")
    assert len(rows) == 60
    assert max(float(row["spike_frequency"]) for row in rows) > 30
    assert sum(int(row["onset"]) for row in rows) >= 1
    assert Image.open(out / "loom" / "trace.png").size == (990, 946)
    overlay = VideoReader(out / "loom" / "overlay.mp4")
    pictures = list(overlay)
    assert (len(pictures), overlay.fps) == (60, 30.0)
    alert = next(number for number, row in enumerate(rows) if row["alert"] == "1")
    inactive, active = (pictures[number][20:50, 30:160].mean((0, 1)) for number in (5, alert))
    assert active[0] > inactive[0] + 100  # the alert indicator turns orange
    assert run(clip, "--out", out) == 2
    assert "already exists" in capsys.readouterr().err


def test_configurations_are_compared_on_a_folder_of_clips(tmp_path, clip, looming, capsys):
    folder = tmp_path / "clips"
    folder.mkdir()
    (folder / "loom.mkv").write_bytes(clip.read_bytes())
    write_lossless(folder / "still.mkv", looming[:1] * 40)
    (folder / "crashes.csv").write_text("clip,crash_frame,note\nloom,42,a square\nstill.mkv,none,\n")
    out = tmp_path / "run"
    arguments = (folder, "--crashes", folder / "crashes.csv", "--no-plots", "--out", out)
    assert run(*arguments, "--configs", "paper", "paper-18hz") == 0
    printed = capsys.readouterr().out
    for text in ("configurations over all clips", "1 of 1", "T_sf = 15 spikes/s at 18 Hz", "none"):
        assert text in printed
    assert len(rows_of(out / "loom" / "trace-paper-18hz.csv")) == 36
    assert not list(out.rglob("*.png"))


def test_events_of_a_folder_are_scored(tmp_path, clip, looming, capsys):
    folder = tmp_path / "clips"
    folder.mkdir()
    (folder / "loom.mkv").write_bytes(clip.read_bytes())
    write_lossless(folder / "still.mkv", looming[:1] * 40)
    write_lossless(folder / "other.mkv", looming[:1] * 40)
    events = tmp_path / "events.csv"
    events.write_text("file,event_s,start_s,end_s\nloom,1.9,,\nstill.mkv,,0.5,1.0\n")
    out = tmp_path / "run"
    assert run(folder, "--events", events, "--no-plots", "--out", out) == 0
    printed = capsys.readouterr()
    assert "other.mkv has no row in" in printed.err
    assert "1 clips" not in printed.out
    assert "1 clip with and 1 without an event, threshold" in " ".join(printed.out.split())
    assert all(len(line) <= 80 for line in printed.out.splitlines() if str(out) not in line)
    scores = {row["figure"]: row for row in rows_of(out / "scores.csv")}
    trace = rows_of(out / "loom" / "trace.csv")
    before = [float(row["spike_frequency"]) for row in trace[8:57]]
    level = float(scores["recall at 0.5 s"]["threshold"])
    assert level == min(value for value in before if value > 0)
    first = next(number for number, value in enumerate(before) if value >= level)
    assert float(scores["TTA at the cap"]["value"]) == pytest.approx((49 - first) / 30, abs=1e-5)
    loom, still = rows_of(out / "clip_scores.csv")
    assert float(loom["score_at_0.5_s"]) == max(before[:35])
    assert (float(still["evaluated_s"]), still["score_at_0.5_s"]) == (0.5, "")


def test_times_of_a_clip_with_a_gap(tmp_path, capsys):
    """4 s with a missing second: trace, event, crash frame and errors share one notion of time."""
    clip = tmp_path / "gap.avi"
    ffmpeg("-f", "lavfi", "-i", "testsrc2=size=64x48:rate=30:duration=4", "-vf",
           "select='not(between(t,1,1.99))'", "-fps_mode", "vfr", "-c:v", "ffv1", clip)  # fmt: skip
    events = tmp_path / "events.csv"
    events.write_text("file,event_s\ngap,3.5\n")
    assert run(clip, "--events", events, "--no-plots", "--out", tmp_path / "run") == 0
    rows = rows_of(tmp_path / "run" / "gap" / "trace.csv")
    assert (len(rows), rows[-1]["time_s"]) == (120, "3.9667")
    (job,) = make_jobs([clip], events=events)
    assert (job.crash_frame, job.crash_s) == (75, pytest.approx(3.5))
    (job,) = make_jobs([clip], crash_frame=30)  # the first frame after the gap
    assert job.crash_s == pytest.approx(2.0)
    events.write_text("file,event_s\ngap,4.1\n")
    assert run(clip, "--events", events, "--out", tmp_path / "other") == 2
    assert "event_s must be in the clip, 0 to 4.00 s (90 frames" in capsys.readouterr().err


def test_an_unreadable_file_of_a_folder_is_named_and_left_out(tmp_path, capsys):
    folder = tmp_path / "clips"
    folder.mkdir()
    make_test_clip(folder / "good.mkv", "-c:v", "ffv1")
    for name in ("bad.mp4", "._good.mkv"):
        (folder / name).write_bytes(b"no video")
    assert run(folder, "--no-plots", "--out", tmp_path / "run") == 2
    printed = capsys.readouterr().err
    assert "bad.mp4' is truncated or not a video" in printed
    assert "._good" not in printed
    assert len(rows_of(tmp_path / "run" / "good" / "trace.csv")) == 30
    assert run(folder / "good.mkv", folder / "bad.mp4", "--out", tmp_path / "other") == 2
    assert not (tmp_path / "other").exists()  # a file that is given by itself
    (folder / "good.mkv").unlink()
    assert run(folder, "--out", tmp_path / "none") == 2
    assert capsys.readouterr().err.count("\n") == 2


def test_a_truncated_clip_keeps_its_trace_and_gives_exit_code_2(tmp_path, capsys):
    path = truncate(make_test_clip(tmp_path / "clip.mkv", "-c:v", "ffv1"), 0.6)
    assert run(path, "--no-plots", "--out", tmp_path / "run") == 2
    message = capsys.readouterr().err.splitlines()[-1]
    assert message.startswith("lgmd-gym: clip ")
    assert "is truncated: it ends after" in message
    assert 5 < len(rows_of(tmp_path / "run" / "clip" / "trace.csv")) < 28


def test_a_variable_frame_rate_is_reported_once(tmp_path, capsys):
    path = tmp_path / "variable.mkv"
    make_test_clip(path, "-vf", "select='not(between(n\\,12\\,15))'", "-fps_mode", "vfr", "-c:v", "ffv1")
    assert run(path, "--no-plots", "--configs", "paper", "conservative", "--out", tmp_path / "run") == 0
    assert capsys.readouterr().err.count("has a variable frame rate; resampled to") == 1


@pytest.fixture
def files(tmp_path, clip, monkeypatch):
    """The current folder, with one good clip and several invalid files."""
    folder = tmp_path / "files"
    folder.mkdir()
    (folder / "good.mkv").write_bytes(clip.read_bytes())
    (folder / "empty.mp4").touch()
    (folder / "LIST.m3u8").write_text("#EXTM3U\n#EXTINF:9.0,\ngood.mkv\n")
    (folder / "text.mp4").write_text("not a video, " * 50)
    make_test_clip(folder / "sound.m4a", source="sine=duration=1")
    make_test_clip(folder / "dot.mkv", "-vf", "scale=2:2", "-c:v", "ffv1")
    truncate(make_test_clip(folder / "headless.mp4", "-pix_fmt", "yuv420p"), 0.6)
    for name, text in {
        "unknown": "clip,crash_frame\nother,3\n",
        "twice": "clip,crash_frame\ngood,3\ngood.mkv,4\n",
        "word": "clip,crash_frame\ngood,soon\n",
        "beyond": "clip,crash_frame\ngood,60\n",
        "column": "file,crash\ngood,3\n",
        "events": "file,event_s\ngood,1.4\n",
        "late": "file,event_s\ngood,2.5\n",
        "early": "file,event_s,start_s\ngood.mkv,1.0,1.2\n",
        "backwards": "file,event_s,start_s,end_s\ngood.mkv,,1.5,1.2\n",
        "header": "file,event_ms\ngood,3\n",
        "missing": "file,event_s\ngod.mkv,1.0\n",
        "none": "file,event_s\ngood.mkv,none\n",
        "text": "file,event_s\ngood.mkv,1:20\n",
    }.items():
        (folder / f"{name}.csv").write_text(text)
    monkeypatch.chdir(folder)
    return folder


INVALID = [  # (arguments, part of the message)
    (["nowhere.mp4"], "clip 'nowhere.mp4' does not exist"),
    (["empty.mp4"], "clip 'empty.mp4' is empty (0 bytes)"),
    (["text.mp4"], "clip 'text.mp4' is truncated or not a video"),
    (["sound.m4a"], "clip 'sound.m4a' has no video stream"),
    (["LIST.m3u8"], "clip 'LIST.m3u8' is a playlist, not a video; pass the video files that it lists"),
    (["dot.mkv"], "clip 'dot.mkv' is 2×2 px; it must be at least 3×3"),
    (["headless.mp4"], "clip 'headless.mp4' is truncated"),
    (["good.mkv", "--crashes", "unknown.csv"], "line 2: unknown clip 'other'; known: good.mkv"),
    (["good.mkv", "--crashes", "twice.csv"], "line 3: clip 'good.mkv' is listed twice"),
    (["good.mkv", "--crashes", "word.csv"], "a frame number, or empty for no crash, got 'soon'"),
    (["good.mkv", "--crashes", "beyond.csv"], "crash frame of good.mkv must be in 0 to 59, got 60"),
    (["good.mkv", "--crashes", "column.csv"], "lacks the column 'clip'"),
    (["good.mkv", "--crashes", "nowhere.csv"], "crash file 'nowhere.csv' cannot be read"),
    (["good.mkv", "dot.mkv", "--crash-frame", "3"], "--crash-frame 3 applies to a single clip"),
    (["good.mkv", "--events", "late.csv"], "line 2: event_s must be in the clip, 0 to 2.00 s (60 frames"),
    (["good.mkv", "--events", "early.csv"], "event_s 1 is outside the evaluated part, 1.2 to 2 s"),
    (["good.mkv", "--events", "backwards.csv"], "start_s must be before end_s, got 1.5 and 1.2"),
    (["good.mkv", "--events", "header.csv"], "unknown column 'event_ms'; did you mean 'event_s'?"),
    (["good.mkv", "--events", "missing.csv"], "line 2: unknown clip 'god.mkv'; did you mean 'good.mkv'?"),
    (["good.mkv", "--events", "none.csv"], "none.csv has no clip with an event"),
    (["good.mkv", "--events", "text.csv"], "event_s must be a time in seconds, or empty, got '1:20'"),
    (["good.mkv", "--events", "nowhere.csv"], "event file 'nowhere.csv' cannot be read"),
    (["good.mkv", "--events", "events.csv", "--crash-frame", "3"], "remove one of them"),
    (["good.mkv", "--events", "events.csv", "--false-alarm-cap", "10"], "alarm-cap must be in [0, 1]"),
    (["good.mkv", "--configs", "papr"], "did you mean 'paper'?"),
    (["good.mkv", "--fps", "0"], "fps must be in (0, 1000], got 0"),
    (["good.mkv", "--size", "2", "9"], "each 3 to 16384 px, got (2, 9)"),
    (["good.mkv", "--roi", "0", "0", "99", "9"], "(0, 0, 99, 9)"),
    (["good.mkv", "--drop-duplicates", "1"], "drop_duplicates must be in [0, 1), got 1"),
    (["good.mkv", "--threshold", "-3"], "LGMD t_sf must be in (0, inf) spikes/s, got -3"),
    (["good.mkv", "--params", "nowhere.toml"], "params file 'nowhere.toml' cannot be read"),
    (["good.mkv", "--out", "/proc/nowhere/run"], "/proc/nowhere/run"),
    ([], "a clip is required"),
]


def test_invalid_input_gives_one_line_and_writes_nothing(files, capsys):
    before, failures = set(files.rglob("*")), []
    for arguments, message in INVALID:
        code, printed = run(*arguments), capsys.readouterr().err
        one_line = printed.startswith("lgmd-gym: ") and printed.count("\n") == 1
        if code != 2 or not one_line or message not in printed:
            failures.append((arguments, code, printed))
    assert failures == []
    assert set(files.rglob("*")) == before


def test_the_help_lists_every_configuration(capsys):
    with pytest.raises(SystemExit):
        run("--help")
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert [name for name in PLAYBACK_CONFIGS if name not in text] == []


@pytest.mark.slow
def test_memory_does_not_depend_on_the_length_of_a_clip(tmp_path):
    """Peak memory for half a minute and for two, in new processes; trace and figure included."""
    code = (
        "import sys; from lgmd_gym.cli import main; sys.path.insert(0, sys.argv[1]); "
        "from support.processes import peak_memory; code = main.run(sys.argv[2:]); "
        "print(peak_memory(), code)"
    )
    peaks = []
    for seconds in (30, 120):
        source = f"testsrc2=size=176x144:rate=30:duration={seconds}"
        path = make_test_clip(tmp_path / f"{seconds}.mp4", "-pix_fmt", "yuv420p", source=source)
        tests = str(Path(__file__).parents[1])
        arguments = [tests, "video", str(path), "--out", str(tmp_path / f"run-{seconds}")]
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
        )
        peaks.append(float(done.stdout.split()[-2]))
    assert peaks[1] < peaks[0] + 20  # MiB


@pytest.mark.bench
def test_a_run_is_ten_times_faster_than_real_time(tmp_path):
    """For 352×288 at 30 Hz, decoding included."""
    source = "testsrc2=size=352x288:rate=30:duration=20"
    path = make_test_clip(tmp_path / "clip.mp4", "-pix_fmt", "yuv420p", source=source)
    list(ClipRun(path, PlaybackConfig()))
    start = time.perf_counter()
    assert sum(1 for _ in ClipRun(path, PlaybackConfig())) == 600
    assert 20.0 / (time.perf_counter() - start) > 10.0
