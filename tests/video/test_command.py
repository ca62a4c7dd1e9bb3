"""`lgmd-gym video` from start to end, in a room that does not grow."""

import csv
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.clips import broken, store, synthesize

from lgmd_gym.cli import main as cli
from lgmd_gym.cli import options as cli_options
from lgmd_gym.video import VideoReader
from lgmd_gym.video.clips.playback import CHOICES, Choice, Watch


def run(*arguments):
    return cli.run(["video", *map(str, arguments)])


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_video_command_from_start_to_end(tmp_path, clip, capsys):
    out = tmp_path / "run"
    assert run(clip, "--crash-frame", "42", "--overlay", "--out", out) == 0
    said = capsys.readouterr()
    assert "T_sf = 30 spikes/s at 30 Hz" in said.out
    assert "paper" in said.err  # the progress bar
    rows = rows_of(out / "loom" / "trace.csv")
    assert len(rows) == 60
    assert max(float(row["spike_frequency"]) for row in rows) > 30
    assert sum(int(row["onset"]) for row in rows) >= 1
    assert (out / "loom" / "trace.png").stat().st_size > 20_000
    film = VideoReader(out / "loom" / "overlay.mp4")
    pictures = list(film)
    assert (len(pictures), film.fps) == (60, 30.0)
    lit = next(number for number, row in enumerate(rows) if row["alert"] == "1")
    dark, bright = (pictures[number][20:50, 30:160].mean((0, 1)) for number in (5, lit))
    assert bright[0] > dark[0] + 100
    assert run(clip, "--out", out) == 2
    assert "exists and is kept" in capsys.readouterr().err


def test_choices_are_compared_over_a_folder(tmp_path, clip, looming, capsys):
    folder = tmp_path / "clips"
    folder.mkdir()
    (folder / "loom.mkv").write_bytes(clip.read_bytes())
    store(folder / "still.mkv", looming[:1] * 40)
    (folder / "crashes.csv").write_text("clip,crash_frame,note\nloom,42,a square\nstill.mkv,none,\n")
    out = tmp_path / "run"
    arguments = (folder, "--crashes", folder / "crashes.csv", "--no-plots", "--out", out)
    assert run(*arguments, "--choices", "paper", "paper-18hz") == 0
    said = capsys.readouterr().out
    for words in ("choices over all clips", "1 of 1", "T_sf = 15 spikes/s at 18 Hz", "none"):
        assert words in said
    assert len(rows_of(out / "loom" / "trace-paper-18hz.csv")) == 36
    assert not list(out.rglob("*.png"))


def test_a_truncated_clip_keeps_its_trace_and_exits_with_two(tmp_path, capsys):
    path = broken(synthesize(tmp_path / "clip.mkv", "-c:v", "ffv1"), 0.6)
    assert run(path, "--no-plots", "--out", tmp_path / "run") == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith("lgmd-gym: clip ")
    assert "is truncated: it breaks off after" in said
    assert 5 < len(rows_of(tmp_path / "run" / "clip" / "trace.csv")) < 28


def test_a_variable_rate_is_said_once(tmp_path, capsys):
    path = tmp_path / "variable.mkv"
    synthesize(path, "-vf", "select='not(between(n\\,12\\,15))'", "-fps_mode", "vfr", "-c:v", "ffv1")
    assert run(path, "--no-plots", "--choices", "paper", "calm", "--out", tmp_path / "run") == 0
    assert capsys.readouterr().err.count("has a variable frame rate; resampled to") == 1


@pytest.fixture
def files(tmp_path, clip, monkeypatch):
    """A folder of clips with everything wrong that can be."""
    folder = tmp_path / "files"
    folder.mkdir()
    (folder / "good.mkv").write_bytes(clip.read_bytes())
    (folder / "empty.mp4").touch()
    (folder / "text.mp4").write_text("no video at all, " * 50)
    synthesize(folder / "sound.m4a", source="sine=duration=1")
    synthesize(folder / "dot.mkv", "-vf", "scale=2:2", "-c:v", "ffv1")
    broken(synthesize(folder / "headless.mp4", "-pix_fmt", "yuv420p"), 0.6)
    for name, text in {
        "unknown": "clip,crash_frame\nother,3\n",
        "twice": "clip,crash_frame\ngood,3\ngood.mkv,4\n",
        "word": "clip,crash_frame\ngood,soon\n",
        "beyond": "clip,crash_frame\ngood,60\n",
        "column": "file,crash\ngood,3\n",
    }.items():
        (folder / f"{name}.csv").write_text(text)
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.mp4"], "clip 'nowhere.mp4' does not exist"),
        (["empty.mp4"], "clip 'empty.mp4' is empty (0 bytes)"),
        (["text.mp4"], "clip 'text.mp4' is truncated, or no video"),
        (["sound.m4a"], "clip 'sound.m4a' holds no picture: it is sound alone"),
        (["dot.mkv"], "clip 'dot.mkv' is 2×2 px; it must be at least 3×3"),
        (["headless.mp4"], "clip 'headless.mp4' is truncated"),
        (["good.mkv", "--crashes", "unknown.csv"], "line 2: clip 'other' is not among the clips given"),
        (["good.mkv", "--crashes", "twice.csv"], "line 3: clip 'good.mkv' comes twice"),
        (["good.mkv", "--crashes", "word.csv"], "crash_frame 'soon' must be a frame number"),
        (["good.mkv", "--crashes", "beyond.csv"], "crash frame 60 of good.mkv is not among its frames 0"),
        (["good.mkv", "--crashes", "column.csv"], "lacks the column 'clip'"),
        (["good.mkv", "--crashes", "nowhere.csv"], "crash file 'nowhere.csv' cannot be read"),
        (["good.mkv", "good.mkv", "dot.mkv", "--crash-frame", "3"], "--crash-frame 3 is for one clip"),
        (["good.mkv", "--choices", "papr"], "did you mean 'paper'?"),
        (["good.mkv", "--fps", "0"], "fps = 0 must lie in (0, 1000]"),
        (["good.mkv", "--size", "2", "9"], "size = (2, 9) must be at least 3 3 px"),
        (["good.mkv", "--roi", "0", "0", "99", "9"], "leaves the frame"),
        (["good.mkv", "--drop-duplicates", "1"], "drop_duplicates = 1 must lie in [0, 1)"),
        (["good.mkv", "--threshold", "-3"], "t_sf = -3 must be > 0"),
        (["good.mkv", "--params", "nowhere.toml"], "params file 'nowhere.toml' cannot be read"),
        (["good.mkv", "--out", "/proc/nowhere/run"], "cannot be made"),
        ([], "which clip?"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line_and_leaves_nothing(arguments, words, files, capsys):
    before = set(files.rglob("*"))
    assert run(*arguments) == 2
    said = capsys.readouterr().err
    assert said.startswith("lgmd-gym: ")
    assert said.count("\n") == 1
    assert words in said
    assert set(files.rglob("*")) == before


def test_choices_are_all_explained():
    said = Path(cli_options.__file__).read_text(encoding="utf-8")
    assert [name for name in CHOICES if name not in said] == []


@pytest.mark.slow
def test_memory_does_not_grow_with_the_length(tmp_path):
    """Peak memory of watching one minute and five, in fresh processes; trace and figure included."""
    code = (
        "import resource, sys; from lgmd_gym import cli; code = cli.run(sys.argv[1:]); "
        "print('peak', resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, code)"
    )
    peaks = []
    for seconds in (60, 300):
        source = f"testsrc2=size=176x144:rate=30:duration={seconds}"
        path = synthesize(tmp_path / f"{seconds}.mp4", "-pix_fmt", "yuv420p", source=source)
        arguments = ["video", str(path), "--out", str(tmp_path / f"run-{seconds}")]
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
        )
        peaks.append(int(done.stdout.split()[-2]))
    assert peaks[1] < peaks[0] + 20_000  # kB


@pytest.mark.bench
def test_ten_times_real_time(tmp_path):
    """At 352×288 and 30 Hz, decoding and trace included."""
    source = "testsrc2=size=352x288:rate=30:duration=20"
    path = synthesize(tmp_path / "clip.mp4", "-pix_fmt", "yuv420p", source=source)
    list(Watch(path, Choice()))
    begun = time.perf_counter()
    assert sum(1 for _ in Watch(path, Choice())) == 600
    assert 20.0 / (time.perf_counter() - begun) > 10.0
