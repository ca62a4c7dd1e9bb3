"""The experiment `realism`: comparison of simulated drives with clips."""

import csv
import hashlib
import re
from importlib import import_module

import numpy as np
import pytest
from PIL import Image
from support.clips import write_lossless
from support.examples import load

from lgmd_gym.clips import published
from lgmd_gym.clips.published import PublishedClip

command = load("realism/realism")
comparison, drives = import_module("comparison"), import_module("drives")
compare, normalized_distance = comparison.compare, comparison.normalized_distance
DriveValues, STATISTICS = comparison.DriveValues, comparison.STATISTICS
Drives, Optics, GROUPS, ROADS = drives.Drives, drives.Optics, drives.GROUPS, drives.ROADS
drive_frames, simulated_drives = drives.drive_frames, drives.simulated_drives
summary_line = command.summary_line
OPTICS = Optics((60, 100), 30, 90.0)


def run(*arguments):
    command.main([str(item) for item in arguments])


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write_clip(path, level, frames=30, shape=(60, 100)):
    """Write a clip of noise that moves to the left, with a mean grey."""
    rng = np.random.default_rng(level)
    picture = np.clip(rng.normal(level, 20, (shape[0], shape[1] + frames)), 0, 255).astype(np.uint8)
    return write_lossless(path, [picture[:, index : index + shape[1]] for index in range(frames)])


@pytest.fixture
def clips(tmp_path):
    """A folder with two clips by day, one of another size, and one at night."""
    folder = tmp_path / "clips"
    folder.mkdir()
    write_clip(folder / "noon.mkv", 120)
    write_clip(folder / "dusk.mkv", 80, shape=(64, 96))
    write_clip(folder / "dark.mkv", 30)
    return folder


@pytest.fixture
def short_drives(monkeypatch):
    """Two environments of half a second."""
    monkeypatch.setattr(drives, "MAX_SECONDS", 0.5)
    monkeypatch.setattr(drives, "ROADS", ROADS[:2])


def drive(group, real, value):
    return DriveValues("drive", group, real, dict.fromkeys(STATISTICS, value))


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ([0, 1], [1, 0], 0.0),
        ([3, 3], [3], 0.0),
        ([0, 0], [5], 1.0),
        ([0, 0], [0, 2], 0.5),
        ([0, 4], [2], 0.5),
        ([1, 2, 3], [2, 3, 4], 1 / 3),
    ],
)
def test_distance_by_hand(one, other, expected):
    one, other = np.array(one, float), np.array(other, float)
    assert normalized_distance(one, other) == normalized_distance(other, one) == pytest.approx(expected)


def test_comparison_by_hand():
    simulated = [drive("day", False, float(value)) for value in range(101)]
    real = [drive("day", True, value) for value in (4.9, 5.0, 95.0, 95.1, np.nan)]
    rows = compare([*real, *simulated, drive("night", True, 1.0)])
    assert [(row.group, row.statistic) for row in rows] == [("day", name) for name in STATISTICS]
    for row in rows:
        assert (row.low, row.high, row.inside, row.median_inside) == (5.0, 95.0, 2, True)
        np.testing.assert_array_equal(row.real, (4.9, 5.0, 95.0, 95.1))


@pytest.mark.parametrize(("values", "expected"), [((0.0, 3.0, 50.0), False), ((0.0, 5.0, 99.0), True)])
def test_the_real_median_is_inside_or_not(values, expected):
    simulated = [drive("day", False, float(value)) for value in range(101)]
    rows = compare([*simulated, *(drive("day", True, value) for value in values)])
    assert {row.median_inside for row in rows} == {expected}
    assert summary_line(rows) == (
        "Statistics with the real median inside the simulated 5–95 % range: "
        f"day {12 if expected else 0} of 12"
    )


def test_day_is_first():
    rows = compare([drive(group, real, 1.0) for group in ("night", "day") for real in (True, False)])
    assert list(dict.fromkeys(row.group for row in rows)) == ["day", "night"]


def test_drives_of_the_laboratory():
    drives = simulated_drives((), range(2), arguments={"ego_speed": 9.0}, camera={"hfov_deg": 40.0})
    assert len(drives) == 2 * 2 * len(ROADS)
    assert {(item.group, item.arguments["weather"]) for item in drives} == {
        ("day", "clear"), ("night", "night")
    }  # fmt: skip
    assert all(item.arguments["ego_speed"] == 9.0 for item in drives)
    assert {item.arguments["world"] for item in drives} == {"laboratory"}
    assert drives[-1].label == (
        "Traffic-Intersection world=laboratory weather=night ego_speed=9.0 hfov_deg=40.0"
    )
    assert [list(item.seeds) for item in drives[:: len(ROADS)]] == [[0], [1], [0], [1]]


def test_drives_have_worlds_and_conditions_in_turn():
    drives = simulated_drives(range(20), range(3))
    day = [item for item in drives if item.group == "day"]
    assert len(drives) == 2 * len(day) == 2 * 3 * len(ROADS)
    assert [item.arguments["world"] for item in day] == [*range(20), *range(7)]
    assert [item.arguments["weather"] for item in day[:7]] == list(GROUPS["day"])
    assert len({item.env for item in day if item.arguments["weather"] == "rain"}) == 4


def test_a_drive_has_the_light_of_its_world():
    frames = {world: next(drive_frames(simulated_drives((world,), (0,))[0], 0, OPTICS)) for world in (0, 1)}
    again = next(drive_frames(simulated_drives((1,), (0,))[0], 0, OPTICS))
    np.testing.assert_array_equal(frames[1], again)
    assert (frames[0] != frames[1]).mean() > 0.9


@pytest.mark.parametrize("env", ["LGMD/Following-v0", "LGMD/Traffic-TwoWay-v0"])
def test_frames_of_a_drive(env, short_drives):
    day, night = (
        Drives(env=env, arguments={"world": "laboratory", "weather": name}) for name in ("clear", "night")
    )
    frames = list(drive_frames(day, 0, OPTICS))
    assert len(frames) == 15
    assert {(frame.shape, frame.dtype) for frame in frames} == {((60, 100), np.dtype(np.uint8))}
    assert any((frame != frames[0]).any() for frame in frames[1:])
    np.testing.assert_array_equal(frames, list(drive_frames(day, 0, OPTICS)))
    assert (np.array(frames) != list(drive_frames(day, 1, OPTICS))).any()
    assert np.mean(list(drive_frames(night, 0, OPTICS))) < 0.5 * np.mean(frames)


def test_rate_of_a_drive():
    """At 25 Hz, one second of a drive has 25 frames; the ego has moved as far as in 30 frames at 30 Hz."""
    arguments = {"ego_speed": 10.0, "world": "laboratory", "scene": {"texture": 0.0}}
    item = Drives(env="LGMD/Following-v0", arguments=arguments)
    one, other = (list(drive_frames(item, 0, OPTICS._replace(fps=fps))) for fps in (25, 30))
    assert (len(one), len(other)) == (125, 150)
    np.testing.assert_array_equal(one[25], other[30])


def test_frames_end_with_the_episode():
    item = Drives(env="LGMD/Traffic-TwoWay-v0", arguments={"config": {"duration": 1.0}})
    assert len(list(drive_frames(item, 0, OPTICS))) == 30


@pytest.mark.usefixtures("short_drives")
def test_command(clips, tmp_path, capsys):
    out = tmp_path / "run"
    run("--clips", clips, "--seeds", 2, "--out", out)
    printed = capsys.readouterr().out
    assert "day: 2 real clips, 4 simulated drives" in printed
    assert "night: 1 real clips, 4 simulated drives" in printed
    drives = rows_of(out / "drives.csv")
    assert {row["name"]: row["group"] for row in drives if row["kind"] == "real"} == {
        "noon.mkv": "day", "dusk.mkv": "day", "dark.mkv": "night"
    }  # fmt: skip
    assert [row["name"] for row in drives if row["kind"] == "simulated"][1] == (
        "Following ego_speed=25.0 world=1 weather=clear seed=0"
    )
    assert "5–95 % range: day " in printed
    rows = rows_of(out / "realism.csv")
    covered = [name for name in STATISTICS if name != "ground"]  # frames of 60 rows have no ground field
    assert [row["statistic"] for row in rows] == covered * 2
    noon = next(row for row in drives if row["name"] == "noon.mkv")
    day = next(row for row in rows if row["statistic"] == "p50")
    assert float(day["real_max"]) == float(noon["p50"]) == pytest.approx(120, abs=1)
    assert (day["clips"], day["drives"]) == ("2", "4")
    text = (out / "realism.md").read_text(encoding="utf-8")
    assert text.count("## ") == 2
    assert text.count("\n|") == 2 * (len(covered) + 3)
    assert text.count("5–95 % range: day ") == 1
    assert Image.open(out / "realism.png").size[0] > 1000


@pytest.mark.usefixtures("short_drives")
def test_command_in_the_laboratory(clips, tmp_path):
    out = tmp_path / "run"
    run("--clips", clips, "--seeds", 1, "--worlds", 0, "--out", out)
    names = [row["name"] for row in rows_of(out / "drives.csv") if row["kind"] == "simulated"]
    assert len(names) == 4
    assert all(" world=laboratory " in name for name in names)


@pytest.mark.usefixtures("short_drives")
def test_an_ignored_bonnet_does_not_change_the_group(tmp_path):
    """The median grey of the whole frame is 90, and 60 without the lowest rows."""
    pictures = np.full((20, 80, 100), 90, np.uint8)
    pictures[:, :38] = 60
    pictures[:, 0, 0] = np.arange(20)
    write_lossless(tmp_path / "dim.mkv", list(pictures))
    out = tmp_path / "run"
    run("--clips", tmp_path, "--ignore-bottom", 0.2, "--seeds", 1, "--out", out)
    row = rows_of(out / "drives.csv")[0]
    assert (row["name"], row["group"], row["p50"]) == ("dim.mkv", "day", "60")


@pytest.mark.usefixtures("short_drives")
def test_crashes_and_named_nights(clips, tmp_path, monkeypatch):
    lengths = {}

    def statistics(frames, fps, optics):
        lengths[len(lengths)] = len(list(frames))
        return dict.fromkeys(STATISTICS, 100.0)

    monkeypatch.setattr(comparison, "drive_statistics", statistics)
    (tmp_path / "crashes.csv").write_text("clip,crash_frame\ndusk,17\nnoon,\n")
    out = tmp_path / "run"
    run("--clips", clips, "--crashes", tmp_path / "crashes.csv", "--night", "noon", "--out", out)
    groups = {row["name"]: row["group"] for row in rows_of(out / "drives.csv") if row["kind"] == "real"}
    assert groups == {"dark.mkv": "day", "dusk.mkv": "day", "noon.mkv": "night"}
    assert [lengths[index] for index in range(3)] == [30, 17, 30]


@pytest.mark.usefixtures("short_drives")
def test_a_group_of_the_published_clips(clips, tmp_path, monkeypatch, capsys):
    """The clips of a group are recognised by their contents, and the package's crash frames apply."""
    annotated = tuple(
        PublishedClip(f"{name} clip", frame, 2, group, digest(clips / f"{name}.mkv"), "", "")
        for name, frame, group in (("noon", 20, "new"), ("dusk", None, "new"), ("dark", 25, "used"))
    )
    for module in (command, published):
        monkeypatch.setattr(module, "published_clips", lambda: annotated)
    out = tmp_path / "run"
    run("--clips", clips, "--group", "new", "--seeds", 1, "--out", out)
    drives = [row["name"] for row in rows_of(out / "drives.csv") if row["kind"] == "real"]
    assert drives == ["noon.mkv", "dusk.mkv"]
    (clips / "noon.mkv").unlink()
    with pytest.raises(ValueError, match="has 1 of the 2 clips of the group 'new'"):
        run("--clips", clips, "--group", "new", "--out", tmp_path / "other")
    with pytest.raises(ValueError, match="--group uses the annotation of the package; remove --crashes"):
        run("--clips", clips, "--group", "used", "--crashes", "my.csv", "--out", tmp_path / "other")


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--seeds", "0"], "seeds must be a whole number >= 1"),
        (
            ["--worlds", "6001"],
            "worlds must be a whole number in [0, 6000]",
        ),
        (["--clip-hfov-deg", "180"], "clip_hfov_deg must be in [10, 160]"),
        (["--ignore-bottom", "0.6"], "ignore_bottom must be in [0, 0.5]"),
        (["--night", "duck"], "did you mean 'dusk'?"),
        (["--ignore-bottom", "0.3"], "at least 50×50 px, got 100×42"),
    ],
)
def test_refused_options(arguments, message, clips, tmp_path, monkeypatch):
    monkeypatch.setattr(command, "simulated_values", None)
    out = tmp_path / "run"
    with pytest.raises(ValueError, match=re.escape(message)):
        run("--clips", clips, *arguments, "--out", out)
    assert not out.exists()


def test_a_clip_that_crashes_at_once_is_named(clips, tmp_path):
    (tmp_path / "crashes.csv").write_text("clip,crash_frame\ndusk,5\n")
    with pytest.raises(ValueError, match=r"clip dusk\.mkv: a drive must have .* different frames, got 5"):
        run("--clips", clips, "--crashes", tmp_path / "crashes.csv", "--out", tmp_path / "run")
